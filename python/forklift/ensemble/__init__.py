"""Many seeded runs, drawn by counter-based random numbers and resumed after a stop: sweeps and proofs."""
