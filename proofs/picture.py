"""The result of a proof as one picture, for README and docs/proof.md.

    python proofs/picture.py proof/score.json [--out docs/_static/proof.svg]

On the left the rates of a run of `forklift prove`, or of several as one (`proofs/record.py together`), each
with its exact 95 % interval (Clopper and Pearson 1934) and the goal; on the right the same campaigns through
simpler ways. All is from ``score.json``.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import matplotlib as mpl

mpl.use("svg")
from matplotlib import pyplot as plt

from forklift.ensemble.proof.score import GOALS

RATES = {
    "kind of fault": "kind of fault",
    "location, or a tie that holds it": "location, or a tie",
    "cause, or a tie that holds it": "cause, or a tie",
    "unknown called unknown": "unknown called unknown",
    "intervals hold the truth": "95 % intervals hold the truth",
    "a wrong name called complete": "a wrong name called complete",
    "false alarms": "false alarms",
}
"""Lines of the score, and their names in the picture."""
WAYS = {
    "largest residual": "largest residual",
    "criterion": "BIC, nothing held out",
    "sparse": "sparse regression",
    "regimes": "clean regimes",
}
OURS, THEIRS, ALARM, GOAL = "#1f6f9f", "#8a8f98", "#c2571a", "#3a3a3a"
STYLE = {
    "svg.fonttype": "none",
    "svg.hashsalt": "forklift",
    "font.size": 9.0,
    "font.family": "sans-serif",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.spines.left": False,
    "ytick.left": False,
}


def picture(score: Mapping[str, Any], path: Path) -> None:
    """Draw it into an SVG file."""
    with mpl.rc_context(STYLE):
        figure, (rates, ways) = plt.subplots(1, 2, figsize=(9.0, 3.3), width_ratios=(1.15, 1.0))
        _rates(rates, score)
        _ways(ways, score)
        if score["seed"] is None:
            run = f"{score['campaigns']} campaigns of {len(score['seeds'])} seeds"
        else:
            run = f"forklift prove --seed {score['seed']} --campaigns {score['campaigns']}"
        figure.suptitle(f"{run}: sealed campaigns of an independent plant", fontsize=9.5)
        figure.tight_layout()
        figure.savefig(path, format="svg", metadata={"Date": None, "Creator": None})
        plt.close(figure)


def _rates(axes: Any, score: Mapping[str, Any]) -> None:
    told = [(words, *GOALS[name], score["rates"][name]) for name, words in RATES.items()]
    told = [one for one in told if one[3]["of"]]
    for place, (_, least, most, rate) in enumerate(reversed(told)):
        lower, share, upper = (100.0 * rate[key] for key in ("lower", "share", "upper"))
        goal, colour = (least, OURS) if least else (most, ALARM)
        axes.plot([lower, upper], [place, place], color=colour, linewidth=2.0, solid_capstyle="butt")
        axes.plot([share], [place], "o", color=colour)
        axes.plot([goal, goal], [place - 0.32, place + 0.32], color=GOAL, linewidth=1.0)
    labels = [f"{words}  {rate['right']} of {rate['of']}" for words, _, _, rate in reversed(told)]
    axes.set_yticks(range(len(told)), labels)
    axes.set_xlim(-2.0, 102.0)
    axes.set_ylim(-0.6, len(told) - 0.4)
    axes.set_xlabel("%, with exact 95 % interval; the tick is the goal")
    axes.grid(axis="x", alpha=0.3)


def _ways(axes: Any, score: Mapping[str, Any]) -> None:
    rates = score["rates"]
    complete = score["by_kind"].get("complete", {}).get("false alarms", {"of": 0, "share": None})
    rows = [("this diagnosis", rates["cause told first"], complete, OURS)]
    for name, words in WAYS.items():
        if name in score["baselines"]:
            given = score["baselines"][name]
            rows.append((words, given["cause told first"], given["false alarms"], THEIRS))
    for place, (_, cause, alarm, colour) in enumerate(reversed(rows)):
        axes.barh(place + 0.18, 100.0 * (cause["share"] or 0.0), 0.32, color=colour)
        axes.barh(place - 0.18, 100.0 * (alarm["share"] or 0.0), 0.32, color=ALARM)
    axes.set_yticks(range(len(rows)), [words for words, *_ in reversed(rows)])
    axes.set_xlim(0.0, 102.0)
    axes.set_xlabel("% of campaigns")
    handles = [plt.Rectangle((0, 0), 1, 1, color=colour) for colour in (OURS, ALARM)]
    axes.legend(
        handles, ["cause named first", "alarm on a complete truck"], frameon=False, fontsize=8.0,
        loc="lower left", bbox_to_anchor=(-0.02, 0.95),
    )  # fmt: skip
    axes.grid(axis="x", alpha=0.3)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("score", type=Path)
    parser.add_argument("--out", type=Path, default=Path("docs/_static/proof.svg"))
    given = parser.parse_args()
    picture(json.loads(given.score.read_text(encoding="utf-8")), given.out)
    print(f"Written: {given.out}")


if __name__ == "__main__":
    main()
