"""Workers of different bodies: drawn at reset, followed by motion, truth, contacts, pictures."""

import dataclasses
import pickle

import numpy as np
import pytest

from assets.workers.poses import rest_motion
from hrc_env.core.batching import map_arrays, one
from hrc_env.core.errors import ConfigError
from hrc_env.core.infos import ABSENT, ACTIVITY, BODY
from hrc_env.core.records import Roi, WorkerPath
from hrc_env.env import HRCEnv
from hrc_env.motion import generator
from hrc_env.scene.build import build
from hrc_env.scene.physics import Physics
from hrc_env.scene.render import CropRenderer
from hrc_env.settings import resolve_settings
from hrc_env.vector.env import HRCVectorEnv
from hrc_env.worker.body import SEGMENT, load_body, worker_names

SHANK, FOOT = SEGMENT["left_shank"], SEGMENT["left_foot"]
ANY = {"worker": "any"}
PUSH = np.full(6, 0.3, np.float32)


def made(n_workers=3, perception="truth", config=ANY):
    return HRCEnv(perception=perception, n_workers=n_workers, config=config)


def bodies(env, info):
    """The names of the workers' bodies."""
    return env.words(info)[BODY]


def test_every_worker_of_an_episode_is_somebody_else():
    env, seen = made(), set()
    for seed in range(12):
        names = bodies(env, env.reset(seed=seed)[1])
        assert len(set(names)) == 3
        assert bodies(env, env.step(PUSH)[-1]) == names
        seen |= set(names)
    assert seen == set(worker_names())
    assert bodies(env, env.reset(seed=4)[1]) == bodies(env, env.reset(seed=4)[1])


def test_who_is_not_there_has_no_body():
    env = made((1, 3))
    for seed in range(6):
        words = env.words(env.reset(seed=seed)[1])
        absent = [name == ABSENT for name in words[BODY]]
        assert absent == [name == ABSENT for name in words[ACTIVITY]]


def test_of_fewer_bodies_than_workers_each_is_there_equally_often():
    env = made(5, config={"worker": ["worker_2", "worker_5"]})
    names = bodies(env, env.reset(seed=0)[1])
    assert sorted(names.count(name) for name in ("worker_2", "worker_5")) == [2, 3]


def test_one_name_is_the_same_however_it_is_written():
    """And what workers go about does not depend on whose bodies they may have."""
    envs = [made(2, "keypoints", {"worker": w}) for w in ("worker_3", ("worker_3",), "any")]
    first = [env.reset(seed=3) for env in envs]
    np.testing.assert_array_equal(first[0][0], first[1][0])
    assert len({tuple(info[f"worker_{w}/activity"] for w in range(2)) for _, info in first}) == 1
    for _ in range(20):
        np.testing.assert_array_equal(envs[0].step(PUSH)[0], envs[1].step(PUSH)[0])


def test_the_truth_has_the_measures_of_the_body():
    env = made()
    names = bodies(env, env.reset(seed=1)[1])
    sensor, looks = env.simulation.pipeline.sensor, []
    expose = sensor.expose
    sensor.expose = lambda now: looks.append(now.truth) or expose(now)
    env.step(PUSH)
    truth = one(looks[0], 0)
    for w, body in enumerate(map(load_body, names)):
        np.testing.assert_array_equal(truth.capsule_radius_m[w], body.capsule_radius_m)
        length = np.linalg.norm(
            truth.capsules_world[w, :, 1] - truth.capsules_world[w, :, 0], axis=1
        )
        baked = np.linalg.norm(body.capsule_ends[:, 1] - body.capsule_ends[:, 0], axis=1)
        np.testing.assert_allclose(length, baked, atol=1e-9)


def test_bones_of_every_body_move_as_they_are():
    """The shank that walks about is as long as the shank that was baked."""
    env = made()
    names = bodies(env, env.reset(seed=2)[1])
    for _ in range(5):
        env.step(PUSH)
    place = generator.current(env.simulation.motion).position_world[0]
    for w, body in enumerate(map(load_body, names)):
        rest = body.rest_position
        baked = np.linalg.norm(rest[FOOT] - rest[SHANK])
        assert np.linalg.norm(place[w, FOOT] - place[w, SHANK]) == pytest.approx(baked, abs=1e-9)


def pressed(physics: Physics, body: str, row: int | None) -> np.ndarray:
    """Angles of an arm in whose way a worker stands."""
    rest = rest_motion(load_body(body))
    lead = (physics.batch, 5, 1)
    arrays = (rest.position_world + np.array([-0.25, 0.1, 0.0]), rest.quaternion_wxyz)
    path = WorkerPath(*(np.broadcast_to(array, (*lead, *array.shape)) for array in arrays))
    everyone = np.arange(physics.batch)
    rows = None if row is None else np.full((physics.batch, 1), row)
    physics.reset(everyone, np.tile(physics.scene.home_q, (physics.batch, 1)), rows)
    command = np.tile([0.5, 0.4, -0.3, 0.2, 0.1, 0.0], (physics.batch, 1))
    return np.stack([physics.step(command, path) for _ in range(10)])


def test_the_arm_meets_the_body_that_is_there():
    """Bit for bit as in a scene that was compiled with this body alone."""
    some = ("worker_1", "worker_4", "worker_6")
    drawn, angles = Physics(build(n_workers=1, bodies=some), 2), []
    for row, name in enumerate(some):
        alone = pressed(Physics(build(n_workers=1, bodies=name), 2), name, None)
        np.testing.assert_array_equal(pressed(drawn, name, row), alone)
        angles.append(alone[-1, 0, -1])
    assert np.abs(np.diff(angles, axis=0)).max(1).min() > 1e-4


@pytest.mark.parametrize("n_threads", [1, 2])
def test_many_environments_with_bodies_are_single_ones_bit_for_bit(n_threads):
    many = HRCVectorEnv(
        6, perception="keypoints", n_workers=(1, 3), config=ANY, max_episode_steps=7,
        num_threads=n_threads,
    )  # fmt: skip
    ones = [made((1, 3), "keypoints") for _ in range(6)]
    batch, infos = many.reset(seed=20)
    alone = [env.reset(seed=20 + k) for k, env in enumerate(ones)]
    for step in range(1, 20):
        for k, (observation, *_, info) in enumerate(alone):
            np.testing.assert_array_equal(batch[k], observation)
            assert {name: infos[name][k] for name in info} == info
        batch, *_, infos = many.step(np.tile(PUSH, (6, 1)))
        alone = [env.reset() if step % 8 == 0 else env.step(PUSH) for env in ones]
    many.close()


def test_a_state_brings_the_bodies_along():
    env, other = made(), made()
    env.reset(seed=0), other.reset(seed=7)
    env.step(PUSH)
    other.set_state(env.get_state())
    twin = pickle.loads(pickle.dumps(env))
    for _ in range(10):
        now = env.step(PUSH)
        for copy in (other, twin):
            again = copy.step(PUSH)
            np.testing.assert_array_equal(again[0], now[0])
            assert again[1:] == now[1:]


def test_a_picture_shows_the_body_that_is_there():
    """Pixel by pixel as in a scene that was compiled with this body alone; two have no hat."""
    some, window = ("worker_1", "worker_5", "worker_8"), Roi((950.0, 540.0), 520.0, 0.0)
    drawn, seen = CropRenderer(build(n_workers=1, bodies=some)), []
    for row, name in enumerate(some):
        rest = map_arrays(rest_motion(load_body(name)), lambda array: array[None])
        place = rest.position_world + np.array([0.9, 0.3, 0.0])
        motion = dataclasses.replace(rest, position_world=place, body=np.array([row]))
        alone = CropRenderer(build(n_workers=1, bodies=name))
        for renderer in (drawn, alone):
            renderer.pose(drawn.scene.home_q, motion if renderer is drawn else rest_of(motion))
        seen.append(drawn.crop(0, window))
        np.testing.assert_array_equal(seen[-1], alone.crop(0, window))
        alone.close()
    assert np.abs(np.diff(np.array(seen, float), axis=0)).mean((1, 2, 3)).min() > 0.3
    drawn.close()


def rest_of(motion):
    """The same where there is one body only."""
    return dataclasses.replace(motion, body=None)


@pytest.mark.parametrize(
    ("worker", "words"),
    [
        ("worker_11", "worker_11.*worker_1.*any"),
        (("worker_1", "bob"), "bob"),
        ((), "at least|several different"),
        (("worker_1", "worker_1"), "several different"),
        (3, "must be"),
        ([1, 2], "must be"),
    ],
)
def test_bodies_that_there_are_not_are_refused_with_those_that_there_are(worker, words):
    with pytest.raises(ConfigError, match=words):
        resolve_settings(config={"worker": worker})
