"""Completion, tracking and registration of many files, in any number of processes or machines."""

import time
from collections import defaultdict
from collections.abc import Callable, Iterable
from concurrent.futures import Executor, Future, as_completed
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, TypeAlias

from .. import files
from .._errors import InputError, KindError, SettingError, in_one_line
from ..files import CannotResumeError
from ..files.frame_names import FrameNames, single
from .checkpoint import OtherJobError
from .completion_options import CompletionOptions
from .file_completion import complete_into
from .register_job import RegisterJob, RegisterReport
from .report import FileReport
from .track_report import TrackFileReport
from .tracking_job import TrackingJob
from .unfinished import remembered


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
        status: "done", "doubtful" if the output was written, now or before, but is probably wrong,
            "exists" if it was already complete, or "failed".
        reason: why the job failed, in one line; empty otherwise. The remarks say why a result is
            doubtful.
        frames: number of frames in the output; 0 if it was not written.
        seconds: the time that the job took; 0 if `kept`.
        remarks: remarks about the output for the user, one line each.
        kept: whether the output is from an earlier run, so that nothing was done.
    """

    job: AnyJob
    status: Literal["done", "doubtful", "exists", "failed"]
    reason: str = ""
    frames: int = 0
    seconds: float = 0.0
    remarks: tuple[str, ...] = ()
    kept: bool = False


def complete_files(
    jobs: Iterable[AnyJob],
    executor: Executor | None = None,
    *,
    overwrite: bool = False,
    watch: Callable[[Result], None] | None = None,
) -> list[Result]:
    """Completes, tracks or registers the files of every job; one that fails stops no other.

    A job whose output exists is skipped. An interrupted job is continued if the format of its
    output supports that, so repeating a call does what is left to do. Outputs appear under their
    names when they are complete. Every process must see the files under the same paths.

    Args:
        jobs: with different outputs.
        executor: runs the jobs, for example a :class:`concurrent.futures.ProcessPoolExecutor` or
            what ``get_executor()`` of a Dask client returns; None runs them one after another in
            this process.
        overwrite: whether to replace outputs that exist.
        watch: called with each result as soon as it is available.

    Returns:
        The results, in the order of the jobs.

    Raises:
        ValueError: two jobs have the same output, or would write the same file beside it.
    """
    if not isinstance(jobs, Iterable):
        raise KindError(f"must be iterable, not {type(jobs).__name__}", argument="jobs")
    jobs = list(jobs)
    for number, job in enumerate(jobs):
        if not isinstance(job, AnyJob):
            raise KindError(
                f"item {number} must be a Job, a TrackingJob or a RegisterJob, not {job!r}",
                argument="jobs",
            )
    _check_outputs(jobs)
    results: dict[int, Result] = {}

    def take(number: int, result: Result) -> None:
        results[number] = result
        if watch is not None:
            watch(result)

    if executor is None:
        for number, job in enumerate(jobs):
            take(number, _run(job, overwrite))
    else:
        futures = {executor.submit(_run, job, overwrite): i for i, job in enumerate(jobs)}
        for future in as_completed(futures):
            number = futures[future]
            take(number, _result_of(future, jobs[number]))
    return [results[number] for number in range(len(jobs))]


def _run(job: AnyJob, overwrite: bool) -> Result:
    """Runs a job in a worker."""
    began = time.monotonic()
    try:
        report = _continued(job, overwrite)
    except FileExistsError:
        doubt = _doubt_of(job)
        return _kept(job, (doubt,) if doubt else ())
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
    if report.existed:
        return _kept(job, remarks if doubtful else ())
    return Result(job, "doubtful" if doubtful else "done", "", report.frames, seconds, remarks)


def _kept(job: AnyJob, doubts: tuple[str, ...]) -> Result:
    """The result of a job whose output was complete, and is doubtful if there are doubts."""
    status: Literal["doubtful", "exists"] = "doubtful" if doubts else "exists"
    return Result(job, status, frames=_frames_in(job), remarks=doubts, kept=True)


def _frames_in(job: AnyJob) -> int:
    """The number of frames in the output; 0 if it cannot be read."""
    output = Path(job.output)
    if isinstance(job, RegisterJob):
        if not output.is_dir():
            return 1
        # What is remembered of a doubtful result is a hidden file.
        return sum(1 for path in output.iterdir() if not path.name.startswith("."))
    try:
        with files.open(output, format=job.output_format) as made:
            return made.n_frames
    except (OSError, ImportError, ValueError, TypeError):
        return 0


def _continued(job: AnyJob, overwrite: bool) -> FileReport | TrackFileReport | RegisterReport:
    """Runs a job from where it was interrupted, if that can be done."""
    if isinstance(job, RegisterJob):
        return job.register(overwrite=overwrite)
    target = files.target_of(job.output, job.output_format)
    resume = target.writer.resumable and job.retime is None
    anew = overwrite or not target.existing()  # also if frames of another run are kept
    try:
        return _make(job, overwrite if resume else anew, resume=resume)
    except (OtherJobError, CannotResumeError):  # the table has changed, or the files did
        return _make(job, anew, resume=False)


def _make(job: Job | TrackingJob, overwrite: bool, *, resume: bool) -> FileReport | TrackFileReport:
    if isinstance(job, TrackingJob):
        return job.track(overwrite=overwrite, resume=resume)
    return complete_into(job.input, job.output, job, overwrite, resume)


def _doubt_of(job: AnyJob) -> str:
    """Why a result that exists is doubtful; empty if it is not."""
    if isinstance(job, RegisterJob):
        return job.doubt()
    return str(remembered(files.target_of(job.output, job.output_format)).get("doubtful", ""))


def _result_of(future: "Future[Result]", job: AnyJob) -> Result:
    try:
        return future.result()
    except Exception as error:  # an error of the worker, not of the job
        return Result(job, "failed", f"the worker was lost: {in_one_line(error)}")


def _check_outputs(jobs: list[AnyJob]) -> None:
    """Raises an error if two jobs may write the same file, however their outputs name it."""
    files_in: dict[Path, dict[str, Path]] = defaultdict(dict)
    patterns_in: dict[Path, list[tuple[FrameNames, Path]]] = defaultdict(list)
    for job in jobs:
        output = Path(job.output)
        wanted = {real for names in _names_of(job) for real in names.real()}
        for names in wanted:
            files, patterns = files_in[names.folder], patterns_in[names.folder]
            others = [other for pattern, other in patterns if names.meets(pattern)]
            if names.numbered:
                others += [other for name, other in files.items() if names.has(name)]
            elif names.pattern in files:
                others.append(files[names.pattern])
            for other in others:
                same = "" if other == output else f", {other}: both would write the same files"
                raise InputError(f"is the output of more than one job{same}", file=output)
        for names in wanted:
            if names.numbered:
                patterns_in[names.folder].append((names, output))
            else:
                files_in[names.folder][names.pattern] = output


def _names_of(job: AnyJob) -> list[FrameNames]:
    """The names of all files that a job writes."""
    try:
        format = None if isinstance(job, RegisterJob) else job.output_format
        return files.target_of(job.output, format).names()
    except (OSError, ValueError, TypeError, ImportError):  # of this job alone, which will fail
        return [single(Path(job.output))]
