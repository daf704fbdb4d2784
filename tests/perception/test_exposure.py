"""Dark and dull pictures: developed where they show something, and never into people."""

import cv2
import numpy as np
import pytest
from stored import Stills

from hrc_env.core.records import Roi
from hrc_env.core.skeleton import BLAZEPOSE_INDEX
from hrc_env.geometry.cameras import pinhole
from hrc_env.perception.detector import PoseDetector
from hrc_env.perception.exposure import (
    MOST_DOUBT,
    SPAN,
    develop,
    has_edges,
    is_blank,
    measure_noise,
)
from hrc_env.scene.build import build
from hrc_env.scene.domain_randomization import AppearanceConfig, draw_look
from hrc_env.scene.render import CropRenderer

WINDOW = Roi((118.0, 138.0), 220.0, 0.0)
CAMERA = pinhole("still", np.array([4.0, 0, 1]), np.array([0, 0, 1.0]), 60, 256, 256)
NOISE = np.random.default_rng(0).standard_normal((256, 256, 3))


def darker(picture, share, noise=0.0, base=0.0):
    """A picture with a share of its contrast over a base [grey levels], and noise [grey levels]."""
    values = base + share * picture.astype(float) + noise * NOISE
    return np.clip(np.round(values), 0, 255).astype(np.uint8)


def span(picture):
    return float(np.subtract(*np.percentile(cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY), (99, 1))))


def looked(picture):
    detector = PoseDetector([CAMERA])
    sight = detector.detect(Stills([picture]), [WINDOW])
    detector.close()
    return sight


def crops(scene, look=None):
    """Parts of every camera's image."""
    renderer = CropRenderer(scene)
    renderer.randomize(look)
    renderer.pose(scene.home_q, None)
    for c in range(len(scene.cameras)):
        for x in (300.0, 640.0, 980.0):
            yield renderer.crop(c, Roi((x, 360.0), 420.0, 0.0))
    renderer.close()


def test_usual_pictures_pass_bit_for_bit(pictures):
    for crop in (*pictures.values(), *crops(build(name="lab", n_workers=0))):
        before = crop.copy()
        picture, doubt, shows = develop(crop)
        assert picture is crop
        assert (doubt, shows) == (1.0, True)
        np.testing.assert_array_equal(crop, before)


def test_what_a_dark_room_shows_is_spread_although_its_windows_shine():
    """Light from outdoors does not fade with the lamps."""
    scene = build(name="lab", n_workers=0)
    look = draw_look(AppearanceConfig(light=(0.15, 0.15)), 1, np.random.default_rng(0))
    dark = [crop for crop in crops(scene, look) if not is_blank(crop)]
    shines = np.array([np.percentile(crop, 99) > 100 for crop in dark])
    brighter = np.array([np.median(develop(c).picture) > 2.0 * np.median(c) for c in dark])
    assert brighter[~shines].all()
    assert brighter[shines].sum() >= 2


@pytest.mark.parametrize(("share", "base"), [(0.15, 0.0), (0.2, 80.0), (0.2, 190.0), (0.3, 5.0)])
def test_dull_pictures_span_as_much_as_usual_ones(pictures, share, base):
    for crop in pictures.values():
        dull = darker(crop, share, base=base)
        picture, doubt, shows = develop(dull)
        assert span(dull) < 60 < 0.7 * SPAN < span(picture)
        assert 1.0 < doubt < 1.5
        assert shows


def test_contrast_is_given_back_little_by_little(pictures):
    """No step where pictures begin to be dull."""
    spans = [span(develop(darker(pictures["stand.png"], s))[0]) for s in np.arange(0.3, 0.6, 0.01)]
    assert np.abs(np.diff(spans)).max() < 25


@pytest.mark.parametrize("base", [0, 3, 20, 128, 250, 255])
@pytest.mark.parametrize("noise", [0.0, 1.0, 5.0, 8.0])
def test_noise_alone_is_blank_and_stays_as_it_is(base, noise):
    crop = darker(np.zeros((256, 256, 3)), 1.0, noise, base)
    assert is_blank(crop)
    picture, doubt, shows = develop(crop)
    assert picture is crop
    assert (doubt, shows) == (1.0, False)


@pytest.mark.parametrize(
    ("share", "noise", "shows"), [(0.2, 3.0, True), (0.12, 5.0, True), (0.14, 12.0, False)]
)
def test_pictures_in_which_noise_hides_people_show_nothing(pictures, share, noise, shows):
    for crop in pictures.values():
        dull = darker(crop, share, noise, base=40.0)
        assert not is_blank(dull)
        assert develop(dull).is_usable == shows


def test_dull_pictures_without_noise_stay_sharp():
    """Grey levels are spread one by one: what was equal stays equal, up to every edge."""
    squares = np.random.default_rng(0).integers(100, 130, (8, 8))
    dull = np.repeat(np.kron(squares, np.ones((32, 32)))[..., None], 3, axis=2).astype(np.uint8)
    picture = develop(dull).picture
    assert span(picture) > 0.7 * SPAN
    assert all(len(np.unique(picture[dull == level])) == 1 for level in squares.ravel())


@pytest.mark.parametrize("noise", [6.0, 12.0])
def test_noise_stays_small_beside_what_pictures_span(pictures, noise):
    for crop in pictures.values():
        picture = develop(darker(crop, 0.14, noise, base=40.0)).picture
        assert span(picture) > 0.4 * SPAN
        assert measure_noise(cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY)) < 0.12 * SPAN


X, Y = np.meshgrid(np.arange(256.0), np.arange(256.0))
SLOPES = {
    "a light": 255 * np.exp(-((X - 128) ** 2 + (Y - 128) ** 2) / (2 * 90.0**2)),
    "a slope": 40 + 160 * X / 255,
    "a hand": 130 + 20 * np.sin(X / 40) + 15 * np.cos(Y / 50),
    "fog": 170 + 40 * Y / 255 + 6 * np.sin((X + Y) / 70),
    "noise on a slope": 40 + 160 * X / 255 + np.random.default_rng(0).normal(0, 6, X.shape),
}


@pytest.mark.parametrize("name", SLOPES)
def test_pictures_of_slopes_alone_show_nobody(name):
    grey = np.clip(SLOPES[name], 0, 255).astype(np.uint8)
    assert not has_edges(np.repeat(grey[..., None], 3, axis=2))


@pytest.mark.parametrize("light", [1.0, 0.3, 0.15])
def test_pictures_of_rooms_have_edges_in_any_light(pictures, light):
    rooms = (*pictures.values(), *crops(build(name="lab", n_workers=0)))
    assert np.mean([has_edges(darker(crop, light)) for crop in rooms]) > 0.8
    assert all(has_edges(darker(crop, light)) for crop in pictures.values())


def test_what_lies_outside_the_image_does_not_count(pictures):
    mask = np.zeros((256, 256), np.uint8)
    mask[:, :150] = 1
    dull = darker(pictures["stand.png"], 0.15)
    dull[:, 150:] = 255
    assert develop(dull)[0] is dull
    assert span(develop(dull, mask)[0][:, :150]) > 0.7 * SPAN
    flat = np.full((256, 256, 3), 7, np.uint8)
    flat[:, 150:] = NOISE[:, 150:] > 0
    assert is_blank(flat, mask)


def test_dark_and_noisy_pictures_show_the_worker(weights, pictures, reference):
    for name in ("stand.png", "walk.png"):
        official = reference[name][BLAZEPOSE_INDEX, :2]
        for dull in (
            darker(pictures[name], 0.12),
            darker(pictures[name], 0.1, base=100.0),
            darker(pictures[name], 0.26, noise=5.0),
        ):
            error = np.linalg.norm(looked(dull).px[0] - official, axis=1)
            assert np.median(error) / np.ptp(official[:, 1]) < 0.03


def test_deviations_grow_with_noise_and_little_with_darkness(weights, pictures):
    plain, dark, noisy, noisier = (
        looked(darker(pictures["stand.png"], share, noise))
        for share, noise in ((1.0, 0.0), (0.2, 0.0), (0.2, 4.0), (0.2, 8.0))
    )
    trunk = slice(7, 9)  # hips: their visibility hardly changes

    def told(sight):
        return float(np.median(sight.sigma_px[0, trunk]))

    assert told(plain) < told(dark) < 1.25 * told(plain)
    assert told(dark) < told(noisy) < told(noisier) < MOST_DOUBT * told(plain)
    assert told(noisier) > 1.25 * told(plain)


def test_crops_for_pictures_are_those_that_the_network_was_given(weights, pictures):
    dull = darker(pictures["stand.png"], 0.15)
    (crop,) = looked(dull).crops
    np.testing.assert_array_equal(crop, develop(Stills([dull]).crop(0, WINDOW)).picture)
