"""The gallery's page: plain HTML and CSS, no script, nothing from elsewhere."""

import html
from collections.abc import Sequence
from dataclasses import dataclass
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
:root { color-scheme: light dark; --ink: #1f2428; --soft: #66707a; --paper: #f4f2ee;
  --card: #ffffff; --line: #dcd8d0; --mark: #c96a1b; }
@media (prefers-color-scheme: dark) { :root { --ink: #e8e6e1; --soft: #9aa3ab; --paper: #17191c;
  --card: #202327; --line: #33383d; --mark: #f0984a; } }
* { box-sizing: border-box; }
body { margin: 0; background: var(--paper); color: var(--ink);
  font: 16px/1.5 system-ui, "Segoe UI", "DejaVu Sans", sans-serif; }
header, main { max-width: 1240px; margin: 0 auto; padding: 0 24px; }
header { padding-top: 56px; padding-bottom: 8px; }
h1 { font-size: 34px; line-height: 1.15; margin: 0 0 8px; letter-spacing: -0.01em; }
header p { color: var(--soft); max-width: 62ch; margin: 0; }
nav { margin-top: 20px; display: flex; gap: 18px; flex-wrap: wrap; }
nav a { color: var(--mark); text-decoration: none; font-weight: 600; }
h2 { font-size: 22px; margin: 56px 0 16px; padding-top: 12px; border-top: 3px solid var(--mark);
  display: inline-block; }
.grid { display: grid; grid-template-columns: repeat(auto-fill, minmax(240px, 1fr)); gap: 18px; }
figure { margin: 0; background: var(--card); border: 1px solid var(--line); border-radius: 8px;
  overflow: hidden; }
figure.wide { grid-column: 1 / -1; }
img { display: block; width: 100%; height: auto; }
figcaption { padding: 10px 14px 14px; }
figcaption b { display: block; }
figcaption span { color: var(--soft); font-size: 14px; }
footer { max-width: 1240px; margin: 48px auto 0; padding: 0 24px 48px; color: var(--soft);
  font-size: 14px; }
"""


def write_page(exhibits: Sequence[Exhibit], out: Path, command: str) -> None:
    """Write `index.html` into a folder that has the pictures.

    Args:
        exhibits: in the order in which they are shown; those of a section together.
        out: the folder.
        command: what made it, told at the page's end.
    """
    sections = list(dict.fromkeys(exhibit.section for exhibit in exhibits))
    links = "".join(f'<a href="#{_anchor(name)}">{html.escape(name)}</a>' for name in sections)
    parts = [_section(name, [e for e in exhibits if e.section == name]) for name in sections]
    text = f"""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>hrc_env: gallery</title>
<style>{STYLE}</style>
</head>
<body>
<header>
<h1>People beside a robot</h1>
<p>Workers, what they do, and the places where they do it: {len(exhibits)} pictures, drawn by the
environment's own renderer.</p>
<nav>{links}</nav>
</header>
<main>
{"".join(parts)}
</main>
<footer>Made by <code>{html.escape(command)}</code></footer>
</body>
</html>
"""
    (out / "index.html").write_text(text, encoding="utf-8")


def _section(name: str, exhibits: Sequence[Exhibit]) -> str:
    figures = "\n".join(_figure(exhibit) for exhibit in exhibits)
    heading = f'<h2 id="{_anchor(name)}">{html.escape(name)}</h2>'
    return f'{heading}\n<div class="grid">\n{figures}\n</div>\n'


def _figure(exhibit: Exhibit) -> str:
    title, caption = html.escape(exhibit.title), html.escape(exhibit.caption)
    return (
        f"<figure{' class=wide' if exhibit.wide else ''}>"
        f'<img src="{html.escape(exhibit.file)}" alt="{title}: {caption}" loading="lazy">'
        f"<figcaption><b>{title}</b><span>{caption}</span></figcaption></figure>"
    )


def _anchor(name: str) -> str:
    return name.lower().replace(" ", "-")
