"""The notebook runs from top to bottom, and says what the diagnosis says."""

from pathlib import Path

import nbformat
from nbclient import NotebookClient

EXAMPLES = Path(__file__).parents[1] / "examples"


def test_the_notebook_runs_and_names_what_is_concealed():
    notebook = nbformat.read(EXAMPLES / "diagnosis.ipynb", as_version=4)
    NotebookClient(notebook, timeout=600, resources={"metadata": {"path": str(EXAMPLES)}}).execute()
    shown = {
        kind: text
        for cell in notebook.cells
        for output in cell.get("outputs", [])
        for kind, text in output.get("data", {}).items()
    }
    assert "text/html" in shown
    everything = "".join(
        text
        for cell in notebook.cells
        for output in cell.get("outputs", [])
        for text in output.get("data", {}).values()
    )
    assert "free.friction_temperature" in everything
    assert "report.html" in everything
