from ._core import Completer, cells, __version__
