"""Every notebook runs, and prints the words that its stored outputs have."""

import re
from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

NOTEBOOKS = sorted((Path(__file__).parents[1] / "notebooks").glob("*.ipynb"))


def words(notebook):
    """The kinds of output of each cell, and printed words without numbers, which depend on the processor."""
    shown = []
    for output in (output for cell in notebook.cells for output in cell.get("outputs", [])):
        data = output.get("data", {"text/plain": output.get("text", "")})
        text = re.sub(r"\d[\d.]*(e[-+]?\d+)?|\W", " ", data.get("text/plain", ""))
        shown.append((output.output_type, *sorted(data), *text.split()))
    return shown


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs(path, tmp_path, request):
    stored = nbformat.read(path, as_version=4)
    made = nbformat.read(path, as_version=4)
    options = {"timeout": 300, "kernel_name": "python3", "record_timing": False}
    NotebookClient(made, **options, resources={"metadata": {"path": str(tmp_path)}}).execute()
    made.metadata = stored.metadata
    for cell in made.cells:
        # A bar of progress is not a result.
        cell["outputs"] = [output for output in cell.get("outputs", []) if output.get("name") != "stderr"]
        if cell.cell_type != "code":
            del cell["outputs"]
    if request.config.getoption("--store"):
        nbformat.write(made, path)
    else:
        assert words(stored) == words(made)
