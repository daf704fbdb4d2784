"""Any worker does what the recorded person did, on feet that stand."""

import dataclasses

import numpy as np
import pytest
from written import BODY, write_bvh

from hrc_env.core.errors import ConfigError
from hrc_env.mocap.poses import locate_joints, make_marks, pose_segments
from hrc_env.mocap.read import read_recording
from hrc_env.mocap.retarget import align, retarget
from hrc_env.motion import controls as c
from hrc_env.motion.anatomy import LEG, measure_body
from hrc_env.motion.clip import load_clip, save_clip, scale_clip
from hrc_env.worker.body import SEGMENT, load_body, worker_names


@pytest.fixture(scope="module")
def capture(work, tmp_path_factory):
    path = tmp_path_factory.mktemp("bvh") / "walk.bvh"
    return read_recording(write_bvh(path, work.position, work.rotation, work.fps))


@pytest.fixture(scope="module")
def imported(capture):
    return retarget(capture, BODY)


def test_the_projects_own_motion_comes_back_within_a_centimetre(imported):
    _, error = imported
    assert error.scale == pytest.approx(1.0, abs=0.01)
    assert error.mean_m.mean() < 0.01
    assert error.mean_m[1:].max() < 0.015  # the nose was made from the head


@pytest.mark.parametrize("name", worker_names())
def test_every_body_follows_within_a_few_centimetres(capture, name):
    fewer = dataclasses.replace(capture, joints_world=capture.joints_world[::4], fps=12.5)
    _, error = retarget(fewer, load_body(name))
    assert error.mean_m.mean() < 0.04


def test_joints_of_the_projects_own_sense_are_followed_in_that_sense(work, tmp_path):
    np.savez(tmp_path / "joints.npz", joints=work.joints, fps=work.fps)
    _, error = retarget(read_recording(tmp_path / "joints.npz"), BODY)
    assert error.mean_m.max() < 0.02


def test_standing_feet_do_not_slide(imported, capture):
    clip, error = imported
    assert error.slip_m_s < 0.05
    position, _, _ = pose_segments(clip.controls, measure_body(BODY))
    for side, name in enumerate(("left", "right")):
        ball = position[:, SEGMENT[f"{name}_toes"]]
        stands = clip.contacts[1:, side] & clip.contacts[:-1, side]
        flat = np.abs(clip.controls[:, c.ANKLE + 6 * side + 4]) < 0.005
        flat = stands & flat[1:] & flat[:-1]
        creep = np.linalg.norm(np.diff(ball, axis=0), axis=-1) * capture.fps
        assert 0.3 < stands.mean() < 1.0
        assert np.percentile(creep[flat], 95) < 0.05


def test_nothing_jumps_where_feet_were_locked(imported, capture):
    clip, _ = imported
    ankles = clip.controls[:, [c.ANKLE, c.ANKLE + 1, c.ANKLE + 2]]
    acceleration = np.diff(ankles, n=2, axis=0) * capture.fps**2
    assert np.percentile(np.linalg.norm(acceleration, axis=-1), 99) < 62.0  # as of real ankles


def test_feet_do_not_go_through_the_floor(imported):
    clip, _ = imported
    position, _, _ = pose_segments(clip.controls, measure_body(BODY))
    resting = BODY.rest_position[[SEGMENT["left_toes"], SEGMENT["right_toes"]], 2]
    toes = position[:, [SEGMENT["left_toes"], SEGMENT["right_toes"]], 2]
    assert (toes > resting - 0.01).mean() > 0.99


def test_a_clip_begins_at_the_origin_towards_x(imported):
    first = imported[0].controls[0]
    assert np.allclose(first[[c.ROOT_X, c.ROOT_Y, c.HEADING]], 0.0)


def test_the_best_alignment_undoes_any_similarity(work):
    from hrc_env.geometry.rotations import about_axis

    moved = 1.3 * work.joints @ about_axis("z", 0.7).T + [1.0, 2.0, 3.0]
    scale, apart = align(work.joints, moved)
    assert scale == pytest.approx(1.3)
    assert apart.max() < 1e-9


def test_a_clip_scales_to_another_body(imported):
    clip, _ = imported
    other = clip.size * 0.9
    q = scale_clip(clip, other)
    small = dataclasses.replace(
        measure_body(BODY), offset=0.9 * measure_body(BODY).offset, lengths=other
    )
    marks = dataclasses.replace(make_marks(BODY, False), anatomy=small, offset=np.zeros((15, 3)))
    big = dataclasses.replace(make_marks(BODY, False), offset=np.zeros((15, 3)))
    assert np.allclose(locate_joints(q, marks), 0.9 * locate_joints(clip.controls, big), atol=5e-3)
    assert q[-1, c.ROOT_X] == pytest.approx(
        clip.controls[-1, c.ROOT_X] * other[LEG] / clip.size[LEG]
    )


def test_a_saved_clip_is_loaded_as_it_was(imported, tmp_path):
    clip, _ = imported
    save_clip(clip, tmp_path / "new" / "clip.npz")
    again = load_clip(tmp_path / "new" / "clip.npz")
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["clip.npz"]
    for field in dataclasses.fields(clip):
        assert np.array_equal(getattr(again, field.name), getattr(clip, field.name)), field.name


def test_what_is_no_clip_is_refused_in_words(imported, tmp_path):
    clip, _ = imported
    path = tmp_path / "clip.npz"
    with pytest.raises(ConfigError, match=r"The clip .* does not exist"):
        load_clip(path)
    np.savez(path, joints=np.zeros((3, 15, 3)), fps=30)
    with pytest.raises(ConfigError, match=r"arrays fps, joints.*import-motion"):
        load_clip(path)
    save_clip(clip, path)
    path.write_bytes(path.read_bytes()[:-2000])
    with pytest.raises(ConfigError, match="damaged"):
        load_clip(path)


@pytest.mark.parametrize(
    ("field", "value", "told"),
    [
        ("fps", 0.0, "frame rate"),
        ("controls", np.zeros((5, 39)), r"\(5, 39\)"),
        ("controls", np.full((5, c.N_CONTROLS), np.nan), "contacts must have|finite"),
        ("size", np.zeros(3), "size must have"),
    ],
)
def test_a_clip_that_cannot_be_played_is_refused(imported, field, value, told):
    with pytest.raises(ConfigError, match=told):
        dataclasses.replace(imported[0], **{field: value})


def test_a_root_that_jumps_is_refused(imported):
    controls = imported[0].controls.copy()
    controls[100:, c.ROOT_X] += 5.0
    with pytest.raises(ConfigError, match="the root moves"):
        dataclasses.replace(imported[0], controls=controls)
