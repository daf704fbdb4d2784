"""At level `pixels` workers are found soon, and nobody is found who is not there.

After each reset the arm rests until the estimator follows the worker. Empty scenes are episodes of
`EMPTY_STEPS` steps, each in a light of its own, the arm at rest or moving at random.
"""

import numpy as np
import pytest
from figures import Figure, count

from hrc_env.env import HRCEnv

EMPTY_STEPS, LOOKS = 25, 6
"""Steps of an empty episode; looks by which a worker is to be found, the reset's own included."""
SEEDS = {"lab": range(49_100, 49_220), "site": range(49_100, 49_140)}
"""Resets with a worker; bounds come from seeds 2000 to 2199, and from 49000 to 49039, of which one
in the lab (49003) was found at the eleventh look."""
N_EMPTY = {"still": 8, "moving": 4}
REACH = {"still": 0.0, "moving": 1.0}
"""Random actions of the arm in empty scenes."""


DARK = {
    "dark_lab": ("lab", {"appearance": {"light": (0.15, 0.15)}}),
    "dark_site": ("site", {"appearance": {"light": (0.15, 0.15)}}),
    "dark_noise": ("lab", {"faults": [{"kind": "darkness", "cameras": ["all"], "amount": 0.05}]}),
}
"""Scenes in little light, and before cameras that are noisy then."""


def count_looks(env: HRCEnv, seed: int) -> int:
    """Return the number of looks until the worker is tracked; `LOOKS` + 1: in none of them."""
    env.reset(seed=seed)
    for look in range(1, LOOKS + 1):
        if env.simulation.estimate.tracked.all():
            return look
        env.step(np.zeros(env.action_space.shape or (0,), np.float32))
    return LOOKS + 1


def count_phantoms(env: HRCEnv, seed: int, reach: float) -> np.ndarray:
    """Return the images of an episode without people, those of them in which the detector believed
    in somebody, and the steps in which somebody was tracked."""
    counts, rng = np.zeros(3, int), np.random.default_rng(seed)
    env.reset(seed=seed)
    for _ in range(EMPTY_STEPS):
        keypoints, _ = env.simulation.pipeline.last_detections(0)
        assert keypoints is not None
        assert not env.simulation.present.any()
        is_believed = keypoints.confidence[0].any((1, 2))
        is_tracked = env.simulation.estimate.tracked.any()
        counts += np.array([len(is_believed), is_believed.sum(), is_tracked])
        env.step(rng.uniform(-reach, reach, env.simulation.n_actions).astype(np.float32))
    return counts


def find_empty_seeds(scene: str, n: int) -> list[int]:
    """Return the first n seeds of episodes for one worker or none in which nobody is there."""
    env, found, seed = HRCEnv(scene=scene, n_workers=(0, 1), perception="none"), [], 49_100
    while len(found) < n:
        env.reset(seed=seed)
        found += [] if env.simulation.present.any() else [seed]
        seed += 1
    env.close()
    return found


@pytest.mark.long
@pytest.mark.parametrize("scene", ["lab", "site"])
def test_workers_are_found_within_six_looks(scene, figures, pixels):
    env = HRCEnv(perception="pixels", scene=scene, appearance="varied")
    looks = [count_looks(env, seed) for seed in SEEDS[scene]]
    env.close()
    at_once, missed = (sum(map(where, looks)) for where in ((1).__eq__, LOOKS.__lt__))
    figures.hold(
        Figure(f"finding.{scene}.at_once", count(at_once, len(looks)), least=0.8),
        Figure(f"finding.{scene}.missed_in_six", count(missed, len(looks)), most=0.1),
    )


@pytest.mark.long
@pytest.mark.parametrize("look", DARK)
def test_workers_are_found_in_the_dark(look, figures, pixels):
    scene, changes = DARK[look]
    env = HRCEnv(perception="pixels", scene=scene, **changes)
    looks = [count_looks(env, seed) for seed in SEEDS[scene][:40]]
    env.close()
    at_once, missed = (sum(map(where, looks)) for where in ((1).__eq__, LOOKS.__lt__))
    figures.hold(
        Figure(f"finding.{look}.at_once", count(at_once, len(looks)), least=0.8),
        Figure(f"finding.{look}.missed_in_six", count(missed, len(looks)), most=0.1),
    )


@pytest.mark.slow
@pytest.mark.parametrize("look", DARK)
def test_a_worker_in_the_dark_is_found_and_followed(look, pixels):
    scene, changes = DARK[look]
    env = HRCEnv(perception="pixels", scene=scene, **changes)
    for seed in SEEDS[scene][:3]:
        _, info = env.reset(seed=seed)
        for _ in range(LOOKS):
            *_, info = env.step(np.zeros(6, np.float32))
        assert info["tracking/mpjpe_m"] < 0.15
    env.close()


@pytest.mark.long
@pytest.mark.parametrize("scene", ["lab", "site"])
@pytest.mark.parametrize("arm", REACH)
def test_nobody_is_found_in_an_empty_scene(scene, arm, figures, pixels):
    """An image counts that was looked at or not; every fifth is searched."""
    env = HRCEnv(perception="pixels", scene=scene, n_workers=(0, 1), appearance="varied")
    seeds = find_empty_seeds(scene, N_EMPTY[arm])
    counts = np.array([count_phantoms(env, seed, REACH[arm]) for seed in seeds])
    images, believed, tracked = counts.sum(0).tolist()
    env.close()
    steps = EMPTY_STEPS * len(seeds)
    figures.hold(
        Figure(f"finding.{scene}.{arm}.images_believed", count(believed, images), most=0.01),
        Figure(f"finding.{scene}.{arm}.steps_tracked", count(tracked, steps), most=0.04),
    )
