"""Things whose state can be saved and brought back in the middle of an episode.

A thing names the attributes that change; the others are settings and constants, which a
state does not hold.
"""

from typing import Any, ClassVar

from hrc_env.core.batching import copied

State = dict[str, Any]


class Stateful:
    """Saves and brings back the attributes named in `CHANGES`."""

    CHANGES: ClassVar[tuple[str, ...]] = ()

    def get_state(self) -> Any:
        """A copy of everything that changes; `set_state` brings it back bit for bit."""
        return {name: _saved(getattr(self, name)) for name in self.CHANGES}

    def set_state(self, state: Any) -> None:
        """Continue from a state of a thing with the same settings; the state stays as it is."""
        for name in self.CHANGES:
            part = getattr(self, name)
            if hasattr(part, "set_state"):
                part.set_state(state[name])
            else:
                setattr(self, name, copied(state[name]))


def _saved(part: Any) -> Any:
    return part.get_state() if hasattr(part, "get_state") else copied(part)
