"""Completion, tracking and registration of many files by Dask, on one machine or on many."""

import logging
import time
from collections.abc import Generator, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Literal, TypeAlias

from .._errors import SettingError, in_one_line
from .._extras import require
from .completion_options import CompletionOptions
from .file_completion import complete_into
from .register_job import RegisterJob, RegisterReport
from .report import FileReport
from .track_report import TrackFileReport
from .tracking_job import TrackingJob


@dataclass(frozen=True)
class Job(CompletionOptions):
    """One file to complete, with the options of :func:`dynmesh.complete_file`.

    Attributes:
        input: the incomplete sequence, in any format.
        output: path of the completed sequence; its folder is created if it does not exist.
        source: how to read the input, as :func:`dynmesh.open` documents.
        settings: the settings of :class:`dynmesh.Completer`; the method is detail by default.

    The other options are attributes of the same name.
    """

    input: Path
    output: Path


AnyJob: TypeAlias = Job | TrackingJob | RegisterJob


@dataclass(frozen=True)
class Result:
    """The result of a job.

    Attributes:
        job: the job.
        status: "done", "doubtful" if the output was written but is probably wrong, "exists" if
            there was one already, so that nothing was done, or "failed".
        reason: why the job failed or which file exists, in one line; empty otherwise. The remarks
            say why a result is doubtful.
        frames: number of frames that were written.
        seconds: the time that the job took.
        remarks: remarks about the output for the user, one line each.
    """

    job: AnyJob
    status: Literal["done", "doubtful", "exists", "failed"]
    reason: str = ""
    frames: int = 0
    seconds: float = 0.0
    remarks: tuple[str, ...] = ()


def complete_files(
    jobs: Sequence[AnyJob],
    scheduler: str | None = None,
    *,
    workers: int | None = None,
    overwrite: bool = False,
) -> Generator[Result, None, None]:
    """Completes, tracks or registers the files of every job; one that fails stops no other.

    A job whose output exists is skipped, so that repeating a call does what is left to do. A job
    whose worker dies is given to another one. Every worker must see the files under the same paths.

    Args:
        jobs: with different outputs.
        scheduler: the address of a Dask scheduler; None starts a cluster on this machine, which
            ends with the iteration.
        workers: the number of processes of that cluster; None stands for one per processor.
        overwrite: whether to replace outputs that exist.

    Yields:
        The results, in the order of the jobs.

    Raises:
        ImportError: Dask distributed is not installed.
        OSError: no scheduler answers at the address.
    """
    processors: int = require("dask.system", extra="batch").CPU_COUNT
    with _client(scheduler, workers or min(processors, len(jobs))) as client:
        futures = client.map(run_job, jobs, overwrite=overwrite, pure=False)
        for job, future in zip(jobs, futures, strict=True):
            try:
                result = future.result()
            except Exception as error:  # an error of the worker, not of the job
                why = f"{job.input}: the worker was lost: {in_one_line(error)}"
                result = Result(job, "failed", why)
            yield result


def run_job(job: AnyJob, *, overwrite: bool = False) -> Result:
    """Runs a job in this process; whatever goes wrong is in the result."""
    began = time.monotonic()
    try:
        report: FileReport | TrackFileReport | RegisterReport
        if isinstance(job, RegisterJob):
            report = job.register(overwrite=overwrite)
        elif isinstance(job, TrackingJob):
            report = job.track(overwrite=overwrite)
        else:
            report = complete_into(job.input, job.output, job, overwrite)
    except FileExistsError as error:
        return Result(job, "exists", in_one_line(error))
    except SettingError as error:  # its message does not name the file
        return Result(job, "failed", f"{job.input}: {error}", seconds=time.monotonic() - began)
    except Exception as error:  # no error may stop the other jobs
        return Result(job, "failed", in_one_line(error), seconds=time.monotonic() - began)
    seconds = time.monotonic() - began
    remarks = report.remarks
    if isinstance(report, FileReport):
        doubtful = report.doubtful
    else:
        doubtful = report.quality != "good"
        remarks = (*remarks, report.reason) if report.reason else remarks
    return Result(job, "doubtful" if doubtful else "done", "", report.frames, seconds, remarks)


@contextmanager
def _client(scheduler: str | None, workers: int) -> Iterator[Any]:
    """A client of a scheduler, or of a cluster on this machine, which ends with the block."""
    dask, distributed = (require(name, extra="batch") for name in ("dask", "distributed"))
    with ExitStack() as stack:
        address: Any = scheduler
        if scheduler is None:
            scratch = stack.enter_context(TemporaryDirectory())
            stack.enter_context(dask.config.set(temporary_directory=scratch))
            cluster = distributed.LocalCluster(
                n_workers=workers,
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
        yield stack.enter_context(client)
