"""Rigs in files, by name and by coordinates."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

from hrc_env.core.errors import ConfigError
from hrc_env.env import HRCEnv
from hrc_env.geometry.camera_config import CameraConfig, read_rig, write_rig
from hrc_env.scene.build import SceneConfig, build
from hrc_env.scene.rig_distribution import RigDistribution
from hrc_env.scene.rigs import RIGS, describe_defects, find_visible, sample_workspace
from hrc_env.settings import resolve_settings

ODD = replace(
    CameraConfig.from_make("gopro_hero8_wide", 'the "left" one\\', (1.0, -2.0, 2.25)),
    roll_deg=12.5, centre_px=(950.0, 530.5),
)  # fmt: skip


def test_a_rig_that_is_written_and_read_is_the_same(tmp_path):
    write_rig(tmp_path / "rig.toml", (*RIGS["lab"], ODD))
    assert read_rig(tmp_path / "rig.toml") == (*RIGS["lab"], ODD)


def test_a_file_needs_names_and_places_only(tmp_path):
    path = tmp_path / "rig.toml"
    path.write_text('[[camera]]\nname = "a"\neye_world = [1, 2, 3]\n')
    assert read_rig(path) == (CameraConfig("a", (1.0, 2.0, 3.0)),)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('[[camera]]\nname = "a"\n', "eye_world is missing"),
        ('[[camera]]\nname = "a"\neye_world = [1, 2, 3]\nhfov = 90\n', "hfov_deg"),
        ('[[camera]]\nname = "a"\neye_world = [1, 2]\n', "3 values"),
        ('[[camera]]\nname = "a"\neye_world = [1, 2, 3]\nhfov_deg = 999\n', "field of view"),
        ('[[cameras]]\nname = "a"\n', "a \\[\\[camera\\]\\] table for each"),
        ("camera = 3\n", "a \\[\\[camera\\]\\] table for each"),
        ("", "no camera"),
        ("camera = [", "is not valid TOML"),
    ],
)
def test_a_wrong_file_is_refused_in_words_that_name_it(tmp_path, text, said):
    path = tmp_path / "mine.toml"
    path.write_text(text)
    with pytest.raises(ConfigError, match=said) as refused:
        read_rig(path)
    assert "mine.toml" in str(refused.value)


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(ConfigError, match="cannot be read"):
        read_rig(tmp_path / "none.toml")


def test_cameras_are_names_places_records_or_a_file(tmp_path):
    write_rig(tmp_path / "rig.toml", (ODD,))
    assert resolve_settings(cameras="lab_gopro").config.scene.cameras == RIGS["lab_gopro"]
    assert resolve_settings(cameras=tmp_path / "rig.toml").config.scene.cameras == (ODD,)
    assert resolve_settings(cameras=str(tmp_path / "rig.toml")).config.scene.cameras == (ODD,)
    mapping = {"name": "b", "eye_world": [0, 1, 2]}
    settings = resolve_settings(cameras=[(1, 2, 2.5), ODD, mapping, np.array([1.0, 0, 2])])
    assert [camera.name for camera in settings.config.scene.cameras] == [
        "camera_1",
        ODD.name,
        "b",
        "camera_4",
    ]
    assert settings.cameras is None
    some = resolve_settings(cameras=("camera_2", 0))
    assert (some.config, some.cameras) == (resolve_settings().config, ("camera_2", 0))


@pytest.mark.parametrize(
    ("cameras", "said"),
    [
        ("camera_1", "is not a rig"),
        ([(1, 2, 3), "camera_1"], "of a custom rig"),
        ([(1, 2)], "of a custom rig"),
        ([], 'perception="none"'),
        ([(float(k), 0.1 * k, 2.0) for k in range(1, 18)], "1 to 16"),
    ],
)
def test_what_is_no_rig_is_refused(cameras, said):
    with pytest.raises(ConfigError, match=said):
        HRCEnv(perception="keypoints", cameras=cameras)


def test_sixteen_cameras_work():
    angle = np.linspace(0, 2 * np.pi, 16, endpoint=False)
    env = HRCEnv(
        perception="keypoints", cameras=[(2.8 * np.cos(a), 2.5 * np.sin(a), 2.3) for a in angle]
    )
    env.reset(seed=0)
    for _ in range(15):
        info = env.step(np.zeros(6))[4]
    assert info["tracking/mpjpe_m"] < 0.05


def test_a_wide_lens_is_tracked_as_well_as_a_pinhole():
    errors = {}
    for rig in ("lab", "lab_gopro"):
        env = HRCEnv(perception="keypoints", cameras=rig)
        env.reset(seed=4)
        infos = [env.step(np.zeros(6))[4] for _ in range(60)]
        errors[rig] = np.median([info["tracking/mpjpe_m"] for info in infos[10:]])
    assert errors["lab_gopro"] < 1.3 * errors["lab"]


def test_one_camera_works_and_it_is_said_what_is_lost():
    with pytest.warns(UserWarning, match="a single camera, 'camera_2'.*usual size"):
        env = HRCEnv(perception="keypoints", cameras=["camera_2"])
    env.reset(seed=0)
    assert "tracking/lost" in [env.step(np.zeros(6)) for _ in range(10)][-1][4]


@pytest.mark.parametrize(
    ("eye", "target", "said"),
    [
        (
            (2.0, 2.0, 2.0),
            (2.0, 2.1, 4.0),
            "sees 0 % of the workspace: it looks in another direction",
        ),
        ((3.2, 0.0, 1.5), (0.0, 0.0, 1.0), "behind a wall"),
    ],
)
def test_a_poorly_hung_camera_is_told_what_it_sees(eye, target, said):
    poor = CameraConfig("poor", eye, target)
    with pytest.warns(UserWarning, match=said):
        HRCEnv(perception="keypoints", cameras=[poor, (-2.0, 2.0, 2.3)])


@pytest.mark.parametrize("cameras", [["camera_2"], RigDistribution(n_cameras=(1, 3))])
def test_who_needs_pairs_is_told_of_rigs_of_one_camera(cameras):
    with pytest.warns(
        UserWarning, match="'triangulation' needs two cameras .*will detect no people: add a camera"
    ):
        HRCEnv(perception="keypoints", cameras=cameras, estimator="triangulation")


def test_who_needs_no_pairs_is_told_nothing_of_drawn_rigs():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        HRCEnv(perception="keypoints", cameras=RigDistribution(n_cameras=(1, 3)))


def test_the_scenes_own_rigs_see_their_workspace():
    for name in ("lab", "site"):
        scene = build(name=name)
        assert describe_defects(scene) == []
        seen = find_visible(scene.cameras, scene.obstacles, sample_workspace(scene.grounds))
        assert (seen.sum(0) >= 2).mean() > 0.9


def test_two_gopros_are_no_poor_rig():
    scene = build(SceneConfig(cameras=RIGS["lab_gopro"][:2]))
    assert describe_defects(scene) == []
