"""``python -m forklift.ensemble.proof.under_bounds diagnose …``: the command line with bounds under
other values.

The variable FORKLIFT_CRITERIA holds them, a JSON object; they are set before anything else is loaded.
"""

from __future__ import annotations

import json
import os
from importlib import import_module

from forklift.ensemble.proof.bounds import CRITERIA, FITTING, VARIABLE

if __name__ == "__main__":
    for module in (import_module(FITTING), import_module(CRITERIA)):
        for name, value in json.loads(os.environ[VARIABLE]).items():
            if hasattr(module, name):
                setattr(module, name, value)
    from forklift.__main__ import main

    main()
