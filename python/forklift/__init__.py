"""The hydraulic lowering function of a forklift: simulated, fitted to recordings, and diagnosed.

After Fri & Fahlén, *Modelling and Control of a Forklift's Hydraulic Lowering Function*, Linköping
University, LiTH-ISY-EX--17/5050--SE, 2017. Names here are loaded when first used, so that
``import forklift`` costs nothing::

    truck = forklift.Truck.read("thesis")
    campaign = forklift.Campaign.read("campaign")
    print(forklift.compare(campaign, truck))
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from forklift.base import present
from forklift.base.errors import ForkliftError

if TYPE_CHECKING:
    from forklift.diagnosis.diagnose import diagnose as diagnose
    from forklift.diagnosis.result import Diagnosis as Diagnosis
    from forklift.ensemble.rare import Rare as Rare
    from forklift.ensemble.rare import rare as rare
    from forklift.ensemble.sweep import Sweep as Sweep
    from forklift.ensemble.sweep import sweep as sweep
    from forklift.fitting.compare import Comparison as Comparison
    from forklift.fitting.compare import compare as compare
    from forklift.fitting.fit import Fit as Fit
    from forklift.fitting.fit import fit as fit
    from forklift.plant.forklift import commands as commands
    from forklift.plant.forklift.commands import Command as Command
    from forklift.plant.forklift.simulate import Simulation as Simulation
    from forklift.plant.forklift.simulate import predict as predict
    from forklift.plant.forklift.simulate import simulate as simulate
    from forklift.plant.forklift.speed_table import SpeedTable as SpeedTable
    from forklift.plant.forklift.speed_table import speed_to_current as speed_to_current
    from forklift.plant.forklift.speed_table import temperature_scaling as temperature_scaling
    from forklift.plant.forklift.steady import SteadyState as SteadyState
    from forklift.plant.forklift.steady import steady_state as steady_state
    from forklift.plant.forklift.truck import Truck as Truck
    from forklift.plant.forklift.variants import Variants as Variants
    from forklift.plant.forklift.variants import simulate_many as simulate_many
    from forklift.plant.parts import Plant as Plant
    from forklift.plant.simulate import simulate_plant as simulate_plant
    from forklift.recordings.campaign import Campaign as Campaign
    from forklift.recordings.convert import convert as convert
    from forklift.recordings.recording import Recording as Recording

    __version__: str

_HOME = {
    "Campaign": "recordings.campaign",
    "Command": "plant.forklift.commands",
    "Comparison": "fitting.compare",
    "Diagnosis": "diagnosis.result",
    "Fit": "fitting.fit",
    "Plant": "plant.parts",
    "Rare": "ensemble.rare",
    "Recording": "recordings.recording",
    "Simulation": "plant.forklift.simulate",
    "SpeedTable": "plant.forklift.speed_table",
    "SteadyState": "plant.forklift.steady",
    "Sweep": "ensemble.sweep",
    "Truck": "plant.forklift.truck",
    "Variants": "plant.forklift.variants",
    "compare": "fitting.compare",
    "convert": "recordings.convert",
    "diagnose": "diagnosis.diagnose",
    "fit": "fitting.fit",
    "predict": "plant.forklift.simulate",
    "rare": "ensemble.rare",
    "simulate": "plant.forklift.simulate",
    "simulate_many": "plant.forklift.variants",
    "simulate_plant": "plant.simulate",
    "speed_to_current": "plant.forklift.speed_table",
    "steady_state": "plant.forklift.steady",
    "sweep": "ensemble.sweep",
    "temperature_scaling": "plant.forklift.speed_table",
}

present.drawn_by("forklift.report.register")

__all__ = ["ForkliftError", "__version__", "commands", *_HOME]


def __getattr__(name: str) -> Any:
    if name in _HOME:
        value = getattr(import_module(f"forklift.{_HOME[name]}"), name)
    elif name == "commands":
        value = import_module("forklift.plant.forklift.commands")
    elif name == "__version__":
        from importlib.metadata import version

        value = version("forklift")
    else:
        raise AttributeError(f"module 'forklift' has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
