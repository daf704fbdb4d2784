"""Count idiom in the project's prose that a reader of an API reference stumbles over.

    python -m tests.language              # compare with the limits (part of `make check`)
    python -m tests.language --worst 40   # the texts to rewrite first
    python -m tests.language --lower      # lower the limits to the present counts

Counted are docstrings, among them the sentences below fields and constants, of the folders in
`FOLDERS`, and the prose of README.md and docs/*.md, docs/bring_your_own/*.md outside of code,
tables and generated blocks. Limits in `language.toml` are occurrences per 1,000 words, `half` their
number. They only fall.
"""

import argparse
import ast
import re
import sys
import tomllib
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from math import ceil
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
LIMITS = Path(__file__).with_name("language.toml")
FOLDERS = ("hrc_env", "agents", "benchmarks")
"""Folders whose docstrings are counted, each with limits of its own."""
PAGES = "pages"
"""Name of the limits of README.md and the pages that are written by hand."""

IDIOM = {
    "what": r"what",
    "who": r"who(?:m|se|ever)?|(?:no|some|any|every)body",
    "so_near": r"so (?:near|far|long|much|many|often|fast|large|small|late)\b(?! (?:that|as)\b)",
    "told": r"told|tells?|said|says?|spoken|hears?|asks?|asked",
}
"""Regular expressions of words that stand for a noun of the field, by the name of their limit."""
_IDIOM = {name: re.compile(rf"\b(?:{words})\b", re.I) for name, words in IDIOM.items()}
HALF = "half"
"""Name of the limit of docstrings that begin in lowercase, or end in a comma or semicolon."""

_GENERATED = re.compile(
    r"<!-- (?P<kind>example|provenance|results)\b.*?-->.*?<!-- end of (?P=kind) -->", re.S
)
_NO_PROSE = re.compile(r"^ *(`{3,}).*?^ *\1|^ *\|.*?$|<!--.*?-->|`[^`]*`", re.S | re.M)
SLACK = 0.3
"""Difference of a rate from its limit from which lowering the limit is advised."""


@dataclass
class Count:
    """Occurrences of idiom in some texts."""

    words: int = 0
    """Number of words."""
    found: Counter[str] = field(default_factory=lambda: Counter())
    """Number of occurrences by the name of their limit."""

    def add(self, text: str, is_docstring: bool) -> int:
        """Count a text; return its number of occurrences."""
        found = {name: len(pattern.findall(text)) for name, pattern in _IDIOM.items()}
        found[HALF] = int(is_docstring and is_half(text))
        self.found.update(found)
        self.words += len(re.findall(r"[A-Za-z]+", text))
        return sum(found.values())

    def rate(self, name: str) -> float:
        """Return the occurrences per 1,000 words, of `half` their number, up to the next 0.1."""
        number = self.found[name]
        return float(number) if name == HALF else ceil(1e4 * number / max(self.words, 1)) / 10


@dataclass(frozen=True)
class Text:
    """A docstring, or a paragraph of a page."""

    place: str
    """Path and line."""
    text: str
    """Content in one line."""
    is_docstring: bool
    """True for a docstring."""


def is_half(text: str) -> bool:
    """Return whether a text is no whole sentence: it begins in lowercase or ends in a comma."""
    return text[:1].islower() or text.endswith((",", ";"))


def read_docstrings(path: Path) -> Iterator[Text]:
    """Yield every string of a Python file that stands as a statement of its own."""
    for node in ast.walk(ast.parse(path.read_text())):
        match node:
            case ast.Expr(value=ast.Constant(value=str(text))):
                yield Text(f"{path}:{node.lineno}", " ".join(text.split()), True)
            case _:
                pass


def read_paragraphs(path: Path) -> Iterator[Text]:
    """Yield the paragraphs of a page of Markdown without code, tables and generated blocks."""
    page = path.read_text()
    for pattern in (_GENERATED, _NO_PROSE):
        page = pattern.sub(lambda found: "\n" * found[0].count("\n"), page)
    line = 1
    for paragraph in page.split("\n\n"):
        if text := " ".join(paragraph.split()):
            start = line + len(paragraph) - len(paragraph.lstrip("\n"))
            yield Text(f"{path}:{start}", text, False)
        line += paragraph.count("\n") + 2


def read_texts(root: Path) -> dict[str, list[Text]]:
    """Return all texts below the project's root, by the name of their limits.

    Files behind links are not counted twice (`hrc_env/agents`).
    """
    texts = {
        folder: [
            text
            for path in sorted((root / folder).rglob("*.py"))
            if path.resolve().is_relative_to((root / folder).resolve())
            for text in read_docstrings(path)
        ]
        for folder in FOLDERS
    }
    pages = [
        root / "README.md",
        *sorted((root / "docs").glob("*.md")),
        *sorted((root / "docs").glob("bring_your_own/*.md")),
    ]
    return texts | {PAGES: [text for page in pages for text in read_paragraphs(page)]}


def compare(counts: dict[str, Count], limits: dict[str, dict[str, float]]) -> list[str]:
    """Return a sentence for each count that is above its limit."""
    return [
        f'{group}: "{name}" has {counts[group].rate(name):.10g}, and its limit is {limit:.10g}.'
        for group, own in limits.items()
        for name, limit in own.items()
        if counts[group].rate(name) > limit
    ]


def find_slack(counts: dict[str, Count], limits: dict[str, dict[str, float]]) -> list[str]:
    """Return a sentence for each limit that is well above its count."""
    return [
        f'{group}: "{name}" fell to {counts[group].rate(name):.10g}, and its limit is {limit:.10g}.'
        for group, own in limits.items()
        for name, limit in own.items()
        if limit - counts[group].rate(name) > SLACK
    ]


def format_limits(counts: dict[str, Count], limits: dict[str, dict[str, float]]) -> str:
    """Return the text of `language.toml` with limits lowered to the counts; none is raised."""
    lines = ["# Largest counts that tests/language.py accepts. They may only fall:"]
    lines.append("# python -m tests.language --lower")
    for group, count in counts.items():
        lines.append(f"\n[{group}]")
        for name in _IDIOM if group == PAGES else (*_IDIOM, HALF):
            limit = min(count.rate(name), limits.get(group, {}).get(name, float("inf")))
            lines.append(f"{name} = {limit:.10g}")
    return "\n".join(lines) + "\n"


def main() -> int:
    """Print counts and limits; return 1 if a count is above its limit."""
    parser = argparse.ArgumentParser(description=str(__doc__).split("\n", 1)[0])
    parser.add_argument("--worst", type=int, default=0, help="number of texts to print")
    parser.add_argument("--lower", action="store_true", help="lower the limits to the counts")
    options = parser.parse_args()
    limits = tomllib.loads(LIMITS.read_text())
    counts: dict[str, Count] = {}
    worst: list[tuple[float, Text]] = []
    for group, texts in read_texts(ROOT).items():
        counts[group] = Count()
        for text in texts:
            if number := counts[group].add(text.text, text.is_docstring):
                worst.append((number / max(len(text.text.split()), 8), text))
    print("per 1,000 words" + "".join(f"{name:>9s}" for name in (*_IDIOM, HALF)))
    for group, count in counts.items():
        print(f"{group:15s}" + "".join(f"{count.rate(name):9.10g}" for name in (*_IDIOM, HALF)))
    for _, text in sorted(worst, key=lambda found: -found[0])[: options.worst]:
        print(f"{text.place}: {text.text[:160]}")
    if options.lower:
        LIMITS.write_text(format_limits(counts, limits))
        return 0
    above = compare(counts, limits)
    for sentence in above:
        print(sentence, "Rewrite some of these texts: python -m tests.language --worst 40")
    for sentence in find_slack(counts, limits):
        print(sentence, "Lower the limit: python -m tests.language --lower")
    return 1 if above else 0


if __name__ == "__main__":
    sys.exit(main())
