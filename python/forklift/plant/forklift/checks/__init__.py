"""What makes a recording useless for a fit, told from its samples: one kind a file."""
