"""The examples of bringing one's own: short, and known wherever a name is asked for."""

import dataclasses
import re
import runpy
import subprocess
import sys

import gymnasium
import imageio.v2 as imageio
import mujoco
import numpy as np
import pytest
from commands import ROOT, hrc

import hrc_env
from hrc_env.agents.env_info import env_info
from hrc_env.agents.registry import make_agent
from hrc_env.core.errors import ConfigError
from hrc_env.core.records import Roi
from hrc_env.env import HRCEnv
from hrc_env.geometry import chains
from hrc_env.geometry.camera_config import write_rig
from hrc_env.perception.detector import call_detector
from hrc_env.registration import import_files
from hrc_env.scene.build import build
from hrc_env.scene.render import PictureRenderer
from hrc_env.scene.robot import ROBOTS
from hrc_env.tasks.task import TASKS
from hrc_env.tracking.config import ParticleConfig, cast_config
from hrc_env.tracking.estimators import ESTIMATORS
from hrc_env.tracking.particle import ParticleEstimator
from hrc_env.vector.env import HRCVectorEnv
from hrc_env.worker.body import worker_truth
from tests.tasks.variants import vary

EXAMPLES = ROOT / "examples" / "bring_your_own"
TASK, OWN = "HRCTend-v0", "dlt_kalman"


pytestmark = pytest.mark.usefixtures("brought")


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.py")), ids=lambda path: path.stem)
def test_an_example_is_short(path):
    assert len(path.read_text().splitlines()) <= 80


def test_a_task_is_an_environment():
    env = gymnasium.make(TASK, perception="truth", config={"task": {"radius_m": 0.5}})
    observation, info = env.reset(seed=1)
    assert env.observation_space.contains(observation)
    assert info["task/visits"] == 0.0
    for _ in range(40):
        observation, reward, *_, info = env.step(env.action_space.sample())
    terms = [info[name] for name in info if name.startswith("reward/")]
    assert "reward/visit" in info
    assert reward == pytest.approx(sum(terms))
    assert "station" in env.unwrapped.split_observation(observation)
    assert env.spec.kwargs["task"] == TASK


def test_a_task_is_a_vector_environment_with_the_same_numbers():
    many = gymnasium.make_vec(TASK, num_envs=2, perception="keypoints")
    one = gymnasium.make(TASK, perception="keypoints")
    seen, _ = many.reset(seed=[3, 4])
    np.testing.assert_array_equal(seen[1], one.reset(seed=4)[0])
    for _ in range(5):
        actions = many.action_space.sample()
        seen, *_ = many.step(actions)
        np.testing.assert_array_equal(seen[1], one.step(actions[1])[0])


def test_the_command_line_plays_a_task_that_a_file_registers(process):
    done = subprocess.run(
        [sys.executable, "-m", "hrc_env", "--import", EXAMPLES / "task.py", "play", TASK,
         "--agent", "random", "--perception", "truth"],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "visits" in done.stdout


def test_what_nobody_wrote_an_expert_for_says_so():
    done = hrc("play", TASK, "--perception", "truth")
    assert done.returncode == 2
    assert "no scripted agent for HRCTend-v0" in " ".join(done.stderr.split())


def counting(visits: float = 0.0, missing: float = 0.0, success: float = 0.0):
    """Return an `info` that always says this."""
    said = {"task/visits": visits, "task/missing_visits": missing, "is_success": success}
    return lambda self, state: {name: np.full(len(state), each) for name, each in said.items()}


BAD = {
    "markers that are no function": (
        {"id": "HRCTend-v1", "markers": None},
        "markers must be a method",
    ),
    "an id that is taken": ({}, "The task 'HRCTend-v0' exists already"),
    "an id that is none": ({"id": "tend"}, "must be like"),
    "no function": ({"id": "HRCTend-v1", "advance": None}, "advance must be a method"),
    "settings without defaults": (
        {"id": "HRCTend-v1", "config_type": dataclasses.make_dataclass("C", ["x"])},
        "needs a default",
    ),
    "a term that is taken": (
        {"id": "HRCTend-v1", "rewards": hrc_env.rewards.SHARED_TERMS[:1]},
        "term 'effort' exists already",
    ),
    "an info that lacks a count": (
        {"id": "HRCTend-v1", "achieved": "task/screws"},
        "info must hold 'task/screws'",
    ),
    "attempts below zero": (
        {"id": "HRCTend-v1", "info": counting(visits=-1.0)},
        r"info\['task/visits'\] must count attempts",
    ),
    "attempts that are no numbers": (
        {"id": "HRCTend-v1", "info": counting(missing=np.nan)},
        r"info\['task/missing_visits'\] must count attempts",
    ),
    "half a success": (
        {"id": "HRCTend-v1", "info": counting(success=0.5)},
        r"info\['is_success'\] must be 0 or 1",
    ),
    "a state of other rows": (
        {
            "id": "HRCTend-v1",
            "make_state": lambda self, batch: np.zeros(
                3, [("next_station", "i8"), ("n_visits", "i8")]
            ),
        },
        "must have shape \\(2,\\)",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_what_is_wrong_with_a_task_is_said(name):
    changes, said = BAD[name]
    with pytest.raises(ConfigError, match=said):
        hrc_env.register_task(vary(TASKS[TASK], **changes))


def test_an_observation_that_is_no_number_is_named():
    view = lambda self, state, ids: np.full((len(state[ids]), 3), np.nan)  # noqa: E731
    with pytest.raises(FloatingPointError, match="station"):
        HRCVectorEnv(2, task=vary(TASKS[TASK], view=view), perception="none")


def test_one_entry_of_one_environment_that_is_no_number_is_enough():
    def view(self, state, ids):
        seen = np.zeros((len(state[ids]), 3))
        seen[-1, 1] = np.nan
        return seen

    with pytest.raises(FloatingPointError, match=r"not finite numbers: station\.$"):
        HRCVectorEnv(2, task=vary(TASKS[TASK], view=view), perception="none")


def test_an_observation_term_of_another_size_is_named():
    term = dataclasses.replace(TASKS[TASK].observations[0], size=lambda of: 4)
    task = vary(TASKS[TASK], observations=(term,))
    with pytest.raises(ConfigError, match="observation term 'station' must have shape"):
        HRCVectorEnv(2, task=task, perception="none")


def test_a_reward_term_of_another_shape_is_named():
    term = dataclasses.replace(TASKS[TASK].rewards[0], function=lambda *_: np.zeros(5))
    with pytest.raises(ConfigError, match="reward term 'visit' must have shape"):
        HRCVectorEnv(2, task=vary(TASKS[TASK], rewards=(term,)), perception="none")


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(ConfigError, match="cannot be imported"):
        import_files(str(tmp_path / "nowhere.py"))


def test_an_estimator_works_wherever_one_is_named():
    many = gymnasium.make_vec(
        "HRCReach-v0",
        2,
        perception="keypoints",
        estimator=OWN,
        config={"tracker": {"sigma_scale": 1.5}},
    )
    many.reset(seed=[3, 4])
    for _ in range(30):
        *_, infos = many.step(many.action_space.sample())
    assert (infos["tracking/mpjpe_m"] < 0.15).all()  # it lags behind who walks
    assert OWN in hrc("list").stdout


def test_an_estimator_says_the_same_single_and_in_a_batch_with_late_frames_replayed():
    late = [{"kind": "late", "cameras": ["camera_1"], "amount": 0.13}]
    arguments = {"perception": "keypoints", "estimator": OWN, "faults": late}
    many = gymnasium.make_vec("HRCReach-v0", 3, **arguments)
    one = gymnasium.make("HRCReach-v0", **arguments)
    many.reset(seed=[3, 4, 5])
    one.reset(seed=4)
    for _ in range(12):
        actions = many.action_space.sample()
        seen, *_ = many.step(actions)
        np.testing.assert_array_equal(seen[1], one.step(actions[1])[0])


def test_a_function_that_makes_an_estimator_is_one():
    from hrc_env_import_estimator import DltKalman

    env = gymnasium.make(
        "HRCReach-v0", perception="keypoints",
        estimator=lambda P, dt_s, config: DltKalman(P, dt_s, ESTIMATORS[OWN].config()),
    )  # fmt: skip
    assert env.reset(seed=1)[1]["tracking/mpjpe_m"] < 0.2


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({}, "The estimator 'dlt_kalman' exists already"),
        ({"make": lambda P, dt_s, config: object()}, "lacks init, reset, predict"),
        ({"config": dict}, "must be a subclass of TrackerConfig"),
        ({"make": lambda *given: Wrong(*given, np.nan)}, "estimate.mean_world must be finite"),
        (
            {"make": lambda *given: Wrong(*given, np.zeros(7))},
            "mean_world must have shape",
        ),
    ],
)
def test_what_is_wrong_with_an_estimator_is_said(changes, said):
    with pytest.raises(ConfigError, match=said):
        hrc_env.register_estimator(dataclasses.replace(ESTIMATORS[OWN], **changes))


class Wrong(ParticleEstimator):
    """The default one, whose means are something else."""

    def __init__(self, P, dt_s, config, mean):
        super().__init__(P, dt_s, cast_config(config, ParticleConfig))
        object.__setattr__(self, "mean", mean)

    def estimate(self, state):
        found = super().estimate(state)
        shape = found.mean_world.shape if np.ndim(self.mean) == 0 else self.mean.shape
        return dataclasses.replace(found, mean_world=np.broadcast_to(self.mean, shape))


def test_a_shield_changes_commands_and_says_so():
    infos, angles = {}, {}
    for shield in (None, "slow_down"):
        env = gymnasium.make("HRCReach-v0", perception="truth", shield=shield)
        simulation = env.unwrapped.simulation
        agent, (observation, _) = make_agent("scripted", env_info(simulation)), env.reset(seed=1)
        infos[shield] = []
        for _ in range(200):
            observation, *_, info = env.step(agent.act(observation))
            infos[shield].append(info)
        angles[shield] = simulation.physics.q.copy()
    assert "shield/speed_share" not in infos[None][0]
    assert min(info["shield/speed_share"] for info in infos["slow_down"]) < 1.0
    assert np.abs(angles[None] - angles["slow_down"]).max() > 1e-3


def test_a_shield_reads_the_belief_alone():
    """With nobody perceived there is nobody to yield to, wherever they are."""
    env = gymnasium.make("HRCReach-v0", perception="none", shield="slow_down")
    env.reset(seed=1)  # a worker who comes close
    assert {env.step(env.action_space.sample())[4]["shield/speed_share"] for _ in range(20)} == {
        1.0
    }


def test_the_vector_environment_says_what_the_single_one_says_of_its_shield():
    many = gymnasium.make_vec("HRCReach-v0", 2, perception="keypoints", shield="slow_down")
    one = gymnasium.make("HRCReach-v0", perception="keypoints", shield="slow_down")
    many.reset(seed=[5, 6])
    one.reset(seed=6)
    for _ in range(5):
        actions = many.action_space.sample()
        *_, infos = many.step(actions)
        *_, info = one.step(actions[1])
        assert infos["shield/speed_share"][1] == info["shield/speed_share"]


@pytest.mark.parametrize(
    ("shield", "said"),
    [
        ("slow_donw", "Did you mean 'slow_down'"),
        (lambda now, velocities, dt_s: (velocities[:, :2], {}), "velocities must have shape"),
        (lambda now, velocities, dt_s: (velocities * np.nan, {}), "velocities must be finite"),
        (lambda now, velocities, dt_s: (velocities, {"x": np.zeros(7)}), "'x' of a shield must"),
        (3, "shield must be a name, a ShieldConfig or a mapping of its fields, a function or None"),
    ],
)
def test_what_is_wrong_with_a_shield_is_said(shield, said):
    with pytest.raises(ConfigError, match=said):
        stepped(perception="none", shield=shield)


def stepped(**arguments):
    env = gymnasium.make("HRCReach-v0", **arguments)
    env.reset(seed=1)
    return env.step(np.zeros(6))


@pytest.mark.parametrize(
    ("register", "given", "said"),
    [
        (hrc_env.register_shield, ("slow_down", print), "shield 'slow_down' exists already"),
        (hrc_env.register_shield, ("other", None), "must be a function"),
        (
            hrc_env.register_detector,
            ("mirrored", print),
            "detector 'mirrored' exists already",
        ),
        (hrc_env.register_detector, ("other", None), "must be a function"),
    ],
)
def test_what_is_no_function_or_has_a_taken_name_is_refused(register, given, said):
    with pytest.raises(ConfigError, match=said):
        register(*given)


def test_a_detector_finds_the_worker(pixels):
    config = {"detector": {"keypoints": "mirrored"}}
    env = gymnasium.make("HRCReach-v0", perception="pixels", config=config)
    env.reset(seed=3)
    errors_m = [env.step(np.zeros(6))[4].get("tracking/mpjpe_m", np.nan) for _ in range(8)]
    env.close()
    assert np.nanmedian(errors_m) < 0.06


@pytest.mark.parametrize(
    ("found", "said"),
    [(np.zeros((33, 3)), "keypoints must have shape"), (np.full((15, 3), 2.0), "in \\[0, 1\\]")],
)
def test_what_is_wrong_with_keypoints_is_said(found, said):
    with pytest.raises(ConfigError, match=said):
        call_detector(
            lambda crop: found, np.zeros((256, 256, 3), np.uint8), Roi((9.0, 9.0), 9.0, 0.0)
        )


def test_a_joint_that_is_not_found_is_data():
    found = np.full((15, 3), 0.5)
    found[3] = np.nan
    joints = call_detector(
        lambda crop: found, np.zeros((256, 256, 3), np.uint8), Roi((9.0, 9.0), 9.0, 0.0)
    )
    assert joints[3, 2] == 0.0
    assert np.isnan(joints[3, :2]).all()


def test_an_unknown_detector_is_refused_with_those_that_there_are():
    with pytest.raises(ConfigError, match="Did you mean 'mirrored'"):
        gymnasium.make("HRCReach-v0", config={"detector": {"keypoints": "mirored"}})


def test_films_are_followed_without_a_simulator(tmp_path, pixels):
    """Somebody is filmed by four cameras; the example says where they are."""
    from hrc_env_import_image_source import poses

    env = HRCEnv(perception="none")
    env.reset(seed=3)
    scene = env.simulation.scene
    films = [tmp_path / f"{camera.name}.mp4" for camera in scene.cameras]
    writers = [imageio.get_writer(film, fps=25, quality=9) for film in films]
    renderer, truths = PictureRenderer(scene, 1920, 1080), []
    for _ in range(8):
        seen = env.views.glance()
        for camera, writer in zip(scene.cameras, writers, strict=True):
            writer.append_data(renderer.picture(seen.q, seen.motion, camera, shadows=False))
        truths.append(worker_truth(env.simulation.bodies, seen.motion).joints_world)
        env.step(np.zeros(6))
    for each in (*writers, renderer, env):
        each.close()
    write_rig(tmp_path / "rig.toml", scene.rig)
    found = list(poses(tmp_path / "rig.toml", films))
    assert len(found) == 8
    assert found[-1] is not None
    middle, deviation_m = found[-1]
    assert np.linalg.norm(middle - np.reshape(truths[-1], (15, 3)).mean(0)) < 0.05
    assert 0.005 < deviation_m < 0.2


def test_a_robot_works_wherever_one_is_named():
    many = gymnasium.make_vec("HRCReach-v0", 2, perception="keypoints", robot="swing_arm")
    one = gymnasium.make("HRCReach-v0", perception="keypoints", robot=ROBOTS["swing_arm"])
    assert one.action_space.shape == (3,)
    many.reset(seed=[3, 4])
    one.reset(seed=4)
    for _ in range(5):
        actions = many.action_space.sample()
        seen, *_ = many.step(actions)
        np.testing.assert_array_equal(seen[1], one.step(actions[1])[0])
    assert "swing_arm" in hrc("list").stdout


def test_the_geometry_of_a_robot_is_that_of_its_mjcf():
    scene, q = build(robot="swing_arm"), np.array([0.4, -0.3, 1.1])
    data = mujoco.MjData(scene.model)
    data.qpos[:] = q
    mujoco.mj_kinematics(scene.model, data)
    tip = chains.tool_frame(scene.chain, q)[:3, 3]
    np.testing.assert_allclose(data.site("robot/tip").xpos, tip, atol=1e-9)
    for name, ends in zip(scene.robot.capsules, chains.capsules(scene.chain, q), strict=True):
        np.testing.assert_allclose(data.geom(f"robot/{name}").xpos, ends.mean(0), atol=1e-9)


def test_a_robot_goes_where_it_is_told():
    env = gymnasium.make("HRCReach-v0", perception="none", n_workers=0, robot="swing_arm")
    env.reset(seed=1)
    physics = env.unwrapped.simulation.physics
    before = physics.q[0]
    for _ in range(12):
        env.step(np.array([0.5, 0.0, 0.0]))
    moved = physics.q[0] - before
    assert moved[0] > 0.1
    np.testing.assert_allclose(moved[1:], 0.0, atol=1e-3)


SERVO = '<velocity joint="bend" kv="400" ctrlrange="-3 3"/>'


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({}, "robot 'swing_arm' exists already"),
        ({"mjcf": "<mujoco><"}, "cannot be used"),
        ({"mjcf": "nowhere.xml"}, "cannot be used"),
        ({"tool_site": "top"}, "no site 'top'"),
        ({"joints": ("turn", "lift", "bent")}, "no joint 'bent'"),
        ({"joints": ("lift", "turn", "bend")}, "in the same order"),
        ({"capsules": ("turret", "boom", "claw")}, "no geom 'claw'"),
        ({"watched_capsules": ("jip",)}, "Did you mean 'jib'"),
        ({"home_q": (0.0, 0.6)}, "home_q must be 3 angles"),
        ({"home_q": (0.0, 0.6, np.nan)}, "home_q must be 3 angles"),
        ({"home_q": (3.0, 0.6, 1.2)}, "outside the joints' ranges"),
        ({"mjcf": lambda text: text.replace(SERVO, "")}, "needs an <intvelocity>"),
        ({"mjcf": lambda text: re.sub('capsule(" size=".05)', r"cylinder\1", text)},
         "must be a capsule"),
        ({"mjcf": lambda text: re.sub("<inertial[^>]*>", "", text)}, "needs an <inertial>"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_a_robot_is_said(changes, said):
    if callable(changes.get("mjcf")):
        changes = {"mjcf": changes["mjcf"](ROBOTS["swing_arm"].mjcf)}
    with pytest.raises(ConfigError, match=said):
        hrc_env.register_robot(dataclasses.replace(ROBOTS["swing_arm"], **changes))


def test_an_unknown_robot_is_refused_with_those_that_there_are():
    with pytest.raises(ConfigError, match="Did you mean 'swing_arm'"):
        gymnasium.make("HRCReach-v0", robot="swing_amr")


def test_a_study_is_played_and_reported(tmp_path):
    study = runpy.run_path(str(EXAMPLES / "study.py"))["STUDY"]
    short = dataclasses.replace(study, n_quick=2).shorten()
    found = hrc_env.run_experiment(short, tmp_path / "out")
    assert found["bare.share"].value == 1.0
    assert found["qp.contacts_towards"].n == 2
    assert "Cost and benefit of a shield" in (tmp_path / "out" / "report.md").read_text()
