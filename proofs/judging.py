"""Is what a diagnosis said of a truck of `variations.py` right? And the table of all of them."""

from cases import equation_of
from reference.plant import effects
from reference.plant.truck import LIFTS


def judge(result, separable):
    """Which parts of the answer are right; `right` is all that must be."""
    truth, answer = result["truth"], result["answer"]
    known = separable.get("cases", {}).get(result["case"], {})
    hidden = bool(known.get("hidden"))
    if answer["verdict"] in ("refused", "none"):
        refused = any(code in answer["said"] for code in truth["refused"])
        return {"verdict": refused, "equation": refused, "lift": refused, "cause": refused, "alone": refused,
                "form": refused, "right": refused, "hidden": hidden}  # fmt: skip
    if hidden or not truth["causes"]:
        fine = answer["verdict"] in (("no-mismatch",) if hidden else truth["verdicts"])
        return {"verdict": fine, "equation": fine, "lift": fine, "cause": fine, "alone": fine, "form": fine,
                "right": fine, "hidden": hidden}  # fmt: skip
    alike = [{cause, *known.get("alike", {}).get(cause, [])} for cause in truth["causes"]]
    named = [cause["id"] for cause in answer["causes"]]
    location = answer["location"] or {}
    either = result["case"] == "traps-all_late"
    found = [any(one in group for one in named) for group in alike]
    equations = {*truth["equations"], *(equation_of(one) for group in alike for one in group
                                        if one in effects.CATALOGUE)}  # fmt: skip
    wheres = {place for cause in answer["causes"] for place in LIFTS if place in cause["where"]}
    judged = {
        "verdict": answer["verdict"] in truth["verdicts"],
        "equation": location.get("equation") in equations,
        "lift": location.get("lift") == truth["lift"] or truth["lift"] == "both" or wheres == {truth["lift"]},
        "cause": any(found) if either else all(found),
        "alone": all(any(one in group for group in alike) for one in named),
        "form": truth["form"] in ("", *(cause["form"] for cause in answer["causes"])),
        "hidden": hidden,
    }
    unknown = answer["verdict"] == "unknown-effect" and "unknown-effect" in truth["verdicts"]
    if unknown:
        judged |= {"cause": judged["equation"], "alone": True, "form": True}
    judged["right"] = all(judged[key] for key in ("verdict", "lift", "cause", "alone", "form"))
    return judged


def amplitude(result):
    """The concealed amplitude and the interval told for it."""
    told = {one["name"]: one for cause in result["answer"]["causes"] for one in cause["parameters"]}
    words = []
    for concealed in result["concealed"]:
        parameter, value = next(iter(concealed["values"].items()))
        ends = [one for name, one in told.items() if name.endswith(f"{concealed['law']}.{parameter}")]
        words.append(
            f"{value:.3g}" + (f" in {ends[0]['lower']:.3g} … {ends[0]['upper']:.3g}" if ends else "")
        )
    return "; ".join(words)


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
        causes = ", ".join(f"{one['where']}.{one['id']}" for one in answer["causes"]) or "–"
        wrong = [key for key in ("verdict", "lift", "cause", "alone", "form") if not judged[key]]
        lines.append(
            f"| {result['case']}{' (hidden)' if judged['hidden'] else ''} | {points} | {answer['verdict']} "
            f"| {location.get('equation', '–')}{'' if judged['equation'] else ' (wrong)'} | {causes} "
            f"| {'yes' if judged['right'] else 'no: ' + ', '.join(wrong)} "
            f"| {', '.join(sorted({one['form'] for one in answer['causes']})) or '–'} | {amplitude(result)} "
            f"| {left.get('worst_before', float('nan')):.3g} | {left.get('worst_after', float('nan')):.3g} "
            f"| {result['seconds']:.0f} |"
        )
        kind = result["case"].partition("-")[0]
        asked = result["concealed"][0]["asked"] if kind == "effects" else None
        totals.setdefault((kind, asked), []).append(judged)
    lines += [
        "",
        "| set | points | cases | verdict | equation | cause | right | hidden |",
        "|---|---:|" + 6 * "---:|",
    ]
    for (kind, asked), judged in totals.items():
        counts = [
            sum(one[key] for one in judged) for key in ("verdict", "equation", "cause", "right", "hidden")
        ]
        lines.append(
            f"| {kind} | {'' if asked is None else f'{asked:g}'} | {len(judged)} | "
            + " | ".join(str(count) for count in counts)
            + " |"
        )
    return "\n".join(lines) + "\n"
