"""Words and phrases that every page has, to a reader who does not know the engine."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from forklift.base.typeset import capital as capital
from forklift.base.typeset import mean_square as mean_square
from forklift.base.typeset import number as number
from forklift.base.typeset import printed as printed
from forklift.base.typeset import size as size
from forklift.base.typeset import spans as spans
from forklift.base.typeset import stretches as stretches
from forklift.diagnosis.criteria import LAW, NAMED_RIGHTLY

if TYPE_CHECKING:
    from forklift.diagnosis.screening import Screened
    from forklift.fitting.residuals import ChannelResidual
    from forklift.recordings.noise import Sensor


class Quantity(NamedTuple):
    """What a figure draws: its name, the unit it is drawn in, and how many of that one of its own is."""

    name: str
    unit: str = ""
    scale: float = 1.0
    symbol: bool = False
    """Whether its name is written as it is, and never with a capital."""

    @property
    def titled(self) -> str:
        """As an axis has it."""
        name = self.name if self.symbol else capital(self.name)
        return f"{name} [{self.unit}]" if self.unit else name


GLOSSARY: dict[str, str] = {
    "Held out": "Recordings that the model was not fitted on (role validate; the others have the role "
    "estimate). Only they say how good it is: on those it was fitted on, any model can be made to look good.",
    "Fit": "Of simulated to measured. NRMSE, by the normalised root mean square error, is 100 % less that "
    "error in per cent of the measured signal's standard deviation; NMSE the same with squares. 100 % is "
    "perfect, 0 % no better than a constant.",
    "Noise power": "The sensor's own noise, squared: the unit of mean squares on this page. At 1 nothing is "
    "left but noise, so that no model could do better; at 4 the error is twice the noise. "
    "An encoder at rest reads the same count all the time and leaves nothing, so that averages and moments "
    "at rest may lie below 1.",
    "Left over": "The mean square of measured less simulated, in units of the noise power, with what the fit "
    "leaves open removed: for each recording its own load, temperature and start, and the fitted parameters "
    "within their uncertainty, are moved to where they explain it best (by a linear estimate). Where a "
    "recording's own numbers had to move further than is plausible, what that costs is added to the signal "
    "that it serves most. Decisions are made by it. It is not the squared error of a drawn curve, which has "
    "one set of parameters for all recordings.",
    "Free run": "A simulation from the start of a recording to its end, which gets what drove it and sees no "
    "measurement.",
}
"""Words that every page has."""
PARAMETERS: dict[str, str] = {
    "Identifiable": "Yes: the recordings by themselves tell the parameter's value. Together: they tell a "
    "combination with others, and the prior tells their separate values. No: the value is the prior's.",
    "Prior": "What is known of a parameter before the fit: its start value, and how far it may plausibly be "
    "from it.",
}
"""Words of a fit."""
CAUSES: dict[str, str] = {
    "Before, after": "Before: the model with its parameters fitted as well as can be. After: the same with "
    "what was found, fitted anew.",
    "Leave-one-out log score": "Told where what was found shows in no recording alone: how well all other "
    "recordings predict each one, as the natural logarithm of the probability density of what was measured. "
    "An improvement by 5 means that the recordings are 150 times as probable.",
    "Credibility": "In which share of random redraws of the recordings held out a cause leaves less over "
    "than everything else that was tried. Where a cause has a name and its form is uncertain, less what is "
    f"left for a law that was not tried: {NAMED_RIGHTLY:g} of that share, as often as such names were right "
    "on campaigns of known truth.",
    "Interval": "Where the true value lies with a probability of 95 %, if the model is right. It is widened "
    "by what is left over, and where that is correlated.",
    "Predicted gain": "How far −ln of the probability of all recordings together would fall with a "
    "hypothesis, by a linear estimate and before any fit. Many make up for one another, and for how the "
    "sensors' noise is taken, so that fits on recordings held out decide.",
}
"""Words of a diagnosis."""

REST = "an encoder at rest leaves nothing, so that an average may lie below 1"
"""Why averages lie below what is called noise alone."""
NOISE = "times the sensors' noise power (1 is noise alone)"
"""The unit of what is left over, in words."""


def noise_power(error: float, sensor: Sensor | None) -> float | None:
    """A root mean square error squared, in units of the sensor's noise power.

    None without a sensor, and of an encoder: its readings are rounded, and stand still as long as it does.
    """
    return None if sensor is None or sensor.count else (error / sensor.noise) ** 2


def left_over(judged: Sequence[ChannelResidual]) -> str:
    """What a signal leaves over by one model after another; what implausible conditions cost said apart."""
    squares = [one.mean_square - one.strain / one.samples for one in judged]
    said = " → ".join(map(mean_square, squares))
    said = f"left over {said} times, with parameters moved within their uncertainty"
    if any(one.strain for one in judged):
        costs = [mean_square(one.strain / one.samples) for one in judged]
        said += f", and {' → '.join(costs)} for conditions further from those entered than is plausible"
    return said


def another_law(curve: Screened, joined: bool) -> str:
    """Why the law of what explains everything is in doubt; `joined`: whether the curve is in the model."""
    return (
        "The catalogue's law alone leaves no more than the noise in any signal, but a curve over "
        f"{curve.hypotheses[0].over} beside it explains all recordings better (by a linear estimate by "
        f"{number(curve.gain)} in ln posterior, where {LAW:g} is much); fitted without those held out, it "
        f"{'explains these better too' if joined else 'does not clearly explain these better'}. Where no "
        "recording lies, neither is told."
    )
