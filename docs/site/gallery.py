"""A page for each built-in subject that plays what was seen, the completed mesh, and the original.

They exist on the site alone, and only if dynmesh was built.
"""

import contextlib
from typing import Any, get_args

from mkdocs.structure.files import File

dynmesh: Any = None
with contextlib.suppress(ImportError):  # not built
    import dynmesh

PAGE = """# Gallery

Each page plays a built-in subject: what one camera sees of it, how dynmesh completes it, coloured
by the error, and the original. The number is the NMSVE x 10^4. The same commands make them:

```console
dynmesh synth walker walker.npz
dynmesh degrade walker.npz seen.npz --camera 1
dynmesh complete seen.npz completed.npz
dynmesh view completed.npz --input seen.npz --reference walker.npz -o walker.html
```

"""
FRAMES = 60


def on_files(files: Any, config: Any) -> Any:
    """Adds the pages, and the one that leads to them."""
    text = PAGE
    for name in get_args(dynmesh.synth.Name) if dynmesh else ():
        content, error = play(name)
        files.append(File.generated(config, f"gallery/{name}.html", content=content))
        text += f"- [{name}](gallery/{name}.html): {error:.3g}\n"
    files.append(File.generated(config, "gallery.md", content=text))
    return files


def play(name: str) -> tuple[str, float]:
    """The page of a subject, and its error."""
    truth = getattr(dynmesh.synth, name)()[:FRAMES]
    seen = dynmesh.read(dynmesh.degrade(truth, camera=1))
    completed = dynmesh.read(dynmesh.complete(seen))
    page = dynmesh.view(completed, input=seen, reference=truth, title=name)
    return page.html, 1e4 * dynmesh.evaluate(completed, truth).nmsve
