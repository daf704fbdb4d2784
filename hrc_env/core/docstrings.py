"""Docstrings of dataclass fields, which Python itself does not keep."""

import ast
import dataclasses
import inspect
import itertools
import textwrap


def field_docs(kind: type) -> dict[str, str]:
    """Return the docstring of each field of a dataclass, inherited ones included."""
    docs: dict[str, str] = {}
    for each in reversed(kind.__mro__):
        if dataclasses.is_dataclass(each):
            docs |= attribute_docs(each)
    return docs


def attribute_docs(kind: type) -> dict[str, str]:
    """Return the docstring of each annotated attribute in the body of a class."""
    docs: dict[str, str] = {}
    (tree,) = ast.parse(textwrap.dedent(inspect.getsource(kind))).body
    body: list[ast.stmt] = getattr(tree, "body", [])
    for field, after in itertools.pairwise(body):
        if isinstance(field, ast.AnnAssign) and isinstance(after, ast.Expr):
            docs[ast.unparse(field.target)] = " ".join(ast.literal_eval(after.value).split())
    return docs
