"""The workers of a batch, on this machine or of a cluster, and what is wrong with them."""

import logging
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from tempfile import TemporaryDirectory
from typing import Any

from .._core import __version__
from .._extras import require
from .._report import counted

INTERVAL = 10.0
"""Seconds between two looks at the workers while a job is waited for."""


class Workers:
    """Those of a client of Dask, watched while jobs are waited for."""

    def __init__(self, client: Any, scheduler: str | None) -> None:
        """Checks the workers that a cluster has already.

        Args:
            client: of the scheduler.
            scheduler: its address; None for processes of this machine.
        """
        self.client, self._scheduler = client, scheduler
        self._known, self._none_told = frozenset[str](), False
        self._look()

    def result(self, future: Any) -> Any:
        """Waits for a result; says on standard error if no worker is there to compute it."""
        wait = require("distributed", extra="batch").wait
        while not future.done():
            try:
                wait(future, timeout=INTERVAL)
            except TimeoutError:
                self._look(is_waiting=True)
        return future.result()

    def _look(self, *, is_waiting: bool = False) -> None:
        present = frozenset(self.client.nthreads())
        if new := present - self._known:
            self._check(sorted(new))
        self._known = present
        if present or not is_waiting:
            self._none_told = self._none_told and not present
        elif not self._none_told:
            self._none_told = True
            where = self._scheduler or "on this machine"
            print(
                f"dynmesh: no worker is left {where}, so the jobs wait"
                if self._scheduler is None
                else f"dynmesh: the cluster at {where} has no worker, so the jobs wait: start "
                f"`dask worker {where}` with dynmesh {__version__} installed",
                file=sys.stderr,
                flush=True,
            )

    def _check(self, new: list[str]) -> None:
        """Refuses workers that cannot import dynmesh, or another version."""
        if self._scheduler is None:
            return
        # Text, which needs nothing there to be read; what a job needs is imported with it.
        version = "__import__('dynmesh.cli.job_table').__version__"
        found = self.client.run(eval, version, workers=new, on_error="return")
        for worker, answer in found.items():
            if answer != __version__:
                what = f"has dynmesh {answer}" if isinstance(answer, str) else "has no dynmesh"
                why = "" if isinstance(answer, str) else f" ({type(answer).__name__}: {answer})"
                others = counted(sum(a != __version__ for a in found.values()), "worker")
                raise OSError(
                    f"worker {worker} {what}{why}, but needs {__version__}, as here; "
                    f"{others} of {len(found)} must be started again with it"
                )


@contextmanager
def workers_of(scheduler: str | None, count: int) -> Iterator[Workers]:
    """The workers of a scheduler, or of a cluster on this machine, which ends with the block."""
    dask, distributed = (require(name, extra="batch") for name in ("dask", "distributed"))
    with ExitStack() as stack:
        address: Any = scheduler
        if scheduler is None:
            scratch = stack.enter_context(TemporaryDirectory())
            stack.enter_context(dask.config.set(temporary_directory=scratch))
            cluster = distributed.LocalCluster(
                n_workers=count,
                threads_per_worker=1,
                memory_limit=0,  # or else Dask would kill a job that needs more than its share
                dashboard_address="127.0.0.1:0",  # any port: two clusters may run at once
                silence_logs=logging.ERROR,  # of workers that end in the middle of a job
            )
            address = stack.enter_context(cluster)
        try:
            client = distributed.Client(address)
        except (OSError, ValueError) as error:
            raise OSError(f"no Dask scheduler answers at {scheduler}") from error
        yield Workers(stack.enter_context(client), scheduler)
