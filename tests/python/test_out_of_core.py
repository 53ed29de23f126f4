"""Sequences that do not fit into memory."""

import resource
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from meshes import sheet

import dynmesh
from dynmesh import files

MEGABYTE = 1_000_000


@pytest.mark.large
def test_a_gigabyte_is_completed_in_a_quarter_of_it(tmp_path: Path) -> None:
    if shutil.disk_usage(tmp_path).free < 3000 * MEGABYTE:
        pytest.skip("needs 3 GB of disk")
    mesh = sheet(300)  # 90 000 vertices, 1.08 MB a frame
    first = mesh.vertices.astype(np.float32)
    n_frames = 950
    source, target = tmp_path / "in.h5", tmp_path / "out.h5"
    rng = np.random.default_rng(0)
    masks = rng.random((10, len(first))) < 0.7
    header = dynmesh.Header(mesh.faces, n_frames, len(first), first.dtype, has_known=True)
    with files.create(source, header) as writer:
        for i in range(n_frames):
            known = masks[i % 10] if i else np.ones(len(first), np.bool_)
            points = first + np.float32(0.001 * i)
            points[~known] = np.nan
            writer.append(points, known)
    assert source.stat().st_size > 1000 * MEGABYTE

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_AS, (250 * MEGABYTE, 250 * MEGABYTE))

    # The factor of method detail alone would take more, and so long.
    command = [sys.executable, "-m", "dynmesh", "complete", str(source), str(target)]
    command += ["--method", "motion"]
    environment = {"OPENBLAS_NUM_THREADS": "1", "PATH": "/usr/bin:/bin"}
    subprocess.run(command, preexec_fn=limit, check=True, env=environment)
    with dynmesh.open(target) as reader:
        for number in (0, 1, n_frames // 2, n_frames - 1):
            (frame,) = reader.frames(number, number + 1)
            # A translated mesh is completed exactly, except for rounding.
            np.testing.assert_allclose(frame.points, first + np.float32(0.001 * number), atol=1e-3)
