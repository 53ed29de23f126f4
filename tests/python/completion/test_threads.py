"""Completers and trackers that another thread watches."""

import threading
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from meshes import bumpy_torus
from scans_of_meshes import torus_scan

import dynmesh

TORUS = bumpy_torus(40)


def completer() -> tuple[Any, Callable[[], object]]:
    made = dynmesh.Completer(TORUS.faces, TORUS.vertices)
    known = np.random.default_rng(0).random(len(TORUS.vertices)) < 0.1
    return made, lambda: made.push(TORUS.vertices, known)


def tracker() -> tuple[Any, Callable[[], object]]:
    made = dynmesh.Tracker(TORUS.faces, TORUS.vertices)
    scan = torus_scan(TORUS, TORUS.vertices)
    return made, lambda: made.push(*scan)


@pytest.mark.parametrize("make", [completer, tracker])
def test_a_monitor_reads_reports_while_frames_run(
    make: Callable[[], tuple[Any, Callable[[], object]]],
) -> None:
    """Every read succeeds and is of one frame, also while the sequence is replaced."""
    subject, push = make()
    push()
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
    changes = (push, push, lambda: subject.restore(state), lambda: subject.reset(TORUS.vertices))
    while len(reads) < 50 and not wrong:
        for change in changes:
            is_busy.set()
            change()
            is_busy.clear()
    is_over.set()
    monitor.join()
    assert wrong == []
    assert set(reads) <= {0, 1, 2, 3}
