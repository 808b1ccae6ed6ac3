"""Campaigns of the truth plant (`forklift.ensemble.proof.truth`) with the commands of `tests/campaigns`."""
