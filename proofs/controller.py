"""The long checks of the exported C: ten million ticks, both word lengths; `python3 dev.py control`."""

import argparse
import tempfile
from pathlib import Path

import control_c
from forklift.control.c_export import export_c
from forklift.control.controller import Controller


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--ticks", type=int, default=10_000_000)
    parser.add_argument("--controller", default="damped")
    arguments = parser.parse_args()
    good = True

    def say(what: str, held: bool) -> None:
        nonlocal good
        good &= held
        print(f"{'holds' if held else 'FAILS':<6} {what}", flush=True)

    for word in (16, 32):
        with tempfile.TemporaryDirectory() as home:
            controller = Controller.read(arguments.controller).with_word(word)
            folder = export_c(controller, Path(home) / "ecu")
            ticks = arguments.ticks
            say(
                f"{word} bits: {ticks} ticks bit-equal",
                control_c.equal(controller, folder, seed=11, ticks=ticks),
            )
            say(
                f"{word} bits: coverage {control_c.coverage(folder)}",
                set(control_c.coverage(folder).values()) == {100.0},
            )
            say(f"{word} bits: no finding of MISRA's checker", not control_c.misra(folder))
            say(f"{word} bits: no alarm of Eva", control_c.alarms(folder) == 0)
            say(
                f"{word} bits: an alarm without the clamp",
                control_c.alarms(control_c.without_clamp(folder)) > 0,
            )
            for processor in control_c.MACHINES:
                held = control_c.on_cortex(controller, folder, processor, ticks=100_000)
                size = control_c.size(folder, processor)
                say(f"{word} bits: 100000 ticks bit-equal on {processor}, {size}", held)
    return 0 if good else 1


if __name__ == "__main__":
    raise SystemExit(main())
