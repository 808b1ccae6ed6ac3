"""Is what a diagnosis said of a truck of `variations.py` right? And the table of all of them."""

from math import inf

from cases import BETWEEN_LIFTS, EQUATIONS, POINTS
from forklift.diagnosis.criteria import SLIGHT
from forklift.ensemble.proof.truth.truck import LIFTS

PARTS = ("verdict", "equation", "lift", "cause", "alone", "form")
"""Of an answer: the verdict, where it is, who it is, nobody else, and whether the law's form is right."""
NEEDED = ("verdict", "lift", "cause", "alone", "form")


def judge(result, separable):
    """Which parts of the answer are right; `right` if all that are needed are; how many laws are `hidden`."""
    truth, answer = result["truth"], result["answer"]
    known = [separability(result["lift"], one, separable) for one in result["concealed"]]
    hidden = sum(one.get("hidden", False) for one in known) if truth["causes"] else 0
    all_hidden = bool(known) and hidden == len(known)
    if answer["verdict"] in ("refused", "none"):
        return whole(any(code in answer["said"] for code in truth["refused"]), hidden)
    if all_hidden or not truth["causes"]:
        return whole(answer["verdict"] in (["no-mismatch"] if all_hidden else truth["verdicts"]), hidden)
    # What the recordings cannot part from a cause is as right as the cause. One of two that they hide may be
    # named, but need not be, and excuses no other name.
    groups = [{cause} for cause in truth["causes"]]
    to_find = list(groups)
    for group, one in zip(groups, known, strict=False):
        if one.get("hidden"):
            to_find.remove(group)
        else:
            group.update(one.get("alike", ()))
    if result["case"] in EITHER:
        groups = to_find = [set().union(*groups)]
    named = [cause["id"] for cause in answer["causes"]]
    location = answer["location"] or {}
    equations = {*truth["equations"], *(EQUATIONS[one] for group in groups for one in group)}
    places = {lift for cause in answer["causes"] for lift in LIFTS if lift in cause["where"]}
    judged = {
        "verdict": answer["verdict"] in verdicts(truth["verdicts"], groups),
        "equation": location.get("equation") in equations,
        "lift": truth["lift"] in ("both", location.get("lift"))
        or places == {truth["lift"]}
        or (bool(named) and set(named) <= set(BETWEEN_LIFTS)),
        "cause": all(group & set(named) for group in to_find),
        "alone": all(any(one in group for group in groups) for one in named),
        "form": form(truth, answer, known),
    }
    if answer["verdict"] == "unknown-effect" and "unknown-effect" in truth["verdicts"]:
        judged |= {"cause": judged["equation"], "alone": True, "form": True}
    return judged | {"hidden": hidden, "right": all(judged[part] for part in NEEDED)}


EITHER = ("traps-all_late",)
"""Cases whose causes are one and the same to any recording."""


def whole(right, hidden):
    """All parts are right or none."""
    return dict.fromkeys((*PARTS, "right"), right) | {"hidden": hidden}


def separability(lift, concealed, separable):
    """What was fixed beforehand of this law, at the points nearest below what it costs here."""
    laws, name = separable.get("laws", {}), concealed["law"]
    points = [one for one in POINTS if one <= max(concealed["asked"], POINTS[0])][-1]
    return laws.get(f"{lift}/{name}/{points:g}", {})


def verdicts(told, groups):
    """The right ones, with those of what the cause cannot be parted from."""
    right = set(told)
    for group in groups:
        right |= {"sensor-fault" for one in group if EQUATIONS[one] == "sensor"}
        right |= {"parameter-error" for one in group if EQUATIONS[one] == "operating-point"}
    return right


def form(truth, answer, known):
    """Whether `complete` is said of what is, and `uncertain` of another law at the right place; of a law that
    hardly shows that is right as well."""
    before = (answer.get("left_over") or {}).get("worst_before", inf)
    told = {cause["form"] for cause in answer["causes"]}
    if truth["form"] == "uncertain" and any(
        set(truth["causes"]) & set(one.get("alike", ())) for one in known
    ):
        return True  # the catalogue's law imitates it within the noise: either is right
    if truth["form"] == "complete" and told == {"uncertain"} and before <= SLIGHT:
        return True
    return truth["form"] in ("", *told)


def amplitudes(result):
    """Each concealed amplitude, and the interval told for it if its effect was named."""
    told = {one["name"]: one for cause in result["answer"]["causes"] for one in cause["parameters"]}
    for concealed in result["concealed"]:
        parameter, value = next(iter(concealed["values"].items()))
        ends = [one for name, one in told.items() if name.endswith(f"{concealed['law']}.{parameter}")]
        yield value, (ends[0]["lower"], ends[0]["upper"]) if ends else None


def amplitude(result):
    """The same in words."""
    return "; ".join(
        f"{value:.3g}" + (f" in {ends[0]:.3g} … {ends[1]:.3g}" if ends else "")
        for value, ends in amplitudes(result)
    )


def table(results, separable):
    """Markdown of all cases, then totals by set and amplitude."""
    lines = [
        "| case | points | verdict | equation | causes | right | form | amplitude | before | after | s |",
        "|---|---:|---|---|---|---|---|---|---:|---:|---:|",
    ]
    totals = {}
    for result in results:
        answer, judged = result["answer"], judge(result, separable)
        points = "+".join(f"{one['points']:.2g}" for one in result["concealed"])
        location, left = answer.get("location") or {}, answer.get("left_over") or {}
        causes = ", ".join(f"{one['where']}.{one['id']}".lstrip(".") for one in answer["causes"]) or "–"
        wrong = [part for part in NEEDED if not judged[part]]
        laws = len(result["concealed"])
        several = f"{judged['hidden']} of {laws} " if laws > 1 else ""
        hidden = f" ({several}hidden)" if judged["hidden"] else ""
        lines.append(
            f"| {result['case']}{hidden} | {points} | {answer['verdict']} "
            f"| {location.get('equation', '–')}{'' if judged['equation'] else ' (wrong)'} | {causes} "
            f"| {'yes' if judged['right'] else 'no: ' + ', '.join(wrong)} "
            f"| {', '.join(sorted({one['form'] for one in answer['causes']})) or '–'} | {amplitude(result)} "
            f"| {left.get('worst_before', float('nan')):.3g} | {left.get('worst_after', float('nan')):.3g} "
            f"| {result['seconds']:.0f} |"
        )
        kind = result["case"].partition("-")[0]
        asked = result["concealed"][0]["asked"] if kind == "effects" else None
        inside = [ends[0] <= value <= ends[1] for value, ends in amplitudes(result) if ends]
        totals.setdefault((kind, asked), []).append(judged | {"told": len(inside), "inside": sum(inside)})
    lines += [
        "",
        "| set | points | cases | verdict | equation | cause | right | hidden | intervals | hold truth |",
        "|---|---:|" + 8 * "---:|",
    ]
    for (kind, asked), judged in totals.items():
        parts = ("verdict", "equation", "cause", "right", "hidden", "told", "inside")
        counts = [sum(one[key] for one in judged) for key in parts]
        lines.append(
            f"| {kind} | {'' if asked is None else f'{asked:g}'} | {len(judged)} | "
            + " | ".join(str(count) for count in counts)
            + " |"
        )
    return "\n".join(lines) + "\n"
