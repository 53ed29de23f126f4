"""Cases of the commands: `dynmesh`, and `dynmesh-complete`, which is compiled."""

import re
import struct
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
from commands import run_here

import dynmesh

from .case import Case, Printed, World
from .files import on_a_full_disk


def prepare(world: World) -> None:
    """Creates further files that the cases read, in addition to those of `files.prepare`."""
    folder = world.folder
    corners = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in world.vertices.tolist()]
    faces = ["f " + " ".join(str(v + 1) for v in face) for face in world.faces.tolist()]
    (folder / "body.obj").write_text("\n".join(corners + faces))
    (folder / "nan.obj").write_text("v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n")
    (folder / "wild.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n")
    (folder / "flat.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\n")
    (folder / "empty.obj").touch()
    frames = world.sequence.vertices.astype("<f4")
    (folder / "body.raw").write_bytes(frames.tobytes())
    (folder / "cut.raw").write_bytes(frames.tobytes()[:-100])
    wild = frames.copy()
    wild[0, 4, 1] = 1e30
    (folder / "wild.raw").write_bytes(wild.tobytes())
    header = struct.pack("<12siiffi", b"POINTCACHE2\0", 1, 7, 0.0, 1.0, 2)
    (folder / "other.pc2").write_bytes(header + bytes(7 * 12 * 2))
    (folder / "empty.pc2").touch()
    header = struct.pack("<12siiffi", b"POINTCACHE2\0", 1, 49, 0.0, 1.0, -5)
    (folder / "negative.pc2").write_bytes(header + frames.tobytes())
    holed = frames.copy()
    holed[1, 4, 1] = np.nan
    (folder / "holed.raw").write_bytes(holed.tobytes())
    (folder / "two.raw").write_bytes(frames[:2].tobytes())
    (folder / "none_in.raw").touch()
    (folder / "in_mm.raw").write_bytes((1000 * frames).tobytes())
    (folder / "renamed.raw").write_bytes((folder / "body.pc2").read_bytes())
    (folder / "done.raw").write_bytes(b"precious")
    (folder / "done.html").write_text("precious")
    for name, text in {
        "no_column": "input\nbody.npz\n",
        "odd_column": "input,output,colour\nbody.npz,new.npz,red\n",
        "no_value": "input,output\n,new.npz\n",
        "too_many": "input,output\nbody.npz,new.npz,more\n",
        "no_number": "input,output,fps\nbody.npz,new.npz,fast\n",
        "no_count": "input,output,threads\nbody.npz,new.npz,1.5\n",
        "no_flag": "input,output,provenance\nbody.npz,new.npz,perhaps\n",
        "no_method": "input,output,method\nbody.npz,new.npz,lsm\n",
        "out_of_range": "input,output,threads\nbody.npz,new.npz,0\n",
        "input_and_scans": "input,scans,output\nbody.npz,cloud,new.npz\n",
        "no_template": "scans,output,template\ncloud,new.npz,\n",
        "scans_method": "scans,output,template,method\ncloud,new.npz,template.npz,detail\n",
        "scans_uncertain": "scans,output,template,uncertainty\ncloud,new.npz,template.npz,yes\n",
        "input_cameras": "input,output,cameras\nbody.npz,new.npz,rig.json\n",
        "no_start": "input,output,start\nbody.npz,new.npz,first\n",
        "no_take": "input,output,training\nbody.npz,new.npz,;training.npz\n",
        "failing": "input,output\nnone.npz,new.npz\n",
        "tabs": "input\toutput\nbody.npz\tnew.npz\n",
        "nothing": "",
        "too_few": "input,output\n\nbody.npz\n",
        "unclosed": 'input,output\nbody.npz,"new.npz\n',
        "semicolons": "input;output\nbody.npz;new.npz\n",
    }.items():
        (folder / f"{name}.csv").write_text(text)
    (folder / "quad.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 4 3\n")
    fewer = world.sequence.vertices[:, :7], np.array([[0, 1, 2]])
    dynmesh.write(folder / "fewer.npz", dynmesh.Sequence(*fewer))
    (folder / "gap").mkdir()
    for number in (0, 1, 3):
        (folder / "gap" / f"f_{number:04d}.obj").write_text("\n".join(corners + faces))


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


def shell_case(line: str, *names: str, full: bool = False) -> Case:
    """A command line that must fail."""

    def run(_: World) -> None:
        if full:
            on_a_full_disk(lambda: dynmesh_command(*line.split()))
        else:
            dynmesh_command(*line.split())

    given = f"`{line}`" + (", where no file may exceed 20 kB" if full else "")
    return Case(f"dynmesh {line.split()[0]}", given, run, Printed, names)


shell = [
    shell_case("info none.npz", "none.npz:", "No such file", "exit code 1"),
    shell_case("info letter.npz", "letter.npz:", "damaged", "exit code 1"),
    shell_case(
        "complete holes.npz new.npz",
        "holes.npz",
        "1 of 49",
        "vertex 4",
        "--start whole",
        "exit code 1",
    ),
    shell_case("info gap", "gap: f_0002.obj is missing", "add it", "exit code 1"),
    shell_case("info gap/f_*.obj", "gap/f_*.obj: f_0002.obj is missing", "exit code 1"),
    shell_case("info body.npz --brief", "--brief", "--json", "exit code 2"),
    shell_case("info body.npz other.npz", "other.npz", "put patterns in quotes", "exit code 2"),
    shell_case("complete body.npz other.npz", "other.npz:", "--overwrite", "exit code 1"),
    shell_case("complete body.npz body.npz --overwrite", "body.npz:", "input", "exit code 1"),
    shell_case("complete body.npz folder.npz", "folder.npz", "exit code 1"),
    shell_case("complete body.npz no/new.npz", "no/new.npz:", "no folder no", "exit code 1"),
    shell_case("complete body.npz new.stl", "new.stl:", "'.stl'", "exit code 1"),
    shell_case("complete body.npz new", "new:", "no suffix", "exit code 1"),
    shell_case("complete body.npz new.npz --format fbx", "body.npz:", "'fbx'", "exit code 1"),
    shell_case("complete body.npz new.npz --mask none.npy", "none.npy:", "exit code 1"),
    shell_case("complete body.npz new.npz --mask mask.npy", "mask.npy:", "(3, 48)", "exit code 1"),
    shell_case("complete body.npz new.npz --faces body.obj", "body.npz:", "faces", "exit code 1"),
    shell_case("complete body.npz new.npz --prim /a", "body.npz:", "prim", "exit code 1"),
    shell_case("complete body.npz new.npz --fps 0", "fps:", "not 0", "exit code 1"),
    shell_case("complete body.npz new.npz --fps fast", "--fps", "'fast'", "exit code 2"),
    shell_case("complete none new.npz", "none:", "no such file or folder", "exit code 1"),
    shell_case("complete no* new.npz", "no*:", "no suffix", "exit code 1"),
    shell_case("complete body.npz new.npz --method lsm", "--method", "'lsm'", "exit code 2"),
    shell_case(
        "complete body.npz new.npz --disconnected x", "--disconnected", "'x'", "exit code 2"
    ),
    shell_case("complete body.npz new.npz --missing nan", "--missing", "'nan'", "exit code 2"),
    shell_case(
        "complete body.npz new.npz --extra-iterations -1", "--extra-iterations", "-1", "code 2"
    ),
    shell_case("complete body.npz new.npz --extra-iterations 1e9", "'1e9'", "exit code 2"),
    shell_case("complete body.npz new.npz --extra-iterations 10000000", "'--extra", "code 2"),
    shell_case(
        "complete body.npz new.npz --no-revisit", "'--no-revisit'", "--method motion", "exit code 2"
    ),
    shell_case(
        "complete body.npz new.npz --method detail --extra-iterations 2",
        "'--extra-iterations'",
        "motion",
        "exit code 2",
    ),
    shell_case(
        "complete body.npz new.npz --extra-iterations 9",
        "'--extra-iterations'",
        "--method motion",
        "exit code 2",
    ),
    shell_case(
        "complete body.npz new.npz --method motion --noise 0.1",
        "'--noise'",
        "--method detail",
        "exit code 2",
    ),
    shell_case("complete body.npz new.npz --noise -1", "'--noise'", "not -1", "exit code 2"),
    *(
        shell_case(
            f"complete body.npz new.npz --drop-above {value}",
            "'--drop-above'",
            f"must be positive and finite, not {value}",
            "exit code 2",
        )
        for value in ("0.0", "-1.0", "nan", "inf")
    ),
    *(
        shell_case(
            f"complete body.npz new.npz --drop-above 1 --method motion{more}",
            "'--drop-above'",
            "requires --method detail",
            "exit code 2",
        )
        for more in ("", " --prim all")
    ),
    shell_case("complete body.npz new.npz --start 3", "start: must be less", "3", "exit code 1"),
    shell_case("complete body.npz new.npz --start -1", "'--start'", "'-1'", "exit code 2"),
    shell_case("complete body.npz new.npz --start half", "'--start'", "'half'", "exit code 2"),
    shell_case(
        "complete body.npz new.npz --template quad.obj",
        "quad.obj: its number of vertices is 4, but 49 in body.npz",
        "exit code 1",
    ),
    shell_case("complete gap new.npz", "gap: f_0002.obj", "--gaps lost", "exit code 1"),
    shell_case("complete body.npz new.npz --gaps lost", "body.npz: gaps", "npz", "exit code 1"),
    shell_case("complete body.npz new.npz --gaps some", "'--gaps'", "'some'", "exit code 2"),
    shell_case("complete body.npz new.npz --threads 0", "--threads", "0", "exit code 2"),
    shell_case("complete body.npz new.npz --threads 257", "'--threads'", "not 257", "exit code 2"),
    shell_case(
        "complete body.npz new.npz --method motion --reject-outliers",
        "'--reject-outliers'",
        "--method detail",
        "exit code 2",
    ),
    shell_case(
        "complete body.npz new.npz --method motion --learn",
        "'--learn'",
        "--method detail",
        "exit code 2",
    ),
    shell_case("complete body.npz new.npz --speed 3", "--speed", "exit code 2"),
    shell_case("complete body.npz", "OUT", "exit code 2"),
    shell_case("complete long.npz new.npz", "new.npz:", "exit code 1", full=True),
    shell_case("complete scene.usda new.npz --prim all", "new.npz:", "USD or Alembic", "code 1"),
    shell_case("complete body.npz new.usda --prim all", "body.npz:", "single mesh", "exit code 1"),
    shell_case("complete scene.usda new.usda --prim all --resume", "'--resume'", "exit code 2"),
    shell_case("complete scene.usda new.usda --prim all --fps 25", "'--fps'", "exit code 2"),
    shell_case("complete scene.usda new.usda --prim all --mask mask.npy", "known:", "exit code 1"),
    shell_case("complete still.usda new.usda --prim all", "still.usda:", "/mesh", "exit code 1"),
    shell_case("complete scene.usda new.abc --overlay", "new.abc:", ".usda", "exit code 1"),
    shell_case("complete scene.abc new.usda --overlay", "new.usda:", "must be USD", "exit code 1"),
    shell_case("complete scene.usda new.usda --overlay --fps 25", "fps:", "be 25", "exit code 1"),
    shell_case("complete scene.usda new.usda --overlay --resume", "new.usda:", "resumed", "code 1"),
    shell_case("info scene.usda --prim all", "scene.usda:", "--prim all", "/mesh", "exit code 1"),
    shell_case("convert scene.abc new.abc --prim all", "scene.abc:", "/mesh", "exit code 1"),
    shell_case("degrade body.npz new.npz", "--known", "--noise", "exit code 2"),
    shell_case(
        "degrade body.npz new.npz --known 30",
        "--known",
        "not 30; for 30 per cent, write 30%",
        "exit code 2",
    ),
    shell_case(
        "degrade body.npz new.npz --known 130%", "--known", "below 100%", "130%", "exit code 2"
    ),
    shell_case(
        "degrade body.npz new.npz --patches third",
        "--patches",
        "0.3 or 30%",
        "third",
        "exit code 2",
    ),
    shell_case("degrade body.npz new.npz --known 0", "--known", "not 0", "exit code 2"),
    shell_case("degrade body.npz new.npz --known 1", "--known", "not 1", "exit code 2"),
    shell_case("degrade body.npz new.npz --noise nan", "--noise", "nan", "exit code 2"),
    shell_case("degrade body.npz new.npz --known nan", "--known", "nan", "exit code 2"),
    shell_case("degrade body.npz new.npz --camera 0", "--camera", "0", "exit code 2"),
    shell_case("degrade body.npz new.npz --noise -1", "--noise", "-1", "exit code 2"),
    shell_case("degrade body.npz new.npz --dropout 1", "--dropout", "1", "exit code 2"),
    shell_case("degrade body.npz new.npz --known 0.5 --seed -1", "--seed", "-1", "exit code 2"),
    shell_case("evaluate body.npz none.npz", "none.npz:", "exit code 1"),
    shell_case("evaluate late_holes.npz body.npz", "late_holes.npz: frame 1", "vertex 4", "code 1"),
    shell_case("evaluate single.npz body.npz", "1 frame", "3", "exit code 1"),
    shell_case("evaluate single.npz single.npz", "frame 0", "exit code 1"),
    shell_case("evaluate body.npz long.npz", "3 frames", "40", "exit code 1"),
    shell_case("synth lake new.npz", "'lake'", "ocean", "exit code 2"),
    shell_case("synth ocean new.npz --frames 0", "--frames", "0", "exit code 2"),
    shell_case("convert body.npz other.npz", "other.npz:", "--overwrite", "exit code 1"),
    shell_case("convert long.npz new.npz", "new.npz:", "exit code 1", full=True),
    shell_case("view body.npz -o new.txt", "new.txt:", "exit code 1"),
    shell_case("view body.npz -o new.html --colour age", "age", "exit code 1"),
    shell_case("view body.npz -o new.html --max-frames 0", "--max-frames", "0", "exit code 2"),
    shell_case("view body.npz -o new.html --colour red", "--colour", "'red'", "exit code 2"),
    shell_case("view body.npz -o new.html --input long.npz", "3 frames", "40", "exit code 1"),
    shell_case("view body.npz -o new.html --input fewer.npz", "49 vertices", "exit code 1"),
    shell_case("view body.npz -o new.html --input none.npz", "none.npz:", "exit code 1"),
    shell_case(
        "view body.npz -o new.html --reference late_holes.npz",
        "late_holes.npz:",
        "vertex 4",
        "code 1",
    ),
    shell_case("view body.npz -o new.html --reference long.npz", "3 frames", "40", "exit code 1"),
    shell_case("view body.npz -o new.html --reference fewer.npz", "49 vertices", "exit code 1"),
    shell_case("view body.npz -o new.html --range 0 1", "range:", "not plain", "exit code 1"),
    shell_case(
        "view body.npz -o new.html --reference body.npz --range 2 1", "range:", "not 2 1", "code 1"
    ),
    shell_case(
        "view body.npz -o new.html --reference body.npz --range 0 nan", "range:", "nan", "code 1"
    ),
    shell_case("view body.npz -o new.html --range 1", "--range", "exit code 2"),
    shell_case("view body.npz -o new.html --range low 2", "'low'", "exit code 2"),
    shell_case("view body.npz -o done.html", "done.html:", "--overwrite", "exit code 1"),
    shell_case("view body.npz -o no/new.html", "no folder", "exit code 1"),
    shell_case("picture body.npz -o new.jpg", "new.jpg:", ".png", "exit code 1"),
    shell_case("picture body.npz -o new.png --frame 3", "frame 3", "exit code 1"),
    shell_case("picture body.npz -o new.png --range 0 1", "range:", "not plain", "exit code 1"),
    shell_case(
        "picture body.npz -o new.png --reference body.npz --range 3 3",
        "range:",
        "not 3 3",
        "code 1",
    ),
    shell_case("picture body.npz -o new.png --reference fewer.npz", "49 vertices", "exit code 1"),
    shell_case("picture body.npz -o new.png --size 0", "--size", "0", "exit code 2"),
    shell_case("batch none.csv", "none.csv:", "No such file", "exit code 1"),
    shell_case("batch no_column.csv", "no_column.csv:", "'output'", "exit code 1"),
    shell_case("batch semicolons.csv", "semicolons.csv:", "'input'", "commas", "exit code 1"),
    shell_case("batch tabs.csv", "tabs.csv:", "'input'", "tabs", "exit code 1"),
    shell_case("batch nothing.csv", "nothing.csv:", "'input'", "exit code 1"),
    shell_case("batch too_few.csv", "too_few.csv: line 3", "exit code 1"),
    shell_case("batch unclosed.csv", "unclosed.csv:", "exit code 1"),
    shell_case("batch odd_column.csv", "odd_column.csv:", "'colour'", "exit code 1"),
    shell_case("batch no_value.csv", "no_value.csv: line 2", "input", "exit code 1"),
    shell_case("batch too_many.csv", "too_many.csv: line 2", "exit code 1"),
    shell_case(
        "batch no_number.csv",
        "no_number.csv: line 2: fps: must be a number, not 'fast'",
        "exit code 1",
    ),
    shell_case(
        "batch no_count.csv", "line 2: threads: must be a whole number, not '1.5'", "exit code 1"
    ),
    shell_case(
        "batch no_flag.csv",
        "line 2: provenance: must be true or false, not 'perhaps'",
        "exit code 1",
    ),
    shell_case(
        "batch no_method.csv", "line 2: method: must be motion or detail, not 'lsm'", "exit code 1"
    ),
    shell_case("batch no_start.csv", "no_start.csv: line 2: start:", "'first'", "exit code 1"),
    shell_case(
        "batch out_of_range.csv", "failed: body.npz: threads: must be from 1", "exit code 1"
    ),
    shell_case("batch input_and_scans.csv", "line 2: has both input and scans", "exit code 1"),
    shell_case("batch no_template.csv", "line 2: template is empty", "exit code 1"),
    shell_case(
        "batch scans_method.csv", "line 2: method: cannot be combined with scans", "exit code 1"
    ),
    shell_case("batch scans_uncertain.csv", "line 2: uncertainty: needs provenance", "exit code 1"),
    shell_case(
        "batch input_cameras.csv", "line 2: cameras: cannot be combined with input", "exit code 1"
    ),
    shell_case("batch failing.csv", "none.npz:", "1 failed", "exit code 1"),
    shell_case("batch failing.csv --workers 0", "--workers", "0", "exit code 2"),
    shell_case("frobnicate body.npz", "frobnicate", "exit code 2"),
]


def compiled(programs: Path) -> list[Case]:
    """Cases of the program in this folder."""

    def case(line: str, *names: str) -> Case:
        def run(_: World) -> None:
            command: list[Any] = [programs.resolve() / "dynmesh-complete", *line.split()]
            ended = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
            if ended.returncode:
                printed = ended.stderr.strip().replace(str(command[0]), "dynmesh-complete")
                printed = " / ".join(printed.splitlines())
                raise Printed(f"{printed} (exit code {ended.returncode})")

        return Case("dynmesh-complete", f"`{line}`", run, Printed, names)

    body = "--template body.obj --input body.raw"
    new = "--output new.raw"
    detail = f"{body} {new} --method detail --training"
    return [
        case(f"{body}", "--output is missing", "exit code 2"),
        case(f"--template body.obj {new}", "--input is missing", "exit code 2"),
        case(f"--input body.raw {new}", "--template is missing", "exit code 2"),
        case(f"{body} {new} more", "'more'", "exit code 2"),
        case(f"{body} {new} --speed", "'--speed'", "exit code 2"),
        case(f"{body} {new} --disconnected vanish", "--disconnected:", "'vanish'", "exit code 2"),
        case(f"{body} {new} --extra-iterations many", "--extra-iterations:", "'many'", "code 2"),
        case(
            f"{body} {new} --method motion --extra-iterations -1",
            "--extra-iterations:",
            "-1",
            "exit code 2",
        ),
        case(f"{body} {new} --extra-iterations 99999999999", "out of range", "exit code 2"),
        case(f"{body} {new} --extra-iterations 1.5", "'1.5'", "exit code 2"),
        case(f"--template none.obj --input body.raw {new}", "none.obj:", "exit code 1"),
        case(f"--template empty.obj --input body.raw {new}", "empty.obj:", "exit code 1"),
        case(f"--template flat.obj --input body.raw {new}", "flat.obj: faces:", "exit code 1"),
        case(f"--template nan.obj --input body.raw {new}", "nan.obj:", "vertex 1", "nan", "code 1"),
        case(f"--template wild.obj --input body.raw {new}", "line 4", "vertex 9", "exit code 1"),
        case(f"--template body.raw --input body.raw {new}", "body.raw:", ".obj", "exit code 1"),
        case(f"--template body.obj --input none.raw {new}", "none.raw:", "exit code 1"),
        case(f"--template body.obj --input frames {new}", "frames:", "exit code 1"),
        case(f"--template body.obj --input body.npz {new}", "body.npz:", ".pc2", "exit code 2"),
        case(f"--template body.obj --input other.pc2 {new}", "other.pc2:", "7", "49", "code 1"),
        case(f"--template body.obj --input empty.pc2 {new}", "empty.pc2:", "is not", "code 1"),
        case(f"--template body.obj --input negative.pc2 {new}", "negative.pc2:", "-5", "code 1"),
        case(f"--template body.obj --input renamed.raw {new}", "renamed.raw:", "PC2", "code 1"),
        case("--template body.obj --input renamed.raw --output done.raw --overwrite", "PC2"),
        case(f"--template body.obj --input wild.raw {new}", "wild.raw: frame 1:", "row 4", "e+30"),
        case(
            f"{body} {new} --method motion --training body.raw",
            "--training:",
            "--method detail",
            "code 2",
        ),
        case(f"{detail} none.raw", "none.raw:", "exit code 1"),
        case(f"{detail} body.npz", "body.npz:", ".pc2", "exit code 2"),
        case(f"{detail} other.pc2", "other.pc2:", "7", "49", "exit code 1"),
        case(f"{detail} cut.raw", "cut.raw: frame 3", "bytes", "exit code 1"),
        case(f"{detail} holed.raw", "holed.raw: frame 2: vertex 4", "nan", "exit code 1"),
        case(f"{detail} body.raw --training holed.raw", "holed.raw: frame 2: vertex 4", "code 1"),
        case(f"{detail} two.raw", "two.raw:", "2", "3", "exit code 1"),
        case(f"{detail} none_in.raw --training body.raw", "none_in.raw: has no frames", "code 1"),
        case(f"{detail} in_mm.raw", "in_mm.raw:", "2836", "unit", "exit code 1"),
        case(f"{detail} - --training -", "standard input", "once", "exit code 2"),
        case(
            f"{body} --output two.raw --overwrite --method detail --training two.raw",
            "two.raw: is also a training sequence",
            "exit code 2",
        ),
        case(f"{body} --output done.raw", "done.raw:", "--overwrite", "exit code 1"),
        case(f"{body} --output body.raw --overwrite", "body.raw:", "input", "exit code 2"),
        case(f"{body} --output no/new.raw", "no/new.raw:", "exit code 1"),
        case(f"{body} --output new.npz", "new.npz:", ".pc2", "exit code 2"),
        case(f"{body} --output /dev/full", "/dev/full:", "No space left", "exit code 1"),
    ]
