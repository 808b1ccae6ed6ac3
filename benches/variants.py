"""How many times as fast `simulate_many` is as calls of `simulate`, of the same parameter sets.

    python benches/variants.py [--cases 1000] [--sampled 50] [--repeats 3]

Both lifts through a random command of 12 s. `simulate` is timed with its own settings (adaptive, tolerance
1e-4), and with as many fixed substeps as `simulate_many`, whose error is about the same as that of the former
(`measurements.md`). Its calls are sampled and scaled up; of each way the fastest repeat counts.
"""

import argparse
import time

import numpy as np

from forklift import Truck, commands, simulate, simulate_many

TRUCK = Truck.read("thesis")
COMMAND = commands.generate("prms", "both", duration_s=12.0, seed=1)
DEGC = 40.0


def drawn(count):
    random = np.random.default_rng(1)
    names = ("free.friction.sigma_2", "main.friction.sigma_2", "free.bulk.a_1", "main.bulk.a_1")
    varied = {name: TRUCK.values[name] * random.uniform(0.9, 1.1, count) for name in names}
    return varied | {"load_kg": random.uniform(0.0, 1500.0, count)}


def one_by_one(cases, count, **settings):
    for k in range(count):
        own = {name: float(values[k]) for name, values in cases.items()}
        load = own.pop("load_kg")
        truck = TRUCK.with_values(own)
        simulate(truck, COMMAND, load_kg=load, oil_temperature_degc=DEGC, **settings)


def fastest(repeats, run):
    found = []
    for _ in range(repeats):
        wall, processor = time.perf_counter(), time.process_time()
        run()
        found.append((time.perf_counter() - wall, time.process_time() - processor))
    return tuple(min(column) for column in zip(*found, strict=True))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=1000)
    parser.add_argument("--sampled", type=int, default=50)
    parser.add_argument("--repeats", type=int, default=3)
    given = parser.parse_args()
    cases = drawn(given.cases)
    many = fastest(given.repeats, lambda: simulate_many(TRUCK, cases, COMMAND, oil_temperature_degc=DEGC))
    print(f"{given.cases} cases at once: {many[0]:.2f} s wall, {many[1]:.2f} s processor")
    for what, settings in (("as it is", {}), ("fixed substeps", {"solver": "fixed", "substeps": 8})):
        own = fastest(given.repeats, lambda settings=settings: one_by_one(cases, given.sampled, **settings))
        wall, processor = (seconds * given.cases / given.sampled for seconds in own)
        print(
            f"simulate, {what}: {wall:.2f} s wall, {processor:.2f} s processor: "
            f"{wall / many[0]:.1f} and {processor / many[1]:.1f} times as long"
        )


if __name__ == "__main__":
    main()
