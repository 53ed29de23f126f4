"""The command that completes a sequence, for all meshes of a scene."""

from pathlib import Path

import typer

from .._errors import SettingError
from ..jobs.completion_options import CompletionOptions
from ..jobs.report import FileReport
from ..jobs.scene_completion import complete_meshes
from .done import of_training, shares_of
from .options import usage_error
from .terminal import DOUBTFUL, say, say_remarks, track


def complete_all(
    path: Path, output: Path, options: CompletionOptions, *, resume: bool, overwrite: bool
) -> None:
    """Completes every mesh that moves and prints what was done.

    Raises:
        typer.Exit: with code 1 if a mesh could not be completed.
    """
    for_one_mesh = {
        "--resume": resume,
        "--fps": options.fps,
        **{f"--{name.replace('_', '-')}": True for name in options.changed},
        "--template": options.template,
        "--gaps": options.source.get("gaps") == "lost",
    }
    for option, value in for_one_mesh.items():
        if value:
            alone = "; complete that mesh afterwards, from OUT, with --prim PATH"
            raise typer.BadParameter(
                f"cannot be combined with --prim all{alone if option == '--template' else ''}",
                param_hint=f"'{option}'",
            )

    try:
        report = complete_meshes(
            path,
            output,
            options,
            overwrite,
            watch=lambda frames, whole, done: track(frames, whole, "completing", done),
        )
    except SettingError as error:
        raise usage_error(error, options.settings) from error
    except KeyboardInterrupt:
        say(f"{output}: interrupted; nothing was kept")
        raise
    for mesh, done in report.meshes.items():
        say(f"{mesh}: {_summary(done)}")
        for remark in done.remarks:
            say(f"{mesh}: {remark}")
    say_remarks(output, report.remarks)
    whole = len(report.meshes) + len(report.failed)
    say(f"{output}: {len(report.meshes)} of {whole} moving meshes completed")
    for mesh, reason in report.failed.items():
        say(f"{path}: {mesh}: not completed: {reason}")
    if report.failed:
        raise typer.Exit(1)
    if any(done.doubtful for done in report.meshes.values()):
        raise typer.Exit(DOUBTFUL)


def _summary(report: FileReport) -> str:
    """What was done to a mesh, in one line."""
    if report.filled + report.disconnected + report.rejected == 0:
        return f"{report.frames} frames, nothing was missing"
    shares = shares_of(report, **({"rejected": report.rejected} if report.rejected else {}))
    learnt = "" if report.prior_weight is None else f"; {of_training(report)}"
    return f"{report.frames} frames, {shares} of the vertices{learnt}"
