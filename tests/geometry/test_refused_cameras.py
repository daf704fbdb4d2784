"""A camera, lens, rig file or picture that is wrong in one thing only is refused."""

from dataclasses import replace

import numpy as np
import pytest

from hrc_env.core.errors import ConfigError
from hrc_env.geometry.camera_config import CameraConfig, intrinsics, read_rig
from hrc_env.geometry.lens import Lens
from hrc_env.geometry.triangulation import triangulate

CAMERA = CameraConfig("left", (2.0, 1.0, 2.5))
FISHEYE, BARREL = Lens("kannala_brandt", (0.01,)), Lens("brown_conrady", (-0.01,))
WIDE = np.nextafter(179.0, 0.0)
FIELD, FOCAL, CENTRE = "field of view", "focal lengths must be positive", "principal point must"
CLOSE = {"target_world": (2.0, 1.0, 2.5 + 0.000999)}
CASES = {
    "x of its place": ({}, {"eye_world": (np.nan, 1.0, 2.5)}, "must be finite"),
    "z of its place": ({}, {"eye_world": (2.0, 1.0, np.inf)}, "must be finite"),
    "x of its aim": ({}, {"target_world": (np.inf, 0.0, 1.0)}, "must be finite"),
    "z of its aim": ({}, {"target_world": (0.0, 0.0, np.nan)}, "must be finite"),
    "its roll": ({"roll_deg": -720.0}, {"roll_deg": np.inf}, "must be finite"),
    "its distance": ({"target_world": (2.0, 1.0, 2.501001)}, CLOSE, "must differ from its"),
    "least width": ({"width_px": 64, "height_px": 64}, {"width_px": 63}, "width_px must"),
    "most width": ({"width_px": 16384}, {"width_px": 16385}, "width_px must be"),
    "least height": ({"height_px": 64}, {"height_px": 63}, "height_px must be"),
    "most height": ({"width_px": 16384, "height_px": 16384}, {"height_px": 16385}, "height_px"),
    "no rate": ({"rate_hz": 0.0}, {"rate_hz": -1e-9}, "rate_hz must be from"),
    "any rate": ({"rate_hz": 1e9}, {"rate_hz": np.inf}, "rate_hz must be from"),
    "what is no rate": ({"rate_hz": 1.0}, {"rate_hz": np.nan}, "rate_hz must be from"),
    "no latency": ({"latency_s": 0.0}, {"latency_s": -1e-9}, "latency_s must be from 0 to 1"),
    "most latency": ({"latency_s": 1.0}, {"latency_s": 1.0 + 1e-9}, "latency_s must be from"),
    "no exposure": ({"exposure_s": 0.0}, {"exposure_s": -1e-9}, "exposure_s must be from"),
    "most exposure": ({"exposure_s": 0.1}, {"exposure_s": 0.1 + 1e-9}, "exposure_s must be from"),
    "one focal length": ({"focal_px": (900.0, 900.0)}, {"focal_px": (900.0,)}, "empty or two"),
    "a third focal length": ({"focal_px": ()}, {"focal_px": (9.0,) * 3}, "empty or two numbers"),
    "one of a centre": ({"centre_px": (9.0, 9.0)}, {"centre_px": (9.0,)}, "empty or two numbers"),
    "a third of a centre": ({"centre_px": ()}, {"centre_px": (9.0,) * 3}, "empty or two numbers"),
    "least field": ({"hfov_deg": 1.0}, {"hfov_deg": 1.0 - 1e-9}, FIELD),
    "most field of a pinhole": ({"hfov_deg": 160.0}, {"hfov_deg": 179.0}, FIELD),
    "what is left of the field of a pinhole": ({}, {"hfov_deg": WIDE}, "reach the center"),
    "most field of a barrel": (
        {"hfov_deg": 90.0, "lens": BARREL}, {"hfov_deg": 179.0, "lens": BARREL}, FIELD),
    "most field of a fisheye": (
        {"hfov_deg": np.nextafter(340.0, 0.0), "lens": FISHEYE, "height_px": 1920},
        {"hfov_deg": 340.0, "lens": FISHEYE, "height_px": 1920}, FIELD),
    "focal length in x": ({"focal_px": (900.0, 700.0)}, {"focal_px": (0.0, 900.0)}, FOCAL),
    "focal length in y": ({"focal_px": (700.0, 900.0)}, {"focal_px": (900.0, -1e-9)}, FOCAL),
    "what is hardly a focal length": ({}, {"focal_px": (0.5, 900.0)}, "reach the center"),
    "any focal length": ({"focal_px": (1e9, 900.0)}, {"focal_px": (900.0, np.inf)}, FOCAL),
    "a centre that is none": ({}, {"centre_px": (np.nan, 9.0)}, FOCAL),
    "a centre at the left": ({"centre_px": (1e-9, 9.0)}, {"centre_px": (0.0, 9.0)}, CENTRE),
    "a centre at the right": ({"centre_px": (1919.999, 9.0)}, {"centre_px": (1920.0, 9.0)}, CENTRE),
    "a centre at the top": ({"centre_px": (9.0, 1e-9)}, {"centre_px": (9.0, 0.0)}, CENTRE),
    "a centre at the foot": ({"centre_px": (9.0, 1079.999)}, {"centre_px": (9.0, 1080.0)}, CENTRE),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_a_cameras_settings_end_where_they_say(name):
    taken, refused, said = CASES[name]
    assert np.isfinite(intrinsics(replace(CAMERA, **taken))).all()
    with pytest.raises(ConfigError, match=rf"Camera 'left': .*{said}"):
        replace(CAMERA, **refused)


def folds(lens: Lens, **given: object) -> str:
    """Return what is said of a lens in a square camera; nothing if it will do."""
    try:
        replace(CAMERA, width_px=1000, height_px=1000, lens=lens, **given)
    except ConfigError as error:
        return str(error)
    return ""


def test_a_barrel_may_be_as_wide_as_its_image_grows():
    """r (1 - k r^2) grows up to r = 1 / sqrt(3 k), here the tangent of half the field."""
    lens = Lens("brown_conrady", (-1.0 / 3.0,))
    assert folds(lens, hfov_deg=89.9) == ""
    assert "be monotonic up to 45.05 degrees" in folds(lens, hfov_deg=90.1)


@pytest.mark.parametrize("edge", range(4))
def test_light_comes_to_the_middle_of_every_edge(edge):
    """The widest place in the image is at 2/3 where the lens is as above."""
    lens = Lens("brown_conrady", (-1.0 / 3.0,))
    for far_px, taken in ((599.5, True), (600.5, False)):
        centre, focal = [500.0, 500.0], [900.0, 900.0]
        axis = edge % 2
        centre[axis] = far_px if edge < 2 else 1000.0 - far_px
        said = folds(lens, focal_px=tuple(focal), centre_px=tuple(centre))
        assert ("reach the center" in said) != taken


@pytest.mark.parametrize(("model", "n"), [("none", 0), ("brown_conrady", 5), ("kannala_brandt", 4)])
def test_a_lens_has_as_many_numbers_as_its_model(model, n):
    for k in range(n + 1):
        assert len(Lens(model, (0.0,) * k).coefficients) == k
    with pytest.raises(ConfigError, match=f"up to {n} finite"):
        Lens(model, (0.0,) * (n + 1))


@pytest.mark.parametrize("wrong", [np.nan, np.inf])
def test_a_lens_of_what_is_no_number_is_refused(wrong):
    with pytest.raises(ConfigError, match="finite coefficients"):
        Lens("brown_conrady", (0.0, wrong))


def test_a_model_of_lenses_that_there_is_not_is_refused():
    with pytest.raises(ConfigError, match="Unknown lens model"):
        Lens("fisheye")


ENTRY = '[[camera]]\nname = "a"\neye_world = [1, 2, 3]\n'


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (ENTRY + "[other]\nname = 3\n", "nothing else, got 'other'"),
        ('camera = {name = "a", eye_world = [1, 2, 3]}\n', "got no camera"),
        ('camera = [{name = "a", eye_world = [1, 2, 3]}, 3]\n', "got no camera"),
        ("camera = []\n", "got no camera"),
        ("camera = 3\n", "got no camera"),
        ("", "got no camera"),
        (ENTRY + ENTRY.replace("3]", "nan]"), r"Camera 'a'|camera\[1\]"),
        (ENTRY.replace("[1, 2, 3]", "3"), r"camera\[0\]\.eye_world"),
    ],
)
def test_a_rig_file_in_which_one_thing_is_wrong_is_refused(tmp_path, text, said):
    path = tmp_path / "mine.toml"
    path.write_text(text)
    with pytest.raises(ConfigError, match=said) as refused:
        read_rig(path)
    assert "mine.toml" in str(refused.value)


def test_a_rig_file_of_several_cameras_is_taken(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(ENTRY + ENTRY.replace('"a"', '"b"'))
    assert [camera.name for camera in read_rig(path)] == ["a", "b"]


P = np.tile(np.eye(3, 4), (2, 1, 1))


@pytest.mark.parametrize(
    ("px", "sigma_px", "gate", "said"),
    [
        ((1, 3, 1, 15, 2), (1, 3, 1, 15), 0.0, "px must have shape"),
        ((1, 1, 1, 15, 2), (1, 1, 1, 15), 0.0, "px must have shape"),
        ((1, 2, 15, 2), (1, 2, 15), 0.0, "px must have shape"),
        ((1, 2, 1, 1, 15, 2), (1, 2, 1, 1, 15), 0.0, "px must have shape"),
        ((1, 2, 1, 15, 2), (1, 2, 1), 0.0, "sigma_px must have shape"),
        ((1, 2, 1, 15, 2), (1, 2, 1, 15), -1e-9, "gate_sigma must not be negative"),
        ((1, 2, 1, 15, 2), (1, 2, 1, 15), np.nan, "gate_sigma must not be negative"),
    ],
)
def test_views_of_another_shape_are_refused(px, sigma_px, gate, said):
    with pytest.raises(ConfigError, match=said):
        triangulate(P, np.full(px, np.nan), np.ones(sigma_px), gate)


@pytest.mark.parametrize("gate", [0.0, 1e-9, 5.0])
def test_views_of_the_right_shape_are_taken(gate):
    found = triangulate(P, np.full((3, 2, 1, 15, 2), np.nan), np.ones((3, 2, 1, 15)), gate)
    assert found.points_world.shape == (3, 1, 15, 3)
