"""Settings of Sphinx, which `python -m docs.site` builds the site with."""

import inspect
import re
import sys
from pathlib import Path
from typing import Any

from docutils import nodes

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

import hrc_env  # noqa: E402
from docs import declared, rst  # noqa: E402
from hrc_env.core.docstrings import get_own_doc  # noqa: E402

project = "hrc_env"
author = copyright = "The hrc_env authors"
version = release = hrc_env.__version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
exclude_patterns = ["results", "**/__pycache__"]
nitpick_ignore_regex = [
    ("py:class", ".*"),  # types of other packages, and of modules that are not public
    ("py:exc", "(?!ConfigError|HRCError).*"),
]
REPOSITORY = "https://github.com/hrc-env/hrc_env/blob/main/"

myst_heading_anchors = 4
myst_links_external_new_tab = False

default_role = "code"
smartquotes = False
autodoc_mock_imports = ["stable_baselines3", "torch"]
autodoc_member_order = "bysource"
autodoc_default_options = {"members": True}
napoleon_use_param = False
napoleon_use_rtype = False
add_module_names = False
python_maximum_signature_line_length = 88
toc_object_entries = False

html_theme = "furo"
html_title = f"hrc_env {release}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sphinx = False
html_theme_options = {
    "source_repository": "https://github.com/hrc-env/hrc_env/",
    "source_branch": "main",
    "source_directory": "docs/",
    "light_css_variables": {"color-brand-primary": "#1d5fa8", "color-brand-content": "#1d5fa8"},
    "dark_css_variables": {"color-brand-primary": "#8ab8f0", "color-brand-content": "#8ab8f0"},
}

UPWARD = re.compile(r"\]\(((?:\.\./)+)([\w./-]+)\)")
"""A link from a page to a file above it."""


def link_to_repository(app: Any, name: str, source: list[str]) -> None:
    """Lead links to files outside of this folder to the repository."""
    depth = name.count("/")

    def lead(found: re.Match[str]) -> str:
        is_inside = found[1].count("../") <= depth
        return found[0] if is_inside else f"]({REPOSITORY}{found[2]})"

    source[0] = UPWARD.sub(lead, source[0])


def write_rst(app: Any, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """Turn a docstring into reStructuredText, of a class without its list of attributes."""
    own = get_own_doc(obj) if inspect.isclass(obj) else ""
    lines[:] = rst.from_docstring(own or "\n".join(lines)).splitlines()


def add_fields(app: Any, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """Document the fields of a class below its docstring."""
    if what not in ("class", "exception"):
        return
    for field in declared.fields(obj):
        doc = rst.from_docstring(field.doc)
        lines += ["", f".. py:attribute:: {field.name}", f"   :type: {field.annotation}"]
        lines += [f"   :value: {field.default}"] if field.default else []
        lines += ["", *(f"   {line}" for line in doc.splitlines()), ""]


def skip_fields(app: Any, what: str, name: str, obj: Any, skip: bool, options: Any) -> bool:
    """Leave out attributes, which `add_fields` documents."""
    if what == "module":
        return skip
    is_method = inspect.isroutine(obj) or isinstance(obj, property | classmethod | staticmethod)
    return skip or not is_method


def show_source(
    app: Any, what: str, name: str, obj: Any, options: Any, arguments: str, returns: str
) -> tuple[str, str | None] | None:
    """Show signatures as they are written; the fields of a record stand below it."""
    if what not in ("class", "exception"):
        return declared.signature(obj) if inspect.isroutine(obj) else None
    if hasattr(obj, "__dataclass_fields__") or getattr(obj, "_is_protocol", False):
        return "", None
    return (declared.signature(obj.__init__)[0], None) if inspect.isfunction(obj.__init__) else None


def load_lazily(app: Any, doctree: Any) -> None:
    """Let a browser load a picture when it is scrolled to."""
    for picture in doctree.findall(nodes.image):
        picture["loading"] = "lazy"


def setup(app: Any) -> dict[str, bool]:
    """Connect the functions above."""
    app.connect("source-read", link_to_repository)
    app.connect("doctree-read", load_lazily)
    app.connect("autodoc-process-docstring", write_rst, priority=400)  # before napoleon
    app.connect("autodoc-process-docstring", add_fields, priority=600)
    app.connect("autodoc-skip-member", skip_fields)
    app.connect("autodoc-process-signature", show_source)
    return {"parallel_read_safe": True}
