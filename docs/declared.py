"""Signatures and fields as the source declares them.

Python evaluates annotations, so that `Points3` becomes a long expression of NumPy's; the reference
shows the name instead.
"""

import ast
import dataclasses
import inspect
import textwrap
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Any

from hrc_env.core.docstrings import list_attributes

SHORT = 40
"""Length up to which a default is shown by its value [characters]."""


@dataclass(frozen=True, slots=True)
class Field:
    """A documented attribute of a class."""

    name: str
    annotation: str
    default: str
    """As source text; "" if there is none."""
    doc: str


def fields(kind: type) -> list[Field]:
    """Return the documented attributes of a class, those of its bases in this package first."""
    return [
        Field(each.name, each.annotation, _default(kind, each.name, each.node.value), each.doc)
        for each in list_attributes(kind)
    ]


def signature(function: Callable[..., Any]) -> tuple[str, str | None]:
    """Return the arguments of a function in brackets, without `self` and `cls`, and the annotation
    of its result."""
    plain = inspect.unwrap(getattr(function, "__func__", function))
    (node,) = ast.parse(textwrap.dedent(inspect.getsource(plain))).body
    assert isinstance(node, ast.FunctionDef)
    values = inspect.signature(plain).parameters
    known = [each for each in _arguments(node.args) if each.arg not in ("self", "cls")]
    parts = [_parameter(values[each.arg], each) for each in known]
    kinds = [values[each.arg].kind for each in known]
    if inspect.Parameter.KEYWORD_ONLY in kinds and inspect.Parameter.VAR_POSITIONAL not in kinds:
        parts.insert(kinds.index(inspect.Parameter.KEYWORD_ONLY), "*")
    return f"({', '.join(parts)})", None if node.returns is None else _annotation(node.returns)


def _arguments(node: ast.arguments) -> list[ast.arg]:
    """Return the arguments in the order in which they are called."""
    var = [node.vararg] if node.vararg else []
    keywords = [node.kwarg] if node.kwarg else []
    return [*node.posonlyargs, *node.args, *var, *node.kwonlyargs, *keywords]


def _parameter(value: inspect.Parameter, node: ast.arg) -> str:
    stars = {inspect.Parameter.VAR_POSITIONAL: "*", inspect.Parameter.VAR_KEYWORD: "**"}
    text = stars.get(value.kind, "") + node.arg
    if node.annotation is not None:
        text += f": {_annotation(node.annotation)}"
    if value.default is inspect.Parameter.empty:
        return text
    equals = "=" if node.annotation is None else " = "
    return f"{text}{equals}{_short(value.default)}"


def _annotation(node: ast.expr) -> str:
    """Return the text of an annotation, without the quotes of one that is not evaluated."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    return ast.unparse(node)


def _default(kind: type, name: str, node: ast.expr | None) -> str:
    """Return the default of an attribute: its value if that is short, else its source."""
    if node is None:
        return ""
    field = getattr(kind, "__dataclass_fields__", {}).get(name)
    if field is None:
        return _short(getattr(kind, name, ...))
    if field.default is not dataclasses.MISSING:
        return _short(field.default)
    factory = field.default_factory
    return "" if factory is dataclasses.MISSING else f"{getattr(factory, '__name__', '...')}()"


def _short(value: Any) -> str:
    """Return the text of a default that is not too long to read, else dots."""
    if inspect.isclass(value) or inspect.isfunction(value):
        return value.__name__
    if isinstance(value, Enum):
        return f"{type(value).__name__}.{value.name}"
    text = repr(value)
    return "..." if len(text) > SHORT or " at 0x" in text else text
