"""Many seeded runs: drawn by counter-based random numbers, resumed after a stop, reduced in order."""
