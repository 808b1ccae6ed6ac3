"""How Sphinx makes these pages: `python3 dev.py docs`."""

import sys
from pathlib import Path

import forklift

sys.path.insert(0, str(Path(__file__).parent / "_ext"))

project = "forklift"
release = forklift.__version__
extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.mathjax",
    "core_tables",
]
exclude_patterns = ["_build"]
html_theme = "furo"
html_title = f"forklift {release}"
html_static_path = ["_static"]
html_css_files = ["tables.css"]

myst_enable_extensions = ["amsmath", "dollarmath"]
myst_heading_anchors = 3

autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"
napoleon_google_docstring = False
default_role = "code"
