"""A completer that another thread watches, as a tracker may be, too."""

import threading
from typing import Any

import numpy as np
from meshes import bumpy_torus

import dynmesh


def test_a_monitor_reads_reports_while_frames_run() -> None:
    """Every read succeeds and is of one frame, also while the sequence is replaced."""
    torus = bumpy_torus(40)
    subject = dynmesh.Completer(torus.faces, torus.vertices)
    known = np.random.default_rng(0).random(len(torus.vertices)) < 0.1
    subject.push(torus.vertices, known)
    state = subject.state()
    is_busy, is_over = threading.Event(), threading.Event()
    reads: list[Any] = []
    wrong: list[object] = []

    def watch() -> None:
        while not is_over.is_set():
            was_busy = is_busy.is_set()
            try:
                report, n_frames, topology = subject.report, subject.n_frames, subject.topology
                shown = repr(subject)
            except RuntimeError as error:
                wrong.append(error)
                continue
            n_vertices = report.known + report.filled + report.disconnected
            is_whole = n_vertices == subject.n_vertices and f"({n_vertices} " in shown
            is_whole &= (report.quality == "good") == (report.reason == "")
            if not is_whole or topology.components != 1:
                wrong.append(report)
            if was_busy and is_busy.is_set():
                reads.append(n_frames)

    monitor = threading.Thread(target=watch)
    monitor.start()
    while len(reads) < 50 and not wrong:
        is_busy.set()
        subject.push(torus.vertices, known)
        subject.push(torus.vertices, known)
        subject.restore(state)
        subject.reset(torus.vertices)
        is_busy.clear()
    is_over.set()
    monitor.join()
    assert wrong == []
    assert set(reads) <= {0, 1, 2, 3}
