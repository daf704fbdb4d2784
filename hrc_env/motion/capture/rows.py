"""Text files of motion capture, line by line, with errors that say where."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.typing import Floats

FEWEST_FRAMES = 2
LEAST_SHARE = 0.5
"""A file with less than this share of the frames it announces is refused; judgement."""


class Rows:
    """The lines of a file that hold words, one after the other."""

    def __init__(self, path: Path) -> None:
        self.source = path.name
        self._lines = path.read_text(errors="replace").splitlines()
        self.at = 0

    def next(self, expected: str) -> list[str]:
        """Words of the next line that has any.

        Raises:
            ConfigError: the file ends here.
        """
        for words in self.rest():
            return words
        raise ConfigError(
            f"{self.source} is cut off: after its {len(self._lines)} lines {expected} is missing."
        )

    def rest(self) -> Iterator[list[str]]:
        """Words of each line that is left and has any."""
        while self.at < len(self._lines):
            words = self._lines[self.at].split()
            self.at += 1
            if words:
                yield words

    def wrong(self, expected: str) -> ConfigError:
        """The error for the line that was read last."""
        line = self._lines[max(self.at, 1) - 1].strip() if self._lines else ""
        return ConfigError(f"{self.source}, line {self.at}: {expected}; got {line[:60]!r}.")


def number(word: str, rows: Rows) -> float:
    """A word as a number.

    Raises:
        ConfigError: it is none.
    """
    try:
        return float(word)
    except ValueError:
        raise rows.wrong("expected a number") from None


def numbers_of(rows: Rows, width: int) -> Floats:
    """(T, width) the numbers of the lines that are left; an incomplete last line is left out."""
    first = rows.at
    lines = list(rows.rest())
    if lines and len(lines[-1]) < width:
        lines.pop()
    for k, words in enumerate(lines):
        if len(words) != width:
            raise ConfigError(
                f"{rows.source}: a frame has {width} numbers, one a channel; "
                f"frame {k + 1} (about line {first + k + 1}) has {len(words)}."
            )
    try:
        return np.array(lines, dtype=float).reshape(len(lines), width)
    except ValueError as error:
        raise ConfigError(f"{rows.source}: expected numbers in its frames; {error}.") from None


def usable_frames(values: Floats, announced: int, source: str) -> tuple[Floats, tuple[str, ...]]:
    """The frames that are there and what was mended, where more or fewer were announced.

    Raises:
        ConfigError: less than half of them are there, or fewer than two.
    """
    if len(values) < max(FEWEST_FRAMES, LEAST_SHARE * announced):
        raise ConfigError(
            f"{source} is cut off: it announces {announced} frames, {len(values)} are there."
        )
    if len(values) == announced:
        return values, ()
    kept = min(len(values), announced) if announced >= FEWEST_FRAMES else len(values)
    return values[:kept], (
        f"{announced} frames are announced, {len(values)} are there: {kept} are used.",
    )
