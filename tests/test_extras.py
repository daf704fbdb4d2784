"""The environment without the learner's libraries: nothing imports them before somebody learns."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
LINE = 'pip install "hrc_env[train]"'
WITHOUT = """
import sys
from importlib.machinery import PathFinder

class Without(PathFinder):
    @classmethod
    def find_spec(cls, name, path=None, target=None):
        gone = name.split(".")[0] in ("torch", "stable_baselines3", "tensorboard", "triton")
        return None if gone else super().find_spec(name, path, target)

sys.meta_path = [Without if finder is PathFinder else finder for finder in sys.meta_path]
"""
"""From here on it is as if they were not installed."""


DOORS = {
    "acting", "checkpoints", "cloning", "export", "features", "ppo", "ppo_lagrangian", "sac",
    "sb3", "sb3_files", "training",
}  # fmt: skip
"""The modules that cannot be imported without the learner: `hrc_env.sb3`, the rest agents."""


@pytest.fixture
def without_learner(process):
    """Runs code there, with some words."""
    return lambda code, *words: process("-c", WITHOUT + code, *words, cwd=ROOT)


def test_no_module_imports_a_learner_but_the_door_to_one(without_learner):
    done = without_learner("""
import importlib, pkgutil, hrc_env
import hrc_env.agents.registry, hrc_env.agents.random, hrc_env.agents.scripted
refused = []
for module in pkgutil.walk_packages(hrc_env.__path__, "hrc_env.", onerror=refused.append):
    try:
        importlib.import_module(module.name)
    except ModuleNotFoundError:  # of another extra
        pass
    except ImportError as error:
        refused.append(f"{module.name}: {error}")
print(len(refused), *refused)
""")
    assert done.returncode == 0, done.stderr
    doors = set(re.findall(r"hrc_env\.(?:agents\.)?(\w+): ", done.stdout))
    assert doors == DOORS
    assert LINE in done.stdout


def test_the_scripted_film_needs_no_learner(without_learner, tmp_path: Path):
    film = tmp_path / "film.mp4"
    done = without_learner(
        "from hrc_env.__main__ import main; sys.exit(main())",
        "demo", "--perception", "keypoints", "--seconds", "0.2", "--out", str(film),
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert film.exists()


@pytest.mark.parametrize(
    "code",
    [
        "import runpy; sys.argv[0] = 'train.py'; runpy.run_path('train.py', run_name='__main__')",
        "from hrc_env.__main__ import main; sys.argv[1:] = "
        "['play', '--perception', 'truth', '--agent', 'policy.zip']; sys.exit(main())",
    ],
    ids=["train.py", "a checkpoint"],
)
def test_who_wants_to_learn_is_told_the_line_to_type(without_learner, code):
    done = without_learner(code)
    assert done.returncode != 0
    assert LINE in done.stderr
    assert "Traceback" not in done.stderr
