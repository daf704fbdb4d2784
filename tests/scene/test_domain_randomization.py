"""Looks: drawn for every episode, of images and of nothing else."""

import copy

import numpy as np
import pytest

from assets.workers.poses import rest_motion
from hrc_env.core.errors import ConfigError
from hrc_env.core.records import Roi
from hrc_env.env import HRCEnv
from hrc_env.scene.build import build
from hrc_env.scene.domain_randomization import (
    APPEARANCES,
    AS_BUILT,
    VARIED,
    AppearanceConfig,
    draw_look,
    hide_hats,
    randomize,
)
from hrc_env.scene.render import CropRenderer
from hrc_env.vector.env import HRCVectorEnv
from hrc_env.worker.body import load_body

MIDDLE = Roi((640.0, 360.0), 700.0, 0.0)


def stream(seed=0):
    return np.random.default_rng(np.random.SeedSequence(7).spawn(seed + 1)[seed])


def same(look, other):
    return all(np.array_equal(a, b) for a, b in zip(look, other, strict=True))


def test_a_look_depends_on_where_a_stream_came_from_and_leaves_it_alone():
    one, used = stream(), stream()
    used.standard_normal(5)
    used.spawn(3)
    before = one.bit_generator.state
    assert same(draw_look(VARIED, 2, one), draw_look(VARIED, 2, used))
    assert one.bit_generator.state == before
    assert not same(draw_look(VARIED, 2, stream()), draw_look(VARIED, 2, stream(1)))


@pytest.mark.parametrize("name", APPEARANCES)
def test_looks_stay_between_what_was_asked_for(name):
    config = APPEARANCES[name]
    for seed in range(20):
        look = draw_look(config, 1, stream(seed))
        assert config.light[0] - 1e-9 <= look.light <= config.light[1] + 1e-9
        assert 0 <= look.n_litter <= config.litter
        assert (look.clothing_rgb >= 1 - config.clothing).all()
        assert name != "as_built" or look.has_hat.all()


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("light", (1.2, 0.4), "two factors"),
        ("hat", 1.5, "from 0 to 1"),
        ("litter", 1000, "litter must be"),
        ("light_tilt_deg", 80.0, "from 0 to 60"),
    ],
)
def test_what_cannot_be_is_refused(field, value, words):
    with pytest.raises(ConfigError, match=words):
        AppearanceConfig(**{field: value})


@pytest.mark.parametrize("make", [HRCEnv, lambda **k: HRCVectorEnv(2, **k)])
def test_without_images_looks_are_refused(make):
    with pytest.raises(ConfigError, match="Appearances need images"):
        make(perception="keypoints", appearance="varied")


@pytest.mark.parametrize("given", ["wild", {"lamp": 1.0}, 3])
def test_an_unknown_appearance_is_answered_in_words(given):
    with pytest.raises(ConfigError, match=r"appearance|Unknown"):
        HRCEnv(perception="keypoints", appearance=given)


def test_a_mapping_and_a_name_say_the_same():
    env = HRCEnv(perception="keypoints", appearance="as_built")
    assert env.config.appearance == AS_BUILT
    assert HRCEnv(perception="truth", appearance={"hat": 1.0}).config.appearance == AS_BUILT


def test_a_look_changes_the_picture_and_what_is_kept_of_it_is_the_same():
    scene = build(None, "lab", 1)
    renderer, motion = CropRenderer(scene), rest_motion(load_body())
    renderer.pose(scene.home_q, motion)
    plain = renderer.crop(0, MIDDLE)
    look = draw_look(VARIED, 1, stream())
    renderer.randomize(look)
    renderer.pose(scene.home_q, motion)
    first, kept = renderer.crop(0, MIDDLE), renderer.crop(0, MIDDLE)
    assert np.abs(first.astype(int) - plain).mean() > 5
    np.testing.assert_array_equal(first, kept)
    renderer.close()


@pytest.mark.parametrize("name", ["lab", "site"])
def test_a_look_is_drawn_as_by_a_renderer_that_never_had_another(name):
    scene = build(None, name, 1)
    window = Roi((960.0, 700.0), 1000.0, 0.0)

    def drawn(renderer, look):
        renderer.randomize(look)
        renderer.pose(scene.home_q, rest_motion(load_body()))
        return renderer.crop(0, window)

    worn, looks = CropRenderer(scene), [draw_look(VARIED, 1, stream(k)) for k in range(4)]
    for look in looks:
        fresh = CropRenderer(scene)
        np.testing.assert_array_equal(drawn(worn, look), drawn(fresh, look))
        fresh.close()
    worn.close()


def test_hats_come_off_and_lamps_stay_above():
    from hrc_env.scene.build import drawing_model, find_visuals

    scene = build(None, "lab", 1)
    built, seen = drawing_model(scene), find_visuals(scene)
    model = copy.copy(built)
    look = draw_look(VARIED, 1, stream())._replace(has_hat=np.zeros(1), tilt_rad=1.0)
    worn = model.geom_group.copy()
    randomize(model, built, seen, look)
    hide_hats(model, seen, look)
    assert (model.light_dir[:, 2] < -0.3).all()
    assert (model.geom_group != worn).sum() <= len(seen.hats)
    assert (model.mat_rgba != built.mat_rgba).any()
    randomize(model, built, seen, draw_look(AS_BUILT, 1, stream()))
    for name in ("light_dir", "mat_rgba", "mat_texid", "skin_rgba"):
        np.testing.assert_allclose(getattr(model, name), getattr(built, name))


def test_the_world_is_that_of_the_same_seed_without():
    walks = []
    for appearance in (None, "varied"):
        env = HRCEnv(appearance=appearance)
        env.reset(seed=5)
        env.step(np.zeros(6, np.float32))
        simulation = env.simulation
        walks.append((simulation.motion.workers.copy(), simulation.task_state["goal_world"].copy()))
        if appearance:
            assert env.simulation.pipeline.look_of(0) is not None
            state = env.get_state()
            env.set_state(state)
            env.step(np.zeros(6, np.float32))
        env.close()
    for plain, varied in zip(*walks, strict=True):
        np.testing.assert_array_equal(plain, varied)
