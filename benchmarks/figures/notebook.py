"""Executes the example notebook and stores it with its outputs.

    python -m benchmarks.figures.notebook

Players are left out, since each takes more than a megabyte; they appear when the notebook is run.
"""

import tempfile
from pathlib import Path
from typing import Any

import nbclient
import nbformat

NOTEBOOK = Path(__file__).parents[2] / "examples" / "notebook" / "compare_methods.ipynb"
PLAYER = "<iframe"


def main() -> None:
    """Replaces the notebook by an executed one."""
    formats: Any = nbformat  # has incomplete types
    notebook = formats.read(NOTEBOOK, 4)
    with tempfile.TemporaryDirectory() as folder:
        nbclient.execute(notebook, folder, timeout=120, kernel_name="python3", record_timing=False)
    for cell in notebook.cells:
        for output in cell.get("outputs", []):
            shown = output.get("data", {})
            if PLAYER in shown.get("text/html", ""):
                del shown["text/html"]
            if "image/jpeg" in shown:  # the smaller one of two
                del shown["image/png"]
    notebook.metadata = {name: notebook.metadata[name] for name in ("kernelspec", "language_info")}
    formats.write(notebook, NOTEBOOK)


if __name__ == "__main__":
    main()
