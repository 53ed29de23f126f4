"""The picture of the findings."""

from pathlib import Path

import numpy as np
import pytest
from broken_sequences import BROKEN, flipped_faces, leaps, moving
from commands import dynmesh_command as run
from meshes import Array, sheet

import dynmesh
from dynmesh import Sequence
from dynmesh.diagnosis.picture import COLOURS, draw


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Array:
    """The picture of a sequence without findings."""
    pytest.importorskip("pyvista")
    return TestPicture.pixels(moving(sheet(12)), tmp_path_factory.mktemp("sound"))


class TestPicture:
    """Draws with `draw` and with `dynmesh info --picture`."""

    @pytest.fixture(autouse=True)
    def _needs_pyvista(self) -> None:
        pytest.importorskip("pyvista", reason="pictures need pyvista: pip install 'dynmesh[view]'")

    @staticmethod
    def pixels(sequence: Sequence, folder: Path) -> Array:
        """Returns the pixels (height, width, 3) of a picture."""
        draw(dynmesh.diagnose(sequence), folder / "a.png", heading="a", size=300)
        return TestPicture.read(folder / "a.png")

    @staticmethod
    def read(picture: Path) -> Array:
        """Reads the pixels of a picture."""
        from PIL import Image

        with Image.open(picture) as image:
            assert image.format == "PNG"
            return np.asarray(image.convert("RGB")).astype(int)

    @staticmethod
    def on_mesh(image: Array, colour: str) -> int:
        """Counts the pixels with this hue, shaded or not, in the views of the mesh."""
        height, width, _ = image.shape
        sides = image[: height // 2, : int(0.68 * width)] / 255
        wanted = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255
        saturated = np.ptp(sides, axis=2) > 0.2
        cosine = (sides @ wanted) / (np.linalg.norm(sides, axis=2) + 1e-9) / np.linalg.norm(wanted)
        return int((saturated & (cosine > 0.98)).sum())

    def test_what_is_odd_has_a_colour(self, sound: Array, tmp_path: Path) -> None:
        sequence, _ = BROKEN["isolated_vertices"]()
        assert self.on_mesh(self.pixels(sequence, tmp_path), COLOURS[0]) > 15
        assert self.on_mesh(sound, COLOURS[0]) == 0

    def test_every_finding_can_be_drawn(self, tmp_path: Path) -> None:
        assert np.ptp(self.pixels(BROKEN["known_not_finite"]()[0], tmp_path)) > 200
        for points in (np.full((3, 4, 3), np.nan), np.zeros((1, 4, 3))):
            assert np.ptp(self.pixels(Sequence(points, np.array([[0, 1, 2]])), tmp_path)) > 200

    def test_leaps_are_marked_along_the_frames(self, sound: Array, tmp_path: Path) -> None:
        marked = self.pixels(leaps()[0], tmp_path)
        strips = [image[-150:, : int(0.8 * image.shape[1])] for image in (marked, sound)]
        red = [((s[..., 0] > 180) & (s[..., 1] < 90) & (s[..., 2] < 60)).sum() for s in strips]
        assert red[0] > 40
        assert red[1] == 0

    def test_the_command_draws_it(self, tmp_path: Path) -> None:
        path, png = tmp_path / "a.npz", tmp_path / "a.png"
        dynmesh.write(path, flipped_faces()[0])
        assert f"{png}: drawn" in run("info", path, "--picture", png).stderr
        assert self.on_mesh(self.read(png), COLOURS[0]) > 15
        assert "--overwrite" in run("info", path, "--picture", png, code=1).stderr
