"""Build the site: make docs, python -m docs.site [FOLDER]

Sphinx writes the pages of `docs/` as HTML into out/docs, or another folder, with warnings as errors
and without a network; then every link inside of it is followed.
"""

import importlib.util
import shutil
import sys
from collections.abc import Sequence
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

DOCS = Path(__file__).resolve().parent
OUT = DOCS.parent / "out" / "docs"
NEEDED = {"sphinx": "sphinx", "furo": "furo", "myst_parser": "myst-parser"}
"""Modules, and the packages of the extra `docs` that bring them."""
FETCHED = {"script": "src", "img": "src", "link": "href", "iframe": "src", "source": "src"}
"""Elements that a browser loads, and the attribute with the address."""
KEPT_LINKS = ("canonical", "search", "prev", "next", "index", "genindex", "author")
"""Relations of a `link` that a browser does not load."""


class Page(HTMLParser):
    """The anchors, links and loaded files of a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.anchors: set[str] = set()
        self.links: list[str] = []
        self.loaded: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Record the anchor, the link and the loaded file of an element."""
        values = {name: value or "" for name, value in attrs}
        self.anchors.add(values.get("id", ""))
        if tag == "a" and "href" in values:
            self.links.append(values["href"])
        if values.get("rel") not in KEPT_LINKS and FETCHED.get(tag) in values:
            self.loaded.append(values[FETCHED[tag]])


def main(words: Sequence[str] = ()) -> int:
    """Build and check the site; return the exit status.

    Args:
        words: the folder, if it is not out/docs.
    """
    out = Path(words[0]).resolve() if words else OUT
    missing = [
        package for module, package in NEEDED.items() if not importlib.util.find_spec(module)
    ]
    if missing:
        print(f"The site needs {', '.join(missing)}: pip install -e '.[docs]'", file=sys.stderr)
        return 2
    status = build(out)
    wrong = [] if status else broken_links(out)
    for each in wrong:
        print(each, file=sys.stderr)
    if not status and not wrong:
        print(f"The site is {out / 'index.html'}")
    return status or int(bool(wrong))


def build(out: Path) -> int:
    """Write the site into a folder that is emptied before; return Sphinx's exit status."""
    from sphinx.cmd.build import main as sphinx

    shutil.rmtree(out, ignore_errors=True)
    words = ["-q", "-n", "-W", "--keep-going", "-b", "html", "-d", f"{out}/.doctrees"]
    status = sphinx([*words, str(DOCS), str(out)])
    shutil.rmtree(out / ".doctrees", ignore_errors=True)
    return status


def broken_links(out: Path) -> list[str]:
    """Return messages about links without a target, and about files from other sites."""
    pages = {path: Page(path.read_text()) for path in out.rglob("*.html")}
    wrong = []
    for path, page in pages.items():
        name = path.relative_to(out)
        wrong += [f"{name} loads {each}" for each in page.loaded if urlsplit(each).netloc]
        local = [each for each in page.loaded if not urlsplit(each).scheme]
        for link in (*page.links, *local):
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                if parts.scheme not in ("http", "https") or not parts.netloc:
                    wrong.append(f"{name}: {link} is no address")
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            if not target.is_file():
                wrong.append(f"{name}: {link} leads nowhere")
            elif not _has_section(pages.get(target), unquote(parts.fragment)):
                wrong.append(f"{name}: {link} has no such section")
    return wrong


def _has_section(page: Page | None, anchor: str) -> bool:
    """Return whether a page has an anchor; True for "", and for files that are no pages."""
    return not anchor or page is None or anchor in page.anchors


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
