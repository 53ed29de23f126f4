"""The pages of the reference, which exist on the site alone.

They are made of what they describe: the package, the help of its commands, the public headers, and
the errors that the tests provoke.
"""

import contextlib
import re
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File

dynmesh: Any = None
app: Any = None
with contextlib.suppress(ImportError):  # not built
    import dynmesh
    from dynmesh.cli import VERBS, app

MODULES = ("baselines", "frames", "losses", "metrics", "scans", "synth", "topology")
"""What is documented beside the names of the package itself."""

GROUPS = ("Classes", "Functions", "Modules")

REPOSITORY = Path(__file__).parents[2]
PACKAGE = REPOSITORY / "python" / "dynmesh"
HEADERS = REPOSITORY / "cpp" / "include" / "dynmesh"
NOT_BUILT = "dynmesh was not built when this site was.\n"

PYTHON = """# Python

All positions are in the unit of length of your data. `dynmesh.metrics.nmsve` returns the NMSVE in
the unit of the positions. Everywhere else it is divided by the diagonal of the bounding box of
frame 0, and tables show it multiplied by 10⁴.
"""
PAGE = "reference/python/{}.md"
COMMANDS = """# The shell

`dynmesh COMMAND --help` prints the same. The exit code is 0 for success, 1 if data or a file is
refused, 2 if the command line is wrong, and 3 if a result was written but is probably wrong.
`dynmesh --install-completion` lets the tab key complete commands, options and values.
"""
CPP = """# C++

Include `<dynmesh/dynmesh.hpp>` and link to `dynmesh::dynmesh`; [Embedding](../embedding.md) says
how to build and find it. The headers include the standard library only.
"""
C = """# C

All functions return a status; `dynmesh_last_message()` describes the last error of the calling
thread. [Embedding](../embedding.md) says how to build and link the library.
"""

TYPE = re.compile(
    r"(?:class|struct|enum(?: class)?) (?:alignas\(.*?\) |DYNMESH_EXPORT )*(\w+)[^;]*$"
)
POINTER = re.compile(r"typedef .*\(\*(\w+)\)")
FUNCTION = re.compile(r"(?![ #}]|typedef|using|struct|namespace|extern|.*operator).*?(\w+)\(")


def on_files(files: Any, config: Any) -> Any:
    """Adds the pages, and those of Python to the navigation."""
    headers = sorted(HEADERS.glob("*.hpp"))
    pages = {
        "reference/commands.md": commands(),
        "reference/cpp.md": CPP + "".join(header(x, "cpp") for x in headers if x.stem != "dynmesh"),
        "reference/c.md": C + header(HEADERS / "dynmesh.h", "c"),
    }
    index, groups = PYTHON, []
    for group, names in zip(GROUPS, python_names(), strict=True):
        of_group = {name: PAGE.format(f"{group}/{name}".lower()) for name in names}
        index += f"\n## {group}\n\n"
        for name, path in of_group.items():
            pages[path] = f"::: dynmesh.{name}\n"
            index += f"- [{name}]({group.lower()}/{name.lower()}.md){summary(name)}\n"
        groups.append({group: [{name: path} for name, path in of_group.items()]})
    pages[PAGE.format("index")] = index
    for path, text in pages.items():
        files.append(File.generated(config, path, content=text))
    (reference,) = (group["Reference"] for group in config.nav if "Reference" in group)
    reference[-1] = {"Python": [PAGE.format("index"), *groups]}
    return files


def python_names() -> tuple[list[str], list[str], tuple[str, ...]]:
    """The classes, functions and modules that `import dynmesh` has and that are documented."""
    names = re.findall(r"from \.\S+ import ([^\W_]\w*) as", (PACKAGE / "__init__.py").read_text())
    classes = [name for name in names if name[0].isupper()]
    return classes, [name for name in names if name not in classes], MODULES


def summary(name: str) -> str:
    """The first sentence of the docstring."""
    if dynmesh is None:
        return ""
    text = getattr(dynmesh, name).__doc__.partition("\n\n")[0]
    return ": " + " ".join(text.split())


def commands() -> str:
    """The page of what the commands print as their help."""
    if app is None:
        return f"{COMMANDS}\n{NOT_BUILT}"
    text = COMMANDS
    for verb in VERBS:
        of_verb = app[verb].generate_docs(usage_name=f"dynmesh {verb}", heading_level=2)
        _, _, below_the_title = of_verb.partition("\n")
        text += f"\n## dynmesh {verb}\n{below_the_title}"
    return text


def header(path: Path, language: str) -> str:
    """A public header, with headings for its types and functions."""
    return f"\n## dynmesh/{path.name}\n" + "".join(
        (f"\n### {name}\n" if name else "") + f"\n```{language}\n{text}\n```\n"
        for name, text in parts(path.read_text())
    )


def parts(header: str) -> list[tuple[str, str]]:
    """Returns the text of each type and function with its name, and what stands before the first.

    They are separated by empty lines and begin at the left margin. Overloads stay together.
    """
    found = [("", "")]
    for block in header.strip().split("\n\n"):
        name = _name(block) or found[-1][0]
        if name == found[-1][0]:
            found[-1] = (name, f"{found[-1][1]}\n\n{block}".lstrip("\n"))
        else:
            found.append((name, block))
    return found


def _name(block: str) -> str:
    for line in block.splitlines():
        if line.startswith(("//", "template", "/*", " *")):
            continue
        for pattern in (TYPE, POINTER, FUNCTION):
            if match := pattern.match(line.removeprefix("typedef ") if pattern is TYPE else line):
                return match[1]
        return ""
    return ""
