"""Writing a figure."""

from pathlib import Path
from tempfile import TemporaryDirectory

from matplotlib.figure import Figure

from dynmesh.study.style import save


def save_png(figure: Figure, folder: Path, name: str, *, is_chart: bool) -> None:
    """Writes NAME.png alone."""
    folder.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory() as scratch:
        made = save(figure, Path(scratch), name, is_chart=is_chart)
        (folder / made.name).write_bytes(made.read_bytes())
