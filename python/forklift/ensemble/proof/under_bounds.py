"""``python -m forklift.ensemble.proof.under_bounds diagnose …``: the command line with bounds under
other values.

The variable FORKLIFT_CRITERIA holds them, a JSON object; they are set before anything else is loaded.
"""

from __future__ import annotations

import json
import os
from importlib import import_module

from forklift.ensemble.proof.bounds import CRITERIA, VARIABLE

if __name__ == "__main__":
    criteria = import_module(CRITERIA)
    for name, value in json.loads(os.environ[VARIABLE]).items():
        setattr(criteria, name, value)
    from forklift.__main__ import main

    main()
