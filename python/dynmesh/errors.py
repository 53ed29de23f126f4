"""What is raised and warned of, as users import it.

Wherever nothing else is said, a function that takes an argument of a wrong kind raises TypeError,
one out of range or a file that is no valid one ValueError, both of which are a
:class:`DynmeshError`; a file that cannot be read or written OSError; and a library that is not
installed ImportError, which names the extra. Messages say what is wrong, where, and with which
value, and objects stay as they were.
"""

from ._errors import DynmeshError, InputError, KindError, SettingError
from ._report import DoubtfulWarning

__all__ = ["DoubtfulWarning", "DynmeshError", "InputError", "KindError", "SettingError"]
