"""The hydraulic lowering function of a forklift: simulated, fitted to recordings, and diagnosed.

After Fri & Fahlén, *Modelling and Control of a Forklift's Hydraulic Lowering Function*, Linköping
University, LiTH-ISY-EX--17/5050--SE, 2017. Names here are loaded when first used, so that
``import forklift`` costs nothing::

    truck = forklift.Truck.read("thesis")
    campaign = forklift.Campaign.read("campaign")
    print(forklift.compare(campaign, truck))
"""

from __future__ import annotations

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

from forklift.errors import ForkliftError

if TYPE_CHECKING:
    from forklift import commands as commands
    from forklift.campaign import Campaign as Campaign
    from forklift.commands import Command as Command
    from forklift.compare import Comparison as Comparison
    from forklift.compare import compare as compare
    from forklift.convert import convert as convert
    from forklift.diagnose import Diagnosis as Diagnosis
    from forklift.diagnose import diagnose as diagnose
    from forklift.fit import Fit as Fit
    from forklift.fit import fit as fit
    from forklift.plant.diagnose import PlantDiagnosis as PlantDiagnosis
    from forklift.plant.diagnose import diagnose_plant as diagnose_plant
    from forklift.plant.parts import Plant as Plant
    from forklift.plant.simulate import simulate_plant as simulate_plant
    from forklift.recording import Recording as Recording
    from forklift.simulate import Simulation as Simulation
    from forklift.simulate import predict as predict
    from forklift.simulate import simulate as simulate
    from forklift.speed_table import SpeedTable as SpeedTable
    from forklift.speed_table import speed_to_current as speed_to_current
    from forklift.speed_table import temperature_scaling as temperature_scaling
    from forklift.steady import SteadyState as SteadyState
    from forklift.steady import steady_state as steady_state
    from forklift.truck import Truck as Truck

    __version__: str

_HOME = {
    "Campaign": "campaign",
    "Command": "commands",
    "Comparison": "compare",
    "Diagnosis": "diagnose",
    "Fit": "fit",
    "Plant": "plant.parts",
    "PlantDiagnosis": "plant.diagnose",
    "Recording": "recording",
    "Simulation": "simulate",
    "SpeedTable": "speed_table",
    "SteadyState": "steady",
    "Truck": "truck",
    "compare": "compare",
    "convert": "convert",
    "diagnose": "diagnose",
    "diagnose_plant": "plant.diagnose",
    "fit": "fit",
    "predict": "simulate",
    "simulate": "simulate",
    "simulate_plant": "plant.simulate",
    "speed_to_current": "speed_table",
    "steady_state": "steady",
    "temperature_scaling": "speed_table",
}

__all__ = ["ForkliftError", "__version__", "commands", *_HOME]


class _Package(ModuleType):
    """Keeps ``forklift.simulate`` the verb when the module of the same name is imported."""

    def __setattr__(self, name: str, value: Any) -> None:
        if not (name in _HOME and isinstance(value, ModuleType)):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package


def __getattr__(name: str) -> Any:
    if name in _HOME:
        value = getattr(import_module(f"forklift.{_HOME[name]}"), name)
    elif name == "commands":
        value = import_module("forklift.commands")
    elif name == "__version__":
        from importlib.metadata import version

        value = version("forklift")
    else:
        raise AttributeError(f"module 'forklift' has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
