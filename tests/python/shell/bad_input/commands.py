"""Cases of the commands: `dynmesh`, and `dynmesh-complete`, which is compiled."""

import re
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from commands import run_here

import dynmesh

from .case import Case, Printed, World

_TABLES = {
    "no_column": ("input\nbody.npz\n", "no_column.csv:", "'output'"),
    "odd_column": ("input,output,colour\nbody.npz,new.npz,red\n", "failed: new.npz: ", "--colour"),
    "too_few": ("input,output\n\nbody.npz\n", "too_few.csv: line 3"),
    "out_of_range": ("input,output,threads\nbody.npz,new.npz,0\n", "failed: new.npz: body.npz: --threads: must be from 1"),
    "scans_method": ("scans,output,template,method\ncloud,new.npz,template.npz,detail\n", "failed: new.npz: ", "--method"),
    "tabs": ("input\toutput\nbody.npz\tnew.npz\n", "tabs.csv:", "'input'", "tabs"),
    "unclosed": ('input,output\nbody.npz,"new.npz\n', "unclosed.csv:"),
    "no_method": ("input,output,method\nbody.npz,new.npz,lsm\n", "failed: new.npz: ", "--method", "'lsm'"),
    "two_kinds": ("input,scans,output\nbody.npz,cloud,new.npz\n", "line 2: scans:", "with input"),
    "no_input": ("input,output\n,new.npz\n", "line 2: input: is empty"),
    "page_exists": ("template,scan,output,page\nbody.obj,body.obj,new.obj,done.html\n", "failed: new.obj:", "done.html: exists already"),
    "overwrites": ("input,output,overwrite\nbody.npz,new.npz,yes\n", "line 1: overwrite:"),
}  # fmt: skip
"""What is in a table of jobs, and what is said of it."""

_VERDICTS = {
    "no_verdict": ("frame,far\n0,0.1\n", "no_verdict.csv: has no column 'quality'", "--csv"),
    "perfect": ("frame,quality,reason\n0,perfect,\n", "line 2: quality:", "'perfect'"),
    "fourth": (
        "frame,quality,reason\n3,good,\n",
        "fourth.csv: is of frame 3,",
        "body.npz does not",
    ),
}
"""What is in a table of verdicts, and what is said of it."""

_LANDMARKS = {
    "{": "is not JSON",
    '[{"vertex": 3}]': "landmark 0: must have",
    '[{"vertex": 0.5, "position": [1, 2, 3]}]': "landmark 0: vertex:",
    '[{"vertex": 577, "position": [1, 2, 3]}]': "vertex 577",
}
"""What is in a file of landmarks, and what is said of it."""


def prepare(world: World) -> None:
    """Creates further files that the cases read, in addition to those of `files.prepare`."""
    folder, sequence = world.folder, world.sequence
    dynmesh.write(folder / "body.obj", sequence[:1])
    corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
    for name, text in {
        "nan.obj": "v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n",
        "wild.obj": f"{corners}f 1 2 9\n",
        "flat.obj": corners,
        "other1.obj": corners,
        "done.raw": "precious",
        "done.html": "precious",
        "foo.ply": "ply\nfoo\n",
        "clouds/a_0.xyz": "0 0 0\n",
        "clouds/a_1.xyz": "0 x 0\n",
        **{f"{name}.csv": text for name, (text, *_) in (_TABLES | _VERDICTS).items()},
        **{f"marks_{number}.json": text for number, text in enumerate(_LANDMARKS)},
    }.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(text)
    (folder / "body.raw").write_bytes(sequence.vertices.astype("<f4").tobytes())
    four = replace(sequence, vertices=np.stack([world.vertices] * 4))
    dynmesh.write(folder / "gap" / "f_%04d.obj", four)
    (folder / "gap" / "f_0002.obj").unlink()


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
        framed = re.findall(r"^│ (.*?) *│$", result.stderr, flags=re.MULTILINE)
        said = " ".join(framed) or " / ".join(result.stderr.strip().splitlines())
        raise Printed(f"{said} (exit code {result.returncode})")


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
_REGISTER = "register template.npz cloud/s_0000.ply new.obj"
_OF_SEQUENCES = [
    "--mask known.npy",
    "--prim /a",
    "--missing zero",
    "--provenance",
    "--fps 24",
    "--frames 2:3",
]

# What the functions of the package refuse stands with them; here is what the command adds.
shell = [
    refused("info none.npz", "none.npz:", "No such file"),
    refused("info gap", "gap: f_0002.obj is missing", "add it"),
    misused("info body.npz other.npz", "other.npz", "put patterns in quotes"),
    misused("synth lake new.npz", "'lake'", "ocean"),
    misused("synth ocean -- --new.npz --frames 3", "too many arguments: --frames; options stand before --"),
    misused("complete body.npz", "OUTPUT: is missing: the file, in one of the formats"),
    misused("complete two.usda new.usda", "two.usda:", "--prim", "/one, /two"),
    refused("complete no* new.npz", "no*:", "no suffix"),
    misused(f"{_COMPLETE} --training=", "--training: is empty"),
    misused(f"{_COMPLETE} --method lsm", "--method", "'lsm'"),
    misused(f"{_COMPLETE} --method motion --reject-outliers", "--reject-outliers:", "detail"),
    misused(f"{_COMPLETE} --training body.npz --learn --bidirectional", "--learn:"),
    misused(f"{_COMPLETE} --start -1", "--start:", "no frame -1, only 0 to 2"),
    misused(f"{_COMPLETE} --speed 3", "--speed"),
    refused("complete late_known.npz new/deep/out.npz", "late_known.npz: frame 1: points: row 4"),
    refused("complete late_known.npz new/deep/out_%04d.ply", "late_known.npz: frame 1: "),
    misused(f"{_CONVERT} --frames 2:9", "body.npz:", "--frames: must be some of 0:3", "2:9"),
    misused(f"{_CONVERT} --unit m --to-unit mm --scale 1e306", "frame 0: --scale: takes points out of"),
    refused(f"{_CONVERT} --output-format fbx", "new.npz:", "'fbx'"),
    refused("convert body.npz new.usda --up x", "new.usda:", "x"),
    refused("convert foo.ply new.npz", "foo.ply: line 2:", "foo"),
    refused("convert clouds new", "clouds/a_1.xyz: line 1:"),
    refused("convert clouds new.npz", "new.npz: scans are written to a folder", ".npz"),
    *(misused(f"convert cloud{one} {option}", f"{option.split()[0]}: is for sequences") for one in (" new", "s/a_0.xyz new.ply") for option in _OF_SEQUENCES),
    misused(_DEGRADE, "nothing to do"),
    misused(f"{_DEGRADE} --known 0.5 --cameras 2", "--cameras: is for scans alone; --camera is"),
    misused(f"{_DEGRADE} --known 130%", "--known", "130%"),
    misused("degrade body.npz new --depth 32x24 --points 5", "--points: is not for depth images"),
    misused("degrade body.npz new --scan --depth 64x48", "--scan:", "depth images"),
    refused("degrade late_start.npz new.npz --noise 1", "late_start.npz: frame 1001: "),
    refused("degrade walk walk --scan --overwrite", "walk/frame_0000.ply: is the input"),
    refused("degrade body.npz cloud --scan --up z", "s_0000.ply", "exists already"),
    refused("evaluate late_holes.npz body.npz", "late_holes.npz: frame 1", "vertex 4"),
    misused("evaluate body.npz body.npz --only missing", "--input: is needed"),
    refused("evaluate long.npz body.npz", "40 frames", "has 3, and none of the numbers 3, 4, 5,"),
    misused("evaluate body.npz body.npz --faces body.obj", "--faces: has no effect"),
    misused(f"{_VIEW} --prim /a", "--prim: has no effect"),
    refused("evaluate big.npz body.npz", "big.npz: is 1000 times as large as", "--scale 0.001"),
    refused("evaluate in_metres.npz in_millimetres.npz", "in_metres.npz: its unit in metres is 1.0, but 0.001"),
    refused("evaluate at_24.npz body.npz", "at_24.npz: its rate in frames per second is 24"),
    refused("evaluate bare.npy body.npz", "bare.npy:", "faces"),
    refused("view body.npz -o done.html", "done.html:", "--overwrite"),
    refused("view body.npz -o body.npz/new.html", "body.npz/new.html:", "body.npz is not a folder"),
    misused(f"{_VIEW} --colour age", "--colour:", "body.npz: holds no age"),
    misused(f"{_VIEW} --colour error", "--colour: error requires a --reference"),
    refused("view long.npz --input body.npz -o new.html", "40 frames", "has 3"),
    refused(f"{_VIEW} --reference turned_face.npz", "has other faces than"),
    refused("view y_up.npz --reference z_up.npz -o new.html", "z_up.npz", "up axis"),
    refused("view void.npz -o new.html", "void.npz: no vertex is known"),
    misused(f"{_VIEW} --scan-unit mm", "--scan-unit: is that of --scans"),
    misused("view template_m.npz --scans in_mm --scan-unit cm -o new.html", "in_mm:", "--scan-unit:", "0.001", "0.01"),
    *(refused(f"{_VIEW} --quality {name}.csv", *said) for name, (_, *said) in _VERDICTS.items()),
    misused(f"{_VIEW} --pick marks.json", "--scans: are needed"),
    misused("picture body.npz -o new.jpg", "new.jpg:", ".png"),
    misused("picture body.npz -o new.png --frame 3", "--frame: there is no frame 3"),
    refused("batch none.csv", "none.csv:", "No such file"),
    *(refused(f"batch {name}.csv", *said) for name, (_, *said) in _TABLES.items()),
    misused("track cloud new.npz", "--template"),
    refused("rig cloud --template template.npz", "cloud:", "point clouds"),
    misused("rig dropped --page new.html --crop 0.5", "--crop: needs a --template"),
    refused("register template.npz cloud/s_0000.ply template.npz --overwrite", "template.npz: is the input"),
    refused("register walk body.obj walk/frame_0000.ply --overwrite", "frame_0000.ply: is the input"),
    refused("register cloud/s_0000.ply template.npz new.obj", "s_0000.ply: holds only positions"),
    refused(f"{_REGISTER} --page done.html", "done.html: exists"),
    misused(f"{_REGISTER} --threads 1000", "--threads: must be from 1 to 256"),
    misused(f"{_REGISTER} --scale --remove-planes", "--remove-planes:", "scale"),
    refused("register template.npz rig.json new.obj", "rig.json: unknown format '.json'", ".xyz", ".obj"),
    *(refused(f"{_REGISTER} --landmarks marks_{n}.json", f"marks_{n}.json:", said) for n, said in enumerate(_LANDMARKS.values())),
]  # fmt: skip


def compiled(programs: Path) -> list[Case]:
    """Cases of the program in this folder."""

    def case(line: str, *names: str, code: int = 1) -> Case:
        def run(_: World) -> None:
            command: list[Any] = [programs.resolve() / "dynmesh-complete", *line.split()]
            ended = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
            if ended.returncode:
                raise Printed(f"{ended.stderr} (exit code {ended.returncode})")

        expected = (*names, f"exit code {code}")
        return Case("dynmesh-complete", f"`{line}`", run, Printed, expected)

    body = "--template body.obj --input body.raw"
    new = "--output new.raw"
    return [
        case(f"{body}", "--output: is missing", code=2),
        case(f"{body} --output", "--output: needs a value", code=2),
        case(f"{body} {new} --speed", "--speed:", code=2),
        case(f"{body} {new} --disconnected vanish", "--disconnected:", "'vanish'", code=2),
        case(f"{body} {new} --extra-iterations 99999999999", "in range", code=2),
        case(f"{body} {new} --extra-iterations 1.5", "--extra-iterations:", "'1.5'", code=2),
        case(f"--template none.obj --input body.raw {new}", "none.obj:"),
        case(f"--template flat.obj --input body.raw {new}", "flat.obj: faces:"),
        case(f"--template nan.obj --input body.raw {new}", "nan.obj:", "vertex 1", "nan"),
        case(f"--template wild.obj --input body.raw {new}", "line 4", "vertex 9"),
        case(f"--template body.obj --input frames {new}", "frames:"),
        case(f"--template body.obj --input body.npz {new}", "body.npz:", ".raw"),
        case(f"--template body.obj --input none%d.ply {new}", "none1.ply:"),
        case(f"--template body.obj --input %s.ply {new}", "%s.ply:", "%04d"),
        case(f"--template body.obj --input other%d.obj {new}", "other1.obj:", "3", "49"),
        case(f"{body} --output done.raw", "done.raw:", "exists already"),
        case(f"{body} --output new%d.ply", "new%d.ply:", "is not empty"),
        case(f"{body} --output /dev/full", "/dev/full:", "No space left"),
    ]
