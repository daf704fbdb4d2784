"""A study: one question, the settings that answer it, how the answer is drawn and said."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from hrc_env.experiments.beyond.metrics import Found
from hrc_env.experiments.beyond.trial.setting import Setting


@dataclass(frozen=True, slots=True)
class Line:
    """Settings in a row along an axis."""

    label: str
    points: tuple[tuple[float, str], ...]
    """Where, and which setting."""


@dataclass(frozen=True, slots=True)
class Curves:
    """Median and 95th percentile of the error against a number."""

    title: str
    across: str
    """What the number is, with its unit."""
    lines: tuple[Line, ...]
    is_log: bool = False
    """Whether the number's axis is logarithmic."""


@dataclass(frozen=True, slots=True)
class Rows:
    """Median and 95th percentile of the error and coverage, a line a setting."""

    title: str
    settings: tuple[str, ...]


Panel = Curves | Rows


@dataclass(frozen=True, slots=True)
class Study:
    """One question."""

    name: str
    """As in results.json and on the command line."""
    title: str
    asked: str
    """The question, and what is played for it."""
    settings: tuple[Setting, ...]
    panels: Callable[[Found], tuple[Panel, ...]]
    """What is drawn."""
    says: Callable[[Found], str]
    """The answer in a sentence or two, from the numbers."""
    also: Mapping[str, str] = field(default_factory=dict)
    """What is sorted out of the settings' joints, and its words."""

    def words(self, setting: str) -> str:
        """What a setting, or what was sorted out, is called where people read."""
        return {**self.also, **{each.name: each.words for each in self.settings}}[setting]


def across(label: str, settings: dict[float, str]) -> Line:
    """A line of settings by their number."""
    return Line(label, tuple(settings.items()))
