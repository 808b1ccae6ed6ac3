"""Tuning on a simulated truck: the PID over many operating points, and load by load what goes beyond it.

Source: Fri & Fahlén (2017), sections 4.4.1 and 4.5.1, (4.4); section 6.3 asks for more than the PID. What
is searched stands in `space`, the pressure feedback that it starts from in `feedback`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path

from forklift import __version__
from forklift.base.alone import alone_with
from forklift.base.errors import ForkliftError
from forklift.base.output import check_file
from forklift.control.closed_loop import DELAY_TICKS
from forklift.control.controller import Controller
from forklift.control.feedback import LIMIT_MM_S, LIMIT_SOURCE, at_the_knots, swing_of, tune_swing
from forklift.control.presets import today
from forklift.control.search import Journal, minimised
from forklift.control.space import CURVE_LOADS_KG, Space
from forklift.control.trial import TRUCKS, Trial
from forklift.plant.forklift.truck import Truck, truck_of
from forklift.recordings.channels import LIFTS, Lift

METHODS = ("adaptation", "shaped", "swing", "predictor")
"""Section 6.3's: learning of the feed-forward, a shaped reference, feedback of the pressure's swing, a Smith
predictor."""

GENERATIONS = {"free": 250, "main": 120}
CANDIDATES = 18


@dataclass(frozen=True)
class Progress:
    """How far a search is: which lift, how many generations of how many, and the least cost so far."""

    lift: Lift
    generation: int
    generations: int
    cost: float


def tune(
    controller: Controller,
    truck: Truck | str | Path,
    *,
    methods: Sequence[str] = METHODS,
    delays_ticks: dict[Lift, int] | None = None,
    seed: int = 1,
    transition: bool = True,
    start: Controller | None = None,
    kept: Path | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> Controller:
    """The controller with both lifts' gains and what `methods` adds, tuned on a truck and others of its make.

    Parameters
    ----------
    controller
        What it is measured against, and whose settings stay where none of `methods` acts.
    truck
        Whose make the trucks of the trial are scattered about; a name or a path will do.
    methods
        Some of `METHODS`.
    delays_ticks
        From sensors to valve; `DELAY_TICKS` if None.
    seed
        Of the sensors' noise, of the search and of the scattered trucks; at least 0.
    transition
        Whether the transition between the lifts has to be smoother than with the controller in use. If not,
        the lifts swing less.
    start
        Whose numbers, feedback and shaper the search begins with; None sets the feedback up load by load,
        and takes `forklift.control.space.NUMBERS`. What is tuned is measured against `controller`, wherever
        it began.
    kept
        A file for the costs of every generation: after a stop the same call goes on with it, and after the
        end it gives the same at once. None keeps nothing.
    progress
        Is told after every generation how far the search is.

    Raises
    ------
    ForkliftError
        ``"argument-invalid"`` for an unknown method; ``"not-writable"`` and ``"folder-in-use"`` for `kept`;
        as `forklift.control.closed_loop.lower`.
    """
    truck = truck_of(truck)
    for method in methods:
        if method not in METHODS:
            raise ForkliftError(
                "argument-invalid", f"{method} is no method; there are {', '.join(METHODS)}", name="methods"
            )
    given = {**DELAY_TICKS, **(delays_ticks or {})}
    made_of = (
        f"{__version__} {controller.hash} {truck.sha256} {list(methods)} {dict(given)} {seed} {transition}"
        f"{'' if start is None else f' {start.hash}'}"
    )
    with alone_with(check_file(kept)) if kept is not None else nullcontext():
        journal = Journal(kept, made_of)
        for lift in LIFTS:
            controller = _search(
                controller, truck, lift, methods, given[lift], seed, transition, start, journal, progress
            )
    return controller


def _search(
    before: Controller,
    truck: Truck,
    lift: Lift,
    methods: Sequence[str],
    delay: int,
    seed: int,
    transition: bool,
    begun: Controller | None,
    journal: Journal,
    say: Callable[[Progress], None] | None,
) -> Controller:
    """The numbers of a lift, and load by load those of the methods.

    They cost least in a `Trial` beside the controller one starts from and the one in use today. By evolution:
    encoder counts make the cost jump.
    """
    start = before
    own = None if begun is None else getattr(begun, lift)
    if "swing" in methods and own is not None and own.swing is not None:
        start = start.with_swing(lift, at_the_knots(own.swing)).with_numbers(
            lift, LIMIT_SOURCE, swing_limit=LIMIT_MM_S
        )
    elif "swing" in methods:
        start = tune_swing(start, truck, lift, delay_ticks=delay, seed=seed)
    source = (
        f"forklift control tune {before.name}: truck {truck.name} (sha256 {truck.sha256[:12]}) and {TRUCKS} "
        f"like it, {', '.join(methods) or 'no method'}, delay {delay} ticks, seed {seed}"
        f"{'' if begun is None else f', from {begun.name} ({begun.hash})'}"
        f"{'' if transition else ', without the transition'}"
    )
    places = [swing_of(before, truck, lift, load, delay, seed) for load in CURVE_LOADS_KG]
    space = Space.of(start, lift, methods, own, places, source)
    trial = Trial(truck, lift, delay, seed, [before, today(truck)], transition)

    def told(generation: int, cost: float) -> None:
        if say:
            say(Progress(lift, generation, GENERATIONS[lift], cost))

    best = minimised(
        lambda tried: trial.cost([space.controller(one) for one in tried]),
        space.sought,
        generations=GENERATIONS[lift],
        candidates=CANDIDATES,
        seed=len(LIFTS) * seed + LIFTS.index(lift),
        journal=journal,
        say=told,
    )
    return space.controller(best)
