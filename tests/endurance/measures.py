"""Times and memory of a run of any length, measured in constant memory."""

import os
from pathlib import Path

import numpy as np

_SHORTEST = 1e-7  # seconds
_RATIO = 1.01  # from one bin to the next, so the median is accurate to one per cent
_N_BINS = 2200  # up to five minutes


class Times:
    """A histogram with bins of equal ratio."""

    def __init__(self) -> None:
        """Starts empty."""
        self._counts = np.zeros(_N_BINS, np.int64)

    def add(self, seconds: float) -> None:
        """Counts one call."""
        place = np.log(max(seconds, _SHORTEST) / _SHORTEST) / np.log(_RATIO)
        self._counts[min(int(place), _N_BINS - 1)] += 1

    @property
    def median(self) -> float:
        """Returns the median in seconds; NaN without calls."""
        if not self._counts.any():
            return float("nan")
        place = np.searchsorted(np.cumsum(self._counts), self._counts.sum() / 2)
        return float(_SHORTEST * _RATIO ** (int(place) + 1))


class Memory:
    """The resident memory of the process, sampled while it runs.

    A fixed number of samples is spread over the run: when they are full, every other one is
    dropped.

    Attributes:
        peak: MB, the maximum of all samples, including dropped ones.
    """

    def __init__(self, most: int = 512) -> None:
        """Stores at most this many samples, an even number."""
        self._most = most
        self._samples: list[float] = []
        self._calls = 0
        self._every = 1
        self.peak = 0.0

    def sample(self) -> None:
        """Takes a sample."""
        now = resident()
        self.peak = max(self.peak, now)
        if self._calls % self._every == 0:
            self._samples.append(now)
        self._calls += 1
        if len(self._samples) == self._most:
            self._samples = self._samples[::2]
            self._every *= 2

    @property
    def growth(self) -> float:
        """Returns the growth in MB: the mean of the last tenth minus that after the first third.

        The first third is left out, as memory for the largest frames is allocated there.
        """
        third, tenth = len(self._samples) // 3, max(1, len(self._samples) // 10)
        before = self._samples[third : third + tenth]
        return float(np.mean(self._samples[-tenth:]) - np.mean(before))


def resident() -> float:
    """Returns the resident memory of this process in MB."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6
