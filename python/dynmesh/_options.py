"""Headings under which the help of a command lists the options of a function.

They are around the types of its parameters: see :class:`dynmesh.cli.command.Command`.
"""

from typing import Annotated, TypeAlias, TypeVar

T = TypeVar("T")

Input: TypeAlias = Annotated[T, "input"]
Method: TypeAlias = Annotated[T, "method"]
Output: TypeAlias = Annotated[T, "output"]
