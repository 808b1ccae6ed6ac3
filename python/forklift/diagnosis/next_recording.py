"""Which recording to make next: the one that would part two explanations, or tell a parameter.

Two rivals, each at its own optimum, foresee a candidate recording that differs by d(t). What the sensors'
noise S and a move of either rival's parameters θ (known to Σ from the recordings there are) and of the
recording's own conditions φ could not undo of that difference is the expected ln of their likelihood ratio:

    ½ dᵀ (S + J₁ Σ₁ J₁ᵀ + J₂ Σ₂ J₂ᵀ)⁻¹ d,    J = ∂(what the model says)/∂(θ, φ)

It is the criterion of Hunter & Reiner (1965, T-optimality), with the rivals' uncertainty as Box & Hill (1967)
have it, to first order. By Woodbury's identity only a matrix of the size of θ₁, φ₁, θ₂, φ₂ is solved with.
All candidates are simulated, which bounds what they can come to: ½ dᵀS⁻¹d; only the promising ones are
differentiated.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from scipy.linalg import block_diag

from forklift.base.arrays import Floats
from forklift.base.errors import ForkliftError
from forklift.base.threads import one_thread
from forklift.diagnosis.hypothesis import with_hypotheses
from forklift.diagnosis.refit import Refit
from forklift.fitting.interface import Problem, Sample
from forklift.fitting.linearised import Linearised
from forklift.fitting.observed import Observed

PARTS = 10.0
"""Least expected ln likelihood ratio that is worth a recording: odds of 20,000 to 1."""
TELLS = 0.5
"""A recording tells a parameter if it narrows its standard deviation to less than this share."""
LOT, MOST = 16, 64
"""Candidates are differentiated in lots, until no other can be better, but no more than this many times."""
COARSE = 4
"""Substeps of the simulations: what is predicted need not be as exact as what is fitted."""
FAINTEST = 1e-3
"""An encoder's sample tells at least this much of a full one, however slowly it moves."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """A recording that could be made."""

    name: str
    """In words: command, load and temperature."""
    sample: Sample
    """Its command and conditions, with the channels it would have; what these read is of no account."""


@dataclass(frozen=True)
class Parting:
    """How far a recording would part two rivals."""

    rivals: tuple[str, str]
    expected: float
    """Expected ln of their likelihood ratio."""
    recorded: float
    """The greatest that any of the recordings fitted so far would have, were it made once more."""


@dataclass(frozen=True, eq=False)
class Proposal:
    """What to record next, and why; or why nothing would help."""

    candidate: Candidate | None
    why: str
    partings: tuple[Parting, ...] = ()
    """Of the candidate, or of the best there is if none is worth recording."""


@dataclass(frozen=True, eq=False)
class _Rival:
    """One explanation: a problem at its optimum, and what is known of its shared unknowns."""

    label: str
    refit: Refit
    root: Floats
    """Σ = root rootᵀ, widened by what the explanation leaves over."""

    def fitted(self) -> tuple[Problem, Floats]:
        """The rival's problem over the recordings it was fitted to, at its optimum."""
        problem = self.refit.found.problem
        return problem.weighted(problem.sigma, COARSE), self.refit.found.x

    def predicted(self, samples: Sequence[Sample]) -> tuple[Problem, Floats]:
        """The rival's problem over candidates, their conditions as doubtful as it holds them."""
        fitted = self.refit.found.problem
        problem = fitted.over(samples).weighted(fitted.sigma, COARSE)
        for hypothesis in self.refit.hypotheses:
            problem = problem.over(with_hypotheses(problem, [hypothesis]).samples)
        return problem, problem.at(self.refit.found.x)


def part(rivals: Sequence[Refit], candidates: Sequence[Candidate]) -> Proposal:
    """The candidate that would part most pairs of these rivals, and of such the one that parts them best.

    Raises
    ------
    ValueError
        If there are less than two rivals.
    """
    if len(rivals) < 2:
        raise ValueError("to part rivals, give two at least")
    with one_thread():
        known = [_rival(refit) for refit in rivals]
        noise = _noise(rivals)
        recorded = _scores(known, [_linearised(*one.fitted()) for one in known], noise)
        values = [_values(one, candidates) for one in known]
        possible = [k for k in range(len(candidates)) if all(said[k] is not None for said in values)]
        bound = {k: 0.5 * _apart([said[k] for said in values], candidates[k].sample, noise) for k in possible}
        asked = sorted(possible, key=lambda k: -bound[k])[: MOST // len(known)]
        scores: dict[int, Floats] = {}
        while left := asked[len(scores) :][:LOT]:
            if bound[left[0]] < max([PARTS, *(float(found.min()) for found in scores.values())]) and scores:
                break
            runs = [_linearised(*one.predicted([candidates[k].sample for k in left])) for one in known]
            scores |= dict(zip(left, _scores(known, runs, noise), strict=True))
    pairs = [(one.label, other.label) for one, other in combinations(known, 2)]
    most = recorded.max(axis=0, initial=0.0) if len(recorded) else np.zeros(len(pairs))
    if not scores:
        return Proposal(None, f"no candidate can be simulated with {known[0].label} and its rivals")
    first = max(scores, key=lambda k: _rank(scores[k]))
    partings = tuple(
        Parting(pair, float(score), float(before))
        for pair, score, before in zip(pairs, scores[first], most, strict=True)
    )
    chosen = candidates[first]
    parted = [one for one in partings if one.expected >= PARTS]
    if not parted:
        nearest = max(partings, key=lambda one: one.expected)
        return Proposal(
            None,
            f"none of {len(candidates)} recordings that could be made would part {_pair(nearest.rivals)}: "
            f"the best ({chosen.name}) has an expected ln likelihood ratio of {_number(nearest.expected)}, "
            f"and {PARTS:g} is the least that is worth a recording",
            partings,
        )
    words = "; ".join(
        f"the recording parts {_pair(one.rivals)} by an expected ln likelihood ratio of "
        f"{_number(one.expected)}, the best of those recorded so far by {_number(one.recorded)}"
        for one in sorted(parted, key=lambda one: one.expected)
    )
    alike = [_pair(one.rivals) for one in partings if one.expected < PARTS]
    besides = f"; it does not part {' nor '.join(alike)}" if alike else ""
    return Proposal(chosen, f"{chosen.name}: {words}{besides}", partings)


def tell(refit: Refit, name: str, candidates: Sequence[Candidate]) -> Proposal:
    """The candidate that most narrows one shared unknown of a refit.

    With the recording added, the information on θ grows by JᵀS⁻¹J with the recording's own unknowns taken
    off, and Σ becomes (Σ⁻¹ + JᵀS⁻¹J)⁻¹ (Bayesian c-optimality; Chaloner & Verdinelli 1995).

    Raises
    ------
    ValueError
        If the refit has no such unknown.
    """
    problem, x, covariance = refit.found.problem, refit.found.x, refit.knowledge.covariance
    names = [unknown.name for unknown in problem.unknowns]
    if name not in names:
        raise ValueError(f"the refit has no unknown {name}")
    with one_thread():
        rival = _Rival(_label(refit), refit, _root(covariance))
        noise = _noise([refit])
        possible = [k for k, said in enumerate(_values(rival, candidates)) if said is not None]
        if not possible:
            return Proposal(None, f"no candidate can be simulated with {name}")
        predicted, at = rival.predicted([candidates[k].sample for k in possible])
        place = names.index(name)
        after = [_deviation(run, rival.root, noise, place) for run in _linearised(predicted, at)]
    before = float(np.sqrt(covariance[place, place]))
    best = int(np.argmin(after))
    unknown, chosen = problem.unknowns[place], candidates[possible[best]]
    unit = f" {unknown.unit}" if unknown.unit != "1" else ""
    slope = abs(float(unknown.slopes(float(x[place]))[0]))
    told = f"the standard deviation of {name} from {before * slope:.2g} to {after[best] * slope:.2g}{unit}"
    if after[best] >= TELLS * before:
        return Proposal(
            None,
            f"none of {len(candidates)} recordings that could be made tells {name}: the best ({chosen.name}) "
            f"narrows {told}",
        )
    return Proposal(chosen, f"{chosen.name}: the recording narrows {told}")


def _rival(refit: Refit) -> _Rival:
    return _Rival(_label(refit), refit, _root(max(1.0, refit.reduced_chi2) * refit.knowledge.covariance))


def _label(refit: Refit) -> str:
    return " and ".join(hypothesis.label for hypothesis in refit.hypotheses) or "nothing missing"


def _root(covariance: Floats) -> Floats:
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


def _noise(refits: Sequence[Refit]) -> dict[str, float]:
    """The largest that any of the refits shows in each channel, widened where it is not white."""
    found: dict[str, float] = {}
    for refit in refits:
        for name, sigma in refit.found.problem.sigma.items():
            wide = sigma * refit.knowledge.widening.get(name, 1.0)
            found[name] = max(found.get(name, 0.0), wide)
    return found


def _values(rival: _Rival, candidates: Sequence[Candidate]) -> list[Mapping[str, Floats] | None]:
    """What the rival foresees of each candidate; None where it cannot be simulated."""
    problem, x = rival.predicted([candidate.sample for candidate in candidates])
    try:
        return list(problem.said(x))
    except ForkliftError:
        if len(candidates) == 1:
            return [None]
    return [said for candidate in candidates for said in _values(rival, [candidate])]


_Run = tuple[Sample, Linearised]


def _linearised(problem: Problem, x: Floats) -> list[_Run]:
    """Linearised where the readings are what the model says, as those of a candidate are none yet."""
    samples = []
    for sample, said in zip(problem.samples, problem.said(x), strict=True):
        observed = tuple(replace(seen, values=said[seen.sensor.channel]) for seen in sample.observed)
        samples.append(replace(sample, observed=observed))
    return list(zip(samples, problem.over(samples).linearise(x), strict=True))


def _weights(seen: Observed, noise: Mapping[str, float], said: Sequence[Floats]) -> Floats:
    """One over the standard deviation of each sample.

    An encoder's rounding errs alike until it has moved on by a count: while it is slower than a count a
    sample, as the fastest of the rivals says, its samples tell as much as the counts it passes.
    """
    sensor = seen.sensor
    variance = noise[sensor.channel] ** 2
    if not sensor.count:
        return np.full(len(seen.rows), 1.0 / np.sqrt(variance))
    steps = [np.abs(np.diff(one, prepend=one[:1])) for one in said]
    passed = np.max(steps, axis=0) / sensor.count
    return np.asarray(np.sqrt(np.clip(passed, FAINTEST, 1.0) / (variance + sensor.noise**2)))


def _apart(said: Sequence[Mapping[str, Floats] | None], sample: Sample, noise: Mapping[str, float]) -> float:
    """Sum over all pairs of the difference's square, in units of noise: nothing is taken off yet."""
    total = 0.0
    known = [found for found in said if found is not None]
    for seen in sample.observed:
        name = seen.sensor.channel
        weights = _weights(seen, noise, [found[name] for found in known])
        for one, other in combinations(known, 2):
            total += float(np.sum(((one[name] - other[name]) * weights) ** 2))
    return total


def _scores(rivals: Sequence[_Rival], runs: Sequence[Sequence[_Run]], noise: Mapping[str, float]) -> Floats:
    """(recordings, pairs of rivals) expected ln likelihood ratios."""
    rows = []
    for same in zip(*runs, strict=True):  # one recording, as each rival has it
        weights = _all_weights(same, noise)
        scaled = [_scaled(run, weights, one.root) for one, (_, run) in zip(rivals, same, strict=True)]
        rows.append(
            [expected_parting(one[0] - other[0], one[1], other[1]) for one, other in combinations(scaled, 2)]
        )
    return np.array(rows).reshape(len(rows), -1)


def _all_weights(same: Sequence[_Run], noise: Mapping[str, float]) -> dict[str, Floats]:
    """By channel, for one recording as each rival has it."""
    return {
        seen.sensor.channel: _weights(seen, noise, [at.model[seen.sensor.channel] for _, at in same])
        for seen in same[0][0].observed
    }


def _scaled(run: Linearised, weights: Mapping[str, Floats], root: Floats) -> tuple[Floats, Floats]:
    """What the model says, and how far one deviation of each unknown moves it, in units of noise."""
    said = np.concatenate([weights[name] * run.model[name] for name in weights])
    slope = np.vstack([weights[name][:, None] * run.slope[name] for name in weights])
    own = slope.shape[1] - len(root)
    return said, np.asarray(slope @ block_diag(root, np.eye(own)))


def expected_parting(apart: Floats, one: Floats, other: Floats) -> float:
    """½ dᵀ (1 + H Hᵀ)⁻¹ d = ½ (dᵀd − bᵀ(1 + HᵀH)⁻¹ b) with H = (J₁ Σ₁^½, J₂ Σ₂^½) and b = Hᵀd."""
    both = np.hstack([one, other])
    pull = both.T @ apart
    move = np.linalg.solve(np.eye(both.shape[1]) + both.T @ both, pull)
    return max(0.0, 0.5 * float(apart @ apart - pull @ move))


def _deviation(run: _Run, root: Floats, noise: Mapping[str, float], place: int) -> float:
    """Standard deviation of one shared unknown after the recording, in units of its prior's."""
    _, moved = _scaled(run[1], _all_weights([run], noise), root)
    after = np.linalg.inv(np.eye(moved.shape[1]) + moved.T @ moved)[: len(root), : len(root)]
    return float(np.sqrt(root[place] @ after @ root[place]))


def _rank(scores: Floats) -> tuple[int, float]:
    """How many pairs are parted, and how well the least parted of them; of none, the best."""
    parted = scores[scores >= PARTS]
    return len(parted), float(parted.min() if len(parted) else scores.max(initial=0.0))


def _pair(rivals: tuple[str, str]) -> str:
    return f"{rivals[0]} from {rivals[1]}"


def _number(value: float) -> str:
    return f"{value:.0f}" if value >= 10.0 else f"{value:.2g}"
