"""The emulator of what the detector finds knows of dark pictures."""

import numpy as np
import pytest

from hrc_env.core.errors import ConfigError
from hrc_env.env import HRCEnv
from hrc_env.perception.dimness import picture_quality
from hrc_env.perception.faults.fault import FaultConfig

DARK = FaultConfig("darkness", ("all",), 0.02)


def looked(n_steps=3, **kwargs):
    """Keypoints and beliefs of an episode."""
    env = HRCEnv(perception="keypoints", n_workers=1, **kwargs)
    env.reset(seed=4)
    keypoints, estimates = [], []
    for _ in range(n_steps):
        keypoints.append(env.simulation.pipeline.last_detections(0)[0])
        estimates.append(env.simulation.estimate)
        env.step(np.zeros(6, np.float32))
    env.close()
    return keypoints, estimates


def test_usual_light_is_as_it_was_built():
    for light in (1.0, 0.6, 1.4):
        quality = picture_quality(light)
        assert (quality.doubt, quality.missed, quality.blank) == (1.0, 0.0, False)


def test_less_light_and_more_noise_are_worse_in_every_way():
    for row in (
        [picture_quality(light) for light in np.arange(0.5, 0.04, -0.01)],
        [picture_quality(1.0, [share]) for share in np.geomspace(0.2, 0.001, 30)],
        [picture_quality(light, [0.1]) for light in np.arange(1.0, 0.04, -0.02)],
    ):
        for parts in zip(*row, strict=True):
            assert (np.diff(np.array(parts, float)) >= -0.01).all()
        assert row[-1].blank
        assert row[-1].missed == 1.0


def test_light_at_keypoints_changes_what_light_changes_and_nothing_else():
    plain, _ = looked()
    usual, _ = looked(appearance={"light": (0.9, 0.9)})
    dark, _ = looked(appearance={"light": (0.15, 0.15)})
    for one, other in zip(plain, usual, strict=True):
        np.testing.assert_array_equal(one.px, other.px)
        np.testing.assert_array_equal(one.sigma_px, other.sigma_px)
    factor = float(picture_quality(0.15).doubt)
    seen = plain[0].confidence > 0
    np.testing.assert_allclose(dark[0].sigma_px[seen], factor * plain[0].sigma_px[seen])


def test_errors_and_what_is_told_of_them_grow_alike_in_the_dark():
    plain, _ = looked(1)
    dark, _ = looked(1, faults=[DARK])
    factor = float(picture_quality(1.0, [0.02]).doubt)
    both = (plain[0].confidence > 0) & (dark[0].confidence > 0)
    assert factor > 1.2
    np.testing.assert_allclose(dark[0].sigma_px[both], factor * plain[0].sigma_px[both])
    assert not np.array_equal(dark[0].px[both], plain[0].px[both])


def test_a_fault_in_the_dark_begins_when_it_begins_and_is_of_its_camera():
    late = FaultConfig("darkness", ("camera_2",), 0.02, 0.06)
    plain, _ = looked(faults=[FaultConfig("darkness", ("camera_2",), 1.0)])
    dark, _ = looked(faults=[late])
    for step, (one, other) in enumerate(zip(plain, dark, strict=True)):
        same = one.sigma_px == other.sigma_px
        assert same[:, [0, 2, 3]].all() or step > 0
        assert same[:, 1].all() == (step * 0.04 < 0.06)


def test_cameras_whose_pictures_are_blank_see_nobody_and_prove_nothing():
    for kwargs in ({"appearance": {"light": (0.05, 0.05)}},
                   {"faults": [FaultConfig("darkness", ("all",), 0.001)]}):  # fmt: skip
        _, estimates = looked(60, **kwargs)
        assert not any(each.tracked.any() for each in estimates)
        assert estimates[-1].unknown.all()


@pytest.mark.parametrize("changes", [{"tint": 0.2}, {"light": (0.2, 1.0), "hat": 0.5}])
def test_looks_that_are_not_light_need_images(changes):
    with pytest.raises(ConfigError, match="supports only the intensity of the light"):
        HRCEnv(perception="keypoints", appearance=changes)


def test_levels_draw_the_same_light_and_a_saved_state_holds_it():
    envs = [HRCEnv(perception="keypoints", appearance={"light": (0.1, 0.4)}) for _ in range(2)]
    for env in envs:
        env.reset(seed=9)
    light = envs[0].simulation.pipeline.cameras.light
    assert 0.1 <= light[0] <= 0.4
    state = envs[0].simulation.get_state()
    envs[1].reset(seed=10)
    assert envs[1].simulation.pipeline.cameras.light != light
    envs[1].simulation.set_state(state)
    assert envs[1].simulation.pipeline.cameras.light == light
