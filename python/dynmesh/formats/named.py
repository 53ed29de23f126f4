"""The arrays of a sequence by name, as in dynmesh's own archives and in HDF5 files.

`vertices` and the attributes of vertices have one row per frame; all others exist once.
"""

from collections.abc import Callable, Collection
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._errors import InputError
from ..frame import Frame
from ..header import ATTRIBUTES, Header, check_faces, check_needed, check_vertices
from ..polygons import Polygons

per_frame = ("vertices", *ATTRIBUTES)
single = ("fps", "up_axis", "name", "start", "metres_per_unit", "standard_error_of")
once = ("faces", "polygon_sizes", "polygon_corners", "times", *single)


def header_of(
    names: Collection[str],
    kind_of: Callable[[str], tuple[tuple[int, ...], np.dtype[Any]]],
    array_of: Callable[[str], NDArray[Any]],
) -> Header:
    """Reads the header of a file with arrays of these names.

    `kind_of` returns the shape and the dtype of an array, and `array_of` one without a row per
    frame.
    """
    for needed in ("vertices", "faces"):
        if needed not in names:
            raise InputError(
                f"has no array '{needed}': a sequence holds vertices, faces and, "
                f"optionally, known and fps; this file holds {', '.join(sorted(names)) or 'none'}"
            )
    if ("polygon_sizes" in names) != ("polygon_corners" in names):
        raise InputError("polygon_sizes, polygon_corners: must be given both or neither")
    own = [name for name in ATTRIBUTES if name in names]
    check_needed(own)
    shape, dtype = kind_of("vertices")
    check_vertices(dtype, shape)
    faces = array_of("faces")
    if "polygon_sizes" in names:  # which tell what was cut into these triangles
        check_faces(faces.dtype, faces.shape)
    for name, row in ATTRIBUTES.items():
        if name in names:
            own_shape, own_dtype = kind_of(name)
            row.check(own_dtype, own_shape, shape[:2])

    values: dict[str, Any] = {name: array_of(name) for name in ("times", *single) if name in names}
    for name, array in values.items():
        is_number, is_single = array.dtype.kind in "fiu", name != "times"
        if name in ("up_axis", "name", "standard_error_of"):
            values[name] = str(array)
        elif is_number and (not is_single or array.size == 1):
            values[name] = array.item() if is_single else array.astype(np.float64)
        else:
            what = "one number" if is_single else "numbers"
            kind = f"{array.dtype} of shape {array.shape}"
            raise InputError(f"must be {what}, not {kind}", argument=name)
    if "polygon_sizes" in names:
        values["polygons"] = Polygons(array_of("polygon_sizes"), array_of("polygon_corners"))
    n_frames, n_vertices, _ = shape
    dtype = dtype.newbyteorder("=")
    return Header(faces, n_frames, n_vertices, dtype, **values, attributes=own)


def kinds_per_frame(header: Header) -> dict[str, tuple[tuple[int, ...], np.dtype[Any]]]:
    """Returns the shape and the dtype of each array with one row per frame."""
    shape = (header.n_frames, header.n_vertices)
    attributes = {name: (shape, ATTRIBUTES[name].dtype) for name in header.attributes}
    return {"vertices": ((*shape, 3), header.dtype), **attributes}


def rows_of(frame: Frame) -> dict[str, NDArray[Any]]:
    """Returns the row that the frame adds to each of these arrays."""
    attributes = frame.attributes().items()
    return {
        "vertices": frame.points,
        **{name: values.astype(ATTRIBUTES[name].dtype) for name, values in attributes},
    }


def arrays_once(header: Header) -> dict[str, Any]:
    """Returns the arrays that exist once."""
    arrays = {"faces": header.faces, **header.stated}
    if polygons := arrays.pop("polygons", None):
        arrays["polygon_sizes"], arrays["polygon_corners"] = polygons
    return arrays
