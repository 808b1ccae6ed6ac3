"""`forklift diagnose` without one of its steps: what would the answers be worth then?

    python proofs/without.py STEP CAMPAIGN --out OUT

STEP: location (no unknown input tells where it is, and no shape without a name is tried there), rivals
(physics only is suspected, and the first that explains enough is taken), held-out (the recordings that were
fitted judge).
"""

import sys
from argparse import ArgumentParser
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from unittest.mock import patch

import forklift
from forklift import Campaign, ForkliftError, Truck
from forklift.diagnosis import engine, selection
from forklift.diagnosis.locate import unknown_inputs
from forklift.diagnosis.screening import Screening
from forklift.plant.forklift.hypotheses import hypotheses

forklifts = import_module("forklift.plant.forklift.subject")
STEPS = ("location", "rivals", "held-out")


@contextmanager
def without(step):
    """Everything that is diagnosed meanwhile is diagnosed without this step."""
    with ExitStack() as changed:

        def put(place, name, other):
            changed.enter_context(patch.object(place, name, other))

        if step == "location":
            put(engine, "unknown_inputs", in_any_order)
            put(engine, "FreeCurves", NoShapes)
        elif step == "rivals":
            put(forklifts, "hypotheses", physics)
            put(selection, "FIRST", 1)
            put(selection, "FURTHER", 0)
            put(selection, "rivals", lambda *_: [])
        yield


def seen(step, campaign):
    """What is given to the diagnosis of a campaign without this step."""
    if step != "held-out":
        return campaign
    fitted = tuple(one for one in campaign.recordings if one.role == "estimate")
    return replace(campaign, recordings=fitted)


class NoShapes:
    """Offers no hypotheses without a name."""

    def __init__(self, *_):
        pass

    def __call__(self, refit):
        return []

    def laws(self, refit, at, *, slow=False):
        return Screening(0.0, (), (), ())

    def faint(self, refit, everywhere):
        return None

    def twins(self, refit, curve):
        return []

    def near(self, refit, one):
        return 0.0


def in_any_order(*given):
    """The unknown inputs as if nothing told between them."""
    return sorted(unknown_inputs(*given), key=lambda one: one.port)


def physics(*given):
    """The catalogue alone."""
    return tuple(one for one in hypotheses(*given) if one.kind == "physics")


def main():
    parser = ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("step", choices=STEPS)
    parser.add_argument("campaign", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()
    try:
        campaign = seen(given.step, Campaign.read(given.campaign))
        with without(given.step):
            forklift.diagnose(campaign, Truck.read("thesis")).write(given.out)
    except ForkliftError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
