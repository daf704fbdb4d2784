"""Registrations reach the processes that are started, or the error says in words why not."""

import os
import textwrap

import pytest
from commands import ROOT

SCRIPT = """
import multiprocessing
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

import gymnasium
import numpy as np

import hrc_env
from hrc_env.registration import import_files
from hrc_env.scene.robot import ROBOTS
from hrc_env.tasks.task import find_task
from hrc_env.tracking.config import ParticleConfig
from hrc_env.tracking.estimators import EstimatorSpec
from hrc_env.tracking.particle import ParticleEstimator


@dataclass(frozen=True)
class Settings(ParticleConfig):
    half: float = 0.5


def make(P, dt_s, config):
    return ParticleEstimator(P, dt_s, ParticleConfig(sigma_scale=config.half))


def slower(belief, velocities, dt_s):
    return SHARE * velocities, {"share": np.full(len(velocities), SHARE)}


class Own(find_task("HRCReach-v0")):
    id = "HRCOwn-v0"
    max_episode_steps = 7

    def view(self, *given):
        return super().view(*given)


def register():
    hrc_env.register_task(Own)
    hrc_env.register_robot(replace(ROBOTS["ur10e_like"], name="own", home_q=(0, -1, 1, 0, 1, 0)))
    hrc_env.register_estimator(EstimatorSpec("own", make, Settings))
    hrc_env.register_shield("own", slower)
    hrc_env.register_detector("own", lambda: lambda crop: None)


SHARE = 0.25
USED = {"robot": "own", "estimator": "own", "shield": "own"}


def seen(task):
    config = {"tracker": {"half": 0.3}, "detector": {"keypoints": "own"}}
    env = gymnasium.make(task, perception="keypoints", config=config, **USED)
    first = env.reset(seed=1)[0]
    second, *_, info = env.step(np.full(6, 0.5, np.float32))
    return [*first.tolist(), *second.tolist(), info["shield/share"], env.spec.max_episode_steps]


def compare(kind, task="hrc_env:HRCOwn-v0"):
    with ProcessPoolExecutor(1, multiprocessing.get_context(kind)) as pool:
        assert list(pool.map(seen, [task])) == [seen(task)], kind
"""


@pytest.fixture
def script(tmp_path, process):
    """Runs a script that ends with these lines, and returns the process that is over."""

    def run(*lines, text=SCRIPT, **env):
        path = tmp_path / "script.py"
        path.write_text(text + "\n" + "\n".join(map(textwrap.dedent, lines)))
        return process(path, cwd=tmp_path, PYTHONPATH=str(ROOT), TMPDIR=str(tmp_path), **env)

    return run


def test_registrations_of_a_script_reach_processes_of_every_kind(script, tmp_path):
    done = script(
        """
        if __name__ == "__main__":
            register()
            for kind in ("fork", "spawn", "forkserver"):
                compare(kind)
        """
    )
    assert done.returncode == 0, done.stderr
    assert not list(tmp_path.glob("hrc_env_*")), "the snapshot is removed at exit"


def test_they_reach_processes_that_run_the_registration_again_or_were_there_before(script):
    again = script("register()", 'if __name__ == "__main__":\n    compare("spawn")')
    assert again.returncode == 0, again.stderr
    before = script(
        """
        if __name__ == "__main__":
            with ProcessPoolExecutor(1, multiprocessing.get_context("forkserver")) as pool:
                assert list(pool.map(abs, [-1])) == [1]
            register()
            compare("forkserver", "hrc_env:HRCReach-v0")
        """
    )
    assert before.returncode == 0, before.stderr


def test_they_reach_vector_environments_at_pixels(script, pixels):
    done = script(
        """
        if __name__ == "__main__":
            register()
            own = {"detector": {"keypoints": "own"}, "tracker": {"half": 0.3}}
            envs = gymnasium.make_vec("HRCOwn-v0", 2, config=own, **USED)
            envs.reset(seed=1)
            assert (envs.step(np.zeros((2, 6), np.float32))[4]["shield/share"] == SHARE).all()
            envs.close()
            class Other(find_task("HRCOwn-v0")):
                def info(self, state):
                    said = super().info(state)
                    return {**said, "task/one": np.ones(len(said["task/goals_reached"]))}

            own = {"detector": {"keypoints": "own"}}
            envs = gymnasium.make_vec("HRCReach-v0", 1, task=Other, config=own)
            assert envs.reset(seed=1)[1]["task/one"] == [1.0], "the object, not the id's task"
            envs.close()
        """
    )
    assert done.returncode == 0, done.stderr


FILE = """
import hrc_env
from dataclasses import replace
from hrc_env.scene.robot import ROBOTS

hrc_env.register_robot(replace(ROBOTS["ur10e_like"], name={name!r}))
"""
NAMES = """
def names(_):
    from hrc_env.scene.robot import ROBOTS
    return [each for each in ROBOTS if ROBOTS[each] and each.startswith("of_")]
"""


def test_files_reach_them_and_two_of_one_name_are_two(script, tmp_path):
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "arm.py").write_text(FILE.format(name=f"of_{folder}"))
    done = script(
        NAMES,
        """
        if __name__ == "__main__":
            import_files("a/arm.py")
            import_files("b/arm.py")
            for kind in ("spawn", "forkserver"):
                with ProcessPoolExecutor(1, multiprocessing.get_context(kind)) as pool:
                    assert list(pool.map(names, [0])) == [["of_a", "of_b"]], kind
        """,
    )
    assert done.returncode == 0, done.stderr


def test_another_program_may_register_the_same_names(script, tmp_path):
    (tmp_path / "arm.py").write_text(FILE.format(name="own"))
    done = script(
        """
        if __name__ == "__main__":
            import subprocess
            register()
            subprocess.run([sys.executable, "arm.py"], check=True)
        """
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("before", "said"),
    [
        (
            """
            import threading
            lock = threading.Lock()
            hrc_env.register_shield("odd", lambda *given: lock and slower(*given))
            """,
            "The shield 'odd' was registered in the parent process and cannot be transferred to "
            "this one (TypeError: cannot pickle '_thread.lock' object).",
        ),
        (
            """
            Path("odd.py").write_text(
                "import hrc_env\\n"
                "hrc_env.register_shield('odd', lambda now, wanted, dt_s: (wanted, {}))"
            )
            import_files("odd.py")
            Path("odd.py").unlink()
            """,
            "odd.py cannot be imported: there is no such file.",
        ),
        (
            """
            sys.path.insert(0, "elsewhere")
            Path("elsewhere").mkdir()
            Path("elsewhere/odd.py").write_text("def odd(now, wanted, dt_s): return wanted, {}")
            import odd
            hrc_env.register_shield("odd", odd.odd)
            Path("elsewhere/odd.py").unlink()
            """,
            "(ModuleNotFoundError: No module named 'odd')",
        ),
    ],
    ids=["no pickle", "no file", "no module"],
)
def test_what_cannot_travel_says_so_where_it_is_asked_for(script, before, said):
    done = script(
        """
        def step(shield):
            env = gymnasium.make("hrc_env:HRCReach-v0", perception="none", shield=shield)
            env.reset(seed=1)
            return env.step(np.zeros(6, np.float32))[1]
        """,
        "def prepare():" + textwrap.indent(textwrap.dedent(before), "    "),
        """
        if __name__ == "__main__":
            prepare()
            with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
                assert list(pool.map(step, ["qp"])) == [step("qp")]
                step("odd")  # here it goes on
                try:
                    list(pool.map(step, ["odd"]))
                except hrc_env.core.errors.ConfigError as error:
                    print(error)
        """,
    )
    assert done.returncode == 0, done.stderr
    assert said in done.stdout
    assert "HRC_ENV_IMPORT or import_files" in done.stdout


def test_a_snapshot_in_a_folder_of_others_is_not_read(process, tmp_path):
    (tmp_path / "snapshot.pickle").write_bytes(b"cos\nsystem\n(S'touch opened'\ntR.")
    os.chmod(tmp_path, 0o777)
    done = process(
        "-c", "import hrc_env", cwd=tmp_path, PYTHONPATH=str(ROOT),
        HRC_ENV_REGISTERED=str(tmp_path / "snapshot.pickle"),
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "its folder must be owned by this user" in done.stderr
    assert not (tmp_path / "opened").exists()
