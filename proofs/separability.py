"""What recordings like the campaigns' cannot part: fixed beforehand, from the second plant alone.

    python proofs/separability.py [free|main|both ...] [--scratch separability]

Asks of each law at each amplitude: how well do the truck's own parameters imitate it, alone and with one
other hypothesis? README.md beside this file says how. Writes `separable.json` beside this file.
"""

import argparse
import json
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

import forklift
from cases import BETWEEN_LIFTS, POINTS, ROUGH, amplitude_of, at_cost, cost_curve, most, plausible
from forklift.ensemble.proof.truth import effects, others, run
from forklift.ensemble.proof.truth.sensors import COUNT_M, HEIGHT_NOISE_M, PRESSURE_NOISE_PA, PRESSURE_STEP_PA
from forklift.ensemble.proof.truth.truck import ESTIMATED, LIFTS, THESIS
from reference.names import NAMES
from reference.plant import campaign
from variations import write

ROOT = Path(__file__).resolve().parents[1]
LIMIT = 20.0
"""Two laws are one to these recordings if a chi-square over all samples tells them apart by less than this.

Half of it, 10, is the mean logarithm of the likelihood ratio of truth to imitation: below, no
judgement that must also allow for sensors not quite as noisy as told is reliable.
"""
NOISE = {
    "position_free_m": COUNT_M / 12**0.5,
    "position_main_m": COUNT_M / 12**0.5,
    "pressure_free_pa": np.hypot(PRESSURE_NOISE_PA, PRESSURE_STEP_PA / 12**0.5),
    "pressure_main_pa": np.hypot(PRESSURE_NOISE_PA, PRESSURE_STEP_PA / 12**0.5),
    "fork_height_m": HEIGHT_NOISE_M,
}
# Prior standard deviations: of the truck's parameters and of what each recording has of its own
STEP, PARAMETER, AREA, CURRENT_A = 0.07, 0.3, 0.15, 0.02  # the step is in prior deviations
ITERATIONS, MOST = 6, 4.0  # of the best imitation, and prior deviations that it may use
NEAR = 400.0  # a chi-square from which on slopes are taken anew, where the fit ended
FAR = 2e4  # a chi-square that no mending of a linear imitation brings down to the noise
TOGETHER = 16  # variants of the truck simulated at once
TEMPERATURE_K, WARMING_K, START_M = 0.15, 1.0, 0.001  # of each recording's own
LOAD_KG, TEMPERATURE_OFF_K = 100.0, 3.0


def signals(trajectory):
    """All channels, (channels, n), in units of their noise."""
    x, p = trajectory.x, trajectory.p_A
    true = [2.0 * x[0], x[1], p[0], p[1], trajectory.fork_height]
    return np.array([signal / noise for signal, noise in zip(true, NOISE.values(), strict=True)])


def changes(lift, planned, made, plain):
    """How much each recording differs from the plain one, (recordings, channels, ticks), padded by zeros."""
    ticks = max(plan.command.shape[1] for plan in planned)
    out = np.zeros((len(planned), len(NOISE), ticks))
    for k, (one, other) in enumerate(zip(made, plain, strict=True)):
        n = len(other.time_s)
        out[k, :, :n] = signals(one) - signals(other)
    return out


def kept(planned, made):
    """Which samples there are before either lift comes near the end of its stroke, (recordings, ticks)."""
    ticks = max(plan.command.shape[1] for plan in planned)
    pairs = zip(planned, made, strict=True)
    lengths = [len(campaign.cut(one, plan.lift, campaign.END_M).time_s) for plan, one in pairs]
    return np.arange(ticks) < np.array(lengths)[:, None]


def moved(given):
    """The thesis's truck with parameters (lift, name, knot) moved by deviations of their priors."""
    trucks = [dict(lift) for lift in THESIS]
    for (lift, name, knot), by in given:
        own = trucks[LIFTS.index(lift)]
        if knot is None:
            own[name] = own[name] * np.exp(PARAMETER * by)
            continue
        values = own[name].copy()
        values[knot] += (
            CURRENT_A * by if name == "current" else AREA * by * THESIS[LIFTS.index(lift)][name][knot]
        )
        own[name] = values
    return tuple(trucks)


def found_at(lift, truck):
    """By how many deviations of their priors a fitted truck's parameters are moved."""
    moves = []
    for one, name, knot in parameters(lift):
        value, start = truck.values[f"{one}.{NAMES[name]}"], THESIS[LIFTS.index(one)][name]
        if knot is None:
            moves.append(np.log(max(value / start, 1e-9)) / PARAMETER)
        else:
            unit = CURRENT_A if name == "current" else AREA * start[knot]
            moves.append((value[knot] - start[knot]) / unit)
    return np.array(moves)


def parameters(lift):
    """(lift, name, knot) of everything that a fit moves."""
    for one in LIFTS if lift == "both" else [lift]:
        yield from ((one, name, None) for name in ESTIMATED)
        table = THESIS[LIFTS.index(one)]["area"]
        yield from ((one, "area", k) for k in np.flatnonzero(table))
        yield from ((one, "current", k) for k in range(1, len(table) - 1))


def half_seconds(samples):
    """As many as make whole half seconds, so that most laws are asked about the same samples."""
    half = round(0.5 / run.TICK_S)
    return np.arange(samples.shape[1]) < (samples.sum(axis=1) // half * half)[:, None]


class Refitter:
    """The thesis's truck in one campaign: how its channels answer to everything that may be."""

    def __init__(self, lift):
        self.lift = lift
        self.planned = [plan for plan in campaign.plans(lift) if lift != "both" or plan.role == "estimate"]
        self.case = campaign.Case("", lift)
        self.given = [
            run.Condition(plan.command, plan.load_kg, plan.temperature_degc) for plan in self.planned
        ]
        self.plain = run.simulate(THESIS, (), self.given, ROUGH)
        self.kept = kept(self.planned, self.plain)
        self.shared = self.slopes(np.zeros(len(list(parameters(lift)))))
        self.own, self.warming, self.loads = self._own()

    def change(self, made):
        return changes(self.lift, self.planned, made, self.plain)

    def slopes(self, theta):
        """Answers to each parameter of the truck at `theta`, per standard deviation of its prior."""
        names = list(parameters(self.lift))
        trucks = [
            moved(zip(names, theta + by, strict=True))
            for by in (np.zeros(len(names)), *STEP * np.eye(len(names)))
        ]
        columns, count = [], len(self.given)
        for first in range(0, len(trucks), TOGETHER):
            some = trucks[first : first + TOGETHER]
            made = run.simulate(
                THESIS, (), [replace(one, trucks=truck) for truck in some for one in self.given], ROUGH
            )
            for k in range(len(some)):
                columns.append(self.change(made[k * count : (k + 1) * count]))
        return (np.array(columns[1:]) - columns[0]) / STEP

    def _own(self):
        """Answers to a kelvin, to warming up by a kelvin until the end, and to 10 kg in each recording."""
        warmer = [replace(one, temperature_degc=one.temperature_degc + 1.0) for one in self.given]
        warming = [replace(one, warming_k=1.0) for one in self.given]
        heavier = [replace(one, load_kg=one.load_kg + 10.0) for one in self.given]
        made = run.simulate(THESIS, (), warmer + warming + heavier, ROUGH)
        one, two, three = (made[k : k + len(self.given)] for k in range(0, len(made), len(self.given)))
        return self.change(one), self.change(two), self.change(three) / 10.0


def law_at(name, lift, amplitude, share=0.5):
    """The law with its other parameters at this share of the plausible."""
    if name.partition("__")[0] not in BETWEEN_LIFTS:
        amplitude = run.on(lift, amplitude)
    if "__" in name:
        own = {"centre": 0.6 if lift == "free" else 1.5} if name.endswith("asymmetric") else {}
        return others.law(name, amplitude, **own)
    drawn = {}
    for parameter, (lower, upper, scale) in list(plausible(name).items())[1:]:
        drawn[parameter] = (
            lower * (upper / lower) ** share if scale == "log" else lower + share * (upper - lower)
        )
    if name == "friction_position":
        drawn["centre"] = (0.45 if lift == "free" else 1.3) + 0.3 * share
    if name == "valve_current_limit":
        drawn["limit"] = 0.55 + 0.15 * share
    if name == "end_cushion":
        drawn["length"] = 0.1
    return effects.law(name, amplitude, **drawn)


SHARES = (0.25, 0.5, 0.75)


def by_chi(one):
    return one[1]


def answers(refitter, name, scratch):
    """How the campaign answers to a law: at the three amplitudes, and at the least with other parameters."""
    path = scratch / f"{refitter.lift}-{name}.npz"
    if path.exists():
        return dict(np.load(path))
    found = {}
    curve = cost_curve(law_at(name, refitter.lift, 1.0), most(name), refitter.case, THESIS)
    amplitudes = [at_cost(points, *curve)[0] for points in POINTS]
    for share in SHARES if "__" not in name and len(plausible(name)) > 1 else [0.5]:
        law = law_at(name, refitter.lift, 1.0, share)
        key, unit = amplitude_of(law)
        asked = amplitudes if share == 0.5 else amplitudes[:1]
        conditions = [
            run.Condition(one.command, one.load_kg, one.temperature_degc, values={key: unit * amplitude})
            for amplitude in asked
            for one in refitter.given
        ]
        made = run.simulate(THESIS, (law,), conditions, ROUGH)
        count = len(refitter.given)
        for k, points in enumerate(POINTS[: len(asked)]):
            part = made[k * count : (k + 1) * count]
            found[f"{share:g}@{points:g}"] = refitter.change(part).astype(np.float32)
            found[f"kept {share:g}@{points:g}"] = kept(refitter.planned, part)
    found["amplitudes"] = np.array(amplitudes)
    np.savez(path, **found)
    return found


def dull(refitter):
    """Answers to the dull hypotheses, by the word for each: lists of alternatives, each several columns."""
    n = refitter.kept.shape[1]
    zero = np.zeros((len(refitter.planned), len(NOISE), n))
    true = zero.copy()
    for k, one in enumerate(refitter.plain):
        true[k, :, : len(one.time_s)] = signals(one)
    slope = np.gradient(true, axis=2) / run.TICK_S * 0.01
    found = {word: [] for word in ("pressure_gain", "pressure_offset", "position_scale", "sensor_lag")}
    for c, channel in enumerate(NOISE):

        def only(signal, c=c):
            column = zero.copy()
            column[:, c] = signal
            return [column]

        if channel.startswith("pressure"):
            found["pressure_gain"].append(only(0.05 * true[:, c]))
            found["pressure_offset"].append(only(np.ones_like(true[:, c])))
        else:
            found["position_scale"].append(only(true[:, c] - true[:, c, :1]))
        found["sensor_lag"].append(only(slope[:, c]))
    found["load_entered"] = [each(refitter.loads * LOAD_KG)]
    found["temperature_offset"] = [each(refitter.own * TEMPERATURE_OFF_K)]
    return found


def each(answer):
    """One column for each recording."""
    columns = []
    for k in range(len(answer)):
        column = np.zeros_like(answer)
        column[k] = answer[k]
        columns.append(column)
    return columns


class Imitation:
    """What the truck's parameters, and what recordings have of their own, can imitate at these samples."""

    def __init__(self, refitter, samples, shared=None):
        """`shared`: slopes along the truck's parameters, if not those of the thesis's truck."""
        self.refitter, self.kept = refitter, samples
        self.samples = np.broadcast_to(samples[:, None], refitter.own.shape)
        self.starts = []
        # The forks rise by twice of what the main encoder tells.
        for position, height in ((0, 1.0), (1, 2.0)):
            start = np.zeros_like(refitter.own)
            start[:, position] = START_M / list(NOISE.values())[position]
            start[:, 4] = START_M * height / HEIGHT_NOISE_M
            self.starts += each(start)
        shared = refitter.shared if shared is None else shared
        own = [*each(refitter.own * TEMPERATURE_K), *each(refitter.warming * WARMING_K)]
        columns = [*shared, *own, *self.starts]
        A = np.array([column[self.samples] for column in columns]).T
        # Each column's prior is one: chi-square counts it like a sample.
        self.q, self.r = np.linalg.qr(np.concatenate([A, np.eye(A.shape[1])]))

    def rows(self, column, theta=None):
        """The column's samples without what parameters imitate from `theta` on."""
        return self._rest(self._stacked(column, theta))

    def step(self, column, theta, damping):
        """By how much the parameters should move on from `theta`, where the column is still left."""
        normal = self.r.T @ self.r + damping * np.eye(self.r.shape[1])
        return np.linalg.solve(normal, self.r.T @ (self.q.T @ self._stacked(column, theta)))

    def cost(self, column, theta):
        """Chi-square of the column and of the priors."""
        b = self._stacked(column, theta)
        return b @ b

    def conditions(self, theta):
        """The plain recordings with the truck and the oil so moved."""
        names = list(parameters(self.refitter.lift))
        truck = moved(zip(names, theta[: len(names)], strict=True))
        own = theta[len(names) :][: 2 * len(self.refitter.given)].reshape(2, -1)
        return [
            replace(one, trucks=truck, temperature_degc=one.temperature_degc + by, warming_k=until)
            for one, by, until in zip(
                self.refitter.given, TEMPERATURE_K * own[0], WARMING_K * own[1], strict=True
            )
        ]

    def offsets(self, theta):
        """What the starts add to the channels."""
        return sum(by * column for by, column in zip(theta[-len(self.starts) :], self.starts, strict=True))

    def _stacked(self, column, theta):
        b = np.zeros(len(self.q))
        chosen = column[self.samples]
        b[: len(chosen)] = chosen
        if theta is not None:
            b[len(chosen) :] = -theta
        return b

    def _rest(self, b):
        return b - self.q @ (self.q.T @ b)

    def left(self, target, columns=(), free=False):
        """The least chi-square of the projected target, imitated by projected columns too."""
        if not len(columns):
            return float(target @ target)
        B = np.array(columns).T
        ridge = np.zeros((B.shape[1],) * 2) if free else np.eye(B.shape[1])
        coefficients = np.linalg.solve(B.T @ B + ridge + 1e-9 * np.eye(B.shape[1]), B.T @ target)
        rest = target - B @ coefficients
        return float(rest @ rest + coefficients @ ridge @ coefficients)


def fitted(refitter, name, points, amplitude, scratch):
    """Where a fit of the diagnosis's own model to recordings of this law, read by sensors, ends."""
    path = scratch / f"{refitter.lift}-{name}-{points:g}.json"
    if not path.exists():
        with tempfile.TemporaryDirectory() as folder:
            case = campaign.Case("", refitter.lift, 1, (law_at(name, refitter.lift, amplitude),))
            campaign.record(case, Path(folder), refitter.planned, THESIS)
            fit = forklift.fit(forklift.Campaign.read(folder), forklift.Truck.read("thesis"), starts=1)
        write(path, json.dumps(list(found_at(refitter.lift, fit.truck))))
    return np.array(json.loads(path.read_text(encoding="utf-8")))


def descended(refitter, cases, changed, theta):
    """Levenberg and Marquardt from each case's `theta`: where it ends, what is left, and its chi-square."""
    count = len(refitter.given)

    def left_at(tried):
        tried = {case: np.clip(at, -MOST, MOST) for case, at in tried.items()}
        conditions = [one for case, at in tried.items() for one in cases[case].conditions(at)]
        made = []
        for first in range(0, len(conditions), TOGETHER * count):
            made += run.simulate(THESIS, (), conditions[first : first + TOGETHER * count], ROUGH)
        for k, (case, at) in enumerate(tried.items()):
            answer = refitter.change(made[k * count : (k + 1) * count]) + cases[case].offsets(at)
            rest = changed[case] - answer
            yield case, (at, rest, cases[case].cost(rest, at))

    ends, damping = dict(left_at(theta)), dict.fromkeys(theta, 1.0)
    for _ in range(ITERATIONS):
        tried = {case: at + cases[case].step(rest, at, damping[case]) for case, (at, rest, _) in ends.items()}
        for case, end in left_at(tried):
            if end[2] < ends[case][2]:
                ends[case] = end
                damping[case] /= 10.0
            else:
                damping[case] *= 10.0
    return ends


def imitated(refitter, cases, changed, start):
    """What each law's change leaves where the truck imitates it: linear, and by simulated trucks.

    These go by Levenberg and Marquardt from where `start` says a fit ended, with the slopes of the thesis's
    truck, and once more with slopes taken where that comes near but not near enough. Where linear answers
    leave far more than the noise, none is tried.
    """
    changed = {case: change.astype(float) for case, change in changed.items()}
    left = {case: [fit.rows(changed[case])] for case, fit in cases.items()}

    def least(case):
        return min(float(rest @ rest) for rest in left[case])

    def go_on(several, theta, fits):
        ends = descended(refitter, fits, changed, {case: theta[case] for case in several})
        for case, (at, rest, _) in ends.items():
            left[case].append(fits[case].rows(rest, at))
        return {case: at for case, (at, _, _) in ends.items()}

    near = [case for case in cases if LIMIT <= least(case) < FAR]
    begun = {}
    for case in near:
        begun[case] = np.zeros(cases[case].r.shape[1])
        begun[case][: len(refitter.shared)] = start(*case)
    ended = go_on(near, begun, cases)
    for case in near:
        if LIMIT <= least(case) < NEAR:
            shared = refitter.slopes(ended[case][: len(refitter.shared)])
            there = Imitation(refitter, cases[case].kept, shared)
            go_on([case], ended, {case: there})
    return left


def groups(lift, scratch):
    """Of each law at each amplitude: chi-square left by the truck alone, and with each other hypothesis."""
    refitter = Refitter(lift)
    names = [
        name
        for name in (*effects.CATALOGUE, *others.OTHERS)
        if lift != "both" or name.partition("__")[0] in BETWEEN_LIFTS
    ]
    laws = {name: answers(refitter, name, scratch) for name in names}
    rivals = dull(refitter)
    cases, known = {}, {}
    for name, answer in laws.items():
        for points in POINTS:
            samples = half_seconds(refitter.kept & answer[f"kept 0.5@{points:g}"])
            key = samples.tobytes()
            known[key] = cases[name, points] = known.get(key) or Imitation(refitter, samples)

    def start(name, points):
        amplitude = laws[name]["amplitudes"][POINTS.index(points)]
        return fitted(refitter, name, points, amplitude, scratch)

    changed = {case: laws[case[0]][f"0.5@{case[1]:g}"] for case in cases}
    targets = imitated(refitter, cases, changed, start)
    told = {}
    for name, answer in laws.items():
        for points, amplitude in zip(POINTS, answer["amplitudes"], strict=True):
            fit, left = cases[name, points], targets[name, points]
            alone, by = min(map(fit.left, left)), {}
            for other, found in laws.items():
                if other != name and "__" not in other:
                    ways = [key for key in found if "@" in key and not key.startswith("kept")]
                    by[other] = min(
                        fit.left(target, [fit.rows(found[key].astype(float))], free=True)
                        for key in ways
                        for target in left
                    )
            for word, ways in rivals.items():
                several = word in ("load_entered", "temperature_offset")
                by[word] = min(
                    fit.left(target, [fit.rows(column) for column in way], free=not several)
                    for way in ways
                    for target in left
                )
            told[f"{lift}/{name}/{points:g}"] = {
                "amplitude": float(amplitude),
                "by_truck": round(alone, 1),
                "hidden": alone < LIMIT,
                "alike": sorted(other for other, chi in by.items() if chi < LIMIT),
                "next": dict(sorted(((other, round(chi, 1)) for other, chi in by.items()), key=by_chi)[:4]),
            }
            print(f"{lift}/{name}/{points:g}: {told[f'{lift}/{name}/{points:g}']}", flush=True)
    return told


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("lifts", nargs="*", default=["free", "main", "both"])
    parser.add_argument("--scratch", type=Path, default=ROOT / "separability")
    given = parser.parse_args()
    given.scratch.mkdir(parents=True, exist_ok=True)
    path = Path(__file__).with_name("separable.json")
    for lift in given.lifts:
        found = groups(lift, given.scratch)
        laws = json.loads(path.read_text(encoding="utf-8"))["laws"] if path.exists() else {}
        write(path, json.dumps({"limit": LIMIT, "laws": laws | found}, indent=1) + "\n")


if __name__ == "__main__":
    main()
