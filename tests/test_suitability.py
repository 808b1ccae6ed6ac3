"""A campaign that cannot support a fit is refused in one sentence; one that can is not."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from campaigns import CAMPAIGNS
from forklift import Campaign, Recording, Truck, simulate
from forklift.commands import Command, generate
from forklift.demo import measured, scattered
from forklift.estimation.suitability import Suitability, suitability
from forklift.names import LIFTS, commanded
from small_campaign import raised
from test_broken_campaigns import check_sentence

Recordings = tuple[Recording, ...]
THESIS = Truck.read("thesis")
DURATION_S = 8.0


def record(
    truck: Truck, file: str, command: Command, load_kg: float, temperature: float, role: str, stream: int = 0
) -> Recording:
    """A recording of `truck`; the file's name begins with the lift that is commanded."""
    run = simulate(truck, command, load_kg=load_kg, oil_temperature_degc=temperature, solver="fixed")
    columns = measured(run, 1, stream).to_dict(as_series=False)
    time = columns.pop("time_s")
    return Recording(file, file.partition("_")[0], load_kg, role, time, columns)


def commands(kind: str, lift: str, duration_s: float, seed: int) -> Command:
    """A test signal on one lift, or one of its own on each."""
    free, main = (generate(kind, one, duration_s=duration_s, seed=seed + k) for k, one in enumerate(LIFTS))
    if lift != "both":
        return free if lift == "free" else main
    return Command(free.time_s, free.current_free_a, main.current_main_a)


@cache
def good() -> Recordings:
    """Of a truck like the thesis's: each lift with two loads at two temperatures, and both together."""
    truck, made = scattered(THESIS, 1), []
    for lift in LIFTS:
        for seed, load, temperature, role in (
            (1, 0.0, 20.0, "estimate"),
            (2, 1500.0, 60.0, "estimate"),
            (3, 800.0, 40.0, "validate"),
        ):
            command = generate("prms", lift, duration_s=DURATION_S, seed=seed)
            file = f"{lift}_{load:g}kg.csv"
            made.append(record(truck, file, command, load, temperature, role, len(made)))
    both = commands("prms", "both", DURATION_S, 4)
    made.append(record(truck, "both_500kg.csv", both, 500.0, 30.0, "estimate", len(made)))
    return tuple(made)


def with_channels(recording: Recording, **channels: np.ndarray | None) -> Recording:
    """Channels replaced, or removed where None."""
    kept = {
        name: values for name, values in (dict(recording.channels) | channels).items() if values is not None
    }
    return dataclasses.replace(recording, channels=kept, sha256="")


Mutation = Callable[[Recordings], Iterable[Recording]]


def each(change: Callable[[Recording], Recording], *files: str) -> Mutation:
    """`change` applied to these files, else to all."""
    return lambda found: [change(r) if not files or r.file in files else r for r in found]


def column(name: str, change: Callable[[np.ndarray], np.ndarray]) -> Callable[[Recording], Recording]:
    return lambda r: with_channels(r, **{name: change(np.array(r[name]))})


def times(factor: float) -> Callable[[np.ndarray], np.ndarray]:
    return lambda values: values * factor


def held(first: int, last: int) -> Callable[[np.ndarray], np.ndarray]:
    """The sample `first` repeated up to `last`."""
    return lambda values: np.r_[values[:first], np.full(last - first, values[first]), values[last:]]


def dead(values: np.ndarray) -> np.ndarray:
    return np.full_like(values, values[0])


def without(*names: str) -> Callable[[Recording], Recording]:
    return lambda r: with_channels(r, **dict.fromkeys(names))


def exchanged(what: str, unit: str) -> Callable[[Recording], Recording]:
    names = [f"{what}_{lift}_{unit}" for lift in LIFTS]
    return lambda r: with_channels(r, **{names[0]: r[names[1]], names[1]: r[names[0]]})


def chain(*changes: Callable[[Recording], Recording]) -> Callable[[Recording], Recording]:
    def change(recording: Recording) -> Recording:
        for one in changes:
            recording = one(recording)
        return recording

    return change


def other_lift(recording: Recording) -> Recording:
    """Entered and commanded as the other lift."""
    changed = exchanged("current", "a")(recording)
    return dataclasses.replace(changed, lift=LIFTS[1 - LIFTS.index(recording.lift)], sha256="")


def every(change: Callable[[np.ndarray], np.ndarray]) -> Callable[[Recording], Recording]:
    return lambda r: with_channels(
        r, **{name: change(np.array(values)) for name, values in r.channels.items()}
    )


def lost(first: int, count: int) -> Callable[[Recording], Recording]:
    """Samples cut out, and the time even all the same."""

    def change(r: Recording) -> Recording:
        channels = {
            name: np.delete(values, np.s_[first : first + count]) for name, values in r.channels.items()
        }
        return dataclasses.replace(r, time_s=r.time_s[:-count], channels=channels, sha256="")

    return change


def clock(change: Callable[[np.ndarray], np.ndarray]) -> Callable[[Recording], Recording]:
    return lambda r: dataclasses.replace(r, time_s=change(np.array(r.time_s)), sha256="")


def later(name: str, first: int, by: int) -> Callable[[Recording], Recording]:
    """A channel from `first` on moved `by` samples later."""
    return column(name, lambda v: np.r_[v[:first], np.full(by, v[first]), v[first:-by]])


def response_of(command: Callable[[Recording], Command]) -> Callable[[Recording], Recording]:
    """What the sensors would have said under another command; the recorded command stays."""

    def change(r: Recording) -> Recording:
        again = commanded_with(command)(r)
        return with_channels(again, current_free_a=r["current_free_a"], current_main_a=r["current_main_a"])

    return change


def commanded_with(command: Callable[[Recording], Command]) -> Callable[[Recording], Recording]:
    """The same run under another command."""

    def change(r: Recording) -> Recording:
        temperature = float(np.mean(r["oil_temperature_degc"]))
        again = record(scattered(THESIS, 1), r.file, command(r), r.load_kg, temperature, r.role)
        return dataclasses.replace(again, lift=r.lift, sha256="")

    return change


def level(ampere: float) -> Callable[[Recording], Command]:
    """After a second, one current on every commanded valve."""

    def command(r: Recording) -> Command:
        on = np.where(np.arange(len(r)) < 50, 0.0, ampere)
        current = {lift: on if lift in commanded(r.lift) else 0.0 * on for lift in LIFTS}
        return Command(r.time_s, current["free"], current["main"])

    return command


def only(*lifts: str) -> Mutation:
    return lambda found: [r for r in found if r.lift in lifts]


def then(*mutations: Mutation) -> Mutation:
    def change(found: Recordings) -> Iterable[Recording]:
        for mutation in mutations:
            found = tuple(mutation(found))
        return found

    return change


@dataclass(frozen=True)
class Broken:
    """What breaks a good campaign, and what is said of it."""

    name: str
    code: str
    mutation: Mutation
    says: tuple[str, ...]
    facts: dict[str, Any] = field(default_factory=dict)


F0, F1, F8, M0, M1, M8, B = (
    "free_0kg.csv",
    "free_1500kg.csv",
    "free_800kg.csv",
    "main_0kg.csv",
    "main_1500kg.csv",
    "main_800kg.csv",
    "both_500kg.csv",
)
PF, PM, XF, XM, H = (
    "pressure_free_pa",
    "pressure_main_pa",
    "position_free_m",
    "position_main_m",
    "fork_height_m",
)

BROKEN = [
    # nothing to fit
    Broken(
        "only validate recordings",
        "estimate-missing",
        lambda found: [r for r in found if r.role == "validate"],
        ("2 recordings", 'role = "estimate"'),
    ),
    Broken("no recordings", "estimate-missing", lambda found: [], ("0 recordings",)),
    # no excitation
    Broken(
        "valves never opened",
        "no-excitation",
        each(commanded_with(level(0.3))),
        ("current_free_a", "300 mA", "0.36 A", F0),
        {"channel": "current_free_a", "value": 0.3},
    ),
    Broken(
        "one level",
        "no-excitation",
        each(commanded_with(level(0.7))),
        ("one level only", "0.7 A", "current_main_a"),
        {"channel": "current_free_a"},
    ),
    Broken(
        "commanded, but never moving",
        "no-excitation",
        each(response_of(level(0.0))),
        ("free lift moves by at most 0 m", F0, "19.6 mm"),
        {"channel": XF},
    ),
    Broken(
        "one lift, never commanded above its opening",
        "no-excitation",
        then(only("main"), each(commanded_with(level(0.0)))),
        ("current_main_a is at most 0 A", "0.4 A"),
        {"lift": "main"},
    ),
    # a dead or stuck channel
    Broken(
        "dead pressure",
        "channel-stuck",
        each(column(PF, dead), F0),
        (PF, "0.00 to 7.98 s", "ignore"),
        {"file": F0, "channel": PF, "from_s": 0.0, "files": [F0]},
    ),
    Broken(
        "pressure dead at zero", "channel-stuck", each(column(PM, times(0.0)), M1), (PM, "0 Pa"), {"file": M1}
    ),
    Broken(
        "dead pressure everywhere",
        "channel-stuck",
        each(column(PM, dead)),
        (PM, M0),
        {"file": M0, "channel": PM},
    ),
    Broken(
        "dead pressure of the resting lift",
        "channel-stuck",
        each(column(PM, dead), F1),
        (PM,),
        {"file": F1, "channel": PM},
    ),
    Broken(
        "pressure stuck for 0.8 s",
        "channel-stuck",
        each(column(PF, held(200, 240)), F8),
        (PF, "4.00 to 4.78 s"),
        {"file": F8, "channel": PF, "samples": 40},
    ),
    Broken(
        "height stuck",
        "channel-stuck",
        each(column(H, held(150, 400)), M0),
        (H, "3.00 to 7.98 s"),
        {"file": M0, "channel": H},
    ),
    Broken(
        "dead encoder",
        "channel-stuck",
        each(column(XF, dead), F0),
        (XF, "forks move"),
        {"file": F0, "channel": XF},
    ),
    Broken(
        "dead encoder, no height",
        "channel-stuck",
        each(chain(without(H), column(XF, dead))),
        (XF, "pressure"),
        {"file": F0, "channel": XF},
    ),
    Broken(
        "encoder stuck half-way",
        "channel-stuck",
        each(column(XM, held(200, 400)), M8),
        (XM,),
        {"file": M8, "channel": XM},
    ),
    Broken(
        "encoder stuck in a recording of both",
        "channel-stuck",
        each(column(XM, held(200, 400)), B),
        (XM,),
        {"file": B, "channel": XM},
    ),
    Broken(
        "recorder stopped",
        "recording-frozen",
        each(every(held(200, 270)), F1),
        ("4.00 to 5.38 s", PF, H),
        {"file": F1},
    ),
    Broken(
        "the lift stands though commanded",
        "command-unanswered",
        each(response_of(level(0.0)), F0),
        ("current_free_a", "stands still"),
        {"file": F0, "channel": "current_free_a"},
    ),
    # swapped lifts
    Broken(
        "encoders swapped",
        "lifts-swapped",
        each(exchanged("position", "m"), F0),
        (XF, XM, "exchanged"),
        {"file": F0, "channel": XF},
    ),
    Broken(
        "encoders swapped, no height",
        "lifts-swapped",
        each(chain(without(H), exchanged("position", "m")), M0),
        (XF, XM, "lift = 'main'"),
        {"file": M0},
    ),
    Broken(
        "pressures swapped",
        "lifts-swapped",
        each(exchanged("pressure", "pa"), F8),
        (PF, PM),
        {"file": F8, "channel": PF},
    ),
    Broken(
        "pressures swapped everywhere",
        "lifts-swapped",
        each(exchanged("pressure", "pa")),
        (PF, PM),
        {"file": F0},
    ),
    Broken(
        "pressures swapped, both",
        "lifts-swapped",
        each(exchanged("pressure", "pa"), B),
        (PF, PM),
        {"file": B},
    ),
    Broken(
        "lift and currents swapped",
        "lifts-swapped",
        each(other_lift, F0),
        ("lift = 'main'", "enter lift = 'free'"),
        {"file": F0},
    ),
    Broken(
        "all swapped against lift",
        "lifts-swapped",
        then(only("free", "main"), each(other_lift)),
        ("lift = 'main'",),
        {"file": F0, "files": [F0, F1, F8, M0, M1, M8]},
    ),
    Broken(
        "currents swapped against lift",
        "lift-contradicts-current",
        each(exchanged("current", "a"), M0),
        ("current_free_a", 'lift = "main"'),
        {"file": M0},
    ),
    Broken(
        "currents swapped, both",
        "lifts-swapped",
        each(exchanged("current", "a"), B),
        ("current_free_a", "current_main_a"),
        {"file": B, "channel": "current_free_a"},
    ),
    # units
    Broken(
        "bar for Pa",
        "unit-wrong",
        each(column(PF, times(1e-5)), F0),
        (PF, "bar", "multiply it by 100000"),
        {"file": F0, "channel": PF},
    ),
    Broken(
        "bar for Pa everywhere", "unit-wrong", each(column(PM, times(1e-5))), (PM, "bar"), {"channel": PM}
    ),
    Broken(
        "1e5 Pa for Pa", "value-out-of-bounds", each(column(PF, times(1e5)), F1), (PF, "unit"), {"file": F1}
    ),
    Broken(
        "MPa after bar",
        "unit-wrong",
        each(chain(column(PF, times(1e-6)), column(PM, times(1e-6)))),
        (PF, "MPa"),
        {},
    ),
    Broken(
        "a tenth of the pressure",
        "pressure-implausible",
        each(column(PF, times(0.1)), F1),
        (PF, "load_kg = 1500", "14.8 MPa"),
        {"file": F1, "channel": PF},
    ),
    Broken(
        "kgf/cm2 mistaken by ten",
        "pressure-implausible",
        each(column(PM, times(5.0)), M0),
        (PM, "5.17 MPa"),
        {"file": M0, "channel": PM},
    ),
    Broken("position times 1e5", "unit-wrong", each(column(XF, times(1e3)), F0), (XF, "mm"), {"file": F0}),
    Broken(
        "position times 1e5", "value-out-of-bounds", each(column(XF, times(1e5)), F0), (XF,), {"file": F0}
    ),
    Broken(
        "position by 1e-5",
        "position-implausible",
        each(column(XF, times(1e-5)), F0),
        (XF,),
        {"file": F0, "channel": XF},
    ),
    Broken(
        "all positions by 1e-5",
        "position-implausible",
        each(chain(column(XF, times(1e-5)), column(XM, times(1e-5)))),
        (XF,),
        {"channel": XF},
    ),
    Broken(
        "position by 1e-5, no height",
        "position-implausible",
        each(chain(without(H), column(XM, times(1e-5))), M1),
        (XM,),
        {"file": M1, "channel": XM},
    ),
    Broken(
        "position in decimetres",
        "position-implausible",
        each(column(XM, times(10.0)), F1),
        (XM, "2.2 m"),
        {"file": F1, "channel": XM},
    ),
    Broken(
        "the cylinder's position for the forks'",
        "height-contradicts-position",
        each(column(XF, times(0.5)), F0),
        (XF, H),
        {"file": F0, "channel": XF},
    ),
    Broken(
        "height by 1e-5",
        "height-contradicts-position",
        each(column(H, times(1e-5)), M0),
        (H, "scale"),
        {"file": M0, "channel": H},
    ),
    Broken("height times 1e5", "value-out-of-bounds", each(column(H, times(1e5)), M0), (H,), {"file": M0}),
    Broken(
        "the resting lift's position by 1e-5",
        "height-contradicts-position",
        each(column(XM, times(1e-5)), F0),
        (XM, "3.92 m"),
        {"file": F0},
    ),
    Broken(
        "current by 1e-5",
        "command-implausible",
        each(column("current_free_a", times(1e-5)), F0),
        ("current_free_a", "opens at 360 mA"),
        {"file": F0, "channel": "current_free_a"},
    ),
    Broken(
        "kA everywhere",
        "command-implausible",
        each(chain(column("current_free_a", times(1e-3)), column("current_main_a", times(1e-3)))),
        ("current_free_a",),
        {"channel": "current_free_a"},
    ),
    Broken(
        "current times 1e5",
        "value-out-of-bounds",
        each(column("current_main_a", times(1e5)), M0),
        ("current_main_a",),
        {"file": M0},
    ),
    Broken("mA for A", "unit-wrong", each(column("current_main_a", times(1e3)), M0), ("mA",), {"file": M0}),
    Broken(
        "temperature by 1e-5",
        "temperature-implausible",
        each(column("oil_temperature_degc", times(1e-5)), B),
        ("oil_temperature_degc",),
        {"file": B, "channel": "oil_temperature_degc"},
    ),
    Broken(
        "temperature times 1e5",
        "value-out-of-bounds",
        each(column("oil_temperature_degc", times(1e5)), B),
        ("oil_temperature_degc",),
        {"file": B},
    ),
    Broken("time times 1e5", "sample-rate-mismatch", each(clock(times(1e5)), F0), (), {"file": F0}),
    Broken("time by 1e-5", "sample-rate-mismatch", each(clock(times(1e-5)), F0), (), {"file": F0}),
    Broken(
        "all times by 1e-5",
        "clock-implausible",
        each(clock(times(1e-5))),
        ("time_s", "2e-07 s"),
        {"channel": "time_s"},
    ),
    Broken("all times times 1e5", "clock-implausible", each(clock(times(1e5))), ("time_s", "2 ks"), {}),
    # clocks that jump
    Broken(
        "time jumps",
        "clock-jump",
        each(clock(lambda t: np.r_[t[:200], t[200:] + 1.5]), F0),
        ("time_s", "5.5"),
        {"file": F0},
    ),
    Broken(
        "time runs back",
        "time-not-increasing",
        each(clock(lambda t: np.r_[t[:200], t[200:] - 1.5]), F0),
        ("time_s",),
        {"file": F0},
    ),
    Broken("half a second lost", "samples-lost", each(lost(200, 25), F0), (XF, H, "4.00 s"), {"file": F0}),
    Broken("half a second lost everywhere", "samples-lost", each(lost(180, 25)), (H, "3.60 s"), {"file": F0}),
    Broken(
        "half a second lost, no height",
        "channel-jump",
        each(chain(without(H), lost(330, 25)), M0),
        (XM, "6.60 s"),
        {"file": M0, "channel": XM},
    ),
    Broken(
        "encoder loses counts",
        "channel-jump",
        each(column(XF, lambda v: np.r_[v[:250], v[250:] - 0.06]), F1),
        (XF, "5.00 s"),
        {"file": F1, "channel": XF},
    ),
    Broken(
        "command half-way 1.5 s late",
        "command-shifted",
        each(later("current_free_a", 150, 75), F0),
        ("current_free_a", "too early"),
        {"file": F0, "channel": "current_free_a"},
    ),
    Broken(
        "response 1.5 s late",
        "command-shifted",
        each(column("current_main_a", lambda v: np.r_[v[75:], np.full(75, v[-1])]), M1),
        ("current_main_a", "too late"),
        {"file": M1},
    ),
]


@pytest.mark.parametrize("broken", BROKEN, ids=lambda broken: broken.name)
def test_what_cannot_be_fitted_is_told_in_one_sentence(broken):
    error = raised(suitability, tuple(broken.mutation(good())), THESIS)
    assert error.code == broken.code, error
    for words in broken.says:
        assert words in error.message, error
    for name, value in broken.facts.items():
        assert error.facts[name] == value, (name, error.facts)
    check_sentence(error)


def test_a_good_campaign_supports_a_fit_of_both_lifts():
    assert suitability(good(), THESIS) == Suitability(("free", "main"), ())


def codes(found: Suitability) -> list[str]:
    json.dumps(found.to_dict())
    for caution in found.cautions:
        assert caution.sentence.isprintable()
        assert ";" in caution.sentence
    return [caution.code for caution in found.cautions]


CAUTIONS = [
    (
        "one load",
        lambda found: [r for r in found if r.load_kg == 0.0 or r.role == "validate"],
        {"one-load": "free.friction.f_cfr", "one-temperature": "main.viscosity.lambda"},
        ("free", "main"),
    ),
    (
        "one load, 1500 kg of the free lift",
        lambda found: [r for r in found if r.lift == "free" and r.load_kg > 0.0],
        {"one-load": "1500 kg", "one-temperature": "60"},
        ("free",),
    ),
    (
        "loads entered alike",
        lambda found: [dataclasses.replace(r, load_kg=0.0, sha256="") for r in found if r.lift == "free"],
        {"one-load": "0 kg", "load-doubtful": "agree on 15"},
        ("free",),
    ),
    (
        "one temperature",
        each(column("oil_temperature_degc", lambda v: 0 * v + 30.5)),
        {"one-temperature": "30.5 degC"},
        ("free", "main"),
    ),
    (
        "one temperature within the sensor's error",
        lambda found: [
            column("oil_temperature_degc", lambda v, k=k: 0 * v + 30.0 + 0.5 * k)(r)
            for k, r in enumerate(found)
        ],
        {"one-temperature": "30 degC"},
        ("free", "main"),
    ),
    (
        "no validate recordings",
        lambda found: [r for r in found if r.role == "estimate"],
        {"validate-missing": 'role = "validate"'},
        ("free", "main"),
    ),
    (
        "one lift at one level",
        lambda found: each(commanded_with(level(0.7)), M0, M1, M8)([r for r in found if r.lift != "both"]),
        {"lift-left-out": "one level only, 0.7 A"},
        ("free",),
    ),
    (
        "one lift never opened",
        lambda found: each(commanded_with(level(0.2)), F0, F1, F8)([r for r in found if r.lift != "both"]),
        {"lift-left-out": "current_free_a is at most 200 mA"},
        ("main",),
    ),
    (
        "one lift only to validate",
        lambda found: [
            r if r.lift == "free" else dataclasses.replace(r, role="validate", sha256="")
            for r in found
            if r.lift != "both"
        ],
        {"lift-left-out": "no estimate recording commands the main lift"},
        ("free",),
    ),
    (
        "a wrong load",
        each(lambda r: dataclasses.replace(r, load_kg=900.0, sha256=""), M1),
        {"load-doubtful": "entered as 900"},
        ("free", "main"),
    ),
    (
        "a pressure's gain",
        each(column(PF, times(1.5)), F1),
        {"pressure-doubtful": "reads 22.1 MPa"},
        ("free", "main"),
    ),
    (
        "a height's zero",
        each(column(H, lambda v: v + 0.08), B),
        {"height-contradicts-position": "starts 8"},
        ("free", "main"),
    ),
    (
        "an encoder's scale",
        each(column(XF, times(1.06)), F0),
        {"height-contradicts-position": "fork_height_m moves by"},
        ("free", "main"),
    ),
    (
        "a glitch",
        each(column(H, lambda v: np.r_[v[:100], v[100] + 0.4, v[101:]]), F0),
        {"sample-glitch": "fork_height_m jumps by 40"},
        ("free", "main"),
    ),
]


@pytest.mark.parametrize(("name", "mutation", "says", "lifts"), CAUTIONS, ids=[row[0] for row in CAUTIONS])
def test_what_a_fit_survives_is_a_caution(name, mutation, says, lifts):
    found = suitability(tuple(mutation(good())), THESIS)
    assert found.lifts == lifts
    assert set(codes(found)) == set(says)
    for code, words in says.items():
        assert any(caution.code == code and words in caution.sentence for caution in found.cautions), found


@pytest.mark.parametrize(
    ("names", "codes_told"),
    [((H,), []), ((XF, XM), []), ((PF, PM), []), ((XF, XM, H), []), ((PM, XM), [])],
    ids=["height", "encoders", "pressures", "all but pressures", "main"],
)
def test_a_channel_that_is_not_there_is_no_fault(names, codes_told):
    assert codes(suitability(tuple(each(without(*names))(good())), THESIS)) == codes_told


def test_missing_samples_are_no_fault():
    """Empty cells, in a row or here and there, of every channel that may have them."""
    random = np.random.default_rng(1)

    def gaps(values: np.ndarray) -> np.ndarray:
        values[random.integers(0, len(values), 20)] = np.nan
        values[200:230] = np.nan
        return values

    changed = each(chain(*(column(name, gaps) for name in (PF, PM, XF, XM, H, "oil_temperature_degc"))))
    assert suitability(tuple(changed(good())), THESIS) == Suitability(("free", "main"), ())


def test_coarse_sensors_without_noise_are_no_fault():
    """Steps of 1 bar and 5 mm, nothing below."""
    truck, made = scattered(THESIS, 3), []
    for seed, load in enumerate((0.0, 1500.0)):
        for lift in LIFTS:
            kind = ("prms", "staircase")[seed]
            command = generate(kind, lift, duration_s=DURATION_S, seed=seed)
            run = simulate(truck, command, load_kg=load, oil_temperature_degc=30.0, solver="fixed")
            columns = measured(run, 1, 0).to_dict(as_series=False)
            for name, step in ((PF, 1e5), (PM, 1e5), (H, 5e-3)):
                columns[name] = np.round(run[name] / step) * step
            time = columns.pop("time_s")
            made.append(Recording(f"{lift}_{load:g}.csv", lift, load, "estimate", time, columns))
    assert suitability(made, THESIS).lifts == ("free", "main")


@pytest.mark.parametrize("rate_hz", [20.0, 200.0])
def test_other_sample_rates_are_no_fault(rate_hz):
    truck, made = scattered(THESIS, 2), []
    for seed, load in enumerate((0.0, 1500.0)):
        slow = generate("prms", "main", duration_s=DURATION_S, seed=seed)
        time = np.arange(int(DURATION_S * rate_hz)) / rate_hz
        command = Command(time, 0.0 * time, np.interp(time, slow.time_s, slow.current_main_a))
        made.append(record(truck, f"main_{load:g}.csv", command, load, 20.0 + load / 50.0, "estimate", seed))
    assert suitability(made, THESIS).lifts == ("main",)


EFFECTS = (
    {},
    {"mast_coupling.factor": 1.0},
    {"free.leakage.coefficient": 1.5e-12, "main.leakage.coefficient": 1.5e-12},
    {"free.friction_temperature.rate": 0.018},
)


@settings(max_examples=150, deadline=None)
@given(
    seed=st.integers(0, 10_000),
    lift=st.sampled_from([*LIFTS, "both"]),
    effect=st.sampled_from(EFFECTS),
    kind=st.sampled_from(["prms", "staircase"]),
    loads=st.tuples(st.floats(0.0, 2000.0), st.floats(0.0, 2000.0)),
    temperature=st.floats(0.0, 70.0),
    duration_s=st.floats(4.0, 30.0),
)
def test_recordings_of_any_truck_of_the_make_are_fit(
    seed, lift, effect, kind, loads, temperature, duration_s
):
    """Also where a lift reaches its stop and stands there, and with physics that the thesis left out."""
    assume(kind == "prms" or duration_s >= 10.0)  # a shorter staircase has one step, which tells too little
    truck = scattered(THESIS, seed).with_values(effect)
    made = []
    for k, load in enumerate(loads):
        command = commands(kind, lift, duration_s, seed + k)
        made.append(record(truck, f"{lift}_{k}.csv", command, load, temperature, "estimate", k))
    assume(min(np.min(recording[name]) for recording in made for name in (PF, PM)) > -1e6)  # else never read
    found = suitability(made, THESIS)
    assert found.lifts == commanded(lift)
    assert set(codes(found)) <= {"one-load", "one-temperature", "validate-missing"}


CONCEALED = {"null": ("free",), "coupling": ("free", "main"), "thermfric": ("free",), "leak": ("main",)}


@pytest.mark.parametrize(("name", "lifts"), CONCEALED.items())
def test_the_simulated_campaigns_are_fit(name, lifts):
    """What they conceal is for a diagnosis, not a reason not to fit."""
    assert suitability(Campaign.read(CAMPAIGNS / name).recordings, THESIS) == Suitability(lifts, ())


S, P = "free_steps_0kg_30c.csv", "free_prms1_1500kg_60c.csv"

BROKEN_NULL = [
    ("no-excitation", each(response_of(level(0.0))), "free lift moves by at most"),
    (
        "no-excitation",
        each(chain(*(column(f"current_{x}_a", times(0.2)) for x in LIFTS), every(dead))),
        "valve opens",
    ),
    ("channel-stuck", each(column(PF, held(300, 335)), P), "6.00 to 6.68 s"),
    ("channel-stuck", each(column(XF, held(250, 500)), P), "position_free_m stands"),
    ("lifts-swapped", each(exchanged("pressure", "pa")), "pressure_main_pa"),
    ("lifts-swapped", each(exchanged("position", "m"), S), "position_main_m"),
    ("lifts-swapped", each(other_lift, S), "enter lift = 'free'"),
    ("unit-wrong", each(column(PF, times(1e-5)), P), "bar"),
    ("position-implausible", each(column(XF, times(1e-5)), S), "position_free_m"),
    ("height-contradicts-position", each(column(H, times(1e-5))), "fork_height_m"),
    ("samples-lost", each(lost(300, 40), S), "6.00 s"),
    ("clock-jump", each(clock(lambda t: np.r_[t[:300], t[300:] + 0.8]), S), "time_s"),
    ("command-shifted", each(later("current_free_a", 200, 100), P), "current_free_a"),
]


@pytest.mark.parametrize(
    ("code", "mutation", "says"), BROKEN_NULL, ids=lambda value: value if isinstance(value, str) else ""
)
def test_a_shared_campaign_broken_is_told(code, mutation, says):
    found = Campaign.read(CAMPAIGNS / "null").recordings
    error = raised(suitability, tuple(mutation(found)), THESIS)
    assert error.code == code, error
    assert says in error.message, error
    check_sentence(error)


def test_one_load_of_a_shared_campaign_is_a_caution():
    found = Campaign.read(CAMPAIGNS / "null").recordings
    assert codes(suitability([r for r in found if r.load_kg == 800.0], THESIS)) == ["one-load"]
