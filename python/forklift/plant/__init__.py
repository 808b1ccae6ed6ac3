"""Machines of your own: what a diagnosis needs to know of one, and the call that makes it.

::

    plant = Plant(name="tank", states=..., params=..., inputs=..., outputs=..., ports=..., effects=..., ...)
    print(forklift.diagnose_plant(plant, recordings))
"""

from forklift.plant.parts import (
    Effect as Effect,
)
from forklift.plant.parts import (
    Input as Input,
)
from forklift.plant.parts import (
    Output as Output,
)
from forklift.plant.parts import (
    Param as Param,
)
from forklift.plant.parts import (
    Plant as Plant,
)
from forklift.plant.parts import (
    Port as Port,
)
from forklift.plant.parts import (
    State as State,
)
from forklift.plant.recording import Recording as Recording
