"""Files that were damaged."""

import random
import re

WORDS = (b"nan", b"-1", b"1e999", b"word", b"9" * 30, b"null", b"[]", b"{}", b"\xff\xfe", b'"')


def damaged(content: bytes, generator: random.Random) -> bytes:
    """Changes bytes, leaves out or inserts some, cuts the end off, or replaces a word."""
    words = [*re.finditer(rb"[-+\w.]+", content[:2000])]
    change = generator.randrange(5)
    at = generator.randrange(min(len(content), generator.choice((300, len(content)))))
    if change == 0:
        return content[:at] + bytes([generator.randrange(256)]) + content[at + 1 :]
    if change == 1:
        return content[:at]
    if change == 2:
        return content[:at] + generator.randbytes(generator.choice((1, 9))) + content[at:]
    if change == 3 or not words:
        return content[:at] + content[at + generator.choice((1, 9)) :]
    word = generator.choice(words)
    return content[: word.start()] + generator.choice(WORDS) + content[word.end() :]
