"""What a plant's diagnosis leaves behind: its sentence, its text, its JSON and its folder."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from forklift.base import output, present
from forklift.base.numbers import defined
from forklift.base.result_files import PAGE
from forklift.diagnosis.dependence import TELLING
from forklift.diagnosis.ledger import collected

if TYPE_CHECKING:
    from forklift.diagnosis.plant_diagnose import PlantDiagnosis

MARK = "diagnosis.json"
LIKELY = 0.5
"""Credibility from which on a cause is told without a doubt in its sentence."""


def sentence(found: PlantDiagnosis) -> str:
    """The verdict in one sentence."""
    name = found.plant.name
    if found.verdict == "no-mismatch":
        return f"No mismatch: {name} explains its recordings to the sensors' noise."
    if not found.causes:
        return (
            f"Something unknown acts on {name}, most likely at {found.inputs[0].port}: nothing of the "
            f"catalogue explains it ({_before(found)})."
        )
    said = "; ".join(
        f"{'' if cause.credibility >= LIKELY else 'perhaps '}{cause.hypothesis.name} "
        f"({cause.hypothesis.label})"
        f"{f', by another law, a curve over {cause.curve.over}' if cause.curve else ''}"
        for cause in found.causes
    )
    rest = "" if found.final.complete else " It is not all: something is still left over."
    return f"{name}: {said}. {_falls(found)}.{rest}"


def _where(found: PlantDiagnosis) -> str:
    return "what was held out" if found.judged_on == "validate" else "what it was fitted on"


def _units(found: PlantDiagnosis) -> set[str]:
    return {one.unit for one in found.plant.outputs}


def _before(found: PlantDiagnosis) -> str:
    if len(_units(found)) > 1:
        return f"{found.baseline.reduced_chi2:.3g} times the noise power is left of {_where(found)}"
    (unit,) = _units(found)
    error = f"{found.rmse(found.judged_on)[0]:.3g}{'' if unit == '1' else f' {unit}'}"
    return f"root mean square error on {_where(found)}: {error}"


def _falls(found: PlantDiagnosis) -> str:
    """By how much the model gains; outputs of several units only compare in units of their noise."""
    if len(_units(found)) > 1:
        return (
            f"What is left over of {_where(found)} falls from {found.baseline.reduced_chi2:.3g} to "
            f"{found.final.reduced_chi2:.3g} times the sensors' noise power"
        )
    (unit,) = _units(found)
    before, after = found.rmse(found.judged_on)
    return (
        f"The root mean square error on {_where(found)} falls from {before:.3g} to {after:.3g}"
        f"{'' if unit == '1' else f' {unit}'}"
    )


def to_dict(found: PlantDiagnosis) -> dict[str, Any]:
    """For JSON: what is not finite is null."""
    from forklift import __version__

    told = {
        "plant": found.plant.name,
        "verdict": found.verdict,
        "sentence": found.sentence,
        "causes": [
            {
                "id": cause.hypothesis.id,
                "label": cause.hypothesis.label,
                "name": cause.hypothesis.name,
                "kind": cause.hypothesis.kind,
                "credibility": cause.credibility,
                "form": cause.form,
                "curve_over": cause.curve and cause.curve.over,
                "not_separable_from": [one.label for one in cause.not_separable_from],
                "rivals": [
                    {
                        "hypotheses": [one.label for one in rival],
                        "credibility": share,
                        "mean_square": square,
                    }
                    for rival, share, square in cause.rivals
                ],
            }
            for cause in found.causes
        ],
        "located": [{"port": one.port, "evidence": one.evidence, "noise": one.noise} for one in found.inputs],
        "shapes": [
            {"variable": one.variable, "explained": one.explained, "region": list(one.region)}
            for one in found.shapes
        ],
        "scores": [vars(one) for one in found.scores],
        "confounded": [
            {"cause": one.accepted.label, "other": one.other.label, "share": one.share}
            for one in found.confounded
        ],
        "outlying_groups": list(found.outlying_groups),
        "groups": [one.to_dict() for one in found.groups],
        "parameters": _parameters(found),
        "untestable": [one.label for one in found.untestable],
        "next_recording": None if found.next_recording is None else found.next_recording.why,
        "mean_square": {"before": found.baseline.reduced_chi2, "after": found.final.reduced_chi2},
        "hypotheses": [one.to_dict() for one in collected(found.selection, found.screening, found.causes)],
        "recordings": [
            {
                "file": one.recording.file,
                "role": one.recording.role,
                "group": one.recording.group,
                "samples": len(one.recording),
                "sha256": one.recording.sha256,
            }
            for one in found.after
        ],
        "forklift": __version__,
        "runtime_s": dict(found.seconds),
    }
    finite: dict[str, Any] = _finite(told)
    return finite


def _parameters(found: PlantDiagnosis) -> list[dict[str, Any]]:
    """As the final model has them, and as the fitted plant had them before."""
    before = {one.name: vars(one) for one in found.numbers_before}
    starts = {one.name: one.unknown.start[0] for one in found.final.knowledge.estimates}
    return [{**vars(one), "start": starts[one.name], "before": before.get(one.name)} for one in found.numbers]


def _finite(told: Any) -> Any:
    if isinstance(told, dict):
        return {key: _finite(value) for key, value in told.items()}
    if isinstance(told, list | tuple):
        return [_finite(value) for value in told]
    return defined(told)


def write(found: PlantDiagnosis, out: str | Path) -> Path:
    """See `PlantDiagnosis.write`."""
    told = to_dict(found)
    with output.folder(out, {MARK, PAGE}, MARK) as temporary:
        text = json.dumps(told, indent=1, ensure_ascii=False, allow_nan=False)
        (temporary / MARK).write_text(text + "\n", encoding="utf-8", newline="\n")
        (temporary / PAGE).write_text(present.page(found, told), encoding="utf-8", newline="\n")
    return Path(out)


def text(found: PlantDiagnosis) -> str:
    """Everything, for a terminal."""
    return "\n".join([sentence(found), *_lines(found)])


def _lines(found: PlantDiagnosis) -> list[str]:
    lines = []
    if found.inputs:
        named = ", ".join(f"{one.port} ({one.evidence:.0f})" for one in found.inputs[:4])
        lines.append(f"Where (ln evidence of an unknown input): {named}.")
    if found.shapes:
        best = found.shapes[0]
        lines.append(
            f"  In recordings left out {100.0 * best.explained:.0f} % of it is a function of {best.variable}."
            if best.explained >= TELLING
            else "  In recordings left out it is a function of nothing that was measured."
        )
    for cause in found.causes:
        lines.append(
            f"Cause: {cause.hypothesis.label} — {cause.hypothesis.name}; credibility "
            f"{cause.credibility:.2f}, "
            f"form {cause.form}."
        )
        if cause.not_separable_from:
            lines.append(f"  Not separable from {', '.join(one.label for one in cause.not_separable_from)}.")
        stand = [one for one in found.confounded if one.accepted is cause.hypothesis]
        if stand:
            named = ", ".join(f"{one.other.label} ({100.0 * one.share:.0f} %)" for one in stand)
            lines.append(f"  These recordings cannot tell it from {named}.")
        for rival, share, square in cause.rivals[:6]:
            lines.append(
                f"  rival {' + '.join(one.label for one in rival) or 'none'}: credibility {share:.2f}, "
                f"mean square left {square:.3g}"
            )
    for one in found.numbers:
        lines.append(f"  {one.name} = {one.value:.4g} ({one.lower:.4g} to {one.upper:.4g}) {one.unit}")
    for score in found.scores:
        lines.append(
            f"  {score.file} {score.output} [{score.role}]: RMSE {score.rmse_before:.4g} -> "
            f"{score.rmse_after:.4g}"
        )
    for group in found.groups:
        verb = "holds" if group.holds else "does not hold"
        amplitudes = ", ".join(f"{name} = {value:.4g}" for name, value in group.amplitudes)
        lines.append(
            f"  left out {group.group}: {verb}, mean square {group.before:.3g} -> {group.after:.3g}, fitted "
            f"alone {group.alone:.3g}; without it {amplitudes}"
        )
    if found.outlying_groups:
        lines.append(f"Fits no law that fits the others: {', '.join(found.outlying_groups)}.")
    if found.next_recording:
        lines.append(f"Next recording: {found.next_recording.why}")
    return lines
