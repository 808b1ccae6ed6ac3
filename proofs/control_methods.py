"""What each of section 6.3's methods does: alone with the thesis's PID, and left out of the better one.

`python3 dev.py control methods` prints the table. Trucks, loads, delays and signals are those of
`control_scattered`.
"""

from collections.abc import Iterator

import control_scattered
from forklift.control.controller import Controller, LiftSettings
from forklift.control.tune import METHODS
from forklift.plant.forklift.truck import Truck
from forklift.recordings.channels import LIFTS, Lift

PID = ("proportional", "integral", "derivative", "u_max", "overspeed", "overspeed_from")
NUMBERS = {
    "adaptation": ("adaptation_s",),
    "shaped": ("early_corner",),
    "swing": ("swing_limit",),
    "predictor": ("prediction",),
}
"""The numbers of a method; a shaped reference and the pressure's swing have tables besides."""
TABLES = {"shaped": "shaper", "swing": "swing"}


def with_method(to: Controller, lift: Lift, method: str, of: Controller) -> Controller:
    """One controller's settings of a method in another."""
    giver: LiftSettings = getattr(of, lift)
    values = {name: giver.numbers[name].value for name in NUMBERS[method]}
    found = to.with_numbers(lift, f"as {of.name}", **values)
    table = TABLES.get(method)
    if table == "shaper":
        found = found.with_shaper(lift, giver.shaper)
    elif table == "swing":
        found = found.with_swing(lift, giver.swing)
    return found


def variants(thesis: Controller, better: Controller) -> Iterator[tuple[str, Controller]]:
    """The better one's PID alone, each method with the thesis's PID, each left out of the better one."""
    pid, alone, without = thesis, dict.fromkeys(METHODS, thesis), dict.fromkeys(METHODS, better)
    for lift in LIFTS:
        numbers = getattr(better, lift).numbers
        pid = pid.with_numbers(lift, "as the better one", **{name: numbers[name].value for name in PID})
        for method in METHODS:
            alone[method] = with_method(alone[method], lift, method, better)
            without[method] = with_method(without[method], lift, method, thesis)
    yield "PID alone", pid
    yield from ((f"{method} alone", one) for method, one in alone.items())
    yield from ((f"without {method}", one) for method, one in without.items())
    yield "all", better


def report(name: str = "damped") -> None:
    """Prints, for each row with a load, the worst swing over the thesis's and what the mean NRMSE gains."""
    thesis = Controller.read("thesis")
    made = dict(variants(thesis, Controller.read(name)))
    width = max(map(len, made)) + 2
    table: dict[str, list[str]] = {variant: [] for variant in made}
    heads = []
    for row in control_scattered.rows([thesis, *made.values()], Truck.read("thesis")):
        if row.load_kg == 0.0:
            continue
        heads.append((f"{row.lift} {row.oil_temperature_degc:.0f} degC", f"{row.load_kg:.0f} kg"))
        worst, nrmse = row.swing_m_s.max(axis=1), row.nrmse_percent.mean(axis=1)
        for k, cells in enumerate(table.values(), start=1):
            cells.append(f"{worst[k] / worst[0]:.2f} {nrmse[k] - nrmse[0]:+.1f}")
    for words in zip(*heads, strict=True):
        print(" " * width + "".join(f"{word:>13}" for word in words))
    for variant, cells in table.items():
        print(f"{variant:<{width}}" + "".join(f"{cell:>13}" for cell in cells))
