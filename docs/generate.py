"""Write what is generated of the documentation: python -m docs.generate

The reference (`docs/reference/`) comes from the code, tables of measurements in README.md and
`docs/*.md` from the studies, which declare them, and from what they found last, in
`docs/results/whole/`.
"""

import os
import re
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parent.parent))  # where benchmarks/ and docs/ are

from docs import leaderboard, names, records, reference, tables
from hrc_env.tasks import BUILT_IN

DOCS = Path(__file__).resolve().parent
PAGES = (
    DOCS.parent / "README.md",
    *sorted(DOCS.glob("*.md")),
    *sorted(DOCS.glob("bring_your_own/*.md")),
)
"""Written by hand, with tables that are filled in."""
PATH = re.compile(r"(?<![\w/`])docs/([\w/]+)\.md")
"""Paths of pages, as docstrings name them."""
PLACEHOLDER = re.compile(r'"(\w+<\w+>)"')
"""Keys with a variable part, which a browser would take for a tag."""
WRITERS: dict[Path, Callable[[], str]] = {
    DOCS / "reference" / "environment.md": reference.environment,
    **{DOCS / "reference" / f"{each}.md": partial(reference.task_page, each) for each in BUILT_IN},
    DOCS / "reference" / "config.md": reference.config,
    DOCS / "reference" / "hooks.md": reference.hooks,
    DOCS / "reference" / "infos.md": reference.infos,
    DOCS / "reference" / "command_line.md": reference.command_line,
    DOCS / "reference" / "recordings.md": reference.recordings,
    DOCS / "reference" / "shields.md": reference.shields,
    DOCS / "reference" / "leaderboard.md": leaderboard.page,
    DOCS / "reference" / "declarations.md": reference.declarations,
    DOCS / "reference" / "names.md": names.index,
    DOCS / "reference" / "records.md": records.page,
    **{
        DOCS / "reference" / "api" / names.page_name(each): partial(names.page, each)
        for each in names.groups()
    },
}
"""Functions that write the pages of the reference."""


def write_reference(page: Path) -> str:
    """Return a page of the reference, in which paths of other pages are links."""

    def link(found: re.Match[str]) -> str:
        target = os.path.relpath(DOCS / f"{found[1]}.md", page.parent)
        return f"[{found[1].rpartition('/')[2].replace('_', ' ')}]({target})"

    return PLACEHOLDER.sub(r"`\1`", PATH.sub(link, WRITERS[page]()))


REFERENCE = {page: partial(write_reference, page) for page in WRITERS}
"""Generated whole."""


def main() -> None:
    """Write every page that has changed."""
    for path in PAGES:
        _write(path, tables.filled(path.read_text()))
    for path, page in REFERENCE.items():
        _write(path, page())


def _write(path: Path, text: str) -> None:
    if not path.exists() or path.read_text() != text:
        path.write_text(text)
        print(f"wrote {path.relative_to(DOCS.parent)}")


if __name__ == "__main__":
    main()
