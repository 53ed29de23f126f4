"""The time and error of detail after training, beside detail and libigl."""

from collections.abc import Iterator

import numpy as np

from dynmesh.study.baselines import BIHARMONIC
from dynmesh.study.completion import Completion
from dynmesh.study.losses import losses
from dynmesh.study.measure import nmsve, timed
from dynmesh.study.methods import DETAIL, MOTION, trained
from dynmesh.study.tables import Line, bold_below_one, markdown, mean, median, number
from dynmesh.study.training_study import TRAINED, halves

from .comparison import Measurement, no_collection
from .plan import SpeedPlan
from .scenes import Scene

_LABELS = {
    MOTION.key: MOTION.label,
    BIHARMONIC.key: BIHARMONIC.label,
    TRAINED: "detail, trained",
}


def measure(scene: Scene, plan: SpeedPlan, missing: dict[str, str]) -> Iterator[Measurement]:
    """Complete the second half of a scene after training of the first.

    All methods complete each frame before the next frame begins, so that a disturbance affects all
    of them. If the scene has too few frames for a training sequence, nothing is measured.
    """
    if (parts := halves(scene.subject)) is None:
        missing["training"] = f"{scene.name} has too few frames"
        return
    training_frames, half = parts
    methods = [DETAIL, trained(TRAINED, _LABELS[TRAINED], training_frames), MOTION]
    completions: dict[str, Completion] = {}
    for method in (*methods, BIHARMONIC):
        try:
            completions[method.key] = method.begin(half.faces, half.vertices[0])
        except ImportError as error:
            missing[method.label] = str(error)
    for loss, masks in losses(half, plan.shares).items():
        known = np.stack(masks)
        about = "training", scene.name, scene.numbering, loss
        rows = {
            key: Measurement(*about, key, half.n_vertices, float(known[1:].mean()), 0.0)
            for key in completions
        }
        for completion in completions.values():
            completion.reset()
        for n in range(1, min(half.n_frames, plan.slow_frames + 1)):
            for key, completion in completions.items():
                with no_collection():
                    completed, seconds = timed(completion, half.vertices[n], known[n])
                rows[key].seconds.append(seconds)
                frame = completed.astype(np.float32)
                rows[key].nmsve.append(float(nmsve(half, [n], [frame])[0]))
        yield from rows.values()


def table(rows: list[Measurement]) -> str:
    """Tabulate times and errors relative to detail, errors in bold if they are smaller."""
    masks = list(dict.fromkeys(row.mask for row in rows))
    times = {(row.method, row.mask): median(row.seconds) for row in rows}
    errors = {(row.method, row.mask): mean(row.nmsve) for row in rows}
    first = rows[0]
    lines: list[Line] = [(f"second half of {first.scene}, {first.n_vertices} vertices", *masks)]
    for key in (TRAINED, BIHARMONIC.key, MOTION.key):
        if not any(row.method == key for row in rows):
            continue
        label = f"{_LABELS[key]}, times detail"
        slower = [number(times[key, mask] / times[DETAIL.key, mask]) for mask in masks]
        worse = [bold_below_one(errors[key, mask] / errors[DETAIL.key, mask]) for mask in masks]
        lines += [(f"time of {label}", *slower), (f"NMSVE of {label}", *worse)]
    return markdown(lines)
