"""The page of a proof: what was concealed, what was said of it, and how often that was right."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from forklift.report import page
from forklift.report.blocks import Fact, Figure, Page, Panel, Section, Table, Text

if TYPE_CHECKING:
    from forklift.ensemble.proof.prove import Proof

ORDER = ("complete", "effect", "shape", "two", "stranger", "sensor", "condition")
KINDS = {
    "complete": "nothing",
    "effect": "an effect of the catalogue",
    "shape": "its effect by another law",
    "two": "two effects",
    "stranger": "physics outside the catalogue",
    "sensor": "a sensor or clock fault",
    "condition": "a wrong load or temperature",
}
LINES = (
    "kind of fault",
    "location",
    "location, or a tie that holds it",
    "cause, or a tie that holds it",
    "cause told first",
    "unknown called unknown",
    "a wrong name",
    "a wrong name called complete",
    "false alarms",
    "false alarms that tell but a load within 1 %",
    "intervals hold the truth",
    "no answer",
)
OURS = "this diagnosis"
GLOSSARY = {
    "hidden": "By a rule applied before the diagnosis, another truck imitates the effect within the sensors' "
    "noise; no-mismatch is then right.",
    "size": "Root mean square change of velocity and pressure that the concealed effect makes, in units of "
    "the sensors' noise.",
    "share removed": "1 − Σ(after − true)²/Σ(before − true)² of the velocity on held-out recordings, against "
    "the noise-free truth.",
}


def rate(told: Mapping[str, Any]) -> str:
    """``19 of 20 (95 %, 75–100 %)``; the interval is Clopper and Pearson's, 95 %."""
    if not told["of"]:
        return "–"
    ends = f"{100 * told['lower']:.0f}–{100 * told['upper']:.0f} %"
    return f"{told['right']} of {told['of']} ({100 * told['share']:.0f} %, {ends})"


def short(told: Mapping[str, Any]) -> str:
    """``19/20``."""
    return f"{told['right']}/{told['of']}" if told["of"] else "–"


def headline(score: Mapping[str, Any]) -> str:
    """The result in one sentence."""
    rates = score["rates"]
    return (
        f"{score['campaigns']} campaigns: kind of fault right in {rate(rates['kind of fault'])}, location in "
        f"{rate(rates['location'])}, cause in {rate(rates['cause, or a tie that holds it'])}; false alarms "
        f"{rate(rates['false alarms'])}."
    )


def proof_text(found: Proof) -> str:
    """The score for a terminal."""
    score = found.score
    lines = [f"Proof ({score['label']}{'' if score['seed'] is None else ' seed ' + str(score['seed'])})"]
    lines += [f"  {name:32s} {rate(score['rates'][name])}" for name in LINES if score["rates"][name]["of"]]
    for kind, told in score["removed"].items():
        lines.append(
            f"  share removed, {kind:16s} median {100 * told['median']:.0f} % of {told['campaigns']}"
        )
    for lifts, told in score["seconds"].items():
        lines.append(
            f"  {lifts:32s} median {told['median']:.0f} s, 95 % {told['95 %']:.0f} s, "
            f"longest {told['longest']:.0f} s"
        )
    for name, told in score["baselines"].items():
        lines.append(
            f"  {name:32s} kind {short(told['kind of fault'])}, location {short(told['location'])}, "
            f"cause {short(told['cause told first'])}, false alarms {short(told['false alarms'])}"
        )
    return "\n".join(lines)


def proof_page(found: Proof) -> str:
    """The page of a proof."""
    return page.html(_page(found))


def _page(found: Proof) -> Page:
    score = found.score
    seed = "open campaigns" if score["seed"] is None else f"seed {score['seed']}, {score['label']}"
    more = [
        f"Run by one version of the package ({score['packages'][0]})."
        if len(score["packages"]) == 1
        else f"Run by {len(score['packages'])} versions of the package: not one figure of one program."
    ]
    if score["label"] == "development":
        more.append(
            "A development seed: bounds may have been set on these campaigns, so no figure of it is told."
        )
    return Page(
        "Proof",
        f"Sealed campaigns of an independent plant: {seed}, {score['campaigns']} campaigns",
        headline(score),
        more,
        _facts(score),
        [
            Section("score", "Score", "", [_lines(score), _kinds(score), _against(score)]),
            Section("calibration", "Calibration", "", [_reliability(score), *_reliability_figure(score)]),
            Section("detection", "Detection", "", [*_detection_figure(score), _detection(score)]),
            Section("causes", "Causes", "", [_causes(score), _confusion(score)]),
            Section("gain", "Gain and time", "", [_removed(score), _seconds(score)]),
            Section("campaigns", "Campaigns", "", [_campaigns(found.results)]),
        ],
        GLOSSARY,
    )


def _facts(score: Mapping[str, Any]) -> list[Fact]:
    rates = score["rates"]
    facts = [
        Fact("How often is the cause right?", rate(rates["cause, or a tie that holds it"])),
        Fact("How often does it raise a false alarm?", rate(rates["false alarms"])),
        Fact("Is unknown physics called unknown?", rate(rates["unknown called unknown"])),
    ]
    return facts


def _table(
    title: str, head: Sequence[str], rows: Sequence[Sequence[str]], note: str = "", folded: bool = False
) -> Any:
    if not rows:
        return Text(f"{title}: nothing to tell of these campaigns.", note=True)
    return Table(title, head, rows, [n > 0 for n in range(len(head))], note, folded)


def _lines(score: Mapping[str, Any]) -> Any:
    rows = [[name, rate(score["rates"][name])] for name in LINES if score["rates"][name]["of"]]
    note = (
        "Exact intervals of 95 % (Clopper and Pearson). "
        "Low is good of wrong names, false alarms and no answer."
    )
    return _table("All campaigns", ["What", "Right (share, interval)"], rows, note)


def _kinds(score: Mapping[str, Any]) -> Any:
    names = ("all right", "kind of fault", "location", "cause, or a tie that holds it", "a wrong name")
    rows = [
        [KINDS.get(kind, kind), *(short(score["by_kind"][kind][name]) for name in names)]
        for kind in ORDER
        if kind in score["by_kind"]
    ]
    return _table("By what was concealed", ["Concealed", *names], rows)


def _against(score: Mapping[str, Any]) -> Any:
    names = ("kind of fault", "location", "cause told first", "false alarms")
    rows = [[OURS, *(rate(score["rates"][name]) for name in names)]]
    rows += [[name, *(rate(told[one]) for one in names)] for name, told in score["baselines"].items()]
    note = (
        "Same campaigns, same fitted truck. Largest residual names no cause. Criterion: BIC over linear "
        "steps, no held-out recordings. Sparse: sequentially thresholded least squares on the residuals "
        "(Brunton et al. 2016). "
        "Regimes: after LISDD (arXiv 2606.23215), in a plain form written for this table."
    )
    return _table("Against simpler ways", ["Way", *names], rows, note)


def _reliability(score: Mapping[str, Any]) -> Any:
    rows = [
        *([f"{one['from']:g} to {one['to']:g}", one] for one in score["reliability"]),
        *([f"form {one['form']}", one] for one in score["forms"]),
    ]
    return _table(
        "Credibility and form of a named cause, and how often it was right",
        ["Told", "Right", "Physics of the same place, by a law that the catalogue lacks"],
        [[told, rate(one), str(one["by_another_law"])] for told, one in rows if one["of"]],
    )


def _reliability_figure(score: Mapping[str, Any]) -> list[Figure]:
    rows = [one for one in score["reliability"] if one["of"]]
    if not rows:
        return []
    x = [0.5 * (one["from"] + one["to"]) for one in rows]
    data = [
        {
            "x": [0, 1],
            "y": [0, 1],
            "mode": "lines",
            "name": "calibrated",
            "line": {"color": "@soft", "dash": "dot"},
        },
        {
            "x": x,
            "y": [one["share"] for one in rows],
            "mode": "markers",
            "name": "told causes",
            "marker": {"color": "@after", "size": 9},
            "error_y": _ends(rows),
        },
    ]
    return [_figure("Reliability", "credibility told", "share right", data, {"range": [0, 1.02]})]


def _ends(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    return {
        "type": "data",
        "symmetric": False,
        "array": [one["upper"] - one["share"] for one in rows],
        "arrayminus": [one["share"] - one["lower"] for one in rows],
    }


def _detection_figure(score: Mapping[str, Any]) -> list[Figure]:
    rows = [one for one in score["detection"] if one["detected"]["of"]]
    if not rows:
        return []
    x = [f"{one['from']:g}–{one['to']:g}" if one["to"] else f"above {one['from']:g}" for one in rows]
    data = [
        {
            "x": x,
            "y": [one[key]["share"] for one in rows],
            "mode": "lines+markers",
            "name": name,
            "line": {"color": colour},
            "error_y": _ends([one[key] for one in rows]),
        }
        for key, name, colour in (("detected", "something told", "@before"), ("right", "all right", "@after"))
    ]
    return [
        _figure(
            "Detection over size", "size of the concealed effect / noise", "share", data, {"type": "category"}
        )
    ]


def _figure(title: str, x: str, y: str, data: Sequence[Mapping[str, Any]], axis: Mapping[str, Any]) -> Figure:
    layout = {
        "xaxis": {"title": {"text": x}} | dict(axis),
        "yaxis": {"title": {"text": y}, "range": [0, 1.05]},
        "showlegend": True,
        "legend": {"orientation": "h", "y": 1.15},
    }
    return Figure(title, "Bars are exact intervals of 95 %.", [Panel("", data, layout)])


def _detection(score: Mapping[str, Any]) -> Any:
    rows = [
        [
            f"{one['from']:g} to {one['to']:g}" if one["to"] else f"above {one['from']:g}",
            rate(one["detected"]),
            rate(one["right"]),
            str(one["hidden"]),
        ]
        for one in score["detection"]
        if one["detected"]["of"]
    ]
    return _table("By size, one concealed law", ["Size", "Something told", "All right", "Hidden"], rows)


def _causes(score: Mapping[str, Any]) -> Any:
    rows = [[one["id"], KINDS.get(one["kind"], one["kind"]), rate(one)] for one in score["by_cause"]]
    return _table(
        "By concealed cause: all right", ["Cause", "Kind", "All right"], rows, folded=len(rows) > 20
    )


def _confusion(score: Mapping[str, Any]) -> Any:
    rows = [[one["concealed"], one["told"], str(one["count"])] for one in score["confusion"]]
    return _table("Confusion", ["Concealed", "Told", "Campaigns"], rows, folded=len(rows) > 20)


def _removed(score: Mapping[str, Any]) -> Any:
    rows = [
        [
            KINDS.get(kind, kind),
            str(told["campaigns"]),
            f"{100 * told['median']:.0f} %",
            f"{100 * told['quartiles'][0]:.0f} to {100 * told['quartiles'][1]:.0f} %",
        ]
        for kind, told in score["removed"].items()
    ]
    head = ["Concealed", "Campaigns", "Median", "Quartiles"]
    return _table("Share of the misfit to the noise-free velocity removed, held out", head, rows)


def _seconds(score: Mapping[str, Any]) -> Any:
    rows = [
        [lifts, str(told["campaigns"]), *(f"{told[key]:.0f} s" for key in ("median", "95 %", "longest"))]
        for lifts, told in score["seconds"].items()
    ]
    head = ["Of", "Campaigns", "Median", "95 %", "Longest"]
    return _table("Time of a diagnosis, and of making what it is given", head, rows)


def _campaigns(results: Sequence[Mapping[str, Any]]) -> Any:
    rows = []
    for one in results:
        concealed = ", ".join(
            cause["id"] + (" (hidden)" if cause["hidden"] else "") for cause in one["answer"]["causes"]
        )
        told = ", ".join(
            f"{cause['id']} ({cause['form']}, {cause['credibility']:.2f})" for cause in one["told"]["causes"]
        )
        share = one["removed"]
        rows.append(
            [
                str(one["number"]),
                concealed or "nothing",
                f"{one['told']['verdict']}: {told}" if told else str(one["told"]["verdict"]),
                "yes" if one["judged"]["all"] else "no",
                "–" if share is None else f"{100 * share:.0f} %",
                f"{one['seconds']:.0f}",
            ]
        )
    head = ["Campaign", "Concealed", "Told", "All right", "Removed", "s"]
    return _table("Every campaign", head, rows, folded=len(rows) > 40)
