"""Machines of your own: what a diagnosis needs to know of one, and the call that makes it.

::

    plant = Plant(name="tank", states=..., params=..., inputs=..., outputs=..., ports=..., effects=..., ...)
    print(forklift.diagnose(plant, recordings))
"""

from forklift.plant.parts import Effect, Input, Output, Param, Plant, Port, State
from forklift.plant.recording import Recording

__all__ = ["Effect", "Input", "Output", "Param", "Plant", "Port", "Recording", "State"]
