"""Completion and tracking of many files, in any number of processes or machines."""

import time
from collections import defaultdict
from collections.abc import Callable, Iterable
from concurrent.futures import Executor, Future, as_completed
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from .. import files
from .._errors import InputError, KindError, SettingError
from ..files import CannotResumeError
from ..files.frame_names import FrameNames, single
from ..frames.scenes import every_mesh
from .checkpoint import OtherJobError
from .completion_options import CompletionOptions
from .file_completion import complete_into
from .report import FileReport
from .scene_completion import SceneReport, complete_meshes
from .track_report import TrackFileReport
from .tracking_job import TrackingJob
from .unfinished import remembered


@dataclass(frozen=True)
class Job(CompletionOptions):
    """One file to complete, with the options of :func:`dynmesh.complete_file`.

    Attributes:
        input: the incomplete sequence, in any format.
        output: path of the completed sequence; its folder is created if it does not exist.
        source: how to read the input, as :func:`dynmesh.open` documents; "all" as its `prim` means
            every mesh that moves, as :func:`dynmesh.complete_scene` completes them.
        settings: the settings of :class:`dynmesh.Completer`; the method is detail by default.

    The other options are attributes of the same name.
    """

    input: Path
    output: Path


@dataclass(frozen=True)
class Result:
    """The result of a job.

    Attributes:
        job: the job.
        status: "done", "doubtful" if the output was written, now or before, but is probably wrong,
            "exists" if it was already complete, or "failed".
        reason: why the job failed, in one line; empty otherwise. The remarks say why a result is
            doubtful.
        frames: number of frames in the output, of all its meshes; 0 if it was not written.
        seconds: the time that the job took.
        remarks: remarks about the output for the user, one line each.
    """

    job: Job | TrackingJob
    status: Literal["done", "doubtful", "exists", "failed"]
    reason: str = ""
    frames: int = 0
    seconds: float = 0.0
    remarks: tuple[str, ...] = ()


def complete_files(
    jobs: Iterable[Job | TrackingJob],
    executor: Executor | None = None,
    *,
    overwrite: bool = False,
    watch: Callable[[Result], None] | None = None,
) -> list[Result]:
    """Completes, or tracks, the files of every job. If one fails, the others are still done.

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
        if not isinstance(job, Job | TrackingJob):
            raise KindError(
                f"item {number} must be a Job or a TrackingJob, not {job!r}", argument="jobs"
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


def _run(job: Job | TrackingJob, overwrite: bool) -> Result:
    """Runs a job in a worker."""
    began = time.monotonic()
    try:
        if isinstance(job, Job) and job.source.get("prim") == every_mesh:
            scene = complete_meshes(Path(job.input), Path(job.output), job, overwrite)
            return _result_of_scene(job, scene, began)
        overlay = isinstance(job, Job) and job.overlay
        target = files.target_of(job.output, job.output_format, overlay=overlay)
        try:
            resume = target.writer.resumable and job.retime is None
            report = _make(job, overwrite, resume=resume)
        except (OtherJobError, CannotResumeError):  # the table has changed, or the files did
            report = _make(job, overwrite or not target.existing(), resume=False)
    except FileExistsError:
        doubt = remembered(files.target_of(job.output, job.output_format)).get("doubtful", "")
        return Result(job, "doubtful", remarks=(doubt,)) if doubt else Result(job, "exists")
    except SettingError as error:  # its message does not name the file
        return Result(job, "failed", f"{job.input}: {error}", seconds=time.monotonic() - began)
    except Exception as error:  # no error may stop the other jobs
        return Result(job, "failed", _in_one_line(error), seconds=time.monotonic() - began)
    seconds = time.monotonic() - began
    remarks = report.remarks
    if isinstance(report, FileReport):
        doubtful = report.doubtful
    else:
        doubtful = report.quality != "good"
        remarks = (*remarks, report.reason) if report.reason else remarks
    if report.existed and not doubtful:
        return Result(job, "exists")
    return Result(job, "doubtful" if doubtful else "done", "", report.frames, seconds, remarks)


def _make(job: Job | TrackingJob, overwrite: bool, *, resume: bool) -> FileReport | TrackFileReport:
    if isinstance(job, TrackingJob):
        return job.track(overwrite=overwrite, resume=resume)
    return complete_into(job.input, job.output, job, overwrite, resume)


def _result_of_scene(job: Job, report: SceneReport, began: float) -> Result:
    """A job has failed if one of its meshes has, although the others are in the output."""
    failed = "; ".join(f"{mesh}: {why}" for mesh, why in report.failed.items())
    doubtful = any(one.doubtful for one in report.meshes.values())
    return Result(
        job,
        "failed" if failed else "doubtful" if doubtful else "done",
        f"{job.input}: {failed}; the other meshes are in {job.output}" if failed else "",
        sum(one.frames for one in report.meshes.values()),
        time.monotonic() - began,
        (*report.remarks, *(f"{m}: {r}" for m, one in report.meshes.items() for r in one.remarks)),
    )


def _result_of(future: "Future[Result]", job: Job | TrackingJob) -> Result:
    try:
        return future.result()
    except Exception as error:  # an error of the worker, not of the job
        return Result(job, "failed", f"the worker was lost: {_in_one_line(error)}")


def _in_one_line(error: Exception) -> str:
    if isinstance(error, OSError) and error.filename:
        return f"{error.filename}: {error.strerror}"
    lines = str(error).splitlines()
    return lines[0] if lines else type(error).__name__


def _check_outputs(jobs: list[Job | TrackingJob]) -> None:
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


def _names_of(job: Job | TrackingJob) -> list[FrameNames]:
    """The names of all files that a job writes."""
    try:
        return files.target_of(job.output, job.output_format).names()
    except (OSError, ValueError, TypeError, ImportError):  # of this job alone, which will fail
        return [single(Path(job.output))]
