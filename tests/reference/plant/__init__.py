"""A second plant: the truck with every effect of the catalogue, and with laws of other shapes, in NumPy.

It extends the witness beside it to both lifts and many recordings at once, shares no code with forklift,
and is what the proofs record their trucks with. Everything is in SI units; x and v are the cylinders' and
positive upward, a load is the mass on the forks. Arrays are over (lift, perturbation, recording), the free
lift first.

========== ====================================================================
truck      parameters of both lifts, scattered by a seed
model      the right-hand side of the thesis, and the places where laws enter
effects    the catalogue's laws in this plant's words
others     laws of another shape at the same places
solver     a linearly implicit method with fixed substeps, all recordings at once
run        conditions in, trajectories out
sensors    what the truck's sensors make of a trajectory, and how they may fail
campaign   a folder of recordings
========== ====================================================================
"""
