"""A machine of one equation, y = k u + c u², of which a diagnosis is to find the second term."""

from forklift.plant.parts import Effect, Input, Output, Param, Plant, Port

BEND = Effect(
    "bend", "it bends", (Param("c", "1", 0.0, -1.0, 1.0),), ("law",),
    lambda x, u, p, bus: {"law": p["c"] * u["u"] ** 2},
)  # fmt: skip
LINE = Plant(
    "line", (Param("k", "1", 1.0, 0.1, 10.0),), (Input("u"),), (Output("y", sigma=0.05),),
    lambda t, x, u, w, p, bus: {"y": p["k"] * u["u"] + w["law"]},
    ports=(Port("law", kind="law"),), effects=(BEND,), score="algebraic",
)  # fmt: skip
