"""Is the curve that explains most among those that are simulated? Of physics that no catalogue holds.

    python proofs/foreseen.py [--seed 620001] [--campaigns 60] [--out TABLE.md]

Of the campaigns of `forklift prove --seed SEED --campaigns CAMPAIGNS` those of one lift are taken in which a
stranger is concealed. Every curve at the most credible places, over every variable, is simulated for what the
fitted truck leaves over, as a diagnosis simulates only those of which the places' answers to hats promise
most. A row says which has the greatest evidence, and of it the share that the best of the first two, four,
six, `MOST_NOW` or `MOST_PAST` and twelve has, of those of the moment and of those of the past. Ends with
status 1 if of any campaign less than `CURVE_TIE` of the greatest evidence is among those that are simulated.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from chance import asked
from forklift import Diagnosis, ForkliftError
from forklift.diagnosis.criteria import CURVE_TIE, MOST_NOW, MOST_PAST
from forklift.diagnosis.curves import credible, ranges_of, variables
from forklift.diagnosis.foreseen import foreseen
from forklift.diagnosis.locate import hats
from forklift.diagnosis.screening import screen
from forklift.ensemble.proof.draw import draw

Pair = tuple[str, str]
"""A place and a variable."""


def weighed(found: Diagnosis) -> tuple[dict[Pair, float], dict[Pair, float]]:
    """Of every curve what is foreseen, and its evidence by its own simulation."""
    baseline = found.selection.baseline
    early, at = baseline.early, baseline.told_from
    machine = early.problem.machine
    known = {place.name: place for place in machine.places}
    places = [known[one.port] for one in credible([one for one in found.inputs if one.port in known])]
    width_s = machine.hat_width_s(early.problem.samples)
    centres = [hats(sample, width_s) for sample in early.problem.samples]
    seen = {part: variables(early.problem, early.x, part, centres) for part in {one.part for one in places}}
    promised = foreseen(
        early.problem,
        early.x,
        {one.name: seen[one.part] for one in places},
        {one.name: one.size for one in places},
        width_s,
    )
    curves = {
        curve: (place.name, variable)
        for place in places
        for variable, ends in ranges_of(at, place.part).items()
        for curve in machine.curves(place, variable, *ends)[:1]
    }
    told = screen(at.problem, at.x, list(curves), 0, slow=baseline.quiet).ranked
    return promised, {curves[one.hypotheses[0]]: one.evidence for one in told}


def shares(order: list[Pair], evidence: dict[Pair, float], firsts: list[int]) -> list[float]:
    """Of the greatest evidence the share that the best of the first so many has."""
    return [max(evidence[pair] for pair in order[:first]) / max(evidence.values()) for first in firsts]


def main() -> int:
    """A row for each campaign, and the least of all."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=620001)
    parser.add_argument("--campaigns", type=int, default=60)
    parser.add_argument("--out", type=Path, help="where the table goes")
    given = parser.parse_args()
    now, past = [2, 4, 6, MOST_NOW, 12], [2, 4, 6, MOST_PAST, 12]
    titles = [*(f"now {first}" for first in now), *(f"past {first}" for first in past)]
    lines = [
        f"| campaign | concealed | greatest | evidence | {' | '.join(titles)} | simulated |",
        "|---:|---|---|---:|" + "---:|" * (len(titles) + 1),
    ]
    print("\n".join(lines), flush=True)
    least = 1.0
    for number in range(given.campaigns):
        drawn = draw(given.seed, number)
        if drawn.kind != "stranger" or drawn.lift == "both":
            continue
        try:
            found = asked(drawn)
        except ForkliftError as error:
            print(f"{number} is refused: {error.code}", file=sys.stderr)
            continue
        promised, evidence = weighed(found)
        best = max(evidence, key=lambda pair: evidence[pair])
        if evidence[best] <= 0.0:
            continue
        of_past = found.selection.baseline.early.problem.machine.past
        ranked = sorted(evidence, key=lambda pair: -promised[pair])
        kinds = [[pair for pair in ranked if (pair[1] in of_past) is old] for old in (False, True)]
        told = [
            share
            for order, firsts in zip(kinds, (now, past), strict=True)
            for share in shares(order, {pair: evidence[pair] for pair in order}, firsts)
        ]
        simulated = [*kinds[0][:MOST_NOW], *kinds[1][:MOST_PAST]]
        share = max(evidence[pair] for pair in simulated) / evidence[best]
        least = min(least, share)
        row = [
            f"{number}",
            drawn.concealed[0],
            f"{best[0]} over {best[1]}",
            f"{evidence[best]:.0f}",
            *(f"{one:.2f}" for one in told),
            f"{share:.2f}",
        ]
        lines.append(f"| {' | '.join(row)} |")
        print(lines[-1], flush=True)
    lines.append(f"| least | | | | {' | '.join([''] * len(titles))} | {least:.2f} |")
    print(lines[-1])
    if given.out:
        given.out.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return int(least < CURVE_TIE)


if __name__ == "__main__":
    sys.exit(main())
