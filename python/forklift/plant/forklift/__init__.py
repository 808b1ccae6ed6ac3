"""The forklift as a machine: truck, simulation, effects, checks of its recordings."""
