"""How many times as long a truck takes with a free curve as without, in lanes.

    python benches/curves.py [--cases 400] [--repeats 5]

The free lift through a random command of 12 s, by `simulate_many`: the truck as it is, and with a curve whose
coefficients are not zero. Both take turns; the ratio is that of the fastest repeats.
"""

import argparse
import time

import numpy as np

from forklift import Truck, commands, simulate_many
from forklift.plant.forklift.free_curve import COEFFICIENTS, FINE, FreeCurve

TRUCK = Truck.read("thesis")
COMMAND = commands.generate("prms", "free", duration_s=12.0, seed=1)
FEW, MANY = (0.05,) * COEFFICIENTS, (0.05,) * FINE
CURVES = {
    "friction over the velocity": FreeCurve("free", "friction", "velocity", -0.6, 0.1, 0.0, FEW),
    "friction over the speed of half a second ago": FreeCurve(
        "free", "friction", "speed", 0.0, 0.6, 0.5, FEW, fades=True
    ),
    "friction over the time at rest": FreeCurve("free", "friction", "time_at_rest", 0.0, 10.0, 0.0, FEW),
    "friction over the position, fine": FreeCurve("free", "friction", "position", 0.0, 1.5, 0.0, MANY),
}
RESPONSE = {f"free.free_response.time_{k}": 0.05 for k in range(COEFFICIENTS)} | {
    "free.free_response.range": 0.7
}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=400)
    parser.add_argument("--repeats", type=int, default=5)
    given = parser.parse_args()
    loads = {"load_kg": np.random.default_rng(1).uniform(0.0, 1500.0, given.cases)}
    trucks = {"as it is": TRUCK}
    trucks |= {name: TRUCK.with_values(curve.parameters()) for name, curve in CURVES.items()}
    trucks["a valve of its own answer"] = TRUCK.with_values(RESPONSE)
    seconds = {name: [] for name in trucks}
    for _ in range(given.repeats):
        for name, truck in trucks.items():
            began = time.perf_counter()
            simulate_many(truck, loads, COMMAND, lifts="free", oil_temperature_degc=40.0)
            seconds[name].append(time.perf_counter() - began)
    least = min(seconds["as it is"])
    for name, all_of in seconds.items():
        print(f"{name}: {min(all_of) / least:.2f}")


if __name__ == "__main__":
    main()
