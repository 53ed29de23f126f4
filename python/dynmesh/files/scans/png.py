"""The parts of a PNG file that hold the image, with their checksums verified.

Libraries for images skip the checksums of image data, so that a flipped bit becomes other depths,
and stumble over chunks that say nothing about depths, such as profiles of colours.
"""

import struct
import zlib
from collections.abc import Iterator
from typing import NamedTuple

SIGNATURE = b"\x89PNG\r\n\x1a\n"

HEADER_SIZE = len(SIGNATURE) + 4 + 4 + 13 + 4

_DAMAGED = "is a PNG image that is cut or damaged"
_PASSES = (
    (8, 8, 0, 0),
    (8, 8, 4, 0),
    (4, 8, 0, 4),
    (4, 4, 2, 0),
    (2, 4, 0, 2),
    (2, 2, 1, 0),
    (1, 2, 0, 1),
)
"""Of an interlaced image: the steps to the right and down, and the column and row of the first."""


class PngHeader(NamedTuple):
    """What the first chunk states, in its order."""

    width: int
    height: int
    bits: int
    channels: int
    compression: int
    filters: int
    interlaced: int

    @property
    def n_bytes(self) -> int:
        """Number of bytes of an image of one channel of 16 bits.

        Each row of each pass begins with the number of its filter.
        """
        total = 0
        for right, down, column, row in _PASSES if self.interlaced else ((1, 1, 0, 0),):
            width = -((column - self.width) // right)
            height = -((row - self.height) // down)
            total += height * (1 + 2 * width) if width > 0 and height > 0 else 0
        return total


def read_header(beginning: bytes) -> PngHeader:
    """Reads the header from the first `HEADER_SIZE` bytes of a file.

    Raises:
        ValueError: it is cut or damaged.
    """
    kind, content = next(_chunks(beginning))
    if kind != b"IHDR" or len(content) != 13:
        raise ValueError(f"{_DAMAGED}: it begins with chunk {kind!r} of {len(content)} bytes")
    return PngHeader._make(struct.unpack(">IIBBBBB", content))


def sound_image(content: bytes, header: PngHeader) -> bytes:
    """Returns a file with the same image of one channel of 16 bits and nothing else.

    Its data are not compressed, as they are decompressed here already, to verify them.

    Raises:
        ValueError: the file is cut or damaged.
    """
    compressed = b"".join(part for kind, part in _chunks(content) if kind == b"IDAT")
    inflating = zlib.decompressobj()
    try:
        # One byte more than there should be: otherwise the checksum at the end would not be read.
        rows = inflating.decompress(compressed, header.n_bytes + 1)
    except zlib.error as error:
        raise ValueError(f"{_DAMAGED}: its image data cannot be decompressed: {error}") from error
    if len(rows) != header.n_bytes or not inflating.eof:
        end = "go on" if len(rows) > header.n_bytes else f"end after {len(rows)}"
        raise ValueError(
            f"{_DAMAGED}: its image data should be {header.n_bytes} bytes for {header.width} x "
            f"{header.height} pixels, but {end}"
        )
    return content[:HEADER_SIZE] + _chunk(b"IDAT", zlib.compress(rows, 0)) + _chunk(b"IEND", b"")


def _chunks(content: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Yields the kind and the content of each chunk, up to the one that ends the image."""
    place, kind = len(SIGNATURE), b""
    while kind != b"IEND":
        length, kind = struct.unpack_from(">I4s", content.ljust(place + 8, b"\0"), place)
        end = place + 8 + length
        if end + 4 > len(content):
            raise ValueError(f"{_DAMAGED}; it has {len(content)} bytes")
        (checksum,) = struct.unpack_from(">I", content, end)
        if zlib.crc32(content[place + 4 : end]) != checksum:
            raise ValueError(f"{_DAMAGED}: the checksum of chunk {kind!r} at byte {place} is wrong")
        yield kind, content[place + 8 : end]
        place = end + 4


def _chunk(kind: bytes, content: bytes) -> bytes:
    checked = kind + content
    return struct.pack(">I", len(content)) + checked + struct.pack(">I", zlib.crc32(checked))
