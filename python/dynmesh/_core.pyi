# Calls of the C++ interface. Arrays are packed, of the dtype that is stated, or of float32 or
# float64 in one call alike; users see the modules beside this.
# Arrays named last are written to.
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

__version__: str

_Doubles = NDArray[np.floating[Any]]  # float64
_Flags = NDArray[np.uint8]
_Indices = NDArray[np.int32]
_Positions = NDArray[np.floating[Any]]

def default_settings() -> dict[str, Any]: ...
def default_tracker_settings() -> dict[str, Any]: ...
def training(first_frame: _Positions) -> Any: ...
def completer(
    faces: _Indices, first_frame: _Positions, settings: dict[str, Any], training: Any
) -> Any: ...
def tracker(
    faces: _Indices, first_frame: _Positions, settings: dict[str, Any], training: Any
) -> Any: ...
def cells(faces: _Indices, n_vertices: int) -> tuple[_Indices, _Indices]: ...
def nmsve(faces: _Indices, reference: _Doubles, completed: _Doubles, errors: _Doubles) -> None: ...
def vertex_error(reference: _Doubles, completed: _Doubles, errors: _Doubles) -> None: ...
def least_squares_mesh(faces: _Indices, n_vertices: int) -> Any: ...
def laplacian_interpolation(
    faces: _Indices, n_vertices: int, objective: str, weights: str, reference: _Doubles | None
) -> Any: ...
def quality_of_frames(frames: list[str]) -> Literal["good", "doubtful", "ruined"]: ...
def is_hardly_known(known: int, n_vertices: int) -> bool: ...
def falling_sight(seen: list[float]) -> int: ...

# Limits of quality, which stand in the core.
ruined_far: float
large_hole: float
other_size: float

other_unit: float

# The motion (4, 4), the mean edge, places of the surface and some of the points.
def align_rigidly(
    faces: _Indices, first_frame: _Doubles, scan: _Doubles
) -> tuple[NDArray[np.float64], float, NDArray[np.float64], NDArray[np.float64]]: ...

# The scan is points, normals and viewpoints, or a list of depth images with their cameras.
def register(
    faces: _Indices, template: _Positions, scan: Any, *choices: Any
) -> tuple[_Positions, _Flags, _Positions, dict[str, Any]]: ...

# None if the word is not a number; otherwise as in all text files, NaN and infinity included.
def parse_number(word: str) -> float | None: ...

# The content of files: positions, the numbers of corners of faces and all corners; of OBJ, also
# comments, the keywords of other lines, and whether vertices have colours; of PLY, the properties
# of the records of each element, of lists their lengths and all values, and comments.
def parse_obj(
    data: bytes,
) -> tuple[
    NDArray[np.float64], NDArray[np.int64], NDArray[np.int64], list[str], list[str], bool
]: ...
def parse_ply(
    data: bytes,
) -> tuple[
    dict[str, dict[str, NDArray[Any] | tuple[NDArray[np.int64], NDArray[Any]]]], list[str]
]: ...
