"""House rules, held by reading the source: floors, doors, belief and truth."""

import ast
import re
import subprocess
import sys
import tomllib
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "hrc_env"
SOURCES = sorted(PACKAGE.rglob("*.py"))
ALL_SOURCES = [*SOURCES, *sorted((ROOT / "agents").glob("*.py")), ROOT / "train.py"]

TRUTH_READERS = {
    "hrc_env/core/records.py": "declares it",
    "hrc_env/worker/body.py": "makes it from the worker's motion",
    "hrc_env/infos.py": "gives errors against it their names",
    "hrc_env/simulation.py": "carries it to cost, metrics and perception",
    "hrc_env/pipeline/sensor_input.py": "hands it to the sensors of `keypoints` and `truth`",
    "hrc_env/experiments/impact/episodes.py": "counts what came of beliefs",
    "hrc_env/experiments/price/episodes.py": "counts what came of beliefs",
    "hrc_env/experiments/price/true_bodies.py": "hands true bodies to the shield of an upper bound",
    "hrc_env/perception/emulator.py": "projects it into emulated cameras",
    "hrc_env/tracking/oracle.py": "copies it into the belief: the one place",
}


def relative(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


@cache
def nodes(path: Path) -> list[ast.AST]:
    return list(ast.walk(ast.parse(path.read_text())))


@cache
def imported(path: Path) -> frozenset[str]:
    """Modules and names in them that a file imports, as "hrc_env.core.records.WorkerTruth"."""
    package = [*path.relative_to(ROOT).with_suffix("").parts][:-1]
    if package[:1] == ["agents"]:  # to which a link in the package leads
        package = ["hrc_env", *package]
    found: set[str] = set()
    for node in nodes(path):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            above = package[: len(package) - node.level + 1] if node.level else []
            module = ".".join([*above, *([node.module] if node.module else [])])
            found |= {module, *(f"{module}.{alias.name}" for alias in node.names)}
    return frozenset(found)


@cache
def identifiers(path: Path) -> frozenset[str]:
    """Every name in a file's code: variables, attributes, arguments, keywords, what it imports."""
    found = {part for name in imported(path) for part in name.split(".")}
    for node in nodes(path):
        for field in ("id", "attr", "arg", "name"):
            if isinstance(name := getattr(node, field, None), str):
                found.add(name)
    return frozenset(found)


def test_imports_point_downward():
    """The floors are declared in pyproject.toml; import-linter reads the real imports."""
    done = subprocess.run(
        [Path(sys.executable).parent / "lint-imports", "--no-cache"],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout


def test_every_layer_is_one_room_or_rooms_that_do_not_know_each_other():
    """Siblings that may import each other would be several layers in one."""
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]
    (layers,) = [each["layers"] for each in contracts["contracts"] if each["type"] == "layers"]
    assert not [layer for layer in layers if ":" in layer]
    rooms = {room.strip() for layer in layers for room in layer.split("|")}
    there = {path.stem for path in PACKAGE.glob("*.py")} - {"__init__"}
    there |= {path.parent.name for path in PACKAGE.glob("*/__init__.py")}
    assert there - rooms == {"agents", "registration"}


def test_the_package_knows_nothing_that_only_a_checkout_has():
    """Neither by an import nor by a string; `MOVED` tells people how commands are called there."""
    beside = ("agents", "assets", "benchmarks", "docs", "examples", "tests")
    module = re.compile(rf"({'|'.join(beside)})\.[\w.]+")
    for path in ALL_SOURCES:
        assert not [name for name in imported(path) if name.split(".")[0] in beside], relative(path)
        modules = [each for each in strings(path) if module.fullmatch(each)]
        assert not modules, (relative(path), modules)


def test_only_these_files_know_the_truth():
    """Whoever is not in the list, with a reason, does not even name the record of truth."""
    knowing = {relative(path) for path in SOURCES if "WorkerTruth" in identifiers(path)}
    assert knowing == set(TRUTH_READERS) & knowing
    assert knowing >= {"hrc_env/simulation.py", "hrc_env/tracking/oracle.py"}


READERS = ["belief", "observations", "rewards", "control"]
READERS += [f"tasks/{path.stem}" for path in sorted((PACKAGE / "tasks").glob("*.py"))]


@pytest.mark.parametrize("name", READERS)
def test_what_the_robot_reads_knows_no_truth(name):
    """Terms take `Belief`, which has no truth in it; nothing in these files names it."""
    path = PACKAGE / f"{name}.py"
    assert not {each for each in identifiers(path) if "truth" in each or "_true" in each}
    assert "WorkerMotion" not in identifiers(path)


def test_who_chooses_windows_and_tracks_is_not_shown_the_world():
    """Sensors are; what looks through them and believes names neither their input nor bodies."""
    looks = ["worker_detector", "reacquisition", "tracking", "image_tracking", "pose_tracker"]
    finds = ["detector", "searching", "windows", "blazepose", "network"]
    paths = [PACKAGE / "pipeline" / f"{name}.py" for name in looks]
    paths += [PACKAGE / "perception" / f"{name}.py" for name in finds]
    paths += [path for path in (PACKAGE / "tracking").rglob("*.py") if path.stem != "oracle"]
    world = {"SensorInput", "TrueSensorInput", "WorkerMotion", "WorkerTruth", "worker_truth"}
    for path in paths:
        assert not identifiers(path) & world, relative(path)
    rendered = nodes(PACKAGE / "pipeline" / "rendered.py")
    (pipeline,) = [node for node in rendered if getattr(node, "name", "") == "PixelPipeline"]
    used = {node.attr for node in ast.walk(pipeline) if isinstance(node, ast.Attribute)}
    assert not used & {"now", "motion", "truth"}


def test_agents_do_not_touch_simulator_state():
    """An agent knows the robot and the observation: no physics, no motion, no truth."""
    state = {"hrc_env.simulation", "hrc_env.motion", "hrc_env.scene", "hrc_env.infos"}
    for path in (ROOT / "agents").glob("*.py"):
        assert not identifiers(path) & {"truth", "motion", "physics", "worker_truth"}, path
        if relative(path) != "agents/env_info.py":  # which reads a simulation
            assert not [each for each in imported(path) if each.startswith(tuple(state))], path


def test_randomness_is_an_argument():
    """No module draws from NumPy's global generator; one seeds it for a library that does."""
    made = {"Generator", "default_rng", "SeedSequence", "BitGenerator", "PCG64"}
    for path in ALL_SOURCES:
        drawn = {
            node.attr
            for node in nodes(path)
            if isinstance(node, ast.Attribute) and ast.unparse(node.value) == "np.random"
        }
        assert drawn <= made, relative(path)
        assert not {each for each in imported(path) if each == "random"}, relative(path)


def test_the_library_does_not_print():
    """Only the command line and train.py speak to the terminal."""
    for path in SOURCES:
        if "cli" not in path.parts and path.name != "__main__.py":
            called = {ast.unparse(node.func) for node in nodes(path) if isinstance(node, ast.Call)}
            assert "print" not in called, relative(path)


def strings(path: Path) -> list[str]:
    """Texts in a file's code, docstrings and sentences after fields left out."""
    said = {id(node.value) for node in nodes(path) if isinstance(node, ast.Expr)}
    constants = [node for node in nodes(path) if isinstance(node, ast.Constant)]
    return [c.value for c in constants if isinstance(c.value, str) and id(c) not in said]


def test_no_general_module_knows_a_task():
    """A task is in its file, and in the table of those that come with the package."""
    modules = {path.stem for path in (PACKAGE / "tasks").glob("*.py")} - {
        "__init__",
        "task",
        "goal",
        "check",
        "hooks",
    }
    files = {f"hrc_env/tasks/{name}.py" for name in modules} | {"hrc_env/tasks/__init__.py"}
    for path in SOURCES:
        if relative(path) not in files:
            assert not [each for each in imported(path) if re.match(r"hrc_env\.tasks\.", each)
                        and each.split(".")[2] in modules], path  # fmt: skip
            named = [text for text in strings(path) if re.search(r"HRC[A-Z]\w+-v\d", text)]
            assert not named, f"{relative(path)}: {named}"


def test_user_input_is_not_checked_by_assert():
    """`python -O` removes asserts; what a user gives is checked by errors that explain."""
    for path in SOURCES:
        if "cli" not in path.parts:
            assert not [node for node in nodes(path) if isinstance(node, ast.Assert)], path


def test_every_config_field_is_explained():
    """The sentence after a field is its documentation and the command line's help."""
    for path in SOURCES:
        for node in nodes(path):
            if isinstance(node, ast.ClassDef) and node.name.endswith("Config"):
                for field, after in zip(node.body, [*node.body[1:], None], strict=True):
                    if isinstance(field, ast.AnnAssign):
                        said = isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant)
                        assert said, f"{relative(path)}: {node.name}.{ast.unparse(field.target)}"
