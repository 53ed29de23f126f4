"""Prints how much memory an object takes, and how much of it stays with the process: Linux."""

import ctypes
import gc
import os
from pathlib import Path

import numpy as np

import dynmesh

walker = dynmesh.synth.walker()
faces, frames = walker.faces, walker.vertices[:4]
known = np.random.default_rng(0).random(len(frames[0])) < 0.3
trim = ctypes.CDLL(None).malloc_trim


def megabytes() -> float:
    """The memory of the process that is not swapped out."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def measure(name, make, frame, copies=4):
    """Prints a row: of one object, after deletion, and after malloc_trim; in MB."""
    trim(0)
    before = megabytes()
    objects = []
    for _ in range(copies):
        objects.append(make())
        for points in frames[1:]:
            frame(objects[-1], points)
    used = megabytes()
    objects.clear()
    gc.collect()
    left = megabytes()
    trim(0)
    shares = [(now - before) / copies for now in (used, left, megabytes())]
    print(name, *(f"{abs(share):.0f}" for share in shares), sep=",")


def completer(**settings):
    """Returns a function that makes a completer."""
    return lambda: dynmesh.Completer(faces, frames[0], **settings)


def complete(one, points):
    """Completes a frame."""
    one.push(points, known)


print("of 10 002 vertices,in use,after deletion,after malloc_trim")
completer(method="motion")()  # loads what all of them share
measure("completer: method motion", completer(method="motion"), complete)
measure("completer: method detail", completer(), complete)
measure("completer: uncertainty", completer(uncertainty=True), complete)
measure("completer: learn", completer(learn=True), complete)
measure("tracker", lambda: dynmesh.Tracker(faces, frames[0]), dynmesh.Tracker.push)
