"""A fit as one self-contained page: verdict, what is left and where, parameters, curves before and after."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from forklift import fit_files
from forklift.estimation.judgement import AT_NOISE
from forklift.estimation.knowledge import QUANTILE
from forklift.estimation.unknowns import SCALES
from forklift.names import LIFTS
from forklift.plots import SHOWN, Floats, curves, figure, numbers, page, shown
from forklift.tables import HOW_KNOWN, change_rows, mean_square, of_lift, percent

if TYPE_CHECKING:
    from forklift.compare import Prediction
    from forklift.estimation.profile import Profile
    from forklift.fit import Fit
    from forklift.names import Lift

RISE = QUANTILE**2
"""Of −2 ln L, at the ends of a 95 % interval."""
STRONGEST = 100.0
"""Mean square of the most strongly coloured cell."""
SHADE = 50.0
"""Its share of colour [%]: text on it stays readable, by day and by night."""
ROW_PX = 17
"""Height of a row of the correlations."""


def fit_page(fit: Fit) -> str:
    """The page of a fit."""
    lifts = [lift for lift in LIFTS if len(fit.after.validation(lift))]
    validate = [pair for pair in shown(fit.after) if pair[1].recording.role == "validate"]
    before = {prediction.recording.file: prediction for prediction in fit.before.predictions}
    drawn = [
        figure(lift, {"before": before[after.recording.file], "after": after}, _notes(fit, lift, after))
        for lift, after in validate or shown(fit.after)
    ]
    return page(
        title=f"{fit.campaign.name} fitted from {fit.start.name}",
        summary=fit.verdict,
        tables=[*(_change(fit, lift) for lift in lifts), _mean_squares(fit), *_parameters(fit)],
        details=[_sensors(fit), *_starts(fit)],
        groups=[
            curves(drawn) | {"title": "Measured, before and after"},
            *_profiles(fit),
            _correlations(fit),
        ],
        footer=[
            f"Campaign {fit.campaign.name}: {len(fit.campaign.recordings)} recordings, sha256 "
            f"{fit.campaign.sha256[:12]}",
            f"Started from truck {fit.start.name} ({fit.start.origin}), sha256 {fit.start.sha256[:12]}; "
            f"the fitted truck, truck.toml, has sha256 {fit.truck.sha256[:12]}",
            f"{fit.found.evaluations} evaluations with derivatives in the best search, "
            f"{fit.seconds:.1f} s in all",
            "The curves run free from the start of each recording: nothing is corrected by measurements. "
            "Velocities are the derivative of the fork height, or of the lift's own encoder, through a "
            "Savitzky–Golay filter of 11 samples and second order, measured and simulated alike.",
        ],
        command=fit_files.command(fit),
    )


def _notes(fit: Fit, lift: Lift, after: Prediction) -> list[str]:
    """Both fits of the velocity and the pressure, before and after."""
    notes = []
    table = fit.fits
    for channel in (f"velocity_{lift}_m_s", f"pressure_{lift}_pa"):
        row = table.filter((table["file"] == after.recording.file) & (table["channel"] == channel))
        if len(row) and row["nrmse_percent_after"][0] is not None:
            was, now = (percent(row[f"nrmse_percent_{when}"][0]) for when in ("before", "after"))
            notes.append(f"{SHOWN[row['unit'][0]][0]} fit {was} → {now} % (NRMSE)")
    return notes


def _change(fit: Fit, lift: Lift) -> dict[str, Any]:
    table = fit.validation(lift)
    judged = (table["role"] == "validate").all()
    return {
        "title": f"Velocity of the {lift} lift: model fit, before → after, laid out as Table "
        f"{'5.4' if lift == 'free' else '5.5'}"
        + ("" if judged else " (no validate recordings, so all of them)"),
        "head": ["Temperature [°C]", "Load [kg]", "Fit (NMSE) [%]", "Fit (NRMSE) [%]", "Recording"],
        "numeric": [True, True, True, True, False],
        "rows": change_rows(table),
        "wide": True,
    }


def _mean_squares(fit: Fit) -> dict[str, Any]:
    """A row per recording, a cell per signal, the stronger coloured the more is left over."""
    channels = list(fit.sensors)
    files = dict.fromkeys((found.role, found.file) for found in fit.judged)
    found = {(seen.file, seen.channel): seen.mean_square for seen in fit.judged}
    rows = [
        [file, role, *(_shaded(found.get((file, channel))) for channel in channels)]
        for role, file in sorted(files, key=lambda key: key[0] != "validate")
    ]
    return {
        "title": "What is left over: mean square in units of the sensors' noise. 1 is noise alone, up to "
        f"{AT_NOISE:g} counts as explained; more is coloured",
        "head": ["Recording", "Role", *(_short(channel) for channel in channels)],
        "numeric": [False, False, *[True] * len(channels)],
        "rows": rows,
        "wide": True,
    }


def _shaded(value: float | None) -> Any:
    if value is None:
        return {"text": "—", "shade": 0}
    strength = np.log(max(value, AT_NOISE) / AT_NOISE) / np.log(STRONGEST / AT_NOISE)
    return {"text": mean_square(value), "shade": round(SHADE * min(float(strength), 1.0))}


def _short(channel: str) -> str:
    """``pressure_free_pa`` as a head has room for it."""
    return channel.rpartition("_")[0].replace("_", " ")


def _parameters(fit: Fit) -> list[dict[str, Any]]:
    found = fit.parameters
    bars = dict(zip(found["name"], _bars(fit), strict=True))
    lifts: list[Lift | None] = [*LIFTS, None]
    tables = []
    for lift in lifts:
        rows = [
            [
                row["name"],
                f"{row['start']:.5g}",
                f"{row['start_lower']:.3g} to {row['start_upper']:.3g}",
                f"{row['value']:.5g}",
                f"{row['lower']:.4g} to {row['upper']:.4g}",
                row["unit"],
                HOW_KNOWN[row["told"]],
                bars[row["name"]],
            ]
            for row in of_lift(found, lift).iter_rows(named=True)
        ]
        if rows:
            tables.append(
                {
                    "title": f"Parameters of {f'the {lift} lift' if lift else 'the truck'}. Thin line: 95 % "
                    "before, thick: 95 % after; upright: the start",
                    "head": [
                        "Parameter", "Start", "95 % before", "Value", "95 % after", "Unit", "Known", "",
                    ],
                    "numeric": [False, True, True, True, True, False, False, False],
                    "rows": rows,
                    "wide": True,
                }
            )  # fmt: skip
    return tables


def _bars(fit: Fit) -> list[dict[str, Any]]:
    """By parameter its intervals before and after, in per cent of a bar as wide as both."""
    bars = []
    for estimate, theta in zip(fit.knowledge.estimates, fit.found.x.tolist(), strict=False):
        prior, half = fit_files.PRIOR_QUANTILE, QUANTILE * estimate.deviation
        ends = [-prior, prior, theta - half, theta + half]
        least, most = min(ends), max(ends)
        at = [100.0 * (end - least) / (most - least) for end in (*ends, 0.0)]
        bars += [
            {
                "title": f"{estimate.deviation:.2g} of the spread before",
                "before": [round(at[0], 1), round(at[1] - at[0], 1)],
                "after": [round(at[2], 1), round(at[3] - at[2], 1)],
                "start": round(at[4], 1),
            }
        ] * len(estimate.unknown.names)
    return bars


def _sensors(fit: Fit) -> dict[str, Any]:
    return {
        "title": "Sensors, as the samples tell them",
        "head": ["Signal", "Noise", "Encoder's count", "Weighted as", "Widened by"],
        "numeric": [False, True, True, True, True],
        "rows": [
            [
                name,
                f"{sensor.noise:.3g}",
                f"{sensor.count:.3g}" if sensor.count else "—",
                f"{fit.noise[name]:.3g}",
                f"{fit.knowledge.widening.get(name, 1.0):.2f}",
            ]
            for name, sensor in fit.sensors.items()
        ],
        "wide": True,
    }


def _starts(fit: Fit) -> list[dict[str, Any]]:
    if len(fit.ends) < 2:
        return []
    return [
        {
            "title": "Where the starts ended",
            "head": ["Start", "Above the best, −ln posterior", "Furthest parameter [deviations]", "Same"],
            "numeric": [True, True, True, False],
            "rows": [
                [
                    str(end.start + 1),
                    f"{end.cost:.3g}" if np.isfinite(end.cost) else "failed",
                    f"{end.distance:.3g}" if np.isfinite(end.distance) else "—",
                    "yes" if end.same else "no",
                ]
                for end in fit.ends
            ],
            "wide": True,
        }
    ]


def _profiles(fit: Fit) -> list[dict[str, Any]]:
    if not fit.profiles:
        return []
    note = (
        "How much worse everything fits, as −2 ln of the posterior, with one parameter held and all others "
        "fitted anew; dotted: the parabola that the intervals in the table assume. The dashed level bounds "
        "95 %."
    )
    figures = [
        {"title": found.name, "note": _interval(found), "panels": [_profile(fit, found)]}
        for found in fit.profiles
    ]
    return [{"title": "Profiles", "note": note, "figures": figures}]


def _interval(found: Profile) -> str:
    ends = [f"{end:.4g}" if np.isfinite(end) else "beyond" for end in (found.lower, found.upper)]
    return f"95 % interval from the profile: {ends[0]} to {ends[1]}"


def _profile(fit: Fit, found: Profile) -> dict[str, Any]:
    k = [unknown.name for unknown in fit.unknowns].index(found.name)
    unknown, deviation = fit.unknowns[k], fit.knowledge.estimates[k].deviation
    forth = SCALES[unknown.scale].forth
    theta: Floats = np.array([forth(value) for value in found.values.tolist()]) - forth(unknown.start[0])
    normal = ((theta / unknown.width - fit.found.x[k]) / deviation) ** 2
    return {
        "title": "Rise of −2 ln posterior",
        "x": numbers(found.values),
        "x_title": f"{found.name} [{unknown.unit}]",
        "curves": {"profile": numbers(found.rise), "normal": numbers(normal)},
        "level": RISE,
    }


def _correlations(fit: Fit) -> dict[str, Any]:
    names = [unknown.name for unknown in fit.unknowns]
    matrix = [
        [round(value, 2) if np.isfinite(value) else None for value in row]
        for row in fit.knowledge.correlation.tolist()
    ]
    panel = {"title": "", "names": names, "matrix": matrix, "height": 60 + ROW_PX * len(names)}
    return {
        "title": "Correlations",
        "note": "Of the estimates' errors. Near 1 or −1, two parameters are known together only: as a "
        "difference or a sum, a ratio or a product. Columns carry the rows' numbers.",
        "figures": [{"title": "", "note": "", "panels": [panel]}],
    }
