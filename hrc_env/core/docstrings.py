"""Docstrings of the fields of classes, which Python itself does not keep."""

import ast
import dataclasses
import inspect
import itertools
import textwrap
from collections.abc import Iterator
from typing import NamedTuple

_WIDTH = 88
"""Line width of a list of attributes [characters]."""


class Attribute(NamedTuple):
    """An annotated attribute in the body of a class, with the docstring below it."""

    node: ast.AnnAssign
    """Syntax tree of the attribute."""
    doc: str
    """Docstring of the attribute."""

    @property
    def name(self) -> str:
        """Name of the attribute."""
        return ast.unparse(self.node.target)

    @property
    def annotation(self) -> str:
        """Type annotation as in the source, without the quotes of a forward reference."""
        node = self.node.annotation
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            return node.value
        return ast.unparse(node)


def read_attributes(kind: type) -> Iterator[Attribute]:
    """Yield the attributes in the body of a class that have a docstring."""
    (tree,) = ast.parse(textwrap.dedent(inspect.getsource(kind))).body
    body: list[ast.stmt] = getattr(tree, "body", [])
    for node, after in itertools.pairwise(body):
        if isinstance(node, ast.AnnAssign) and isinstance(after, ast.Expr):
            yield Attribute(node, inspect.cleandoc(ast.literal_eval(after.value)))


def attribute_docs(kind: type) -> dict[str, str]:
    """Return the docstring of each annotated attribute in the body of a class."""
    return {each.name: " ".join(each.doc.split()) for each in read_attributes(kind)}


def field_docs(kind: type) -> dict[str, str]:
    """Return the docstring of each field of a dataclass, including inherited fields."""
    docs: dict[str, str] = {}
    for each in reversed(kind.__mro__):
        if dataclasses.is_dataclass(each):
            docs |= attribute_docs(each)
    return docs


def list_attributes(kind: type) -> list[Attribute]:
    """Return the public documented attributes of a class and of its bases in this package."""
    found: dict[str, Attribute] = {}
    for base in reversed(kind.__mro__):
        if base.__module__.partition(".")[0] == "hrc_env":
            found |= {each.name: each for each in read_attributes(base)}
    hidden = {"RENAMED"}  # former names of fields, for errors
    return [each for name, each in found.items() if not name.startswith("_") and name not in hidden]


class DocWithAttributes:
    """A descriptor for `__doc__` that appends a list of attributes to the docstring of a class.

    The list is read from the source only when `__doc__` is accessed, for example by `help`, which
    keeps imports fast.

    Args:
        own: docstring that the class itself has.
    """

    def __init__(self, own: str) -> None:
        self.own = own

    def __get__(self, instance: object, owner: type) -> str:
        try:
            attributes = list_attributes(owner)
        except (OSError, TypeError):  # there is no source
            return self.own
        if not attributes:
            return self.own
        entries = [f"{each.name} ({each.annotation}): {each.doc}" for each in attributes]
        lines = (
            textwrap.fill(" ".join(entry.split()), _WIDTH, initial_indent=" " * 4,
                          subsequent_indent=" " * 8, break_long_words=False)
            for entry in entries
        )  # fmt: skip
        return "\n".join([inspect.cleandoc(self.own), "", "Attributes:", *lines])


def show_attributes(kind: type) -> None:
    """Let `help` and `__doc__` of a class also show the docstrings of its attributes."""
    own = kind.__dict__.get("__doc__")
    if isinstance(own, str):
        kind.__doc__ = DocWithAttributes(own)  # type: ignore[assignment]


def get_own_doc(kind: type) -> str:
    """Return the docstring of a class without the list of its attributes, or "" if it has none."""
    own = kind.__dict__.get("__doc__")
    return inspect.cleandoc(own.own if isinstance(own, DocWithAttributes) else own or "")
