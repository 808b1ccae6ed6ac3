"""One lift's hydraulic circuit as a drawing, with places of its equations marked."""

from __future__ import annotations

from collections.abc import Collection, Mapping

LINES = (
    "M 112 236 H 262",  # from the cylinder
    "M 322 236 H 392",  # from the proportional valve
    "M 452 236 H 512",  # from the control volume
    "M 572 236 H 660 V 252",  # to the tank
    "M 422 214 V 186 H 542 V 208",  # what the compensator feels
)
"""Pipes and pilot line."""
PRESSURES = {"p_A": (230, 254), "p_B": (482, 254), "p_T": (640, 228)}
"""As the equations call them, and where they are."""

PARTS: Mapping[str, tuple[str, tuple[float, float], str]] = {
    "force-balance": ("M 52 28 H 148 V 54 H 52 Z M 100 54 V 150", (100, 20), "load and mast"),
    "friction": (
        "M 80 126 l 8 10 M 80 136 l 8 10 M 112 126 l 8 10 M 112 136 l 8 10",
        (150, 134),
        "friction",
    ),
    "cylinder-pressure": ("M 84 120 V 246 H 116 V 120 M 84 150 H 116", (44, 200), "cylinder"),
    "bulk-modulus": (
        "M 92 170 v 8 M 100 184 v 8 M 108 170 v 8 M 92 200 v 8 M 108 204 v 8",
        (44, 220),
        "its oil",
    ),
    "mast-coupling": ("M 148 41 H 196 M 196 30 H 240 V 54 H 196 Z", (276, 46), "other lift"),
    "chassis": (
        "M 40 262 H 160 M 72 276 m -10 0 a 10 10 0 1 0 20 0 a 10 10 0 1 0 -20 0 "
        "M 128 276 m -10 0 a 10 10 0 1 0 20 0 a 10 10 0 1 0 -20 0 M 100 246 V 262",
        (100, 304),
        "chassis",
    ),
    "sensor": (
        "M 192 236 V 220 M 192 206 m -14 0 a 14 14 0 1 0 28 0 a 14 14 0 1 0 -28 0",
        (192, 184),
        "sensor",
    ),
    "valve-flow": (
        "M 262 206 H 322 V 266 H 262 Z M 270 236 H 310 M 302 229 L 312 236 L 302 243",
        (292, 286),
        "valve",
    ),
    "valve-dynamics": (
        "M 276 180 H 308 V 206 H 276 Z M 276 206 L 308 180 M 292 180 V 156",
        (292, 148),
        "solenoid",
    ),
    "control-volume": (
        "M 402 214 H 442 Q 452 214 452 224 V 248 Q 452 258 442 258 H 402 Q 392 258 392 248 V 224 "
        "Q 392 214 402 214",
        (422, 278),
        "volume",
    ),
    "compensator": (
        "M 512 208 H 572 V 264 H 512 Z M 520 236 H 560 M 552 229 L 562 236 L 552 243 "
        "M 542 264 l -6 5 l 12 5 l -12 5 l 12 5 l -6 5",
        (542, 306),
        "compensator",
    ),
    "tank": ("M 630 250 V 276 H 690 V 250", (660, 296), "tank"),
    "viscosity": ("M 660 256 q -9 12 0 15 q 9 -3 0 -15", (712, 268), "oil"),
    "operating-point": ("M 60 34 H 140 V 48 H 60 Z", (146, 70), "as entered"),
}
"""By equation: what is drawn, and where it is called what."""
ALWAYS = frozenset(PARTS) - {"operating-point", "mast-coupling", "sensor"}
"""What a circuit has whatever is wrong."""


def circuit(marked: Collection[str], tied: Collection[str], lift: str) -> str:
    """An SVG drawing; empty where no equation that is marked has a place in it.

    Parameters
    ----------
    marked, tied
        Equations whose places are marked, and those that recordings do not part from them.
    lift
        What the drawing is called after; of an entered condition, nothing.
    """
    if not set(marked) & set(PARTS):
        return ""
    drawn = [one for one in PARTS if one in ALWAYS | set(marked) | set(tied)]
    said = ", ".join(PARTS[one][2] for one in PARTS if one in marked)
    groups = [
        f'<g class="{"marked" if one in marked else "tied" if one in tied else "part"}">'
        f'<path d="{path}"/><text x="{x}" y="{y}">{name}</text></g>'
        for one in drawn
        for path, (x, y), name in [PARTS[one]]
    ]
    pressures = [
        f'<text x="{x}" y="{y}">p<tspan dy="4" font-size="10">{name[2:]}</tspan></text>'
        for name, (x, y) in PRESSURES.items()
    ]
    return (
        f'<svg class="circuit" viewBox="0 0 760 316" role="img" '
        f'aria-label="The circuit{f" of {lift}" if lift else ""}, marked: {said}">'
        f'<path d="{" ".join(LINES)}"/>{"".join(pressures)}{"".join(groups)}</svg>'
    )
