"""What is wrong with a recording is found and mended, or refused in words."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hrc_env.core.errors import ConfigError
from hrc_env.core.skeleton import JOINT, MIRROR
from hrc_env.geometry.rotations import about_axis
from hrc_env.mocap import repair
from hrc_env.mocap.person import resample, smooth
from hrc_env.mocap.read import read_recording

UPS = {
    "+y": about_axis("x", -np.pi / 2), "-y": about_axis("x", np.pi / 2),
    "+x": about_axis("y", np.pi / 2), "-x": about_axis("y", -np.pi / 2),
    "-z": about_axis("x", np.pi), "+z": np.eye(3),
}  # fmt: skip


def imported(folder, joints, wished_fps=None):
    np.savez(folder / "joints.npz", joints=joints, fps=50.0)
    return read_recording(folder / "joints.npz", wished_fps)


def distances(joints):
    """(T, 15, 15) between joints: what no turn, mirror or shift changes."""
    return np.linalg.norm(joints[:, :, None] - joints[:, None], axis=-1)


@settings(max_examples=25, deadline=None)
@given(
    unit=st.sampled_from(list(repair.UNITS.values())), up=st.sampled_from(list(UPS)),
    mirror=st.booleans(), yaw=st.floats(-3, 3), floor_m=st.floats(-0.05, 0.05),
)  # fmt: skip
def test_any_unit_any_axis_and_any_handedness_give_the_same_person(
    work, tmp_path_factory, unit, up, mirror, yaw, floor_m
):
    told = work.joints @ about_axis("z", yaw).T + [0.0, 0.0, floor_m]
    told = told @ UPS[up].T * ([1.0, -1.0, 1.0] if mirror else 1.0) / unit
    joints = imported(tmp_path_factory.mktemp("npz"), told).joints_world
    assert np.allclose(distances(joints), distances(work.joints), atol=1e-6)
    heights = joints[..., 2] - floor_m
    assert np.allclose(heights, work.joints[..., 2], atol=0.16)  # the floor may be elsewhere
    ahead = np.cross(joints[:, 1] - joints[:, 2], [0.0, 0.0, 1.0])
    feet = joints[:, JOINT["left_foot"]] - joints[:, JOINT["left_ankle"]]
    assert np.median((ahead * feet).sum(-1)) > 0.0


def test_short_gaps_are_bridged_and_said(work, tmp_path):
    joints = work.joints.copy()
    joints[100:108, JOINT["left_wrist"]] = np.nan
    joints[:4, 0] = np.inf
    capture = imported(tmp_path, joints)
    assert np.abs(capture.joints_world - work.joints)[100:108].max() < 0.02
    assert "left_wrist (8 frames)" in capture.notes[0]


def test_long_gaps_are_refused_with_their_place(work, tmp_path):
    joints = work.joints.copy()
    joints[100:150, JOINT["left_wrist"]] = np.nan
    with pytest.raises(ConfigError, match=r"left_wrist is missing for 1\.00 s from frame 100"):
        imported(tmp_path, joints)


def test_a_person_of_four_metres_is_refused(work, tmp_path):
    with pytest.raises(ConfigError, match=r"a person 4\.\d+ tall"):
        imported(tmp_path, work.joints * 4.0 / 1.75)


def test_who_lies_down_has_no_upward_axis(work, tmp_path):
    aslant = work.joints @ about_axis("x", 0.8).T
    with pytest.raises(ConfigError, match="the upward axis is unclear"):
        imported(tmp_path, aslant)


def test_left_and_right_that_are_exchanged_everywhere_are_a_mirror_image(work, tmp_path):
    capture = imported(tmp_path, work.joints[:, MIRROR])
    assert "mirror" in " ".join(capture.notes)


def test_left_and_right_that_are_exchanged_in_part_are_refused(work, tmp_path):
    joints = work.joints.copy()
    for side in ("left", "right"):
        ankle, foot = JOINT[f"{side}_ankle"], JOINT[f"{side}_foot"]
        joints[:, foot, :2] = 2 * joints[:, ankle, :2] - joints[:, foot, :2]
    with pytest.raises(ConfigError, match="feet point backward, but knees bend forward"):
        imported(tmp_path, joints)


def test_joints_in_another_order_are_no_person(work, tmp_path):
    joints = work.joints.copy()
    joints[:, [JOINT["left_wrist"], JOINT["left_elbow"]]] = joints[
        :, [JOINT["left_elbow"], JOINT["nose"]]
    ]
    joints[:, JOINT["left_shoulder"]] = joints[:, JOINT["right_foot"]]
    with pytest.raises(ConfigError, match=r"not a person|axis is unclear|feet"):
        imported(tmp_path, joints)


def test_only_a_first_frame_that_is_another_pose_is_left_out(work):
    t_pose = work.joints[:1] + np.random.default_rng(0).normal(0, 0.1, (1, 15, 3))
    assert repair.skip_rest_pose(np.concatenate([t_pose, work.joints]))[0] == 1
    assert repair.skip_rest_pose(work.joints) == (0, ())


def test_a_floor_that_is_elsewhere_is_moved_to_0(work, tmp_path):
    capture = imported(tmp_path, work.joints + np.array([0.0, 0.0, 0.9]))
    assert "floor" in " ".join(capture.notes)
    assert np.abs(capture.joints_world - work.joints).max() < 0.03


@pytest.mark.parametrize("fps", [25.0, 30.0, 60.0, 120.0])
def test_another_rate_is_the_same_motion(work, tmp_path, fps):
    again = imported(tmp_path, work.joints, wished_fps=fps)
    assert again.fps == fps
    at = np.arange(len(again.joints_world)) / fps * 50.0
    nearest = work.joints[np.minimum(np.round(at).astype(int), len(work.joints) - 1)]
    assert np.abs(again.joints_world - nearest).mean() < 0.01


@given(st.integers(3, 40), st.floats(100.0, 300.0))
@settings(max_examples=30, deadline=None)
def test_a_straight_line_is_one_at_a_higher_rate_too(n, fps):
    line = np.arange(float(n))[:, None]
    again = resample(line, 100.0, fps)[:, 0]
    at = np.arange(len(again)) * 100.0 / fps
    inside = (at >= 1.0) & (at <= n - 2.0)
    assert np.allclose(again[inside], at[inside])


def test_smoothing_keeps_what_does_not_change():
    assert np.allclose(smooth(np.full((20, 3), 2.5), 4.0), 2.5)
    assert np.array_equal(smooth(np.eye(4), 0.0), np.eye(4))
