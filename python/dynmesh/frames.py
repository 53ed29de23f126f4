"""Frames of a mesh: what all of them share, one of them, and those that can be gone through.

A :class:`Header` is what all frames share, a :class:`Frame` one of them. :class:`Stored` frames,
those of a file or of a :class:`dynmesh.Sequence`, can be read in any order and as often as one
likes, those of a :class:`Run` once, while they are made.
"""

from .frame import Frame, Frames
from .header import Header, Origin
from .run import Kept, Run
from .stored import FileFrames, Stored

__all__ = ["FileFrames", "Frame", "Frames", "Header", "Kept", "Origin", "Run", "Stored"]
