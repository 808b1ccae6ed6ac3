"""`forklift diagnose` without one of its steps: what would the answers be worth then?

    python proofs/without.py STEP CAMPAIGN --out OUT

STEP: location (no unknown input tells where it is, and no shape without a name is tried there), rivals
(physics only is suspected, and the first that explains enough is taken), held-out (the recordings that were
fitted judge).
"""

import sys
from contextlib import ExitStack
from dataclasses import replace
from unittest.mock import patch

from forklift import Campaign, Truck, diagnose
from forklift.diagnosis import selection
from forklift.diagnosis.inputs import unknown_inputs
from forklift.suspects import suspects

STEPS = ("location", "rivals", "held-out")


def without(step, campaign, truck):
    """The diagnosis of a campaign without this step."""
    with ExitStack() as changed:
        if step == "location":
            changed.enter_context(patch("forklift.diagnose.unknown_inputs", in_any_order))
            changed.enter_context(patch("forklift.diagnose.FreeSuspects", lambda *_: lambda trial: []))
        elif step == "rivals":
            changed.enter_context(patch("forklift.diagnose.suspects", physics))
            changed.enter_context(patch.object(selection, "FIRST", 1))
            changed.enter_context(patch.object(selection, "FURTHER", 0))
            changed.enter_context(patch.object(selection, "_confused", lambda *_: []))
        elif step == "held-out":
            fitted = tuple(one for one in campaign.recordings if one.role == "estimate")
            campaign = replace(campaign, recordings=fitted)
        return diagnose(campaign, truck)


def in_any_order(*given):
    """The unknown inputs as if nothing told between them."""
    return sorted(unknown_inputs(*given), key=lambda one: one.port)


def physics(*given):
    """The catalogue alone."""
    return tuple(one for one in suspects(*given) if one.kind == "physics")


def main():
    step, campaign, _, out = sys.argv[1:]
    assert step in STEPS, f"{step} is none of {', '.join(STEPS)}"
    without(step, Campaign.read(campaign), Truck.read("thesis")).write(out)


if __name__ == "__main__":
    main()
