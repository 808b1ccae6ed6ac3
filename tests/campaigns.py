"""Where the simulated campaigns lie: what each conceals stands in ``campaigns/README.md``."""

from pathlib import Path

CAMPAIGNS = Path(__file__).parent / "campaigns"
