"""Reader of the lines of motion-capture text files, with any encoding and decimal separator."""

import codecs
import math
import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from hrc_env.core.errors import ConfigError

MARKS = (
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF32_LE, "utf-32-le"),
    (codecs.BOM_UTF32_BE, "utf-32-be"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
)
"""Byte order marks and the corresponding encodings."""
INSPECTED = 400
"""Number of initial bytes of a file from which UTF-16 without a mark is recognized."""
NO_NUMBER = re.compile(r"[-+]?(1\.#\w+|nan(\(\w*\))?|inf(inity)?)", re.IGNORECASE)
"""Regular expression of missing values, which are NaN or infinite."""


def decode(data: bytes) -> str:
    """Decode text in UTF-8, UTF-16 or UTF-32, with or without a byte order mark, or in Latin-1."""
    for mark, encoding in MARKS:
        if data.startswith(mark):
            return data[len(mark) :].decode(encoding, errors="replace").strip("\0\x1a")
    begin = data[:INSPECTED]
    for first, encoding in ((1, "utf-16-le"), (0, "utf-16-be")):
        if begin[first::2].count(0) > len(begin) // 4:
            return data.decode(encoding, errors="replace").strip("\0\x1a")
    try:
        return data.decode("utf-8").strip("\0\x1a")
    except UnicodeDecodeError:
        return data.decode("latin-1").strip("\0\x1a")


def separate_numbers(words: Sequence[str], count: int | None = None) -> list[str]:
    """Split words into numbers with decimal points; "," and ";" may separate numbers.

    A comma is interpreted as a decimal separator if this results in `count` numbers, otherwise it
    separates numbers. If the count is unknown, it separates numbers if a word contains two commas,
    or a comma and a point.
    """
    if not any("," in word or ";" in word for word in words):
        return list(words)
    text = " ".join(words).replace(";", " ")
    apart = [word for word in (part.strip(",") for part in text.split()) if word]
    is_sign = len(apart) == count
    if count is None:
        is_sign = all(word.count(",") + word.count(".") <= 1 for word in apart)
    return [word.replace(",", ".") for word in apart] if is_sign else text.replace(",", " ").split()


def to_number(word: str) -> float:
    """Convert a word to a number, or NaN if it is missing; raise `ValueError` for other words."""
    return math.nan if NO_NUMBER.fullmatch(word) else float(word)


class Rows:
    """Reader of the non-empty lines of a text file; its error messages contain the line."""

    def __init__(self, path: Path, comments: str = "") -> None:
        """Read a file and remove comments, which begin with a match of the pattern `comments`."""
        self.source = path.name
        self._lines = decode(path.read_bytes()).splitlines()
        self._comment = re.compile(rf"(?:^|\s)(?:{comments}).*") if comments else None
        self.at = 0

    def next(self, expected: str) -> list[str]:
        """Return the words of the next non-empty line; raise `ConfigError` at the file's end."""
        for words in self.remaining():
            return words
        raise ConfigError(
            f"{self.source} is truncated: after its {len(self._lines)} lines {expected} is missing."
        )

    def remaining(self) -> Iterator[list[str]]:
        """Yield the words of each remaining non-empty line."""
        while self.at < len(self._lines):
            line = self._lines[self.at]
            words = (self._comment.sub("", line) if self._comment else line).split()
            self.at += 1
            if words:
                yield words

    def make_error(self, expected: str) -> ConfigError:
        """Return an error for the line that was read last."""
        line = self._lines[max(self.at, 1) - 1].strip() if self._lines else ""
        return ConfigError(f"{self.source}, line {self.at}: {expected}; got {line[:60]!r}.")

    def to_numbers(self, words: Sequence[str], count: int | None = None) -> list[float]:
        """Convert words of the line that was read last to numbers.

        Args:
            words: words of the line.
            count: expected number of numbers; None if unknown.

        Raises:
            ConfigError: a word is not a number, or there are too few.
        """
        try:
            values = [to_number(word) for word in separate_numbers(words, count)]
        except ValueError:
            raise self.make_error("expected a number") from None
        if count is not None and len(values) < count:
            raise self.make_error(f"expected {count} numbers")
        return values[:count]
