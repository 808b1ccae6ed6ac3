"""A campaign of a truck that never was, for when none is given: the free lift alone, as in section 3.5."""

from pathlib import Path

from forklift import demo
from forklift.commands import SAMPLE_RATE_HZ, Command, generate
from forklift.simulate import simulate
from forklift.truck import Truck

SEED = 7
LEAST_M = 0.03  # forks over their lowest, where a recording ends
PLANS = (
    ("steps", 1, 0.0, 30.0, "estimate"),
    ("steps", 1, 1000.0, 30.0, "estimate"),
    *(
        ("prms", seed, load_kg, temperature, role)
        for seed, role in ((1, "estimate"), (2, "validate"))
        for load_kg in (0.0, 800.0, 1500.0)
        for temperature in (20.0, 60.0)
    ),
)


def make(folder: Path) -> None:
    """Write the campaign into `folder`."""
    truth = demo.scattered(Truck.read("thesis"), SEED)
    toml = f'name = "made"\nsample_rate_hz = {SAMPLE_RATE_HZ}\n'
    for stream, (kind, seed, load_kg, temperature, role) in enumerate(PLANS):
        command = generate("staircase" if kind == "steps" else "prms", "free", duration_s=12.0, seed=seed)
        conditions = {"load_kg": load_kg, "oil_temperature_degc": temperature}
        whole = simulate(truth, command, **conditions)
        above = int((whole["position_free_m"] > LEAST_M).argmin()) or len(command.time_s)
        short = Command(*(column[:above] for column in (command.time_s, *command.currents.T)))
        file = f"free_{kind}{seed}_{load_kg:g}kg_{temperature:g}c.csv"
        demo.measured(simulate(truth, short, **conditions), SEED, stream).write_csv(folder / file)
        toml += f'\n[[recording]]\nfile = "{file}"\nlift = "free"\nload_kg = {load_kg}\nrole = "{role}"\n'
    (folder / "campaign.toml").write_text(toml, encoding="utf-8")
