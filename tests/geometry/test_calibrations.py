"""Cameras by K, distortion and pose, and calibration files of other tools, project as OpenCV."""

import cv2
import numpy as np
import pytest

from hrc_env.core.errors import ConfigError
from hrc_env.geometry.camera_config import CameraConfig, read_rig, write_rig
from hrc_env.geometry.cameras import image_from_pinhole, project
from hrc_env.geometry.rotations import about_axis, from_rotation_vector, look_at
from hrc_env.scene.rig import make_cameras
from hrc_env.settings import resolve_settings

K = np.array([[905.0, 0.0, 948.0], [0.0, 912.0, 551.0], [0.0, 0.0, 1.0]])
BROWN = (-0.21, 0.06, 0.001, -0.002, -0.004)
FISHEYE = (0.05, -0.01, 0.002, -0.0005)
EYES = ((2.9, 2.6, 2.4), (-2.9, 2.6, 2.4), (2.9, -2.6, 2.4), (0.2, 0.0, 2.6), (0.2001, 0.0, 2.6))
"""The last but one looks straight down, the last nearly so."""
ROLLS_DEG = (0.0, 90.0, 180.0, -35.0, 12.0)


def pose(k):
    """T_world_from_cam of a camera that looks at the workspace and is rolled."""
    T_world_from_cam = np.eye(4)
    eye, target = np.array(EYES[k]), np.array([0.2, 0.0, 1.0])
    T_world_from_cam[:3, :3] = look_at(eye, target) @ about_axis("z", np.radians(ROLLS_DEG[k]))
    T_world_from_cam[:3, 3] = eye
    return T_world_from_cam


def seen(T_world_from_cam):
    """(200, 3) points before a camera."""
    points_cam = np.random.default_rng(0).uniform((-0.5, -0.5, 1.5), (0.5, 0.5, 2.5), (200, 3))
    return points_cam @ T_world_from_cam[:3, :3].T + T_world_from_cam[:3, 3]


def by_opencv(points_world, T_world_from_cam, distortion, fisheye):
    """(N, 2) where OpenCV has them."""
    R_cam_from_world = T_world_from_cam[:3, :3].T
    t = -R_cam_from_world @ T_world_from_cam[:3, 3]
    r = cv2.Rodrigues(R_cam_from_world)[0]
    if fisheye:
        points = points_world[:, None]
        return cv2.fisheye.projectPoints(points, r, t[:, None], K, np.array(distortion))[0][:, 0]
    return cv2.projectPoints(points_world, r, t, K, np.array(distortion))[0][:, 0]


def by_us(points_world, camera):
    (hung,) = make_cameras((camera,))
    return image_from_pinhole(hung, project(hung.P[None], points_world[None])[0][0, 0])


LENSES = [((), False), (BROWN, False), (BROWN[:4], False), (FISHEYE, True)]


@pytest.mark.parametrize("k", range(len(EYES)))
@pytest.mark.parametrize(("distortion", "fisheye"), LENSES)
def test_a_camera_of_matrices_projects_as_opencv_does(k, distortion, fisheye):
    camera = CameraConfig.from_matrices("a", K, pose(k), (1920, 1080), distortion, fisheye)
    theirs = by_opencv(seen(pose(k)), pose(k), distortion or (0.0,) * 5, fisheye)
    assert np.abs(by_us(seen(pose(k)), camera) - theirs).max() < 1e-3


def test_mappings_and_rig_files_take_matrices_too(tmp_path):
    camera = CameraConfig.from_matrices("a", K, pose(1), (1920, 1080), BROWN)
    mapping = {"name": "a", "K": K, "distortion": BROWN, "T_world_from_cam": pose(1)}
    assert resolve_settings(cameras=[mapping]).config.scene.cameras == (camera,)
    with pytest.raises(ConfigError, match=r"cameras\[0\]\.latency_ms.*latency_s"):
        resolve_settings(cameras=[{**mapping, "latency_ms": 3}])
    path = tmp_path / "rig.toml"
    path.write_text(
        f'[[camera]]\nname = "a"\nK = {K.tolist()}\ndistortion = {list(BROWN)}\n'
        f"T_world_from_cam = {pose(1).tolist()}\nrate_hz = 12.5\n"
    )
    (read,) = read_rig(path)
    assert read.rate_hz == 12.5
    write_rig(path, [read])
    assert read_rig(path) == (read,)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"K": K.T}, r"K must be \[\[fx, 0, cx\]"),
        ({"K": K + np.diag([5.0, 0.0], 1)}, "without skew"),
        ({"T_world_from_cam": np.diag([1.0, 1.0, -1.0, 1.0])}, "must be .4, 4.: a rotation"),
        ({"T_world_from_cam": pose(0)[:3]}, "must be .4, 4.: a rotation"),
        ({"distortion": (0.1,) * 8}, "got 8 coefficients"),
    ],
)
def test_matrices_of_no_camera_are_refused(changes, said):
    given = {"name": "a", "K": K, "T_world_from_cam": pose(0), "size_px": (1920, 1080), **changes}
    with pytest.raises(ConfigError, match=said):
        CameraConfig.from_matrices(**given)


def test_a_rotation_vector_is_opencvs():
    for vector in ((0.0, 0.0, 0.0), (1e-9, 0.0, 0.0), (0.3, -2.0, 1.1), (0.0, np.pi, 0.0)):
        assert np.allclose(from_rotation_vector(np.array(vector)), cv2.Rodrigues(vector)[0])


def table(k, unit_m=1.0, turn=None, **changes):
    """The table of a camera as anipose and others write it; None leaves an entry out."""
    T_world_from_cam = pose(k)
    if turn is not None:
        T_world_from_cam[:3] = turn @ T_world_from_cam[:3]
    R_cam_from_world = T_world_from_cam[:3, :3].T
    entries = {
        "name": f'"c{k}"', "size": [1920, 1080], "matrix": K.tolist(),
        "distortions": list(BROWN), "rotation": cv2.Rodrigues(R_cam_from_world)[0].ravel().tolist(),
        "translation": (-R_cam_from_world @ T_world_from_cam[:3, 3] / unit_m).tolist(), **changes,
    }  # fmt: skip
    lines = [f"{word} = {value}" for word, value in entries.items() if value is not None]
    return f"[cam_{k}]\n" + "\n".join(lines) + "\n\n"


def calibration(folder, *tables):
    path = folder / "calibration.toml"
    path.write_text("".join(tables) + "[metadata]\nadjusted = false\nerror = 0.3\n")
    return path


def test_a_calibration_is_a_rig_whose_pixels_count_from_the_corner(tmp_path):
    path = calibration(tmp_path, *map(table, range(4)))
    cameras = resolve_settings(cameras=str(path)).config.scene.cameras
    assert [camera.name for camera in cameras] == ["c0", "c1", "c2", "c3"]
    for k, camera in enumerate(cameras):
        theirs = by_opencv(seen(pose(k)), pose(k), BROWN, False)
        assert np.abs(by_us(seen(pose(k)), camera) - 0.5 - theirs).max() < 1e-3


def test_fisheyes_matrices_of_rotation_and_other_spellings_are_read(tmp_path):
    R_cam_from_world = pose(0)[:3, :3].T.tolist()
    fisheye = table(0, distortions=list(FISHEYE), fisheye="true", rotation=R_cam_from_world)
    unnamed = table(1, name=None, size=[1920.0, 1080.0], distortions=[[*BROWN]], port=1)
    left_out = table(2, rotation=None, translation=None, ignore="true")
    first, second = read_rig(calibration(tmp_path, fisheye, unnamed, left_out))
    theirs = by_opencv(seen(pose(0)), pose(0), FISHEYE, True)
    assert np.abs(by_us(seen(pose(0)), first) - 0.5 - theirs).max() < 1e-3
    assert second.name == "cam_1"
    nested = calibration(tmp_path, table(0).replace("[cam_0]", "[cameras.0]"))
    assert [camera.name for camera in read_rig(nested)] == ["c0"]


def test_millimetres_are_told_and_read(tmp_path):
    usual = read_rig(calibration(tmp_path, *map(table, range(4))))
    path = calibration(tmp_path, *(table(k, unit_m=1e-3) for k in range(4)))
    with pytest.warns(UserWarning, match=r"as millimetres; the cameras are up to 7\.7\d m"):
        cameras = read_rig(path)
    for camera, other in zip(cameras, usual, strict=True):
        assert np.allclose(camera.eye_world, other.eye_world)
        assert np.allclose(by_us(seen(pose(0)), camera), by_us(seen(pose(0)), other), atol=1e-6)


def test_a_world_whose_z_axis_is_not_up_is_told(tmp_path):
    turn = about_axis("x", np.pi / 2)
    upright = [table(k, turn=turn, name=f'"{k}"') for k in (0,)]
    with pytest.warns(
        UserWarning, match=r"the -y axis of its world seems to point up.*\+z to point up"
    ):
        read_rig(calibration(tmp_path, *upright))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"rotation": None}, "table 'cam_0'.*missing rotation. It has no pose in the world yet"),
        ({"size": None}, "missing size"),
        ({"translation": [1, 2]}, r"translation must be 3 numbers, got \[1, 2\]"),
        ({"distortions": [0.1] * 8}, "got 8 coefficients"),
        ({"matrix": (K.T).tolist()}, "K must be"),
        ({"ignore": "true"}, "contains no cameras"),
    ],
)
def test_a_calibration_that_lacks_something_is_refused_in_words(tmp_path, changes, said):
    with pytest.raises(ConfigError, match=rf"calibration\.toml.*{said}"):
        read_rig(calibration(tmp_path, table(0, **changes)))
