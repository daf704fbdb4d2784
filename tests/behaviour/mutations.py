"""Find the one-line changes that a file of the code allows: the candidates of `mutants`.

A candidate changes a number, a comparison, a sign, a unit, a frame, an index, a camera or a joint
within one line. Changes that surely change nothing are left out: texts, annotations, messages,
shapes of arrays, decorators, and settings of speed.
"""

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

_MESSAGES = {
    "warn", "print", "make_unknown_name_error", "require", "check_shape", "check_fields",
    "check_names", "info", "say", "isinstance", "debug", "warning", "dtype", "perf_counter",
    "import_module",
}  # fmt: skip
"""Calls whose arguments are words for people, or kinds of things."""
_ALLOCATORS = {
    "zeros", "ones", "empty", "full", "reshape", "broadcast_to", "tile", "eye", "swapaxes",
    "moveaxis", "expand_dims", "transpose", "record",
}  # fmt: skip
"""Calls whose integers are shapes or axes: with others they fail at once."""
_SPEED = {
    "maxsize", "nthread", "threads", "n_threads", "num_threads", "workers", "max_workers", "chunk",
    "chunks", "stacklevel", "timeout", "axis", "keepdims", "dtype", "decimals", "width", "align",
    "order", "indent", "strict",
}  # fmt: skip
"""Keywords that change the speed or the form of a result, but none of its values."""
_SPEED_NAMES = re.compile(r"(KEPT|CACHE|CHUNK|THREADS|BUFFER)")
"""The same of constants."""
_FIELD_KIND = re.compile(r"\?|[fiu][1248]")
_LEFT_OUT = ast.Raise | ast.Assert | ast.Import | ast.ImportFrom | ast.JoinedStr
_TEXT_FUNCTIONS = {"__repr__", "__str__", "__reduce__"}
_EXCHANGED = {
    "min": "max", "minimum": "maximum", "argmin": "argmax", "nanmin": "nanmax", "sin": "cos",
    "any": "all", "floor": "ceil", "fmin": "fmax",
}  # fmt: skip
_EXCHANGED |= {right: left for left, right in _EXCHANGED.items()}
_TO_RADIANS = {"radians", "degrees", "deg2rad", "rad2deg"}
_TIME_STEPS = {"dt", "dt_s", "ctrl_dt", "sim_dt"}
_PAIRS = {
    "world": ("cam", "base", "tool", "object", "link"), "left": ("right",), "low": ("high",),
    "first": ("second",), "a": ("b",), "up": ("down",), "x": ("y", "z"), "y": ("z",), "u": ("v",),
}  # fmt: skip
"""Parts of names that can be taken for each other."""
_INDICES = {"c": "cameras", "camera": "cameras", "j": "joints", "joint": "joints"}
"""Names of indices, and of which kind it is to take the entry before instead."""
_COUNTERS = {*"bcijkmnw", "count", "row", "step", "camera", "joint", "part"}
"""And names of counts."""
_SIGNS = {ast.Add: ("+", "-"), ast.Sub: ("-", "+"), ast.Mult: ("*", "/"), ast.Div: ("/", "*")}
_REVERSED = {
    ast.Lt: ("<", ">"), ast.LtE: ("<=", ">="), ast.Gt: (">", "<"), ast.GtE: (">=", "<="),
    ast.Eq: ("==", "!="), ast.NotEq: ("!=", "=="),
}  # fmt: skip
_TOUCHED = {"<": "<=", "<=": "<", ">": ">=", ">=": ">"}
_SMALLEST, _LARGEST = 1e-5, 1e6
"""Numbers up to the one, and from the other on, only guard a division or stand for nothing."""
_SMALL_COUNT, _LARGE_COUNT = 10, 1000
"""Integers from the one on are scaled, too, and from the other on moved by one no more."""
_DEGREES = 57.29577951308232


@dataclass(frozen=True, slots=True)
class Candidate:
    """One change of one line."""

    line: int
    kind: str
    before: str
    """The whole line."""
    after: str


@lru_cache(maxsize=512)
def find_candidates(text: str) -> tuple[Candidate, ...]:
    """Return the changes that the text of a module allows, in the order of its lines."""
    finder = _Finder(text)
    finder.visit(ast.parse(text))
    found = {(each.line, each.after): each for each in finder.found if each.before != each.after}
    return tuple(sorted(found.values(), key=lambda each: each.line))


class _Finder(ast.NodeVisitor):
    """Walks through a module and collects candidates."""

    def __init__(self, text: str) -> None:
        self.lines = [line.encode() for line in text.splitlines()]
        self.found: list[Candidate] = []
        self.names: set[str] = set()
        """Names that the function at hand uses."""

    # Left out.

    def visit(self, node: ast.AST) -> None:
        """Leave errors, imports and texts with values out."""
        if not isinstance(
            node, ast.Raise | ast.Assert | ast.Import | ast.ImportFrom | ast.JoinedStr
        ):
            super().visit(node)

    def visit_Expr(self, node: ast.Expr) -> None:
        """Leave docstrings out."""
        if not isinstance(node.value, ast.Constant):
            self.generic_visit(node)

    def visit_AnnAssign(self, node: ast.AnnAssign) -> None:
        """Leave the annotation out."""
        if node.value is not None:
            self.visit(node.value)

    def visit_ClassDef(self, node: ast.ClassDef) -> None:
        """Leave decorators out."""
        self._visit_all(node.body)

    def visit_FunctionDef(self, node: ast.FunctionDef) -> None:
        """Leave decorators and annotations out."""
        if node.name in _TEXT_FUNCTIONS:
            return
        before, self.names = self.names, set(_names_in(node))
        self._visit_all([*node.args.defaults, *filter(None, node.args.kw_defaults), *node.body])
        self.names = before

    def visit_Assign(self, node: ast.Assign) -> None:
        """Leave settings of speed and aliases of types out."""
        names = [each.id for each in ast.walk(node.targets[0]) if isinstance(each, ast.Name)]
        if not any(_SPEED_NAMES.search(name) or name == "__all__" for name in names):
            self.generic_visit(node)

    def visit_keyword(self, node: ast.keyword) -> None:
        """Leave settings of speed out."""
        if node.arg not in _SPEED:
            self.visit(node.value)

    # Changed.

    def visit_Call(self, node: ast.Call) -> None:
        """Exchange functions, drop conversions, shorten ranges."""
        function = node.func
        name = getattr(function, "attr", getattr(function, "id", ""))
        if name in _MESSAGES or name.endswith("Error"):
            return
        if name in _EXCHANGED:
            kind = "trigonometry" if name in ("sin", "cos") else "extremes"
            source = self._source(function)
            self._add(kind, function, f"{source[: -len(name)]}{_EXCHANGED[name]}")
        if name in _TO_RADIANS and len(node.args) == 1:
            self._add("units", node, f"({self._source(node.args[0])})")
        if name == "swapaxes" and isinstance(function, ast.Attribute):
            self._add("frames", node, self._source(function.value))
        if name == "range":
            self._shorten(node)
        if isinstance(function, ast.Attribute):
            self.visit(function.value)
        for each in node.args:
            if not (name in _ALLOCATORS and _is_shape(each)):
                self.visit(each)
        self._visit_all(node.keywords)

    def _shorten(self, node: ast.Call) -> None:
        *_, stop = node.args[:2]
        if not isinstance(stop, ast.Constant):
            self._move(stop, -1)
        if len(node.args) > 1 and not isinstance(node.args[0], ast.Constant):
            self._move(node.args[0], 1)

    def _move(self, node: ast.expr, step: int) -> None:
        source = self._source(node)
        if not isinstance(node, ast.Name | ast.Attribute | ast.Call):
            source = f"({source})"
        self._add("off by one", node, f"{source} {'+' if step > 0 else '-'} 1")

    def visit_Constant(self, node: ast.Constant) -> None:
        """Scale numbers, move integers by one, exchange sides of the body."""
        value = node.value
        if isinstance(value, str):
            self._exchange_sides(node, value)
        elif isinstance(value, bool) or not isinstance(value, int | float):
            return
        elif isinstance(value, int):
            near = (value + 1, value - 1) if value < _LARGE_COUNT else ()
            far = (2 * value, value // 2) if value >= _SMALL_COUNT else ()
            for other in (*near, *far):
                if other >= 0:
                    self._add("constant", node, str(other))
        elif _SMALLEST < value < _LARGEST:
            for other in (2 * value, 10 * value, value / 2):
                self._add("constant", node, repr(other))

    def _exchange_sides(self, node: ast.Constant, value: str) -> None:
        if re.fullmatch(r"(left|right)(_\w+)?", value):
            sides = {"left": "right", "right": "left"}
            self._add("joints", node, repr(re.sub("left|right", lambda m: sides[m[0]], value)))

    def visit_Tuple(self, node: ast.Tuple) -> None:
        """Leave fields of records out: name, kind and shape."""
        texts = [each.value for each in node.elts if isinstance(each, ast.Constant)]
        if not any(isinstance(each, str) and _FIELD_KIND.fullmatch(each) for each in texts):
            self.generic_visit(node)

    def visit_Compare(self, node: ast.Compare) -> None:
        """Reverse comparisons; of integers, move them by one."""
        places = [node.left, *node.comparators]
        for (left, right), op in zip(pairwise(places), node.ops, strict=True):
            if type(op) not in _REVERSED or _is_text(left) or _is_text(right):
                continue
            sign, other = _REVERSED[type(op)]
            self._replace_between("comparison", left, right, sign, other)
            if sign in _TOUCHED and (_counts(left) or _counts(right)):
                self._replace_between("comparison", left, right, sign, _TOUCHED[sign])
        self.generic_visit(node)

    def visit_BoolOp(self, node: ast.BoolOp) -> None:
        """Exchange "and" and "or"."""
        word, other = ("and", "or") if isinstance(node.op, ast.And) else ("or", "and")
        for left, right in pairwise(node.values):
            self._replace_between("logic", left, right, word, other)
        self.generic_visit(node)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> None:
        """Drop a minus or a "not"."""
        kind = "sign" if isinstance(node.op, ast.USub) else "logic"
        if not isinstance(node.op, ast.UAdd):
            self._add(kind, node, f"({self._source(node.operand)})")
        self.generic_visit(node)

    def visit_BinOp(self, node: ast.BinOp) -> None:
        """Exchange operators, drop a term of a sum, transpose a rotation."""
        left, right, op = node.left, node.right, type(node.op)
        if op is ast.BitOr and (_is_type(left) or _is_type(right)):
            return
        if op in _SIGNS and not (_is_sequence(left) or _is_sequence(right)):
            sign, other = _SIGNS[op]
            self._replace_between("sign", left, right, sign, other)
            if sign in "+-" and not _is_nothing(right):
                self._add("term", node, f"({self._source(left)})")
        if op in (ast.BitAnd, ast.BitOr):
            sign, other = ("&", "|") if op is ast.BitAnd else ("|", "&")
            self._replace_between("logic", left, right, sign, other)
        if op is ast.MatMult and _is_rotation(left):
            self._add("frames", left, f"{self._source(left)}.swapaxes(-1, -2)")
        self.generic_visit(node)

    def visit_AugAssign(self, node: ast.AugAssign) -> None:
        """Exchange "+=" and "-="."""
        if isinstance(node.op, ast.Add | ast.Sub) and not _is_sequence(node.value):
            sign, other = ("+=", "-=") if isinstance(node.op, ast.Add) else ("-=", "+=")
            self._replace_between("sign", node.target, node.value, sign, other)
        self.generic_visit(node)

    def visit_Subscript(self, node: ast.Subscript) -> None:
        """Exchange indices, move them by one, take the camera or joint before."""
        self.visit(node.value)
        index = node.slice
        parts = index.elts if isinstance(index, ast.Tuple) else [index]
        for part in parts:
            if isinstance(part, ast.Slice):
                self._move_slice(part)
            elif isinstance(part, ast.Name) and part.id in _INDICES:
                self._add(_INDICES[part.id], part, f"{part.id} - 1")
            else:
                self.visit(part)
        for one, other in pairwise(parts):
            if isinstance(one, ast.Name) and isinstance(other, ast.Name):
                text = self._source(one), self._source(other)
                self._replace_span("index", one, other, f"{text[1]}, {text[0]}")

    def _move_slice(self, node: ast.Slice) -> None:
        for bound, step in ((node.lower, 1), (node.upper, -1)):
            if isinstance(bound, ast.Constant) and isinstance(bound.value, int) and bound.value > 0:
                self._add("off by one", bound, str(bound.value + step))
            elif bound is not None and not isinstance(bound, ast.Constant | ast.UnaryOp):
                self._move(bound, step)

    def visit_Attribute(self, node: ast.Attribute) -> None:
        """Drop transposes; take one name for another."""
        if node.attr == "T":
            self._add("frames", node, self._source(node.value))
        elif isinstance(node.ctx, ast.Load):
            self._change_name(node, node.attr)
        self.generic_visit(node)

    def visit_Name(self, node: ast.Name) -> None:
        """Take one name for another."""
        if isinstance(node.ctx, ast.Load):
            self._change_name(node, node.id)

    def _change_name(self, node: ast.Name | ast.Attribute, name: str) -> None:
        source = self._source(node)
        if name in _TIME_STEPS:
            self._add("units", node, f"(2.0 * {source})")
        elif name.endswith("_s") and not name.endswith(("m_s", "rad_s", "n_s")):
            self._add("units", node, f"(1000.0 * {source})")
        elif name.endswith("_rad"):
            self._add("units", node, f"({_DEGREES} * {source})")
        for other in sorted(self.names & set(_similar(name))):
            kind = "joints" if {"left", "right"} & set(name.split("_")) else "frames"
            self._add(kind, node, source[: len(source) - len(name)] + other)

    # How it is written down.

    def _visit_all(self, nodes: list[ast.stmt] | list[ast.expr] | list[ast.keyword]) -> None:
        for node in nodes:
            self.visit(node)

    def _source(self, node: ast.expr) -> str:
        """The text of a node; empty if it goes on in another line."""
        if node.lineno != node.end_lineno:
            return ""
        return self.lines[node.lineno - 1][node.col_offset : node.end_col_offset].decode()

    def _add(self, kind: str, node: ast.expr, text: str) -> None:
        self._replace_span(kind, node, node, text)

    def _replace_span(self, kind: str, first: ast.expr, last: ast.expr, text: str) -> None:
        if first.lineno == last.end_lineno and last.end_col_offset is not None:
            self._keep(kind, first.lineno, first.col_offset, last.end_col_offset, text)

    def _replace_between(
        self, kind: str, left: ast.expr, right: ast.expr, sign: str, other: str
    ) -> None:
        """Replace the sign between two nodes of a line."""
        begin, end = left.end_col_offset, right.col_offset
        if left.end_lineno == right.lineno and begin is not None:
            between = self.lines[right.lineno - 1][begin:end].decode()
            if between.count(sign) == 1:
                self._keep(kind, right.lineno, begin, end, between.replace(sign, other))

    def _keep(self, kind: str, line: int, begin: int, end: int, text: str) -> None:
        before = self.lines[line - 1]
        after = before[:begin] + text.encode() + before[end:]
        self.found.append(Candidate(line, kind, before.decode(), after.decode()))


def _names_in(node: ast.AST) -> Iterator[str]:
    """Yield the names that a function uses, and those of attributes."""
    for each in ast.walk(node):
        if isinstance(each, ast.Name):
            yield each.id
        elif isinstance(each, ast.Attribute):
            yield each.attr
        elif isinstance(each, ast.arg):
            yield each.arg


def _similar(name: str) -> Iterator[str]:
    """Yield the names that differ from one in one part, for which it could be taken."""
    parts = name.split("_")
    for one, others in _PAIRS.items():
        for other in others:
            for k, part in enumerate(parts):
                if part in (one, other) and (len(one) > 1 or len(parts) == 1 or one == "a"):
                    new = other if part == one else one
                    yield "_".join([*parts[:k], new, *parts[k + 1 :]])


def _is_shape(node: ast.expr) -> bool:
    parts = node.elts if isinstance(node, ast.Tuple) else [node]
    return any(isinstance(_bare(each), ast.Constant) for each in parts)


def _bare(node: ast.expr) -> ast.expr:
    return node.operand if isinstance(node, ast.UnaryOp) else node


def _is_text(node: ast.expr) -> bool:
    return isinstance(node, ast.Constant) and not isinstance(node.value, int | float)


def _is_sequence(node: ast.expr) -> bool:
    kinds = ast.JoinedStr | ast.List | ast.Tuple | ast.ListComp | ast.Dict
    return isinstance(node, kinds) or _is_text(node)


def _counts(node: ast.expr) -> bool:
    """Whether a node surely is a number of things or an index."""
    node = _bare(node)
    if isinstance(node, ast.Call):
        return getattr(node.func, "id", "") == "len"
    if isinstance(node, ast.Subscript):
        return getattr(node.value, "attr", "") == "shape"
    name = getattr(node, "id", getattr(node, "attr", ""))
    return name.startswith(("n_", "N_")) or name in _COUNTERS


def _is_type(node: ast.expr) -> bool:
    """Whether a node stands for a type in a union of such."""
    name = getattr(node, "id", getattr(node, "attr", ""))
    is_class = bool(re.match(r"[A-Z]\w*[a-z]", name)) or name in ("str", "int", "float", "bool")
    return is_class or (isinstance(node, ast.Constant) and node.value is None)


def _is_nothing(node: ast.expr) -> bool:
    """Whether a term adds nothing that could be noticed."""
    return isinstance(node, ast.Constant) and not _SMALLEST < abs(node.value) < _LARGEST


def _is_rotation(node: ast.expr) -> bool:
    name = getattr(node, "id", getattr(node, "attr", ""))
    return name == "R" or name.startswith("R_")
