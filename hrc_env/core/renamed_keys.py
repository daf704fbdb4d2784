"""Dictionaries that users read by key, with errors that name the right key."""

import difflib
from collections.abc import Mapping
from typing import Any, ClassVar


class RenamedKeys(dict[str, Any]):
    """A dictionary with errors that name the right key for a former or misspelt one."""

    KIND: ClassVar[str]
    """Kind of the keys, such as "info key"."""
    RENAMED: ClassVar[Mapping[str, str]]
    """Current keys by their former keys."""

    def __missing__(self, key: str) -> Any:
        """Raise a `KeyError` for a missing key."""
        if key in self.RENAMED:
            raise KeyError(describe_renaming(self.KIND, key, self.RENAMED))
        near = difflib.get_close_matches(str(key), self, 1)
        raise KeyError(f"{key}; did you mean {near[0]!r}?" if near else key)

    def get(self, key: str, default: Any = None) -> Any:
        """Return the value of a key, or `default` for one that is missing.

        Raises:
            KeyError: the key is a former one.
        """
        if key in self.RENAMED and key not in self:
            raise KeyError(describe_renaming(self.KIND, key, self.RENAMED))
        return super().get(key, default)


def describe_renaming(kind: str, former: str, renamed: Mapping[str, str]) -> str:
    """Return the error message for a former name.

    Args:
        kind: kind of the name, such as "info key".
        former: the former name.
        renamed: current names by their former names.
    """
    return f"The {kind} {former!r} is called {renamed[former]!r} now."
