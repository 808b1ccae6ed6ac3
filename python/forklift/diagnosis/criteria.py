"""The bounds that decide an answer: whom the search tries, where it stops, what is accepted, what is told.

Bounds in squares or in ln probability hold against the sensors' noise; shares hold of what is left over.
"""

from __future__ import annotations

from collections.abc import Mapping

from forklift.fitting.criteria import AT_NOISE as AT_NOISE
from forklift.fitting.criteria import BY_CHANCE as BY_CHANCE
from forklift.fitting.criteria import FAR as FAR
from forklift.fitting.criteria import HOPED as HOPED
from forklift.fitting.criteria import NUISANCE_GAIN as NUISANCE_GAIN
from forklift.fitting.criteria import ROUNDING as ROUNDING
from forklift.fitting.criteria import STRAIN as STRAIN
from forklift.fitting.criteria import WHITE as WHITE
from forklift.plant.protocol import Hypothesis, Kind

# How much is computed.
BUDGET = 60000.0
"""Simulated recordings (`forklift.fitting.work`) after which no further trial begins. Two cores do some
thousand a second, so that what was not tried by then would not have come within two minutes."""
ONCE_MORE = 15000.0
"""What is granted beyond that, once, where names were found that leave nothing over: to ask all recordings
for one more takes a quarter of it."""

# When anything is asked for at all.
ALARM_PHYSICS, ALARM_CONDITION, ALARM_SENSOR, ALARM_CURVE, ALARM_ROUNDED = 12.0, 30.0, 80.0, 30.0, 130.0
"""Fall of −ln posterior over all recordings that a hypothesis must promise to be asked for where no channel
of a recording held out shows by itself that anything is missing, slow noise taken off: 4.9 deviations of an
amplitude, among some sixty. Conditions have an unknown for every recording; and sensors promise up to 62
where nothing is amiss, since an encoder that starts from the same place in every recording is rounded alike
in all of them. A curve has several unknowns too, and is the best of some two hundred; of it the evidence
counts, and of what encoders alone show of it more than the 107 that they promise of a scale that is off by
next to nothing. What 35 complete trucks promise by chance:
``python proofs/chance.py --seed 2000001 --campaigns 138``."""


def alarm(one: Hypothesis) -> float:
    """Of a hypothesis. A condition that is off by one number in all recordings promises what physics does."""
    by_kind: Mapping[Kind, float] = {
        "physics": ALARM_PHYSICS,
        "parameter": ALARM_PHYSICS if one.amplitude else ALARM_CONDITION,
        "sensor": ALARM_SENSOR,
        "unknown": ALARM_CURVE,
    }
    return by_kind[one.kind]


LEAST_FAULT = 0.02
"""In a prior's deviations: a sensor that is off by less is as it should be. A gain of a thousandth, a lag of
a millisecond, a fiftieth of a bar: no truck's sensor is specified to less, and rounding that is alike in all
recordings looks like as much."""
LEAST_EFFECT = 0.01
"""Likewise: an effect of less, where no recording held out shows it, is none. It is a hundredth of what is
usual where it is one; and in many recordings of one kind what two simulations differ by adds up to as
much."""

# Which names are tried, accepted and compared.
FIRST, FURTHER = 3, 4
"""How many hypotheses the race begins with, and how many more enter if none of them explains everything."""
WORTH = 0.1
"""A hypothesis enters the race if it promises this share of the best one's gain; and what is easily confused
with a complete explanation is tried beside that from this share of its gain on."""
RIVAL = 0.25
"""Share of an accepted explanation's promise from which on another of the most promising is tried beside
it."""
LITTLE = 0.05
"""Likewise of what is left over above the noise: who promises less is tried only if it is the first, or from
the start machine where the evidence is."""
LIVES_BEYOND = 2.0
"""How many times more than its linear step promised a trial may gain: who would not help then is not tried
(but where much is left over, and beside nothing, from the start machine)."""
PAIR = 1.5
"""The best pair enters if it promises this many times as much as the best alone; and a curve is tried instead
of a name that leaves something over with a curve, too, if it promised this many times as much as the name."""
VARIANTS = 3
"""From how many places of its further parameters the search for one hypothesis starts."""
NEARLY = 0.01
"""Share of what was left over that may still be left by a search that only ended in the wrong place."""
NEAR_PLACES, MOST_NEAR, MOST_NEAR_MORE = 4, 4, 2
"""At how many of the most credible places names are tried from the start machine before something is said to
have none, and how many names; and how many beside a name that was accepted."""
SHAPES_BESIDE = 2
"""How many free shapes are tried where a name was accepted that leaves something over: beside it, and
instead."""
SAME_PLACE = 0.25
"""Share of what a name leaves over that a curve at its own place must remove: it mends that name's law, and
is no second cause."""
AHEAD, MOST_OF = 2.0, 0.5
"""How many times as much as the next the most promising promises, and which share of what is left over it
removes, if no other is tried in its place."""
BEYOND_DOUBT = 25.0
"""An amplitude so many of its deviations from none is needed where nothing is left over: without it −ln
posterior would rise by some three hundred."""
LEAST_ROUGH = 2.0
"""A hypothesis stays in the race if, after the tempered stages, −ln posterior has fallen by `ALIKE` of what
it has with the best one, and by no less than this."""
LEAST_GAIN = 0.1
"""Share of what is left over that the first explanation must remove. The same is asked again of each name of
the last fit. So much must the curve of one lift promise on the other."""
LATER, LATER_BEYOND_NOISE = 0.5, 0.2
"""Likewise of an explanation beside another: half, where the sensors' noise can be reached, since what one
law of another shape leaves over invites a second that is none; less on a machine whose model never reaches
it: several effects are the rule there, and a second seldom halves it."""
CLEARLY = 30.0
"""Least fall of the sum of squares on recordings held out that counts as one. So much better, in ln
probability, recordings must foretell each other by a name whose size those that were fitted do not tell: two
and a half times what raises an alarm."""
CONFIRMED = 5.0
"""Where nothing shows, and all recordings together have raised an alarm: how much better, in ln probability,
they must predict each other with a hypothesis. Those held out may be too few to tell, but must not object:
lose more than `AS_NEAR`, or more than `LEAST_GAIN` of what all gain."""
AS_NEAR = 20.0
"""Explanations whose sums of squares on recordings held out differ by less are as good as each other: e^-10
in likelihood, which samples of one recording, that err together, may well make up for."""
SIMPLER = 0.05
"""Share of what the best explanation gains that a simpler one may gain less, where a number of the best has
gone to its bound, or it is unlikely."""
LAW = 15.0
"""Fall of −ln posterior that a curve beside a name must promise to be asked for."""
LAW_BY_CHANCE = 0.01
"""Probability below which what conditions differ by is no chance, but a law over one of those entered: for
each of these, one of a hundred campaigns whose conditions differ by chance is told as a law."""
MOST_ACCEPTED = 3
REDRAWS = 2000
"""Of the recordings held out, for the credibility."""

# How far a search is led, and when an amplitude is there.
SETTLED = 2e-3
"""Share of the cost by which a step of the race must lower it: what gains less is as good there."""
ENDED = 0.3
"""Fall of −ln posterior by less than which the last stage ends: a likelihood ratio of 1.3, far below every
bound here. (A fit of its own goes on to 0.02.)"""
MISFIT = 3.0
"""Mean square in the worst channel from which on that is clear after the tempered stages."""
SLIGHT = 2.0
"""Mean square in the worst channel up to which the tempered stages are blind to what is left over: beside
three times the noise it is a ninth. Hypotheses are then asked over all recordings."""
NEAR, MOVES = 1e-3, 12
"""A strict judgement of recordings whose own unknowns are known vaguely goes on until they stay."""
LESS = 0.95
"""Share of the worst channel's mean square from which on shorter substeps are worth their time: an effect may
be quicker than the model without it."""
TWICE = 2.0
"""Recordings held out may feel the substeps this many times as much as those that were fitted."""
LIVES_UP = 0.8
"""Share of what the score test promised that a search must gain, or it is started elsewhere too."""
MUCH = 0.2
"""Share of what was left over that one start may leave without another being tried."""
ALIKE = 0.5
"""What gains little has more than this share left of what there was without it."""
BEHIND = 2.0
"""A start is not led on if the first stage leaves it this many times as far off as another one."""
BOUND = 1e-3
"""In a prior's deviations: an unknown so near to its bound has gone to it."""
CLEAR = 3.0
"""An amplitude is there if it lies this many of its standard deviations from its null value."""

# Where something acts, and of what it is a function.
MEMORY = 2.0
"""Correlation time of an unknown input's prior, in distances of its hats: on a lift half of the period in
which that rings."""
CURVES_AT, MOST_PLACES, MOST_CURVES = 4, 8, 3
"""At how many of the most credible places curves are screened at least, and at most, which bounds the work;
and how many curves are tried."""
FAINT_CURVES = 6
"""How many curves are screened over all recordings where next to nothing is left over: those that promise
most over the recordings that were fitted."""
MOST_NOW, MOST_PAST = 8, 8
"""How many curves over variables of the moment, and over those of the past, are screened at the most credible
places together: those that promise most by the places' answers to hats. The best of either by its own
simulation was among them in each of nine campaigns (``python proofs/foreseen.py``)."""
CURVE_NEAR = 0.7
"""A curve is tried if its evidence is this share of the greatest: less is far behind, since all of them are
linear about the same place."""
CURVE_TIE = 0.85
"""Of curves whose evidence is this share of the greatest, one at a place where its variable may plausibly
act goes first: what enters between a valve's current and its flow looks much the same. Of names that are
tried by where they act, those go first at whose place an unknown input has this share."""
MOVES_AT_ALL = 1e-6
"""Share of its size by which a variable moves if it is one."""
TELLING = 0.05
"""Share of an input by which what a variable was a while ago must explain more of it, in recordings left out,
than one of the moment, to be told before it."""
STANDS = 0.9
"""Share of an accepted hypothesis's effect, or of the evidence of a curve or of an unknown input at a sensor,
from which on another stands for it."""
FORETOLD = 1.0
"""A group of recordings is foretold by the others if what these leave unknown of it is less than its noise:
mean square in units of that."""
UNTOLD = 0.5
"""An amplitude whose prior the recordings narrow to no less than this cannot be tested."""

# What is told.
AS_GOOD = 0.05
"""Credibility from which on a rival that leaves nothing over cannot be told from the cause."""
ANOTHER_SHAPE = 0.98
"""Share of what a cause removes from which on a rival may be the true one, by a law a little unlike the
catalogue's: so much laws of another shape than the catalogue's lose under its name (median in `forklift prove
--seed 22000001 --campaigns 185`)."""
LIKELY = 0.5
"""Credibility below which a cause is no verdict: it is more likely to be another."""
NAMED_RIGHTLY = 0.7
"""In which share of the causes that are named with their form uncertain the name is right: 26 of 37 in
`forklift prove --seed 740001 --campaigns 80` (`forms` in ``score.json``). Of the others most are physics that
the catalogue lacks, at the place that is named. With their form complete 21 of 21 were right."""

# When nothing is told.
DOUBTFUL = 2.0
"""Mean square up to which what no hypothesis explains is put down to chance, or to the simulation itself."""
TOLD_REGION = 0.5
"""Share of an unknown input that a variable must explain, in recordings left out, to be told as what the
input is a function of: with less, most of it is a function of something else."""
FLAT = 0.3
"""A curve that varies by no more than this share of its largest absolute value is a constant."""
