"""What users import stands in `hrc_env`: every name, its documentation, and who reaches deeper."""

import ast
import dataclasses
import inspect
import json
import os
import pkgutil
import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import gymnasium
import pytest

import hrc_env
from docs import generate, names, reference
from hrc_env import PUBLIC, RENAMED

ROOT = Path(__file__).resolve().parent.parent
SOURCE = ROOT / "hrc_env" / "__init__.py"
EXAMPLES = sorted((ROOT / "examples").rglob("*.py"))
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
ABOUT_THE_INSIDE = {ROOT / "docs" / "architecture.md", *generate.REFERENCE}
"""Pages whose sentences, but not whose code, may name modules."""
HEAVY = {"cv2", "matplotlib", "mujoco", "numba", "PIL", "rich", "scipy", "torch", "tyro"}
LIGHT = {"core", "core.errors", "core.reservation", "registration", "tasks"}
"""The modules that `import hrc_env` imports."""


# The table


def test_importing_the_package_imports_nothing_heavy():
    code = "import hrc_env, sys; print(*sys.modules)"
    alone = {name: value for name, value in os.environ.items() if not name.startswith("HRC_ENV")}
    words = [sys.executable, "-c", code]  # without what other tests have registered
    modules = set(subprocess.check_output(words, text=True, env=alone).split())
    ours = {name for name in modules if name.startswith("hrc_env.")}
    assert ours == {f"hrc_env.{name}" for name in LIGHT}
    assert not HEAVY & {name.split(".")[0] for name in modules}


def test_the_table_is_sorted_in_groups():
    (table,) = re.findall(r"^PUBLIC = \{\n(.*?)^\}", SOURCE.read_text(), re.M | re.S)
    groups = re.split(r"^    # [a-z ,]+\n", table, flags=re.M)
    assert groups[0] == ""
    for group in groups[1:]:
        names = re.findall(r'^    "(\w+)":', group, re.M)
        assert names == sorted(names)
    assert sum(group.count("\n") for group in groups) == len(PUBLIC)


def test_type_checkers_are_told_what_the_table_says():
    imports = {}
    for node in ast.parse(SOURCE.read_text()).body:
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            for each in node.body:
                assert isinstance(each, ast.ImportFrom)
                (name,) = each.names
                assert name.name == name.asname, "without `as` it is private to type checkers"
                imports[name.name] = each.module
    known = {"import_files": "hrc_env.registration"}
    assert imports | known == PUBLIC


def test_no_name_is_that_of_a_module():
    """The import of a module sets an attribute of that name."""
    modules = {each.name for each in pkgutil.iter_modules(hrc_env.__path__)}
    assert not modules & {*PUBLIC, *RENAMED}


def test_pyright_knows_every_name_and_its_type(process, tmp_path):
    lines = ["import hrc_env", *(f"reveal_type(hrc_env.{name})" for name in PUBLIC)]
    path = tmp_path / "user.py"
    path.write_text("\n".join(lines))
    pyright = Path(sys.executable).parent / "pyright"
    settings = {"include": [str(path)], "extraPaths": [str(ROOT)], "pythonVersion": "3.11"}
    (tmp_path / "pyrightconfig.json").write_text(json.dumps(settings))
    done = subprocess.run(
        [pyright, "--outputjson", "--pythonpath", sys.executable, "-p", tmp_path],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    found = json.loads(done.stdout)["generalDiagnostics"]
    assert [each["message"] for each in found if each["severity"] == "error"] == []
    types = [each["message"] for each in found if each["severity"] == "information"]
    assert len(types) == len(PUBLIC)
    generic = re.compile(r'is "type\[\w+\[(?:Unknown(?:, )?)+\]\]"$')
    vague = [each for each in types if "Unknown" in each or each.endswith('is "Any"')]
    assert [each for each in vague if not generic.search(each)] == []


def test_a_star_imports_all_that_needs_no_extra():
    code = (
        "import sys; sys.modules['stable_baselines3'] = None\n"
        "from hrc_env import *; import hrc_env\n"
        "print(*(name for name in hrc_env.PUBLIC if name not in globals()))\n"
        "print(*(name for name in hrc_env.PUBLIC if name not in dir(hrc_env)))"
    )
    said = subprocess.check_output([sys.executable, "-c", code], text=True)
    assert said.split() == ["HRCSubprocVecEnv", "HRCVecEnv", "ProximityRamp"] * 2


# Names


@pytest.mark.parametrize("name", PUBLIC)
def test_a_public_name_is_what_its_module_defines(name):
    value = getattr(hrc_env, name)
    assert value is getattr(import_module(PUBLIC[name]), name)
    assert name in dir(hrc_env)
    module = getattr(value, "__module__", PUBLIC[name])
    if inspect.isclass(value) or inspect.isfunction(value):
        assert module == PUBLIC[name], "name the module that defines it"


@pytest.mark.parametrize(
    ("wrong", "right"),
    [("PoseTraker", "PoseTracker"), ("posetracker", "PoseTracker"), ("read_rigs", "read_rig"),
     ("register_sheild", "register_shield"), ("HRCError_", "HRCError")],
)  # fmt: skip
def test_an_unknown_name_is_answered_with_the_nearest(wrong, right):
    with pytest.raises(AttributeError, match=f"no attribute '{wrong}'. Did you mean '{right}'"):
        getattr(hrc_env, wrong)


def test_a_name_like_no_other_is_refused_without_a_guess():
    with pytest.raises(AttributeError, match=r"'xyzzy'\. dir\(hrc_env\) lists all public names"):
        hrc_env.xyzzy  # noqa: B018
    assert not hasattr(hrc_env, "xyzzy")


@pytest.mark.parametrize("old", RENAMED)
def test_a_former_name_is_answered_with_the_present_one(old):
    """An import would hide the words of an `AttributeError`."""
    assert RENAMED[old] in PUBLIC
    assert old not in PUBLIC
    assert not hasattr(hrc_env, old)
    with pytest.raises(AttributeError, match=f"hrc_env.{old} is called hrc_env.{RENAMED[old]}"):
        getattr(hrc_env, old)
    with pytest.raises(ImportError, match=f"hrc_env.{old} is called hrc_env.{RENAMED[old]} now"):
        exec(f"from hrc_env import {old}")


def test_a_wrong_keyword_or_field_is_answered_with_the_nearest():
    with pytest.raises(hrc_env.ConfigError, match=r"'percepton'\. Did you mean 'perception'"):
        hrc_env.HRCVectorEnv(1, percepton="truth")
    with pytest.raises(hrc_env.ConfigError, match=r"'trackr'\. Did you mean 'tracker'"):
        gymnasium.make("HRCReach-v0", perception="truth", config={"trackr": {}})


# Documentation


def is_sentence(doc: str) -> bool:
    line = doc.split("\n")[0]
    return bool(re.fullmatch(r"[A-Z].*\.", line)) and len(line.split()) > 2


def missing_arguments(parameters: list[str], doc: str) -> list[str]:
    """The parameters that `Args:` of a docstring does not name."""
    _, _, args = doc.partition("Args:\n")
    named = {each for line in re.findall(r"^ {4}(\w.*?):", args, re.M) for each in line.split(", ")}
    return [f"the argument {each}" for each in parameters if each not in named]


def parameters_of(function: object, drop: int = 0) -> list[str]:
    return list(inspect.signature(function).parameters)[drop:]


NO_VERBS = ("A", "An", "The", "What", "How", "Where", "Which", "That", "Whether")
SAY_WHAT_COMES = ("Draw", "Make", "Read", "Return")


def missing_words(function: object, parameters: list[str], doc: str, above: str = "") -> list[str]:
    """What the docstring of a function lacks; `above` is that of its class, which may explain
    arguments of several methods in `backticks`."""
    lacks = [] if is_sentence(doc) else ["a first line that is a sentence"]
    verb = doc.split(" ")[0]
    if verb in NO_VERBS:
        lacks.append("a verb to begin with")
    if len(parameters) > 2:
        explained = above + doc if above else ""
        rest = [each for each in parameters if not re.search(rf"`{each}`|\b{each} \[", explained)]
        lacks += missing_arguments(rest, doc)
        returned = inspect.signature(function).return_annotation
        says = "Returns:" in doc or "Yields:" in doc or verb in SAY_WHAT_COMES
        if returned not in (None, "None") and not says:
            lacks.append("what it returns")
    return lacks


def lacks_of(name: str) -> list[str]:
    """What the documentation of a public name lacks. The arguments of methods that override those
    of Gymnasium or Stable-Baselines3 are documented there."""
    value, doc = getattr(hrc_env, name), names.doc_of(name)
    if inspect.isfunction(value):
        return missing_words(value, parameters_of(value), doc)
    lacks = [] if is_sentence(doc) else ["a first line that is a sentence"]
    if not inspect.isclass(value):
        return lacks
    if dataclasses.is_dataclass(value):
        said = reference.field_docs(value)
        fields = [each.name for each in dataclasses.fields(value) if each.init]
        lacks += [f"the field {each}" for each in fields if each not in said]
    elif "__init__" in vars(value) and len(parameters := parameters_of(value.__init__, 1)) > 2:
        lacks += missing_arguments(parameters, doc)
    others = [base for base in value.__mro__ if not base.__module__.startswith("hrc_env")]
    foreign = {attribute for base in others for attribute in vars(base)}
    for attribute, given in vars(value).items():
        function = getattr(value, attribute)
        if attribute.startswith("_") or not inspect.isroutine(function):
            continue
        bound = int(not isinstance(given, classmethod | staticmethod))
        parameters = [] if attribute in foreign else parameters_of(function, bound)
        own = inspect.cleandoc(function.__doc__ or "")
        lacks += [f"{attribute}: {each}" for each in missing_words(function, parameters, own, doc)]
    return lacks


@pytest.mark.parametrize("name", PUBLIC)
def test_a_public_name_is_documented(name):
    assert lacks_of(name) == []


def test_what_a_docstring_lacks_is_noticed():
    def double(points, factor, frame) -> list:
        """The points, made larger by
        a factor."""

    own = inspect.cleandoc(double.__doc__ or "")
    assert missing_words(double, parameters_of(double), own) == [
        "a first line that is a sentence", "a verb to begin with", "the argument points",
        "the argument factor", "the argument frame", "what it returns",
    ]  # fmt: skip


# Who reaches deeper


MENTION = re.compile(r"(?<![\w/.-])hrc_env(?:\.\w+)+")
BLOCK = re.compile(r"^( *)```(\w*)\n(.*?)^ *```", re.M | re.S)
COMMAND = re.compile(r"python3? -m hrc_env[\w.]*")


def is_public(mention: str) -> bool:
    """Whether a dotted name begins with a public name of the package: `hrc_env.Clip.fps`."""
    return mention.split(".")[1] in {*PUBLIC, "__version__"}


def deep_in_code(code: str) -> list[str]:
    """The names that Python code takes from anything but `hrc_env` itself."""
    found = []
    for node in ast.walk(ast.parse(code)):
        taken = []
        if isinstance(node, ast.Import):
            taken = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            taken = [f"{node.module}.{alias.name}" for alias in node.names if alias.name != "*"]
            taken += [str(node.module)] if str(node.module).startswith("hrc_env.") else []
        elif isinstance(node, ast.Attribute):
            taken = [ast.unparse(node)]
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            taken = deep_in_words(node.value)
        whole = [each for each in taken if re.fullmatch(r"hrc_env(\.\w+)+", each)]
        found += [each for each in whole if not is_public(each)]
    return sorted(set(found))


def deep_in_words(text: str) -> list[str]:
    """The dotted names in a text that begin with no public name, commands left out."""
    return [each for each in MENTION.findall(COMMAND.sub("", text)) if not is_public(each)]


def deep_in_page(text: str, with_prose: bool = True) -> list[str]:
    """The same of a page of Markdown: of its Python by syntax, of all else by the words."""
    found = []
    for indent, language, code in BLOCK.findall(text):
        if language in ("python", "py"):
            found += deep_in_code(re.sub(rf"^{indent}", "", code, flags=re.M))
        else:
            found += [
                each for each in MENTION.findall(COMMAND.sub("", code)) if not is_public(each)
            ]
    if with_prose:
        prose = COMMAND.sub("", BLOCK.sub("", text))
        found += [each for each in MENTION.findall(prose) if not is_public(each)]
    return sorted(set(found))


def name_of(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


@pytest.mark.parametrize("path", EXAMPLES, ids=name_of)
def test_an_example_imports_nothing_deeper(path):
    assert deep_in_code(path.read_text()) == []


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_a_page_names_nothing_deeper(page):
    assert deep_in_page(page.read_text(), with_prose=page not in ABOUT_THE_INSIDE) == []


@pytest.mark.parametrize(
    "code",
    [
        "import hrc_env.scene.robot",
        "import hrc_env.scene.robot as robots",
        "from hrc_env.core.records import Keypoints",
        "from hrc_env.core.records import *",
        "from hrc_env.agents.registry import make_agent",
        "from hrc_env import observations",
        "from hrc_env import registration as r",
        "import hrc_env\nhrc_env.registration.import_files('a.py')",
        "def f():\n    import hrc_env.sb3",
        "from importlib import import_module\nimport_module('hrc_env.tracking.paper')",
    ],
)
def test_code_that_reaches_deeper_is_found(code):
    assert deep_in_code(code) != []
    assert deep_in_page(f"Text.\n\n```python\n{code}\n```\n", with_prose=False) != []


@pytest.mark.parametrize(
    "text",
    ["See `hrc_env.tracking.smoother.smooth(P, clip)`.", "It is hrc_env.motion.fit.describe_fit.",
     "```bash\npython -c 'import hrc_env.core.machine'\n```\n", "[`hrc_env.belief`](belief.md)",
     "- in a list\n\n  ```python\n  from hrc_env.config import HRCConfig\n  ```\n"],
)  # fmt: skip
def test_a_page_that_reaches_deeper_is_found(text):
    assert deep_in_page(text) != []


def test_the_front_door_itself_is_not_deep():
    code = "import hrc_env\nfrom hrc_env import Clip\nprint(hrc_env.Clip.fps, hrc_env.__version__)"
    text = "`hrc_env.Clip` is in `hrc_env/motion/clip.py`; `python -m hrc_env list`, hrc_env."
    assert deep_in_code(code) == []
    assert deep_in_page(f"{text}\n\n```python\n{code}\n```\n") == []
