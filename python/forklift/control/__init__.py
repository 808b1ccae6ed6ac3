"""The controller: its settings, the loop closed around a simulated truck, its measures, its C."""
