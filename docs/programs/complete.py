"""Completes a frame through the C interface, without the Python package."""

import ctypes
from ctypes import byref, c_int32, c_int64, c_void_p


class Points(ctypes.Structure):
    """`dynmesh_points` and `dynmesh_output`."""

    _fields_ = [
        ("data", c_void_p),
        ("count", c_int64),
        ("row_stride", c_int64),
        ("column_stride", c_int64),
        ("type", c_int32),
    ]


dynmesh = ctypes.CDLL("libdynmesh.so.0.1")
dynmesh.dynmesh_last_message.restype = ctypes.c_char_p

faces = (c_int32 * 6)(0, 1, 2, 2, 1, 3)
frame = (ctypes.c_float * 12)(0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0)
points = Points(ctypes.addressof(frame), 4, 3, 1, 32)
completer = c_void_p()
assert dynmesh.dynmesh_create(faces, c_int64(2), byref(points), None, byref(completer)) == 0
frame[:9] = [float("nan")] * 9
frame[11] = 5
assert dynmesh.dynmesh_push(completer, byref(points), None, byref(points), None) == 0
print(f"vertex 0 is at height {frame[2]:g}")
assert dynmesh.dynmesh_skip(completer, None, None) == 1
print(dynmesh.dynmesh_last_message().decode())
dynmesh.dynmesh_destroy(completer)
