"""What is raised and warned of, as users import it."""

from ._errors import DynmeshError, InputError, KindError, SettingError
from ._report import DoubtfulWarning

__all__ = ["DoubtfulWarning", "DynmeshError", "InputError", "KindError", "SettingError"]
