"""Writing a figure."""

from pathlib import Path

from matplotlib.figure import Figure

from dynmesh.study import style


def save_png(figure: Figure, folder: Path, name: str, *, is_chart: bool) -> None:
    """Writes NAME.png, without the SVG that the evaluation writes beside it."""
    folder.mkdir(parents=True, exist_ok=True)
    style.save_png(figure, folder / f"{name}.png", is_chart=is_chart)
