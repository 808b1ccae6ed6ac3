"""What was measured: recordings, campaigns, and the files they come from."""
