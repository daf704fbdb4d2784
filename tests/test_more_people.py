"""More people in the room than the environment has slots, before its rendered cameras."""

from dataclasses import replace

import numpy as np
import pytest

from hrc_env.core.infos import MORE_PEOPLE
from hrc_env.core.records import Held, WorkerMotion
from hrc_env.core.vacancy import EMPTY, POSSIBLE
from hrc_env.env import HRCEnv
from hrc_env.motion import generator
from hrc_env.pipeline.pose_tracker import PoseTracker
from hrc_env.pipeline.rendered import RenderedCameras
from hrc_env.scene.build import build

REST = np.zeros(6, np.float32)
NEAR_SEED, FAR_SEED = 10, 27
"""Episodes in which the other person stands nearer to the robot than the worker, and farther."""


def beside(motion: WorkerMotion, other: WorkerMotion) -> WorkerMotion:
    """Both motions, with nothing in the other person's hands."""
    names = (
        "position_world",
        "quaternion_wxyz",
        "velocity_world",
        "angular_velocity_world",
        "body",
    )
    both = {
        name: np.concatenate([getattr(motion, name), getattr(other, name)], 1) for name in names
    }
    w, held = motion.position_world.shape[1], motion.held
    parts = (held.kind, held.position_world, held.quaternion_wxyz)
    nothing = (np.zeros_like(part[:, :1]) for part in parts)
    joined = (
        np.concatenate([part[:, :w], none, part[:, w:]], 1)
        for part, none in zip(parts, nothing, strict=True)
    )
    return WorkerMotion(**both, held=Held(*joined))


class Crowded(RenderedCameras):
    """The cameras of an environment in whose room stands one more person."""

    def __init__(self, env: HRCEnv, seed: int) -> None:
        sim = env.simulation
        recipe, pipeline = sim.scene.recipe, sim.pipeline
        scene = build(*recipe._replace(n_workers=sim.scene.n_workers + 1))
        plain = pipeline.cameras.history.schedule
        super().__init__(scene, 1, pipeline.cameras.appearance, plain)
        state = generator.make_state(
            1, 1, sim.bodies, sim.config.motion, sim.scene.grounds, 1, sim.scene.robot.base_radius_m
        )
        generator.reset(state, np.arange(1), [np.random.default_rng(seed)])
        self.other = generator.current(state)
        pipeline.cameras = pipeline.image_sensor = pipeline.sensor = self

    @property
    def other_xy_m(self) -> np.ndarray:
        return self.other.position_world[0, 0, 0, :2]

    def expose(self, now):
        super().expose(replace(now, motion=beside(now.motion, self.other)))


def crowded(seed: int, **settings) -> tuple[HRCEnv, Crowded]:
    """An environment that was reset, with one person more than it knows of."""
    env = HRCEnv(perception="pixels", people="unaware", **settings)
    cameras = Crowded(env, seed)
    env.reset(seed=seed)
    return env, cameras


@pytest.mark.slow
@pytest.mark.parametrize("seed", [NEAR_SEED, FAR_SEED])
def test_one_more_person_than_slots_is_said_and_makes_the_slots_unknown(seed):
    env, cameras = crowded(seed)
    said, near, followed = [], [], []
    for _ in range(40):
        observation, *_, info = env.step(REST)
        terms, belief = env.split_observation(observation), env.simulation.belief
        said.append(info[MORE_PEOPLE])
        unseen = belief.unseen
        away_m = np.linalg.norm(unseen.floor_world[:, :2] - cameras.other_xy_m, axis=-1)
        if info[MORE_PEOPLE] and terms["worker_tracked"][0]:
            hips = belief.estimate.mean_world[0, 0, 7:9].mean(0)
            followed.append(np.linalg.norm(hips[:2] - cameras.other_xy_m) < 0.5)
            near.append(followed[-1] or (unseen.level[0][away_m < 0.3] == POSSIBLE).all())
            assert (unseen.level[0] == EMPTY).any()  # elsewhere it is known to be empty
    env.close()
    assert np.mean(said) > 0.9
    assert np.mean(near[5:]) > 0.9
    assert (np.mean(followed[-10:]) > 0.5) == (seed == NEAR_SEED)


@pytest.mark.slow
def test_a_worker_alone_is_not_taken_for_several_people():
    env = HRCEnv(perception="pixels", people="unaware")
    env.reset(seed=NEAR_SEED)
    said = [env.step(REST)[-1][MORE_PEOPLE] for _ in range(60)]
    env.close()
    assert not any(said)


@pytest.mark.slow
def test_a_pose_tracker_says_so_too():
    env, cameras = crowded(NEAR_SEED)
    tracker = PoseTracker(env.simulation.scene.cameras)
    for _ in range(8):
        env.step(REST)
        estimate = tracker.update(cameras.images)
    assert tracker.more_people
    assert estimate.unknown.all()
    tracker.forget()
    assert not tracker.more_people
    tracker.close()
    env.close()
