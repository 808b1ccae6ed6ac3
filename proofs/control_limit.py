"""How little the worst trucks can swing: a controller tuned on them alone, with nothing else asked of it.

`python3 dev.py control limit` takes those trucks of `control scattered` that swing most on the free lift, and
searches all the numbers of a controller for the least swing of the worst member of every row, as a share of
the thesis's. All sixteen trucks ask for more, and so do speed, NRMSE and margins. It is a search's end, no
proof that there is nothing better.
"""

from collections.abc import Sequence

import numpy as np

import control_scattered
from forklift.control.closed_loop import TICK_S
from forklift.control.controller import Controller
from forklift.control.metrics import plateaus
from forklift.control.search import Sought, minimised
from forklift.control.trial import scattered
from forklift.plant.forklift.truck import Truck

LIFT = "free"
TRUCKS = (9, 13, 5, 0, 3)
"""Of the scattered: those that swing most with `calm` (`control scattered --worst`), and two more."""
GENERATIONS, CANDIDATES = 200, 18
MEAN_WEIGHT = 0.1
"""Of all rows' mean beside the worst row's, so that every row counts a little."""
NUMBERS = {
    "integral": Sought(0.5, 0.3, 0.0, 5.0),
    "proportional": Sought(0.06, 0.05, 0.0, 0.5),
    "derivative": Sought(0.003, 0.002, 0.0, 0.02),
    "overspeed": Sought(2.0, 3.0, 0.0, 12.0),
    "overspeed_from": Sought(585.0, 20.0, 400.0, 640.0),
    "u_max": Sought(650.0, 30.0, 560.0, 800.0),
    "adaptation_s": Sought(0.1, 0.1, 0.02, 20.0),
    "early_corner": Sought(23.0, 4.0, 2.0, 25.0),
    "prediction": Sought(1.0, 0.2, 0.0, 1.0),
}
CURVES = {
    "delay_s": Sought(0.0, 0.02, -0.2, 0.2),
    "gain_mm_s_per_bar": Sought(0.0, 0.5, -8.0, 8.0),
    "lead_deg": Sought(0.0, 15.0, -360.0, 360.0),
}
"""By how much `calm`'s shaper and feedback are moved, at each of `PLACES` of their knots."""
PLACES = 4

Point = tuple[float, float]
"""Oil temperature [degC] and load [kg]."""


def tried(calm: Controller, values: np.ndarray) -> Controller:
    """`calm` with other numbers, shaper and feedback on the lift."""
    numbers, *curves = np.split(values, len(NUMBERS) + PLACES * np.arange(len(CURVES)))
    found = calm.with_numbers(
        LIFT, "tried", **{name: float(f"{x:.4g}") for name, x in zip(NUMBERS, numbers, strict=True)}
    )
    own = getattr(calm, LIFT)
    moved = {}
    for (name, sought), by in zip(CURVES.items(), curves, strict=True):
        part = own.shaper if name == "delay_s" else own.swing
        knots = np.linspace(0.0, PLACES - 1.0, len(getattr(part, name)))
        known = getattr(part, name) + np.interp(knots, np.arange(PLACES), by)
        least = sought.lower if name == "lead_deg" else 0.0
        moved[name] = [round(float(max(x, least)), 4) for x in known]
    found = found.with_shaper(LIFT, own.shaper.model_copy(update={"delay_s": moved.pop("delay_s")}))
    return found.with_swing(LIFT, own.swing.model_copy(update=moved)).only(LIFT)


def worst(
    controllers: Sequence[Controller], truck: Truck, seed: int, chosen: Sequence[int]
) -> dict[Point, np.ndarray]:
    """(controllers,) The swing [m/s] of the worst member of each row."""
    trucks = scattered(truck, control_scattered.TRUCKS, seed)
    found = {}
    for t in control_scattered.TEMPERATURES_DEGC:
        for load in control_scattered.LOADS_KG:
            members = control_scattered.members(load, LIFT, chosen)
            swing = []
            for signal in control_scattered.SIGNALS:
                request, run = control_scattered.lowered(controllers, trucks, members, LIFT, t, signal, seed)
                swing.append(
                    [
                        max(p.oscillation_m_s for p in plateaus(request, speed, TICK_S))
                        for speed in run.speed_m_s[LIFT]
                    ]
                )
            every = np.nan_to_num(np.max(swing, axis=0), nan=1e3).reshape(len(controllers), len(members))
            found[t, load] = every.max(axis=1)
    return found


def report(*, seed: int = control_scattered.SEED, generations: int = GENERATIONS) -> None:
    """Prints what is left of each row, and what it takes."""
    truck, calm = Truck.read("thesis"), Controller.read("calm")
    own = Controller.read("thesis").only(LIFT)
    thesis = worst([own], truck, seed, range(control_scattered.TRUCKS))

    def shares(controllers: Sequence[Controller]) -> np.ndarray:
        found = worst(controllers, truck, seed, TRUCKS)
        return np.array([found[point] / thesis[point] for point in thesis])

    def cost(values: Sequence[np.ndarray]) -> np.ndarray:
        found = shares([tried(calm, one) for one in values])
        return found.max(axis=0) + MEAN_WEIGHT * found.mean(axis=0)

    def say(generation: int, least: float) -> None:
        if generation % 20 == 0:
            print(f"generation {generation} of {generations}: {least:.3f}", flush=True)

    sought = [*NUMBERS.values(), *(one for one in CURVES.values() for _ in range(PLACES))]
    best = tried(
        calm,
        minimised(cost, sought, generations=generations, candidates=CANDIDATES, seed=1, say=say),
    )
    print(f"\nworst of the members of trucks {', '.join(map(str, TRUCKS))}, share of the thesis's of all")
    print("lift  degC    kg    calm  tuned on them alone")
    for point, before, after in zip(thesis, *shares([calm.only(LIFT), best]).T, strict=True):
        print(f"{LIFT:<5}{point[0]:>5.0f}{point[1]:>6.0f}{before:>8.2f}{after:>21.2f}")
    numbers = getattr(best, LIFT).numbers
    print("its " + ", ".join(f"{name} {numbers[name].value:g}" for name in NUMBERS))
    print("\nthe same controller on all trucks")
    print(control_scattered.HEAD)
    names = [Controller.read("thesis"), Controller.read("today"), best]
    for row in control_scattered.rows(names, truck, seed=seed, lifts=(LIFT,)):
        print(control_scattered.line(row)[0], flush=True)
