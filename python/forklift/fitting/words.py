"""A fit in plain sentences: what the truck explains, what is left over and where, what cannot be told."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from forklift.fitting.residuals import ChannelResidual
from forklift.plant.forklift.phases import IN_WORDS, PHASES, phases, shut_current
from forklift.recordings.channels import Lift, commanded

if TYPE_CHECKING:
    from forklift.fitting.fit import Fit
    from forklift.fitting.intervals import Group

WARM_K = 15.0
"""Recordings this much warmer than the coldest are called warm."""


def verdict(fit: Fit) -> tuple[str, ...]:
    """All sentences, the most important first."""
    said = [_interrupted(fit)] if fit.interrupted else []
    said += [_lift(fit, lift) for lift in fit.lifts]
    said += _left_over(fit)
    said += [caution.sentence for caution in fit.cautions]
    said += _starts(fit)
    said += [_together(group) for group in fit.knowledge.groups]
    if fit.knowledge.unidentifiable:
        names = ", ".join(fit.knowledge.unidentifiable)
        said.append(f"Not told by these recordings at all, and held near the start's values: {names}.")
    return tuple(said)


def _interrupted(fit: Fit) -> str:
    return (
        f"Interrupted after {fit.found.evaluations} evaluation"
        f"{'s' * (fit.found.evaluations != 1)}: this is the best truck so far, and not the best there is."
    )


def _lift(fit: Fit, lift: Lift) -> str:
    """How well one lift's held-out recordings are explained."""
    seen = [found for found in fit.held_out if lift in commanded(found.group)]  # type: ignore[arg-type]
    files = sorted({found.file for found in seen})
    if not seen:
        return f"{lift.capitalize()} lift: no recording of it is judged on."
    what = f"{len(files)} {seen[0].role} recording{'s' * (len(files) > 1)}"
    worst = max(seen, key=lambda found: found.mean_square)
    size = (
        f"{worst.mean_square:.2f} (mean square in units of the sensors' noise, {worst.channel} of "
        f"{worst.file})"
    )
    if worst.explained:
        text = (
            f"{lift.capitalize()} lift: the fitted truck explains all {what} to the sensors' noise; "
            f"what is left is at most {size}"
        )
    else:
        bad = sorted({found.file for found in seen if not found.explained})
        text = (
            f"{lift.capitalize()} lift: no values of these parameters explain the recordings: in "
            f"{len(bad)} of {what} more than the sensors' noise is left over, up to {size}"
        )
    return f"{text}{_velocity(fit, lift)}."


def _velocity(fit: Fit, lift: Lift) -> str:
    before, after = (
        table["nrmse_percent"].drop_nulls().to_numpy()
        for table in (fit.before.validation(lift), fit.after.validation(lift))
    )
    if not len(after):
        return ""
    return (
        f"; its velocity fits to {after.mean():.1f} % on average and {after.min():.1f} % at worst (NRMSE), "
        f"from {before.mean():.1f} % and {before.min():.1f} % before"
    )


def _left_over(fit: Fit) -> Iterator[str]:
    """Which signal and recordings, where in the motion and at which operating points something is left."""
    for lift in fit.lifts:
        own = [found for found in fit.held_out if found.group in (lift, "both")]
        bad = [found for found in own if not found.explained]
        if not bad:
            continue
        excess = {found: found.samples * (found.mean_square - 1.0) for found in bad}
        total = sum(excess.values())
        signals = _shares(bad, excess, lambda found: found.channel)
        said = [f"What is left over on the {lift} lift: {_listed(signals, total)} by signal"]
        files = _shares(bad, excess, lambda found: found.file)
        said.append(f"{_listed(files, total)} by recording")
        worst = next(iter(signals))
        said.append(_phase(fit, [found for found in bad if found.channel == worst], worst))
        points = _operating_points(fit, bad, excess, total)
        yield "; ".join(filter(None, [*said, points])) + "."


def _shares(bad: Sequence[ChannelResidual], excess, key) -> dict[str, float]:  # type: ignore[no-untyped-def]
    sums: dict[str, float] = {}
    for found in bad:
        sums[key(found)] = sums.get(key(found), 0.0) + excess[found]
    return dict(sorted(sums.items(), key=lambda item: -item[1]))


def _listed(shares: dict[str, float], total: float, most: int = 3) -> str:
    shown = list(shares.items())[:most]
    return ", ".join(f"{100.0 * share / total:.0f} % {name}" for name, share in shown)


def _phase(fit: Fit, bad: Sequence[ChannelResidual], channel: str) -> str:
    """In which phase of the motion the squared residuals of the worst signal lie."""
    recordings = {found.file: found for found in fit.campaign.recordings}
    square, seconds = np.zeros(len(PHASES)), np.zeros(len(PHASES))
    for found in bad:
        recording = recordings[found.file]
        lift: Lift = "main" if "main" in channel or recording.lift == "main" else "free"
        current = recording.channels[f"current_{lift}_a"]
        if not (current > shut_current(fit.truck, lift)).any():
            continue
        which = phases(recording.time_s, current, shut_current(fit.truck, lift))[found.rows]
        square += np.bincount(which, found.left**2, len(PHASES))
        seconds += np.bincount(which, minlength=len(PHASES))
    if not square.any():
        return ""
    most = int(np.argmax(square))
    return (
        f"{100 * square[most] / square.sum():.0f} % of {channel}'s in {IN_WORDS[PHASES[most]]} "
        f"({100 * seconds[most] / seconds.sum():.0f} % of the time)"
    )


def _operating_points(fit: Fit, bad: Sequence[ChannelResidual], excess, total: float) -> str:  # type: ignore[no-untyped-def]
    """Whether warm or heavy recordings have more than their share."""
    recordings = {found.recording.file: found for found in fit.after.predictions}
    temperature = {file: found.oil_temperature_degc for file, found in recordings.items()}
    judged = {found.file for found in fit.held_out}
    coldest = min(temperature[file] for file in judged)
    warm = {file for file in judged if temperature[file] > coldest + WARM_K}
    if not warm or len(warm) == len(judged):
        return ""
    share = sum(value for found, value in excess.items() if found.file in warm) / total
    mean = np.mean([temperature[file] for file in warm])
    hold = f"about {mean:.0f} °C) hold {100 * share:.0f} % of it"
    return f"the {len(warm)} warm recordings of {len(judged)} ({hold}"


def _starts(fit: Fit) -> Iterator[str]:
    if len(fit.ends) < 2:
        return
    agreeing = sum(end.same for end in fit.ends)
    if agreeing == 1:
        yield f"No other of {len(fit.ends)} starts ended where the best one did."
    else:
        yield f"{agreeing} of {len(fit.ends)} starts ended in the same place."
    for end in fit.ends:
        if not end.same:
            why = (
                "failed on the way"
                if not np.isfinite(end.cost)
                else f"ended elsewhere: its likelihood is lower by a factor of e^{end.cost:.3g}, and a "
                f"parameter is {end.distance:.3g} standard deviations away"
            )
            yield f"Start {end.start + 1} {why}; it is left out."


def _together(group: Group) -> str:
    moves = " and ".join(
        f"{name} by {by:+.3g}{f' {unit}' if unit != '1' else ''}"
        for name, by, unit in zip(group.names, group.by, group.units, strict=True)
    )
    return (
        f"Known only together: {', '.join(group.names)}; moving {moves} changes nothing that was measured, "
        "so each alone is held near its start by the prior."
    )
