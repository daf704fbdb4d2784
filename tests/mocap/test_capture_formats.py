"""Every format reads back what was written, whatever traps it hides."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from written import ORDERS, Y_UP, cmu_name, compute_angles, write_acclaim, write_bvh

from hrc_env.core.errors import ConfigError
from hrc_env.core.skeleton import JOINTS
from hrc_env.geometry.rotations import about_axis
from hrc_env.mocap.bvh import read_bvh
from hrc_env.mocap.read import read_recording
from hrc_env.mocap.skeleton import HEAD, SIDED

KNOWN = [j for j, joint in enumerate(JOINTS) if not joint.endswith(("nose", "foot"))]


def written(work, folder, **traps):
    return write_bvh(folder / "walk.bvh", work.position, work.rotation, work.fps, **traps)


def test_a_bvh_file_reads_back(work, tmp_path):
    capture = read_recording(written(work, tmp_path))
    assert capture.notes == ()
    assert capture.fps == work.fps
    assert np.abs(capture.joints_world - work.centres)[:, KNOWN].max() < 1e-4


def test_a_bvh_file_full_of_traps_reads_the_same_and_says_what_it_met(work, tmp_path):
    path = written(
        work, tmp_path, unit_m=0.01, axes=Y_UP, orders=ORDERS, rest_first=True,
        name=lambda segment: cmu_name(segment, "mixamorig:"),
    )  # fmt: skip
    capture = read_recording(path)
    assert np.abs(capture.joints_world - work.centres)[:, KNOWN].max() < 1e-4
    said = " ".join(capture.notes)
    for trap in ("centimetres", "T-pose", "+y axis"):
        assert trap in said
    assert capture.node_names[JOINTS.index("left_elbow")] == "mixamorig:LeftForeArm"


def test_acclaim_files_read_back_in_cmus_unit(work, tmp_path):
    path = write_acclaim(tmp_path, work.position, work.rotation)
    capture = read_recording(path, source_fps=work.fps)
    assert np.abs(capture.joints_world - work.centres)[:, KNOWN].max() < 1e-4
    assert "inches" in " ".join(capture.notes)


def test_acclaim_files_without_a_rate_are_taken_to_be_of_120_hz(work, tmp_path):
    capture = read_recording(write_acclaim(tmp_path, work.position, work.rotation))
    assert capture.fps == 120.0
    assert "120 Hz" in " ".join(capture.notes)


def test_joints_in_an_npz_file_are_the_projects_own(work, tmp_path):
    np.savez(tmp_path / "walk.npz", joints=work.joints, fps=work.fps)
    capture = read_recording(tmp_path / "walk.npz")
    assert capture.are_landmarks
    assert np.array_equal(capture.joints_world, work.joints)


def test_a_nose_is_made_where_a_skeleton_has_only_a_head(work, tmp_path):
    nose = read_recording(written(work, tmp_path)).joints_world[:, 0]
    assert np.linalg.norm(nose - work.joints[:, 0], axis=-1).max() < 0.03


def test_foot_tips_are_the_end_sites_of_the_toes(work, tmp_path):
    capture = read_recording(written(work, tmp_path))
    assert np.abs(capture.joints_world - work.joints)[:, -2:].max() < 1e-4


@pytest.mark.parametrize("order", ORDERS)
def test_angles_in_any_order_turn_as_they_were_taken(order):
    rng = np.random.default_rng(0)
    rotation = about_axis("z", rng.uniform(-3, 3, 20)) @ about_axis("y", rng.uniform(-1, 1, 20))
    rotation = rotation @ about_axis("x", rng.uniform(-3, 3, 20))
    again = np.eye(3)
    for axis, angle in zip(order.lower(), compute_angles(rotation, order.lower()).T, strict=True):
        again = again @ about_axis(axis, angle)
    assert np.allclose(again, rotation)


@settings(max_examples=15, deadline=None)
@given(orders=st.lists(st.sampled_from(ORDERS), min_size=1, max_size=5), cm=st.booleans())
def test_what_a_file_means_does_not_depend_on_its_channel_orders(
    work, tmp_path_factory, orders, cm
):
    folder, unit_m = tmp_path_factory.mktemp("bvh"), 0.01 if cm else 1.0
    part = write_bvh(
        folder / "part.bvh", work.position[:40], work.rotation[:40], 50.0, unit_m, orders=orders
    )
    joints = read_recording(part).joints_world
    assert np.abs(joints - work.centres[:40])[:, KNOWN].max() < 1e-4


def test_pybvh_finds_every_node_where_we_do(work, tmp_path):
    pybvh = pytest.importorskip("pybvh")
    path = written(work, tmp_path, unit_m=0.01, axes=Y_UP, orders=ORDERS)
    theirs = pybvh.read_bvh_file(path)
    positions = np.asarray(theirs.node_positions(centered="world"))
    ours = read_bvh(path)
    assert positions.shape == ours.position.shape
    assert np.abs(positions - ours.position).max() < 1e-3  # centimetres


def shortened(path, keep):
    text = path.read_text()
    path.write_text(text[: int(keep * len(text))])
    return path


def test_a_file_that_is_cut_off_in_its_skeleton_is_refused(work, tmp_path):
    with pytest.raises(ConfigError, match=r"walk\.bvh.*(truncated|expected)"):
        read_recording(shortened(written(work, tmp_path), 0.003))


def test_a_file_with_too_few_of_its_frames_is_refused(work, tmp_path):
    with pytest.raises(ConfigError, match=r"declares \d+ frames"):
        read_recording(shortened(written(work, tmp_path), 0.3))


def test_a_file_that_lost_its_last_frames_is_read_with_a_warning(work, tmp_path):
    capture = read_recording(shortened(written(work, tmp_path), 0.9))
    assert 0.8 < len(capture.joints_world) / len(work.joints) < 1.0
    assert "frames are declared" in " ".join(capture.notes)


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("Frame Time: 0.020000", "Frame Time: 0", "frame rate between"),
        ("HIERARCHY", "HELLO", "begins with the word HIERARCHY"),
        ("CHANNELS 3", "CHANNELS 4", "expected CHANNELS"),
        ("Zrotation", "Wrotation", "expected CHANNELS"),
        ("OFFSET 0.", "OFFSET zero.", "expected a number"),
        ("LeftForeArm", "LeftBranch", r"Missing: left_elbow.*Found: .*left_wrist = LeftHand"),
        ("Hand", "Paw", "Missing: left_wrist, right_wrist|forearm"),
    ],
)
def test_a_damaged_or_unknown_file_is_refused_in_words(work, tmp_path, old, new, told):
    path = written(work, tmp_path)
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(ConfigError, match=told):
        read_recording(path)


def test_a_frame_with_a_word_or_a_missing_number_is_refused(work, tmp_path):
    lines = written(work, tmp_path).read_text().splitlines()
    for broken, told in (("1.0 2.0", "has 2"), (lines[-20] + "x", "expected numbers")):
        (tmp_path / "broken.bvh").write_text("\n".join([*lines[:-20], broken, *lines[-19:]]))
        with pytest.raises(ConfigError, match=told):
            read_recording(tmp_path / "broken.bvh")


def test_a_motion_without_its_skeleton_is_refused(work, tmp_path):
    path = write_acclaim(tmp_path, work.position[:50], work.rotation[:50])
    (tmp_path / "walk.asf").unlink()
    with pytest.raises(ConfigError, match="requires its skeleton"):
        read_recording(path)
    (tmp_path / "walk.fbx").write_text("")
    with pytest.raises(ConfigError, match=r"ends in \.bvh, \.amc, \.npz"):
        read_recording(tmp_path / "walk.fbx")


def test_an_npz_file_of_another_shape_is_refused_with_the_right_one(work, tmp_path):
    path = tmp_path / "joints.npz"
    for arrays, told in (
        ({"joints": work.joints}, "missing fps"),
        ({"joints": work.joints[:, :14], "fps": 50}, r"\(\d+, 14, 3\)"),
        ({"joints": work.joints, "fps": 0}, "frame rate between"),
        ({"poses": work.joints, "fps": 50}, "missing joints"),
    ):
        np.savez(path, **arrays)
        with pytest.raises(ConfigError, match=told):
            read_recording(path)
    path.write_bytes(path.read_bytes()[:200])
    with pytest.raises(ConfigError, match="truncated"):
        read_recording(path)


def test_the_page_has_every_name_that_is_understood():
    page = (Path(__file__).parents[2] / "docs" / "motion_capture.md").read_text()
    for names in (*SIDED.values(), HEAD):
        assert f"| {', '.join(names)} |" in page
