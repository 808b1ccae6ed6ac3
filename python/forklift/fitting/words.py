"""A fit in plain sentences: what the machine explains, what is left over and where, what cannot be told."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from forklift.base.typeset import capital
from forklift.fitting.residuals import ChannelResidual

if TYPE_CHECKING:
    from forklift.fitting.fitted import Fitted
    from forklift.fitting.intervals import Group

MORE = 1.5
"""Recordings of one operating point are told if they hold so many times their share of what is left over."""


def sentences(fit: Fitted) -> tuple[str, ...]:
    """All sentences, the most important first."""
    said = [_interrupted(fit)] if fit.interrupted else []
    said += [_part(fit, part) for part in fit.parts]
    said += _left_over(fit)
    said += [caution.sentence for caution in fit.cautions]
    said += _starts(fit)
    said += [_together(group) for group in fit.knowledge.groups]
    if fit.knowledge.unidentifiable:
        names = ", ".join(fit.knowledge.unidentifiable)
        said.append(f"Not identifiable from these recordings; the value comes from the prior: {names}.")
    return tuple(said)


def _interrupted(fit: Fitted) -> str:
    count, noun = fit.found.evaluations, fit.machine.words.noun
    return (
        f"Interrupted after {count} evaluation{'s' * (count != 1)}: this is the best {noun} so far, and not "
        "the best there is. Run it again, to its end, for what follows from it."
    )


def _head(fit: Fitted, part: str) -> str:
    """``"The main lift: "``; nothing where there is one part."""
    return f"{capital(fit.machine.words.part(part))}: " if part else ""


def _of_part(fit: Fitted, part: str) -> list[ChannelResidual]:
    """What is judged on in recordings that drive a part."""
    pieces = _pieces(fit)
    return [one for one in fit.held_out if part in fit.machine.driven(pieces[one.file])]


def _pieces(fit: Fitted) -> dict[str, Any]:
    """By file, every recording or stretch of one."""
    return {piece.file: piece for one in fit.recordings for piece in fit.machine.pieces(one)}


def _recordings(fit: Fitted, judged: Iterable[ChannelResidual]) -> set[str]:
    """The recordings that were judged, each once, in however many stretches."""
    whole = {piece.file: one.file for one in fit.recordings for piece in fit.machine.pieces(one)}
    return {whole[one.file] for one in judged}


def _part(fit: Fitted, part: str) -> str:
    """How well one part's held-out recordings are explained."""
    seen, noun = _of_part(fit, part), fit.machine.words.noun
    if not seen:
        return f"{_head(fit, part)}no recording of it is judged on."
    what = recordings_of(len(_recordings(fit, seen)), seen[0].role)
    worst = max(seen, key=lambda found: found.mean_square)
    signal = fit.machine.words.signal(worst.channel)
    size = f"{worst.mean_square:.2f} times its power (1 is noise alone), in the {signal} of {worst.file}"
    if worst.explained:
        text = (
            f"{_head(fit, part)}the fitted {noun} explains all {what} down to the sensors' noise: at most "
            f"{size}"
        )
    else:
        bad = _recordings(fit, (found for found in seen if not found.explained))
        why = "so far" if fit.interrupted else "no values of these parameters explain the recordings:"
        text = (
            f"{_head(fit, part)}{why} in {len(bad)} of {what} more than the sensors' noise is left over, "
            f"up to {size}"
        )
    return " ".join([capital(f"{text}."), *_gain(fit, part)])


def recordings_of(count: int, role: str) -> str:
    """``"6 held-out recordings"``: how many, and whether the model was fitted on them."""
    kind = "held-out recording" if role == "validate" else "fitted recording"
    return f"{count} {kind}{'s' * (count > 1)}"


def _gain(fit: Fitted, part: str) -> Iterator[str]:
    """How well the signals that the part is told by fit, and did before."""
    for whose, channel in fit.after.headlines:
        before, after = (
            side.validation(channel)["nrmse_percent"].drop_nulls().to_numpy()
            for side in (fit.before, fit.after)
        )
        if whose == part and len(after):
            headline = fit.machine.headline
            what = f"its {headline}" if headline else fit.machine.words.signal(channel)
            was = f" (before: {before.mean():.1f} % and {before.min():.1f} %)" if len(before) else ""
            now = f"to {after.mean():.1f} % on average and {after.min():.1f} % at worst, as NRMSE"
            yield capital(f"{what} fits {now}{was}.")


def _left_over(fit: Fitted) -> Iterator[str]:
    """Which signal and recordings, where in the motion and at which operating points something is left."""
    for part in fit.parts:
        bad = [found for found in _of_part(fit, part) if not found.explained]
        if not bad:
            continue
        excess = {found: found.excess for found in bad}
        total = sum(excess.values())
        if not total:  # conditions further off than is plausible are all that is left
            continue
        signals = _shares(bad, excess, lambda found: found.channel)
        where = f" on {fit.machine.words.part(part)}" if part else ""
        said = [f"What is left over{where}: {_listed(signals, total)} by signal"]
        files = _shares(bad, excess, lambda found: found.file)
        said.append(f"{_listed(files, total)} by recording")
        worst = next(iter(signals))
        said.append(_phase(fit, [found for found in bad if found.channel == worst], worst))
        points = _operating_points(fit, part, files, total)
        yield "; ".join(filter(None, [*said, points])) + "."


def _shares(bad: Sequence[ChannelResidual], excess, key) -> dict[str, float]:  # type: ignore[no-untyped-def]
    sums: dict[str, float] = {}
    for found in bad:
        sums[key(found)] = sums.get(key(found), 0.0) + excess[found]
    return dict(sorted(sums.items(), key=lambda item: -item[1]))


def _listed(shares: dict[str, float], total: float, most: int = 3) -> str:
    shown = list(shares.items())[:most]
    return ", ".join(f"{100.0 * share / total:.0f} % {name}" for name, share in shown)


def _phase(fit: Fitted, bad: Sequence[ChannelResidual], channel: str) -> str:
    """In which phase of the motion the squared residuals of the worst signal lie."""
    machine, pieces = fit.machine, _pieces(fit)
    count = len(machine.phases)
    square, seconds = np.zeros(count), np.zeros(count)
    for found in bad:
        which = machine.labels(pieces[found.file])[channel][found.rows]
        square += np.bincount(which, found.left**2, count)
        seconds += np.bincount(which, minlength=count)
    if not square.any():
        return ""
    most = int(np.argmax(square))
    phase = machine.phase_words[machine.phases[most]]
    share, time = 100 * square[most] / square.sum(), 100 * seconds[most] / seconds.sum()
    return f"{share:.0f} % of {channel}'s in {phase} ({time:.0f} % of the time)"


def _operating_points(fit: Fitted, part: str, left: Mapping[str, float], total: float) -> str:
    """Which recordings of one side of a condition have more than their share, if any have."""
    judged = {found.file for found in _of_part(fit, part)}
    pieces = [piece for file, piece in _pieces(fit).items() if file in judged]
    found = []
    for split in fit.machine.splits(pieces):
        whole = [rows.all() or not rows.any() for rows in split.rows]
        if not all(whole):
            continue  # it parts moments, not recordings
        for name, wanted in ((split.first, True), (split.second, False)):
            own = [one.file for one, rows in zip(pieces, split.rows, strict=True) if rows.all() == wanted]
            share = sum(left.get(file, 0.0) for file in own) / total
            if 0 < len(own) < len(pieces):
                found.append((share * len(pieces) / len(own), share, len(own), f"{name} ({split.name})"))
    if not found or max(found)[0] < MORE:
        return ""
    _, share, count, name = max(found)
    return f"{name} hold {100 * share:.0f} % of it, {count} of {len(pieces)}"


def _starts(fit: Fitted) -> Iterator[str]:
    if len(fit.ends) < 2 or fit.interrupted:
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
    if len(group.names) == 1:
        return (
            f"Identifiable only together with what each recording has of its own: {group.names[0]}. Its "
            "value comes from the prior."
        )
    moves = " and ".join(
        f"{name} by {by:+.3g}{f' {unit}' if unit != '1' else ''}"
        for name, by, unit in zip(group.names, group.by, group.units, strict=True)
    )
    return (
        f"Identifiable only together: {', '.join(group.names)}. Moving {moves} changes nothing that was "
        "measured. Their separate values come from the prior."
    )
