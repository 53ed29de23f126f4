"""Completes a sequence file frame by frame and reports the counts of each frame.

    python complete_file.py partial.npz completed.npz

Does the same as `dynmesh complete`, as a starting point for programs that process each frame.
"""

import sys

import dynmesh


def main(source: str, target: str) -> None:
    """Reads, completes and writes one frame at a time."""
    with dynmesh.open(source) as reader, dynmesh.create_like(reader, target) as writer:
        frames = iter(reader)
        first = next(frames).points
        writer.append(first)
        completer = dynmesh.Completer(reader.faces, first)
        for number, (points, known) in enumerate(frames, start=1):
            writer.append(completer.push(points, known))
            report = completer.report
            print(
                f"frame {number}: {report.known} known, "
                f"{report.filled + report.disconnected} filled in"
            )


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit("usage: python complete_file.py partial.npz completed.npz")
    main(*sys.argv[1:])
