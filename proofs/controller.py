"""The long checks of the exported C: ten million ticks, every argument of its helpers, both word lengths.

python3 dev.py control [c] [--words 16 32] [--ticks N] [--controller NAME] [--seed N] [--skip-helpers]
python3 dev.py control scattered [--controller NAME] [--seed N] [--worst]
                                    thesis, today and it on trucks scattered about the one they were tuned on,
                                    and which members swing most
python3 dev.py control methods [--controller NAME]
                                    each of section 6.3's methods alone, and left out
python3 dev.py control limit        how little the worst of those trucks can swing, with nothing else asked
python3 dev.py control damping      the least-damped mode and the margins over load and temperature
python3 dev.py control table        what Table 5.3's scalings leave over, by the table's oil temperature
"""

import argparse
import tempfile
import time
from pathlib import Path

import control_c
import control_limit
import control_methods
import control_scattered
from forklift.control import presets
from forklift.control.c_export import export_c
from forklift.control.controller import WORDS, Controller
from forklift.ensemble.damping import damping_map, damping_table
from forklift.plant.forklift.truck import Truck
from forklift.recordings.channels import LIFTS


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "what", nargs="?", choices=["c", "scattered", "limit", "methods", "damping", "table"], default="c"
    )
    parser.add_argument("--ticks", type=int, default=10_000_000)
    parser.add_argument("--controller", default="damped")
    parser.add_argument("--seed", type=int, help="of the random states (11), or of the scattered trucks")
    parser.add_argument("--words", type=int, nargs="+", choices=WORDS, default=WORDS, help="word lengths")
    parser.add_argument("--worst", action="store_true", help="tell the members that swing most")
    parser.add_argument("--skip-helpers", action="store_true", help="leave out the 2^32 arguments")
    arguments = parser.parse_args()
    if arguments.what == "scattered":
        names = ("thesis", "today", arguments.controller)
        seed = control_scattered.SEED if arguments.seed is None else arguments.seed
        return 0 if control_scattered.report(names, seed=seed, worst=arguments.worst) else 1
    if arguments.what == "limit":
        control_limit.report(seed=control_scattered.SEED if arguments.seed is None else arguments.seed)
        return 0
    if arguments.what == "methods":
        control_methods.report(arguments.controller)
        return 0
    if arguments.what == "table":
        truck = Truck.read("thesis")
        print("steady speed less the one asked for, root mean square [mm/s]")
        print("table [degC]" + "".join(f"{lift:>8}" for lift in LIFTS))
        for degc in presets.TABLES_DEGC:
            left = [1e3 * presets.scaling_error(truck, lift, float(degc)) for lift in LIFTS]
            print(f"{degc:>12d}" + "".join(f"{one:>8.1f}" for one in left), flush=True)
        return 0
    if arguments.what == "damping":
        for name in ("thesis", "damped", "calm"):
            print(name)
            for lift in LIFTS:
                print(
                    damping_table(damping_map(Truck.read("thesis"), Controller.read(name), lift)), flush=True
                )
        return 0
    good, clock = True, time.monotonic()

    def say(what: str, held: bool) -> None:
        nonlocal good, clock
        good &= held
        now = time.monotonic()
        print(f"{'holds' if held else 'FAILS':<6}{(now - clock) / 60.0:>6.1f} min  {what}", flush=True)
        clock = now

    for word in arguments.words:
        with tempfile.TemporaryDirectory() as home:
            controller = Controller.read(arguments.controller).with_word(word)
            folder = export_c(controller, Path(home) / "ecu")
            ticks = arguments.ticks
            say(
                f"{word} bits: {ticks} ticks from random states bit-equal",
                control_c.equal(
                    controller, folder, seed=11 if arguments.seed is None else arguments.seed, ticks=ticks
                ),
            )
            # The arguments are 16 bits wide whatever the word is; 32 bits differ in nothing but the shifts.
            for helper, number in control_c.helpers(controller) if word == 16 else ():
                if not arguments.skip_helpers:
                    what = f"{helper} ({'lift' if helper == 'table' else 'shift'} {number})"
                    same = control_c.helper_equal(controller, folder, helper, number)
                    say(f"{word} bits: all 2^32 arguments of {what} bit-equal", same)
            covered = control_c.coverage(folder)
            say(f"{word} bits: coverage {covered}", set(covered.values()) == {100.0})
            say(f"{word} bits: no finding of MISRA's checker", not control_c.misra(folder))
            say(f"{word} bits: no alarm of Eva", control_c.alarms(folder) == 0)
            found = control_c.alarms(control_c.without_clamp(folder))
            say(f"{word} bits: {found} alarms without the clamp", found > 0)
            outside = control_c.outside_the_crates_ranges(controller, folder)
            say(f"{word} bits: Eva's ranges lie within the crate's {outside or ''}", not outside)
            for processor in control_c.MACHINES:
                held = control_c.on_cortex(controller, folder, processor, ticks=100_000)
                say(f"{word} bits: 100000 ticks bit-equal on {processor}", held)
                counted = control_c.instructions(controller, folder, processor, ticks=200)
                say(
                    f"{word} bits: {processor}: {counted['mean']:.0f} instructions a tick, at most "
                    f"{counted['most']:.0f}; bytes {control_c.size(folder, processor)}",
                    True,
                )
    return 0 if good else 1


if __name__ == "__main__":
    raise SystemExit(main())
