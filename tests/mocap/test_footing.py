"""Where the floor is, and who is not on it, is told by the feet."""

import re

import numpy as np
import pytest
from strides import FPS, N_STRIDES, stride, written_as
from written import write_acclaim

from hrc_env.core.errors import ConfigError
from hrc_env.core.skeleton import JOINT
from hrc_env.geometry.rotations import about_axis
from hrc_env.mocap.footing import describe_floor_faults, measure_floor_height
from hrc_env.mocap.read import read_recording
from hrc_env.mocap.retarget import retarget
from hrc_env.motion import controls as c
from hrc_env.motion.anatomy import ANKLE_Z
from hrc_env.motion.clip import find_footprints
from hrc_env.worker.body import load_body

UP = np.array([0.0, 0.0, 1.0])


def saved(folder, joints, fps=50.0):
    np.savez(folder / "joints.npz", joints=joints, fps=fps)
    return folder / "joints.npz"


def raised(joints, height_m):
    """Joints with everything so much higher, (T,) [m]."""
    return joints + height_m[:, None, None] * UP


def times(joints):
    return np.arange(len(joints)) / 50.0


@pytest.mark.parametrize("floor_m", [-0.9, -0.08, 0.05, 0.12, 1.0])
def test_resting_feet_are_on_the_floor_wherever_the_files_floor_is(work, tmp_path, floor_m):
    path = saved(tmp_path, work.joints + floor_m * UP)
    clip, _ = retarget(read_recording(path), load_body())
    for side in range(2):
        feet = find_footprints(clip.controls[:, c.ANKLE + 6 * side :], clip.size)
        above = feet[clip.contacts[:, side], 2] - clip.size[ANKLE_Z]
        assert np.abs(above).max() < 1e-3


@pytest.mark.parametrize("degrees", [-3.0, 1.5, 3.5])
def test_a_floor_that_is_slightly_aslant_is_levelled_and_said(work, tmp_path, degrees):
    aslant = work.joints @ about_axis("y", np.radians(degrees)).T
    capture = read_recording(saved(tmp_path, aslant))
    assert re.search(rf"tilted by {abs(degrees):.1f} degrees", " ".join(capture.notes))
    assert np.abs(capture.joints_world - work.joints)[..., 2].max() < 0.03


def test_ordinary_walks_are_on_their_floor():
    for seed in range(N_STRIDES):
        assert describe_floor_faults(stride(seed).joints, FPS) == ()


def test_who_jumps_is_on_the_floor(work):
    t = np.clip(times(work.joints) - 2.0, 0.0, 0.6)
    assert describe_floor_faults(raised(work.joints, 0.5 * 9.81 * t * (0.6 - t)), 50.0) == ()


def ledge(t):
    return 0.2 * np.clip((t - 2.0) / 0.3, 0.0, 1.0)


def stairs(t):
    return 0.17 * sum(np.clip((t - k) / 0.3, 0.0, 1.0) for k in range(1, 5))


def swinging(t):
    return np.clip((t - 1.0) / 0.3, 0.0, 1.0) * (0.5 + 0.15 * np.sin(4.0 * t))


def trampoline(t):
    s = np.mod(t, 1.3)
    return np.maximum(0.0, 0.5 * 9.81 * s * (1.1 - s))


@pytest.mark.parametrize(
    ("height", "told"),
    [
        (ledge, r"Feet rest at heights from -0\.0\d to \+0\.\d\d m"),
        (stairs, "Feet rest at heights"),
        (swinging, r"Both feet are more than 0\.1 m above|Feet rest at"),
        (trampoline, r"Both feet are more than 0\.1 m above the floor for \d\.\d s"),
    ],
)
def test_who_is_off_the_floor_is_refused_unless_that_is_accepted(work, tmp_path, height, told):
    path = saved(tmp_path, raised(work.joints, height(times(work.joints))))
    with pytest.raises(ConfigError, match=rf"joints\.npz: .*({told}).*--allow-off-floor"):
        read_recording(path)
    capture = read_recording(path, allow_off_floor=True)
    assert re.search(told, " ".join(capture.notes))


def test_who_hangs_above_the_files_floor_is_refused(work, tmp_path):
    hanging = work.joints + 0.5 * UP
    for joint, height_m in (("elbow", 0.2), ("wrist", 0.45)):
        for side in ("left", "right"):
            hanging[:, JOINT[f"{side}_{joint}"]] = hanging[:, JOINT[f"{side}_shoulder"]] + (
                height_m * UP
            )
    with pytest.raises(ConfigError, match=r"feet 0\.5\d m above the file's floor"):
        read_recording(saved(tmp_path, hanging))
    read_recording(saved(tmp_path, hanging - 0.5 * UP))  # works overhead


def test_feet_that_are_never_still_are_refused(work, tmp_path):
    t = times(work.joints)
    path = saved(tmp_path, raised(work.joints, 0.06 * np.sin(20.0 * t)))
    with pytest.raises(ConfigError, match=r"rests for \d % of the time"):
        read_recording(path)


@pytest.fixture
def acclaim(tmp_path):
    """A walk as ASF and AMC."""
    return written_as("amc", stride(0), tmp_path)


@pytest.mark.parametrize("share", [0.9, 0.92, 1.08, 1.1])
def test_a_skeleton_of_other_lengths_is_refused(acclaim, share):
    skeleton = acclaim.with_suffix(".asf")
    longer = re.sub(
        r"(?m)(?<=^     length ).*", lambda m: str(float(m[0]) * share), skeleton.read_text()
    )
    skeleton.write_text(longer)
    with pytest.raises(ConfigError, match=r"With this skeleton, feet stand [+-]0\.\d\d m above"):
        read_recording(acclaim, source_fps=FPS)
    assert read_recording(acclaim, source_fps=FPS, allow_off_floor=True).notes


def test_the_own_skeleton_is_not_refused(tmp_path):
    for seed in range(N_STRIDES):
        capture = read_recording(written_as("amc", stride(seed), tmp_path), source_fps=FPS)
        assert abs(measure_floor_height(capture.joints_world, FPS)) < 0.06


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        (r"(?m)^lradius .*", r"\g<0>\nltail 1 2 3", "belongs to another skeleton: it moves ltail"),
        (r"(?m)^lradius .*", "lradius 1.0", "lradius has 1 numbers, not 3"),
        (r"(?m)^lradius .*\n", "", "lradius has 0 numbers, not 3"),
    ],
)
def test_a_motion_of_other_bones_or_freedoms_is_refused(acclaim, old, new, told):
    acclaim.write_text(re.sub(old, new, acclaim.read_text()))
    with pytest.raises(ConfigError, match=told):
        read_recording(acclaim)


def test_a_skeleton_that_says_to_be_another_subjects_is_refused(tmp_path):
    walked = stride(0)
    path = write_acclaim(tmp_path, walked.position, walked.rotation, walked.body, "02_01")
    skeleton = path.with_suffix(".asf").rename(tmp_path / "35.asf")
    for given in (None, skeleton):
        with pytest.raises(
            ConfigError, match=r"of subject 2, but 35\.asf is the skeleton of subject 35"
        ):
            read_recording(path, skeleton=given)
    skeleton.rename(tmp_path / "2.asf")
    assert read_recording(path, source_fps=FPS).fps == FPS
