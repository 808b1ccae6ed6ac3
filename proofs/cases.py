"""What is concealed in the trucks of `variations.py`, and which answers are right: one `Variation` a case."""

import sys
import zlib
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from forklift.ensemble.proof import kinds
from forklift.ensemble.proof.truth import effects, others, run
from forklift.ensemble.proof.truth.sensors import Sensors
from forklift.ensemble.proof.truth.truck import LIFTS, scattered
from reference.plant import campaign

POINTS = (0.5, 2.0, 8.0)
"""What the effects cost, in points of the velocity's NRMSE."""
LARGER = POINTS[1:]
"""What the laws of another shape cost."""
ROUGH = 1e-5  # tolerance where only the cost of an amplitude is asked for
EQUATIONS = {name: places[0] for name, places in kinds.EQUATIONS.items()}
"""Where each cause is right to be located."""
BETWEEN_LIFTS = ("mast_coupling", "chassis_compliance", "return_back_pressure")


@dataclass(frozen=True)
class Truth:
    """What is concealed, and which answers are right."""

    verdicts: tuple[str, ...]
    causes: tuple[str, ...] = ()
    lift: str = ""
    equations: tuple[str, ...] = ()
    form: str = ""
    refused: tuple[str, ...] = ()
    """Codes with which the campaign may be refused instead."""


@dataclass(frozen=True)
class Variation:
    """A case to be made: its laws, each with its points and, once found, its amplitude."""

    name: str
    case: campaign.Case
    truth: Truth
    concealed: tuple[tuple[str, float], ...] = ()  # name of the law, points


def seed_of(name):
    return zlib.crc32(name.encode()) % 100_000


def lift_of(name, seed):
    nearest = name.partition("__")[0]
    if nearest in BETWEEN_LIFTS:
        return "both"
    return "free" if nearest == "end_cushion" else LIFTS[seed % 2]


def plausible(effect):
    """The catalogue's plausible range of each parameter of an effect, and its scale."""
    from forklift import _core

    spec = next(one for one in _core.effect_table() if one["id"] == effect)
    return {p["name"]: (p["plausible_lower"], p["plausible_upper"], p["scale"]) for p in spec["parameters"]}


def law_of(name, lift, seed, amplitude):
    """The law with this amplitude at its lift; its other parameters are drawn amid the plausible."""
    if lift != "both":
        amplitude = run.on(lift, amplitude)
    if "__" in name:
        own = {}
        if name == "friction_position__asymmetric":
            own["centre"] = 0.6 if lift == "free" else 1.5
        return others.law(name, amplitude, **own)
    random = np.random.default_rng([seed, 3])
    drawn = {}
    for parameter, (lower, upper, scale) in list(plausible(name).items())[1:]:
        share = random.uniform(0.25, 0.75)
        drawn[parameter] = (
            lower * (upper / lower) ** share if scale == "log" else lower + share * (upper - lower)
        )
    if name == "friction_position":  # a place that the lift comes by
        drawn["centre"] = random.uniform(0.45, 0.75) if lift == "free" else random.uniform(1.35, 1.7)
    if name == "end_cushion":
        drawn["length"] = 0.1
    if name == "valve_current_limit":
        drawn["limit"] = random.uniform(0.55, 0.7)
    return effects.law(name, amplitude, **drawn)


def most(name):
    """The end of an amplitude's plausible range."""
    if "__" in name:
        return others.MOST[name]
    return next(iter(plausible(name).values()))[1]


def amplitude_for(points, name, case):
    """The amplitude that costs so many points of the velocity's NRMSE, and what it does cost.

    Capped at the end of what is plausible.
    """
    return at_cost(points, *_costs(name, case))


@cache
def _costs(name, case):
    law = law_of(name, case.lift, case.seed, 1.0)
    return cost_curve(law, most(name), case, scattered(case.seed))


def at_cost(points, grid, costs):
    """From a curve of costs, by interpolation of the logarithms; below its start in proportion."""
    if points >= costs[-1]:
        return float(grid[-1]), float(costs[-1])
    if points <= costs[0]:
        return float(grid[0] * points / costs[0]), points
    return float(np.exp(np.interp(np.log(points), np.log(costs), np.log(grid)))), points


def cost_curve(law, highest, case, trucks):
    """Amplitudes up to the highest, and what each costs in points of the velocity's NRMSE.

    All run at once, under the corners of load and temperature of the fitted PRMS. `law` has the amplitude 1.
    """
    planned = [
        plan
        for plan in campaign.plans(case.lift)
        if plan.role == "estimate" and plan.load_kg in (0.0, 1500.0) and plan.temperature_degc != 30.0
    ]
    key, one = amplitude_of(law)
    grid = highest * np.geomspace(1e-3, 1.0, 8)
    plain = campaign.conditions(case, planned)
    amplified = [replace(given, values={key: one * a}) for a in (0.0, *grid) for given in plain]
    found = run.simulate(trucks, (law,), amplified, ROUGH)
    without, costs = found[: len(plain)], []
    for k in range(1, len(grid) + 1):
        pairs = zip(planned, without, found[k * len(plain) : (k + 1) * len(plain)], strict=True)
        costs.append(np.mean([lost(plan, *pair, case.end_m) for plan, *pair in pairs]))
    return grid, np.maximum.accumulate(np.maximum(costs, 1e-9))


def amplitude_of(law):
    """The name of a law's amplitude, and its value."""
    name, value = next(iter(law.values.items()))
    return f"{law.name}.{name}", np.array(value)


def lost(plan, without, with_law, end_m):
    """Points of NRMSE of the commanded lifts' velocities between two runs, until either meets its end."""
    n = min(len(campaign.cut(one, plan.lift, end_m).time_s) for one in (without, with_law))
    moved = [k for k, lift in enumerate(LIFTS) if plan.lift in (lift, "both")]
    return np.mean(
        [
            100.0
            * np.linalg.norm(with_law.v[k, :n] - without.v[k, :n])
            / np.linalg.norm(without.v[k, :n] - without.v[k, :n].mean())
            for k in moved
        ]
    )


def variations(sets):
    makers = {
        "effects": _effects,
        "others": _others,
        "traps": _traps,
        "null": lambda: _complete("null", 6),
        "pairs": _pairs,
        "complete": lambda: _complete("complete", 50),
        "warming": lambda: _complete("warming", 20),
    }
    return [made for name in sets for made in makers[name]()]


def _physics(name, points, kind):
    seed = seed_of(name)
    lift, nearest = lift_of(name, seed), name.partition("__")[0]
    verdicts = ("missing-physics",) if kind == "effects" else ("missing-physics", "unknown-effect")
    truth = Truth(
        verdicts,
        (nearest,),
        lift,
        (EQUATIONS[nearest],),
        "complete" if kind == "effects" else "uncertain",
    )
    case = campaign.Case("", lift, seed, end_m=0.005 if name == "end_cushion" else campaign.END_M)
    return Variation(f"{kind}-{name}-{points:g}", case, truth, ((name, points),))


def _effects():
    return [_physics(name, points, "effects") for points in POINTS for name in effects.CATALOGUE]


def _others():
    return [_physics(name, points, "others") for points in LARGER for name in others.OTHERS]


def _traps():
    """Sensors and circumstances that look like physics, or hide it."""

    def trap(name, truth, concealed=(), **differs):
        seed = seed_of(name)
        lift = LIFTS[seed % 2]
        differs = {key: value(lift) if callable(value) else value for key, value in differs.items()}
        truth = replace(truth, lift=truth.lift or (lift if truth.causes else ""))
        return Variation(f"traps-{name}", campaign.Case("", lift, seed, **differs), truth, concealed)

    fault, fine = Truth(("sensor-fault",), equations=("sensor",)), Truth(("no-mismatch",))
    late = ("position_free_m", "position_main_m", "pressure_free_pa", "pressure_main_pa", "fork_height_m")
    return [
        trap(
            "pressure_gain",
            replace(fault, causes=("pressure_gain",)),
            sensors=lambda lift: Sensors(gains=((f"pressure_{lift}_pa", 1.08),)),
        ),
        trap(
            "position_scale",
            replace(fault, causes=("position_scale",), refused=("height-contradicts-position",)),
            sensors=lambda lift: Sensors(gains=((f"position_{lift}_m", 1.05),)),
        ),
        trap(
            "load_entered",
            Truth(("parameter-error",), ("load_entered",), "both", ("operating-point",)),
            load_off_kg=120.0,
        ),
        trap("sensor_stuck", replace(fault, causes=("sensor_stuck",)), stuck_s=2.0),
        trap(
            "pressure_late",
            replace(fault, causes=("sensor_lag",)),
            sensors=lambda lift: Sensors(lates_s=((f"pressure_{lift}_pa", 0.06),)),
        ),
        trap(
            "all_late",
            Truth(
                ("missing-physics", "sensor-fault"),
                ("valve_delay", "sensor_lag"),
                "both",
                ("valve-dynamics", "sensor"),
                refused=("command-shifted",),
            ),
            sensors=Sensors(lates_s=tuple((channel, 0.06) for channel in late)),
        ),
        trap("noise_doubled", fine, sensors=Sensors(noise=2.0)),
        trap(
            "hardly_excited",
            fine,
            command_gain=0.25,
        ),
        trap("one_temperature", fine, concealed=(("friction_temperature", 2.0),), temperature_degc=30.0),
    ]


PAIRS = (
    ("friction_temperature", "leakage"),
    ("friction_position", "entrained_air"),
    ("friction_pressure", "valve_lag"),
    ("chain_elasticity", "valve_current_limit"),
    ("leakage", "valve_delay"),
    ("bulk_modulus_temperature", "compensator_dynamics"),
    ("oil_temperature_at_valve", "hose_inertance"),
)
"""Of the first five one has the chains' stretch, which these recordings hide; the last two are of what is in
no other pair."""


def _pairs():
    made = []
    for first, second in PAIRS:
        name = f"{first}+{second}"
        seed = seed_of(name)
        truth = Truth(
            ("missing-physics",),
            (first, second),
            LIFTS[seed % 2],
            (EQUATIONS[first], EQUATIONS[second]),
            "complete",
        )
        case = campaign.Case("", LIFTS[seed % 2], seed)
        made.append(Variation(f"pairs-{name}", case, truth, ((first, 2.0), (second, 2.0))))
    return made


def _complete(kind, count):
    made = []
    for number in range(1, count + 1):
        seed = 1000 * (1 + ["null", "complete", "warming"].index(kind)) + number
        case = campaign.Case("", LIFTS[seed % 2], seed)
        if kind == "warming":
            case = replace(case, warming_k=2.0, sensors=Sensors(colour_s=0.1, temperature_lag_s=30.0))
        made.append(Variation(f"{kind}-{number:02d}", case, Truth(("no-mismatch",))))
    return made
