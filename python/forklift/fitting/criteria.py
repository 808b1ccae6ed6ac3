"""Bounds of the judgement that decide an answer; `forklift.diagnosis.criteria` holds the diagnosis's own.

All are multiples of the sensors' noise or of a prior's deviation, so that they hold for any machine.
"""

from __future__ import annotations

from math import sqrt

# When a channel of a recording is explained.
AT_NOISE = 1.2
"""Mean square up to which a channel counts as explained, but for its chance scatter of √(2/n). Complete
models left no more than this on 21 trucks of another plant, and every mismatch nine and more. Calibrate:
``forklift prove --seed 1 --only complete --sensitivity``."""
BY_CHANCE = 4.0
"""How many of its deviations the mean square of slow noise may lie above one. Its independent samples are
so few, and its size is known so badly, that the bound for white noise lies within what many a channel
leaves. Four normal deviations are exceeded by chance in one of some 30,000 channels."""
ROUNDING = sqrt(3.0)
"""Half an encoder's count in units of its noise (count/√12). A lift at rest reads off by a constant of up to
this much: that is rounding, and taken off."""
WHITE = 0.01
"""Level of the Ljung–Box test: a complete model fails one test in a hundred."""

# What recordings have of their own.
FAR = 0.3
"""What moves one of a recording's own unknowns by more of its prior's deviations is linearised anew: a load
that was entered wrongly, say."""
STRAIN = 25.0
"""Sum of squares of a recording's own unknowns, in their priors' deviations, that chance explains: χ² of five
degrees exceeds this once in seven thousand recordings. What exceeds it twice over (once in 10⁹) is left
unexplained, however many samples there are."""
NUISANCE_GAIN = 0.5
"""Fall of −ln posterior by less than which the search for what recordings have of their own ends: a
likelihood ratio of 1.6 tells nothing."""

# Which descents are led on.
HOPED = 2.0
"""How many times faster than its last two evaluations a descent is hoped to go: who would then still miss
what it must come down to, is given up. What explains the recordings comes down within a few evaluations,
what does not crawls. At once the pace, what was concealed in `second/07` was given up."""

# How well a number can be known.
CLOCK = 1e-3
"""Share of a value by which its interval reaches to either side at least: no recording knows a time, nor a
flow, a rate or a period, better than the clock it was taken by, whatever its noise. A crystal is within
0.01 % (50 ppm, and 50 ppm of ageing: Texas Instruments 2017, MSP432E411Y, SLASEK6), a ceramic resonator
within 0.5 % (Murata, CSTCE8M00G55Z); 0.1 % lies between, and is what `forklift prove` draws sample periods
off by. Who has a better clock gets intervals a little too wide."""
