"""Short runs of script/soak and script/kill-test, and checks that they find faults."""

import importlib
import re
import subprocess
import sys
from typing import Any

import numpy as np
import pytest
from conftest import REPOSITORY

import dynmesh

ENDURANCE = REPOSITORY / "tests" / "endurance"


def run(script: str, *arguments: str) -> str:
    command = [sys.executable, str(ENDURANCE / script), *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_a_short_soak() -> None:
    shown = run("soak.py", "--frames", "6000")
    assert "6000 frames in" in shown
    pieces = re.findall(r"threads: other threads did (\d+) pieces", shown)
    assert len(pieces) == 2
    assert min(map(int, pieces)) > 500
    assert shown.endswith("\n0 violations\n")


class Faulty:
    """A completer with a deliberate fault."""

    def __init__(self, completer: dynmesh.Completer, fault: str) -> None:
        self._completer, self._fault = completer, fault

    def __getattr__(self, name: str) -> Any:
        return getattr(self._completer, name)

    def push(self, points: Any, known: Any = None, out: Any = None) -> Any:
        if self._fault == "takes anything":
            try:
                return self._completer.push(points, known, out=out)
            except ValueError:
                return self._completer.skip()
        try:
            completed = self._completer.push(points, known, out=out)
        except ValueError as error:
            if self._fault == "moves on when it refuses":
                self._completer.skip()
            if self._fault == "says something else":
                raise ValueError("no") from error
            raise
        if self._fault == "moves anchors":
            completed += 1e-3
        if self._fault == "leaves a NaN":
            completed[-1] = np.nan
        return completed

    def restore(self, state: bytes) -> None:
        self._completer.restore(state)
        if self._fault == "restores something else":
            self._completer.reset(self._completer.skip() + 1)


@pytest.mark.parametrize(
    ("fault", "what"),
    [
        ("none", ""),
        ("moves anchors", "an anchor was moved"),
        ("leaves a NaN", "not finite"),
        ("takes anything", "was not refused"),
        ("moves on when it refuses", "changed what it refused"),
        ("says something else", "raised ValueError: no"),
        ("restores something else", "made the next frame differently"),
    ],
)
def test_a_soak_finds_faults(fault: str, what: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(ENDURANCE))
    stations = importlib.import_module("stations")
    sea = dynmesh.synth.ocean(8, grid=6)

    class Station(stations.Station):  # type: ignore[misc, name-defined]
        def _new(self) -> Any:
            return Faulty(super()._new(), fault)

    station = Station("faulty", sea.vertices, sea.faces, seed=1)
    for number in range(1500):
        station.step(number / 1500)
    assert bool(station.violations) == (fault != "none")
    assert any(what in violation for violation in station.violations) == (fault != "none")


class FaultyTracker:
    """A tracker with a deliberate fault."""

    def __init__(self, tracker: dynmesh.Tracker, fault: str) -> None:
        self._tracker, self._fault = tracker, fault

    def __getattr__(self, name: str) -> Any:
        return getattr(self._tracker, name)

    @property
    def observed(self) -> Any:
        observed = self._tracker.observed
        return ~observed if self._fault == "observes others" else observed

    def push(self, points: Any, normals: Any = None, **options: Any) -> Any:
        if self._fault == "sees things" and not len(points):
            points, normals = self._tracker.skip(), None
        try:
            tracked = self._tracker.push(points, normals, **options)
        except ValueError:
            if self._fault == "takes anything":
                return self._tracker.skip()
            if self._fault == "moves on when it refuses":
                self._tracker.skip()
            raise
        if self._fault == "loses the surface":
            tracked += 5
        if self._fault == "leaves a NaN":
            tracked[-1] = np.nan
        return tracked

    def restore(self, state: bytes) -> None:
        self._tracker.restore(state)
        if self._fault == "restores something else":
            self._tracker.reset(self._tracker.skip() + 1e-3)


@pytest.mark.parametrize(
    ("fault", "what"),
    [
        ("none", ""),
        ("observes others", "but observed others"),
        ("sees things", "were observed in nothing"),
        ("loses the surface", "did not find the surface"),
        ("leaves a NaN", "not finite"),
        ("takes anything", "was not refused"),
        ("moves on when it refuses", "changed what it refused"),
        ("restores something else", "made the next frame differently"),
    ],
)
def test_a_soak_finds_faults_of_a_tracker(
    fault: str, what: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(str(ENDURANCE))
    soak = importlib.import_module("soak")
    sea = dynmesh.synth.ocean(8, grid=8)

    class Station(soak.ScanStation):  # type: ignore[misc, name-defined]
        def _new(self) -> Any:
            return FaultyTracker(super()._new(), fault)

    station = Station("faulty", sea.vertices, sea.faces, seed=1)
    for number in range(1000):
        station.step(number / 1000)
    violations = station.violations + soak.lost([station])
    assert bool(violations) == (fault != "none"), violations[:3]
    assert any(what in violation for violation in violations) == (fault != "none")


def test_a_soak_finds_that_threads_share_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(ENDURANCE))
    soak = importlib.import_module("soak")
    sea = dynmesh.synth.ocean(8, grid=6)
    station = soak.Station("small", sea.vertices, sea.faces, seed=1, threads=2)
    for number in range(100):
        station.step(number / 100)
    assert soak.not_shared([station]) == ["small: no other thread did a piece of the work"]


def test_jobs_killed_at_random_lose_nothing() -> None:
    assert run("kills.py", "10").endswith(" kills, 0 corruptions\n")


def test_jobs_killed_before_a_change_lose_nothing() -> None:
    shown = run("kills.py", "--moments", "10", "--seed", "1")
    assert " 0 corruptions\n" in shown
    assert shown.count(", tracked ") == 2
