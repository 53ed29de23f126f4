"""Cases of the commands: `dynmesh`, and `dynmesh-complete`, which is compiled."""

import re
import struct
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from commands import run_here

import dynmesh

from .case import Case, Printed, World

_TABLES = {
    "no_jobs": ("input,output\n", "no_jobs.csv: has no jobs"),
    "no_column": ("input\nbody.npz\n", "no_column.csv:", "'output'"),
    "odd_column": ("input,output,colour\nbody.npz,new.npz,red\n", "odd_column.csv: line 1:", "--colour"),
    "too_many": ("input,output\nbody.npz,new.npz,more\n", "too_many.csv: line 2"),
    "out_of_range": ("input,output,threads\nbody.npz,new.npz,0\n", "failed: new.npz: body.npz: threads: must be from 1"),
    "scans_method": ("scans,output,template,method\ncloud,new.npz,template.npz,detail\n", "line 1:", "--method"),
    "tabs": ("input\toutput\nbody.npz\tnew.npz\n", "tabs.csv:", "'input'", "tabs"),
    "nothing": ("", "nothing.csv:", "'input', 'scans' or 'scan'"),
    "too_few": ("input,output\n\nbody.npz\n", "too_few.csv: line 3"),
    "unclosed": ('input,output\nbody.npz,"new.npz\n', "unclosed.csv:"),
    "distance": ("input,output,drop_above\nbody.npz,new.npz,far\n", "distance.csv: line 2: drop_above:", "'far'"),
    "fraction": ("input,output,threads\nbody.npz,new.npz,1.5\n", "line 2: threads:", "'1.5'"),
    "neither": ("input,output,provenance\nbody.npz,new.npz,perhaps\n", "line 2: provenance:", "'perhaps'"),
    "no_method": ("input,output,method\nbody.npz,new.npz,lsm\n", "line 2: method:", "'lsm'"),
    "no_start": ("input,output,start\nbody.npz,new.npz,first\n", "line 2: start:", "'first'"),
    "two_kinds": ("input,scans,output\nbody.npz,cloud,new.npz\n", "line 2: scans:", "with input"),
    "no_input": ("input,output\n,new.npz\n", "line 2: input: is empty"),
    "no_template": ("scan,output,template\nbody.obj,new.npz,\n", "line 2: template: is empty"),
    "page_exists": ("template,scan,output,page\nbody.obj,body.obj,new.obj,done.html\n", "failed: new.obj:", "done.html: exists already"),
    "overwrites": ("input,output,overwrite\nbody.npz,new.npz,yes\n", "line 1: overwrite:"),
}  # fmt: skip
"""What is in a table of jobs, and what is said of it."""

_VERDICTS = {
    "no_verdict": ("frame,far\n0,0.1\n", "no_verdict.csv: has no column 'quality'", "--csv"),
    "no_number": ("frame,quality,reason\n0,good,\nlast,good,\n", "line 3: frame:", "'last'"),
    "perfect": ("frame,quality,reason\n0,perfect,\n", "line 2: quality:", "'perfect'"),
    "shorter": ("frame,quality,reason\n0\n", "line 2: quality:", "''"),
    "fourth": (
        "frame,quality,reason\n3,good,\n",
        "fourth.csv: is of frame 3,",
        "body.npz does not",
    ),
}
"""What is in a table of verdicts, and what is said of it."""


def prepare(world: World) -> None:
    """Creates further files that the cases read, in addition to those of `files.prepare`."""
    folder = world.folder
    dynmesh.write(folder / "body.obj", world.sequence[:1])
    corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
    for name, text in {
        "nan": "v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n",
        "wild": f"{corners}f 1 2 9\n",
        "flat": corners,
        "other1": corners,
        "quad": f"{corners}v 1 1 0\nf 1 2 4 3\n",
    }.items():
        (folder / f"{name}.obj").write_text(text)
    frames = world.sequence.vertices.astype("<f4")
    (folder / "body.raw").write_bytes(frames.tobytes())
    header = struct.pack("<12siiffi", b"POINTCACHE2\0", 1, 7, 0.0, 1.0, 2)
    (folder / "other.pc2").write_bytes(header + bytes(7 * 12 * 2))
    (folder / "done.raw").write_bytes(b"precious")
    (folder / "done.html").write_text("precious")
    for name, (text, *_) in (_TABLES | _VERDICTS).items():
        (folder / f"{name}.csv").write_text(text)
    numbers = np.ones((3, 49), np.int32)
    dynmesh.write(folder / "aged.npz", replace(world.sequence, generation=numbers, age=numbers))
    dynmesh.write(
        folder / "point.npz", replace(world.sequence, vertices=0 * world.sequence.vertices)
    )
    dynmesh.write(folder / "void.npz", replace(world.sequence, known=np.zeros((3, 49), bool)))
    fewer = world.sequence.vertices[:, :7], np.array([[0, 1, 2]])
    dynmesh.write(folder / "fewer.npz", dynmesh.Sequence(*fewer))
    four = replace(world.sequence, vertices=np.stack([world.vertices] * 4))
    dynmesh.write(folder / "gap" / "f_%04d.obj", four)
    (folder / "gap" / "f_0002.obj").unlink()
    dynmesh.write(folder / "seq" / "frame_%04d.ply", world.sequence)
    arrays = {"vertices": world.sequence.vertices, "faces": world.faces + 99}
    np.savez(folder / "far_faces.npz", **arrays)
    (folder / "clouds").mkdir()
    points = {"clouds/a_0.xyz": "0 0 0\n", "clouds/a_1.xyz": "0 x 0\n", "foo.ply": "ply\nfoo\n"}
    for name, text in points.items():
        (folder / name).write_text(text)


def dynmesh_command(*arguments: str) -> None:
    """Runs `dynmesh` in this process.

    Raises:
        Printed: what it printed, with the exit code.
    """
    result = run_here(*arguments)
    assert result.stdout == ""
    if result.returncode:
        # The help on the usage takes several lines, and a batch prints one for each job.
        several = result.returncode == 2 or arguments[0] == "batch"
        assert several or len(result.stderr.splitlines()) == 1, result.stderr
        raise Printed(f"{_essence(result.stderr)} (exit code {result.returncode})")


def _essence(printed: str) -> str:
    """Extracts the message, without the usage and the frame around it."""
    framed = re.findall(r"^│ (.*?) *│$", printed, flags=re.MULTILINE)
    return " ".join(framed) or " / ".join(printed.strip().splitlines())


def refused(line: str, *names: str, code: int = 1) -> Case:
    """A command line that must fail, with exit code 1 unless it is told otherwise."""

    def run(_: World) -> None:
        dynmesh_command(*line.split())

    names = (*names, f"exit code {code}")
    return Case(f"dynmesh {line.split()[0]}", f"`{line}`", run, Printed, names)


def misused(line: str, *names: str) -> Case:
    """A command line that does not have the options or values that there are: exit code 2."""
    return refused(line, *names, code=2)


_COMPLETE = "complete body.npz new.npz"
_CONVERT = "convert body.npz new.npz"
_DEGRADE = "degrade body.npz new.npz"
_VIEW = "view body.npz -o new.html"
_PICTURE = "picture body.npz -o new.png"

# What the functions of the package refuse stands with them; here is what the command adds.
shell = [
    refused("info none.npz", "none.npz:", "No such file"),
    refused("info gap", "gap: f_0002.obj is missing", "add it"),
    refused("info far_faces.npz", "far_faces.npz: faces:"),
    misused("complete two.usda new.usda", "two.usda:", "--prim", "/one, /two"),
    misused("info body.npz other.npz", "other.npz", "put patterns in quotes"),
    refused("complete no* new.npz", "no*:", "no suffix"),
    misused("complete body.npz", "OUTPUT: is missing: the file, in one of the formats"),
    misused(f"{_COMPLETE} --training=", "--training: is empty"),
    refused(f"{_COMPLETE} --template quad.obj", "quad.obj: has 4 vertices, but body.npz has 49"),
    misused(f"{_COMPLETE} --method lsm", "--method", "'lsm'"),
    misused(f"{_COMPLETE} --noise -1", "--noise:", "not -1"),
    misused(f"{_COMPLETE} --method motion --reject-outliers", "--reject-outliers:", "detail"),
    misused(f"{_COMPLETE} --training body.npz --learn --bidirectional", "--learn:"),
    misused(f"{_COMPLETE} --start -1", "--start:", "no frame -1, only 0 to 2"),
    misused(f"{_CONVERT} --frames 2:9", "body.npz:", "--frames: must be some of 0:3", "2:9"),
    misused(f"{_CONVERT} --frames 2-9", "--frames:", "'2-9'"),
    misused(f"{_CONVERT} --to-up w", "--to-up:", "'w'"),
    misused(
        f"{_CONVERT} --unit m --to-unit mm --scale 1e306", "frame 0: --scale: takes points out of"
    ),
    refused("convert foo.ply new.npz", "foo.ply: line 2:", "foo"),
    refused("convert clouds new", "clouds/a_1.xyz: line 1:"),
    refused("convert clouds new.npz", "new.npz: scans are written to a folder", ".npz"),
    misused(
        "convert clouds/a_0.xyz new.ply --output-format obj", "--output-format: is for sequences"
    ),
    refused("complete late_known.npz new/deep/out.npz", "late_known.npz: frame 1: points: row 4"),
    refused("complete late_known.npz new/deep/out_%04d.ply", "late_known.npz: frame 1: "),
    misused(f"{_COMPLETE} --start half", "--start:", "'half'"),
    misused(f"{_COMPLETE} --speed 3", "--speed"),
    misused(_DEGRADE, "nothing to do"),
    misused(f"{_DEGRADE} --known 0.5 --cameras 2", "--cameras: is for scans alone; --camera is"),
    misused(f"{_DEGRADE} --known 0.5 --up x", "--up: is for --camera and scans alone"),
    misused("degrade body.npz new --depth 32x24 --points 5", "--points: is not for depth images"),
    refused("degrade late_start.npz new.npz --noise 1", "late_start.npz: frame 1001: "),
    refused("degrade late_start.npz new.npz --outliers 0.1", "late_start.npz: frame 1001: "),
    refused("degrade late_start.npz new --scan", "late_start.npz: frame 1001: "),
    refused("degrade seq seq --scan --overwrite", "seq/frame_0000.ply: is the input"),
    refused("register seq body.obj seq/frame_0000.ply --overwrite", "frame_0000.ply: is the input"),
    misused("register seq body.obj new.ply --threads 1000", "--threads: must be from 1 to 256"),
    misused(f"{_DEGRADE} --known 30", "--known", "not 30"),
    misused(f"{_DEGRADE} --known 130%", "--known", "130%"),
    misused(f"{_DEGRADE} --patches third", "--patches", "0.3 or 30%", "third"),
    refused("evaluate late_holes.npz body.npz", "late_holes.npz: frame 1", "vertex 4"),
    misused("evaluate body.npz body.npz --only missing", "--input: is needed"),
    refused("evaluate single.npz body.npz", "1 frame", "3"),
    refused(
        "evaluate in_metres.npz in_millimetres.npz",
        "in_metres.npz: its unit in metres is 1.0, but 0.001",
    ),
    refused("evaluate y_up.npz z_up.npz", "y_up.npz: its up axis is y, but z in", "convert"),
    refused("evaluate at_24.npz at_30.npz", "at_24.npz: its rate in frames per second is 24"),
    refused(
        "view in_metres.npz -o new.html --reference in_millimetres.npz",
        "unit in metres is 1.0",
        "0.001",
    ),
    refused("view y_up.npz --reference z_up.npz -o new.html", "z_up.npz", "up axis"),
    refused(
        "complete y_up.npz new.npz --training z_up.npz", "z_up.npz: its up axis is z, but y in"
    ),
    refused("evaluate bare.npy body.npz", "bare.npy:", "faces"),
    misused("synth lake new.npz", "'lake'", "ocean"),
    misused("view body.npz -o new.txt", "new.txt:"),
    refused("view body.npz -o done.html", "done.html:", "--overwrite"),
    refused("view body.npz -o body.npz/new.html", "body.npz/new.html:", "body.npz is not a folder"),
    misused(f"{_VIEW} --colour age", "--colour:", "body.npz: holds no age"),
    misused(f"{_VIEW} --colour error", "--colour: error requires a --reference"),
    misused(f"{_VIEW} --colour red", "--colour", "'red'"),
    refused(f"{_VIEW} --input long.npz", "3 frames", "40"),
    refused(f"{_VIEW} --input fewer.npz", "49 vertices"),
    refused(f"{_VIEW} --reference late_holes.npz", "late_holes.npz:", "vertex 4"),
    refused(f"{_VIEW} --reference turned_face.npz", "has other faces than"),
    refused(f"{_VIEW} --reference point.npz", "errors have no unit"),
    refused("view single.npz -o new.html --scans line --scan-unit mm", "states no unit"),
    refused("view void.npz -o new.html", "void.npz: no vertex is known"),
    misused(f"{_VIEW} --scan-unit mm", "--scan-unit: is that of --scans, which are not given"),
    misused(f"{_VIEW} --crop 1", "--crop: is that of --scans, which are not given"),
    misused(f"{_VIEW} --remove-planes", "--remove-planes: is that of --scans"),
    *(refused(f"{_VIEW} --quality {name}.csv", *said) for name, (_, *said) in _VERDICTS.items()),
    misused(f"{_VIEW} --pick marks.json", "--scans: are needed"),
    misused(f"{_VIEW} --scans line --pick marks.txt", "--pick:", "marks.txt"),
    misused(f"{_VIEW} --scans line --pick marks.json --colour age", "--colour:"),
    misused("picture body.npz -o new.jpg", "new.jpg:", ".png"),
    refused("picture void.npz -o new.png", "void.npz: no vertex is known"),
    misused("picture aged.npz -o new.png --colour age --reference body.npz", "not age"),
    misused(f"{_PICTURE} --frame 3", "--frame: there is no frame 3"),
    misused(f"{_PICTURE} --colour distance", "'distance'"),
    refused("evaluate bare.npy body.npz --faces wild.obj", "wild.obj: line 4", "vertex 9"),
    refused("evaluate body.npz body.npz --faces none.obj", "none.obj: No such file"),
    refused("batch none.csv", "none.csv:", "No such file"),
    *(refused(f"batch {name}.csv", *said) for name, (_, *said) in _TABLES.items()),
    misused("batch tabs.csv --workers 0", "--workers", "0"),
    misused("batch tabs.csv --workers 2 --scheduler tcp://h:1", "--workers:"),
    misused("frobnicate body.npz", "frobnicate"),
]


def compiled(programs: Path) -> list[Case]:
    """Cases of the program in this folder."""

    def case(line: str, *names: str, code: int = 1) -> Case:
        def run(_: World) -> None:
            command: list[Any] = [programs.resolve() / "dynmesh-complete", *line.split()]
            ended = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
            if ended.returncode:
                printed = ended.stderr.strip().replace(str(command[0]), "dynmesh-complete")
                printed = " / ".join(printed.splitlines())
                raise Printed(f"{printed} (exit code {ended.returncode})")

        expected = (*names, f"exit code {code}")
        return Case("dynmesh-complete", f"`{line}`", run, Printed, expected)

    def misused(line: str, *names: str) -> Case:
        return case(line, *names, code=2)

    body = "--template body.obj --input body.raw"
    new = "--output new.raw"
    return [
        misused(f"{body}", "--output: is missing"),
        misused(f"--template body.obj {new}", "--input: is missing"),
        misused(f"--input body.raw {new}", "--template: is missing"),
        misused(f"{body} --output", "--output: needs a value"),
        misused(f"{body} {new} more", "more:"),
        misused(f"{body} {new} --speed", "--speed:"),
        misused(f"{body} {new} --disconnected vanish", "--disconnected:", "'vanish'"),
        misused(f"{body} {new} --method motion --extra-iterations -1", "-iterations:", "-1"),
        misused(f"{body} {new} --extra-iterations 99999999999", "in range"),
        misused(f"{body} {new} --extra-iterations 1.5", "--extra-iterations:", "'1.5'"),
        case(f"--template none.obj --input body.raw {new}", "none.obj:"),
        case(f"--template flat.obj --input body.raw {new}", "flat.obj: faces:"),
        case(f"--template nan.obj --input body.raw {new}", "nan.obj:", "vertex 1", "nan"),
        case(f"--template wild.obj --input body.raw {new}", "line 4", "vertex 9"),
        case(f"--template body.raw --input body.raw {new}", "body.raw:", ".obj"),
        case(f"--template body.obj --input none.raw {new}", "none.raw:"),
        case(f"--template body.obj --input frames {new}", "frames:"),
        case(f"--template body.obj --input body.npz {new}", "body.npz:", ".raw"),
        case(f"--template body.obj --input none%d.ply {new}", "none1.ply:"),
        case(f"--template body.obj --input %s.ply {new}", "%s.ply:", "%04d"),
        case(f"--template body.obj --input other%d.obj {new}", "other1.obj:", "3", "49"),
        case(f"{body} --output done.raw", "done.raw:", "exists already"),
        case(f"{body} --output new%d.ply", "new%d.ply:", "is not empty"),
        case(f"{body} --output no/new.raw", "no/new.raw", "No such file"),
        case(f"{body} --output new%d.obj", "new%d.obj:", "ply"),
        case(f"{body} --output /dev/full", "/dev/full:", "No space left"),
    ]
