"""The truth plant: both lifts, with concealed physics, faulty sensors and the nuisances of a workshop.

It shares no code with the model that diagnoses. Of the package it reads one data file, the thesis's truck.
Everything is in SI units; x and v are the cylinders' and positive upward, a load is the mass on the forks.
Arrays are over (lift, 1, recording), the free lift first.

=========== ===================================================================
truck       parameters of both lifts, scattered by a seed
model       the equations of motion in Lagrange's form, and the places where laws enter
effects     the catalogue's laws in this plant's words
others      laws of another shape at the same places
strangers   physics that the catalogue lacks, each with its source
expressions arrays of CasADi's expressions for the equations and the laws, written with NumPy
solver      a linearly implicit method with step control, compiled for the laws that act
run         conditions in, trajectories out
sensors     what the truck's sensors make of a trajectory, and how they may fail
drive       commands: pseudo-random, staircases, and a driver's ramps
=========== ===================================================================
"""
