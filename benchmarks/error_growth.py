"""Prints how fast a tiny error grows or fades in the recursion from frame to frame, as a table.

    python -m benchmarks.error_growth [--known SHARE ...]

The built-in walker is completed twice, the second time disturbed in one frame by a micrometre;
shown is the factor by which the difference grows in a frame. Vertices are known at random.
"""

import numpy as np

import dynmesh
from dynmesh.sequence import Positions
from dynmesh.settings import Settings
from dynmesh.study.tables import Line

from .harness import Table, parser, progress, show

SHARES = (0.02, 0.05, 0.1, 0.2, 0.3, 0.5)
WAYS: dict[str, Settings] = {
    "once only": {"method": "motion", "revisit": False},
    "re-estimated": {"method": "motion"},
    "10 extra": {"method": "motion", "extra_iterations": 10},
}
WATCHED = 40  # frames after the disturbed one
SETTLING = 10  # of them are left out


def growth(sequence: dynmesh.Sequence, share: float, settings: Settings) -> float:
    """Return the factor from frame to frame, where the last frames of a sequence are watched."""
    truth: Positions = sequence.vertices.astype(np.float64)
    n_frames, n_vertices, _ = truth.shape
    completer = dynmesh.Completer(sequence.faces, truth[0], **settings)
    distances = []
    for number, known in enumerate(dynmesh.degrade.random_known(n_frames, n_vertices, share)):
        frame = completer.push(truth[number], known)
        if number == n_frames - 1 - WATCHED:
            noise = 1e-6 * np.random.default_rng(0).standard_normal(frame.shape)
            disturbed = dynmesh.Completer(sequence.faces, frame + noise, **settings)
        elif number > n_frames - 1 - WATCHED:
            distances.append(np.linalg.norm(disturbed.push(truth[number], known) - frame))
    ratio = distances[-1] / distances[SETTLING - 1]
    return float(ratio ** (1 / (WATCHED - SETTLING)))


def main() -> None:
    """Measure, and print the table."""
    arguments = parser(__doc__, folder=False, known=SHARES).parse_args()
    walker = dynmesh.synth.walker()
    still = np.repeat(walker.vertices[:1], WATCHED + 1, axis=0)
    sequences = {
        "still": dynmesh.Sequence(still, walker.faces),
        "walking": dynmesh.Sequence(walker.vertices[:121], walker.faces),
    }
    lines: list[Line] = [("known", *(f"{name}, {way}" for name in sequences for way in WAYS))]
    for share in progress(arguments.known, "measuring"):
        factors = [growth(s, share, way) for s in sequences.values() for way in WAYS.values()]
        lines.append((f"{share:.0%}", *(f"{factor:.2f}" for factor in factors)))
    show(arguments, Table("error-growth", lines))


if __name__ == "__main__":
    main()
