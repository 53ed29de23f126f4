"""Changes single bytes of files, one after another, and checks what comes of each change.

A test has a folder of sound files and a function that uses them. Each byte is changed once, in a
fresh copy of the folder. The function must then refuse its input with a sentence that names the
damaged file, or return what it returns for the sound files.
"""

import os
import random
import shutil
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

from conftest import LONGER

PLACES = 40
"""How many bytes of each file are changed in the ordinary tests; script/fuzz changes all."""


def places_in(size: int, generator: random.Random, most: int = PLACES) -> Iterable[int]:
    """The places of the bytes that are changed: all, or a sample with both ends of the file."""
    if LONGER > 1 or size <= most:
        return range(size)
    return sorted({0, size - 1, *generator.sample(range(size), most - 2)})


def change_byte(file: Path, place: int, by: int) -> None:
    """Changes the bits `by` of one byte, as a faulty disk does: the file's times stay."""
    before = file.stat()
    with file.open("r+b") as opened:
        opened.seek(place)
        (byte,) = opened.read(1)
        opened.seek(place)
        opened.write(bytes([byte ^ by]))
    os.utime(file, ns=(before.st_atime_ns, before.st_mtime_ns))


def check_damage(
    sound: Path,
    use: Callable[[Path], Any],
    *,
    work: Path,
    victims: Iterable[Path] | None = None,
    afterwards: Callable[[Path], Any] | None = None,
    same: Callable[[Any, Any], bool] = lambda one, other: bool(one == other),
    most: int = PLACES,
    names: Callable[[Path], object] = lambda victim: victim,
) -> Counter[str]:
    """Damages the files of a folder byte by byte, and checks what is made of each.

    Args:
        sound: the folder, which stays as it is.
        use: uses a copy of the folder and returns a result.
        work: where the copies are made; it must not exist.
        victims: the files to damage, relative to the folder; None means all.
        afterwards: is called with the copy after a refusal and must return what `use` returns for
            sound files.
        same: compares two results.
        most: how many bytes of each file to change in the ordinary tests.
        names: what a refusal must name, given the damaged file.

    Returns:
        How many damages were "refused" and how many had the "same" result.
    """
    outcomes: Counter[str] = Counter()
    wrong = []
    shutil.copytree(sound, work, symlinks=True)
    wanted = use(work)
    for victim, place, by in _changes(sound, victims, most):
        shutil.rmtree(work)
        shutil.copytree(sound, work, symlinks=True)
        change_byte(work / victim, place, by)
        outcome = _outcome(use, work, names(work / victim), wanted, same)
        if outcome == "refused" and afterwards is not None:
            try:
                if not same(afterwards(work), wanted):
                    outcome = "was refused, then gave another result"
            except Exception as error:  # whatever it is, a test must say where
                outcome = f"was refused, and afterwards: {type(error).__name__}: {error}"
        outcomes[outcome] += 1
        if outcome not in ("refused", "same"):
            wrong.append(f"{victim}, byte {place} changed by {by:#04x}: {outcome}")
    shutil.rmtree(work)
    assert not wrong, f"{len(wrong)} of {outcomes.total()} damages:\n" + "\n".join(wrong[:20])
    return outcomes


def _changes(
    sound: Path, victims: Iterable[Path] | None, most: int
) -> Iterator[tuple[Path, int, int]]:
    if victims is None:
        victims = (file.relative_to(sound) for file in sound.rglob("*") if file.is_file())
    for victim in sorted(victims):
        generator = random.Random(str(victim))
        for place in places_in((sound / victim).stat().st_size, generator, most):
            yield victim, place, generator.choice((1 << generator.randrange(8), 0xFF))


def _outcome(
    use: Callable[[Path], Any],
    work: Path,
    name: object,
    wanted: Any,
    same: Callable[[Any, Any], bool],
) -> str:
    try:
        result = use(work)
    except (ValueError, OSError) as error:  # with DynmeshError, what the command prints as a line
        told = str(error)
        return "refused" if str(name) in told else f"the file is not named: {told}"
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    return "same" if same(result, wanted) else "gave another result"
