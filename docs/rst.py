"""Docstrings, which are Markdown in Google's style, as the reStructuredText that Sphinx reads."""

import re
import textwrap

from hrc_env import PUBLIC

SECTION = re.compile(r"^(?:Args|Returns|Yields|Raises):$", re.M)
BLOCK = re.compile(r"((?:^    .*\n|^\n(?=    ))+)", re.M)
"""Lines of code between paragraphs."""
CODE = re.compile(r"(`[^`]+`)")
PAGE = re.compile(r"\bdocs/([\w/]+)\.md\b")
SPECIAL = re.compile(r"(?<!\S)\*\w+\*(?!\w)|[*|]|\b_|_\b")
"""Emphasis, which both languages write alike, and characters that would begin or end markup."""

MODULES = {"columns": "hrc_env.experiments.columns"}
"""Public names that are modules, and their own names, by which Sphinx documents them."""


def from_docstring(text: str) -> str:
    """Return a docstring with its code, names of the API and pages marked up."""
    section = SECTION.search(text)
    end = section.start() if section else len(text)
    body, sections = text[:end], text[end:]
    parts = BLOCK.split(body.rstrip() + "\n") if body.strip() else []
    marked = [_code_block(part) if k % 2 else inline(part) for k, part in enumerate(parts)]
    return "".join(marked) + "\n" + inline(sections)


def inline(text: str) -> str:
    """Return a text with what stands in it marked up."""
    parts = CODE.split(text)
    for k in range(0, len(parts), 2):
        escaped = SPECIAL.sub(lambda found: "\\" * (len(found[0]) == 1) + found[0], parts[k])
        parts[k] = PAGE.sub(r":doc:`/\1`", escaped)
        if k > 0 and re.match(r"\w", parts[k]):
            parts[k] = "\\ " + parts[k]  # as in `Task`s
    for k in range(1, len(parts), 2):
        parts[k] = _code(" ".join(parts[k].strip("`").split()))
    return "".join(parts)


def _code(text: str) -> str:
    """Return a quoted name as a link to its entry in the API, all else as code."""
    name = text.removeprefix("hrc_env.")
    if name not in PUBLIC:
        return f"``{text}``"
    return f":py:obj:`{name} <{MODULES.get(name, f'hrc_env.{name}')}>`"


def _code_block(text: str) -> str:
    code = textwrap.indent(textwrap.dedent(text).strip("\n"), "   ")
    return f"\n.. code-block:: python\n\n{code}\n\n"
