"""The notebooks of the documentation run from begin to end.

With ``GREYRIG_RENDER`` set, what they print goes back into them, without the pages that are for a browser alone.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import nbclient
import nbformat
import pytest

NOTEBOOKS = Path(__file__).parents[3] / "docs" / "notebooks"


@pytest.mark.parametrize("name", ["one_motor", "own_effect", "lot"])
def test_notebook(name: str, tmp_path: Path) -> None:
    path = NOTEBOOKS / f"{name}.ipynb"
    formats: Any = nbformat
    notebook: Any = formats.read(path, as_version=4)
    client: Any = nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(tmp_path)}})
    client.execute()
    shown = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    pages = [output for output in shown if "<iframe" in output.get("data", {}).get("text/html", "")]
    assert pages or name == "lot", "answers show themselves"
    if "GREYRIG_RENDER" in os.environ:
        rendered(notebook)
        formats.write(notebook, path)


def rendered(notebook: Any) -> None:
    """Leaves out what only a browser shows, and what is another one each time."""
    for cell in notebook.cells:
        cell["metadata"] = {}
        for output in cell.get("outputs", []):
            data = output.get("data", {})
            if "<iframe" in data.get("text/html", ""):
                del data["text/html"]
        if "outputs" in cell:
            cell["outputs"] = [o for o in cell["outputs"] if o.get("name") != "stderr"]
    notebook["metadata"].pop("widgets", None)
