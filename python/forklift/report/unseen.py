"""How far an unknown input would move the readings by itself."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from forklift.diagnosis.locate import UnknownInput
    from forklift.diagnosis.refit import Refit


def beyond(refit: Refit, one: UnknownInput) -> float:
    """How many times as far as the readings are off the fitted model; 0 of a sensor's own."""
    problem, x = refit.early.problem, refit.early.x
    if one.port in problem.machine.outputs:
        return 0.0
    moved, off = 0.0, 0.0
    width_s = problem.machine.hat_width_s(problem.samples)
    for k, (sample, model) in enumerate(zip(problem.samples, problem.said(x), strict=True)):
        found = problem.respond(x, k, [one.port], one.centres[k], width_s)
        answers = found.at(one.port) @ one.values[k]
        for seen in sample.observed:
            noise = seen.sensor.noise
            moved += float(np.sum((seen.of(answers) / noise) ** 2))
            off += float(np.sum((seen.left(model[seen.sensor.channel]) / noise) ** 2))
    return float(np.sqrt(moved / off)) if off else 0.0
