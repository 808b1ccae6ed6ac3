"""Many seeded runs: stability sweeps, their intervals, and rare failures."""
