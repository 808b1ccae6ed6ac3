"""Do searches from scattered starts end in the same place, and is one that does not recognised and said?

    python proofs/starts.py [--starts 10] [--seed 1] [CAMPAIGN]

README.md beside this file says what is scattered, and what counts as the same place. Ends with status 0 if at
most one start in ten ends elsewhere and the verdict of the fit says which.
"""

import argparse
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
CAMPAIGN = ROOT / "tests" / "campaigns" / "null"

STARTS = 10
SHARE = 0.9  # of the starts that must agree


class Lines:
    """A line for every stage of every start."""

    def __init__(self):
        self.last = None

    def __call__(self, progress):
        at = progress.start, progress.stage
        if at != self.last:
            self.last = at
            print(
                f"start {progress.start + 1} of {progress.starts}, "
                f"stage {progress.stage} of {progress.stages}: misfit {progress.misfit:.3g}",
                flush=True,
            )


def table(ends):
    """Markdown, a row per start."""
    lines = [
        "| start | cost above the best | largest distance [standard deviations] | same place |",
        "|---:|---:|---:|---|",
    ]
    lines += [
        f"| {end.start + 1} | {end.cost:.3f} | {end.distance:.3f} | {'yes' if end.same else 'no'} |"
        for end in ends
    ]
    return "\n".join(lines)


def judged(ends, verdict):
    """What is said of the proof, and whether it holds: enough starts agree, and the others are named."""
    agreeing = sum(end.same for end in ends)
    enough = agreeing >= SHARE * len(ends)
    said = any(f"{agreeing} of {len(ends)} starts ended in the same place" in line for line in verdict)
    unsaid = [
        end.start + 1
        for end in ends
        if not end.same and not any(line.startswith(f"Start {end.start + 1} ") for line in verdict)
    ]
    lines = [f"{agreeing} of {len(ends)} starts ended in the same place; {SHARE * len(ends):g} must."]
    if not said:
        lines.append("The verdict does not say how many.")
    if unsaid:
        lines.append(f"The verdict does not name start {', '.join(map(str, unsaid))}.")
    return "\n".join(lines), enough and said and not unsaid


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("campaign", nargs="?", type=Path, default=CAMPAIGN)
    parser.add_argument("--starts", type=int, default=STARTS)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    from forklift import Campaign, Truck, fit

    found = fit(
        Campaign.read(given.campaign),
        Truck.read("thesis"),
        starts=given.starts,
        seed=given.seed,
        progress=Lines(),
    )
    if found.interrupted:
        return 130
    text, holds = judged(found.ends, found.sentences)
    print(f"\n{table(found.ends)}\n\n{text}")
    print(*(line for line in found.sentences if line.startswith("Start ")), sep="\n")
    return 0 if holds else 1


if __name__ == "__main__":
    sys.exit(main())
