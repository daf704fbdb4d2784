"""The gallery's page: plain HTML and CSS, no script, nothing from elsewhere."""

import html
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path


@dataclass(frozen=True, slots=True)
class Exhibit:
    """A picture in the gallery."""

    section: str
    """The heading that it stands under."""
    file: str
    """Path of the PNG, relative to the page."""
    title: str
    """One or two words."""
    caption: str
    """One sentence."""
    wide: bool
    """Whether it takes a row of its own."""


STYLE = """
:root { color-scheme: light dark; }
body { max-width: 1240px; margin: 40px auto; padding: 24px; font: 16px/1.5 system-ui, sans-serif; }
.grid { display: grid; grid-template-columns: repeat(auto-fill, minmax(240px, 1fr)); gap: 18px; }
figure { margin: 0; } .wide { grid-column: 1 / -1; }
img { display: block; width: 100%; height: auto; border-radius: 8px; }
figcaption { padding: 6px 2px; } figcaption span { opacity: .7; }
"""


def write_page(exhibits: Sequence[Exhibit], out: Path, command: str) -> None:
    """Write `index.html` into a folder that has the pictures.

    Args:
        exhibits: in the order in which they are shown; those of a section together.
        out: the folder.
        command: what made it, told at the page's end.
    """
    sections = groupby(exhibits, lambda exhibit: exhibit.section)
    body = "".join(
        f'<h2>{html.escape(name)}</h2><div class="grid">{"".join(map(_figure, some))}</div>\n'
        for name, some in sections
    )
    text = (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>hrc_env: gallery</title><style>{STYLE}</style></head><body>\n"
        f"<h1>People beside a robot</h1>\n{body}"
        f"<footer>Made by <code>{html.escape(command)}</code></footer></body></html>\n"
    )
    (out / "index.html").write_text(text, encoding="utf-8")


def _figure(exhibit: Exhibit) -> str:
    title, caption = html.escape(exhibit.title), html.escape(exhibit.caption)
    return (
        f"<figure{' class=wide' if exhibit.wide else ''}>"
        f'<img src="{html.escape(exhibit.file)}" alt="{title}: {caption}" loading="lazy">'
        f"<figcaption><b>{title}</b> <span>{caption}</span></figcaption></figure>\n"
    )
