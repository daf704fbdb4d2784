"""Recorded clips are played like procedural motion: anywhere, again and again, without a jump."""

import dataclasses

import numpy as np
import pytest
from recorded import begin, joined, started, walk_straight, watched

from hrc_env.core.batching import one
from hrc_env.core.errors import ConfigError
from hrc_env.core.records import WorkerMotion
from hrc_env.core.skeleton import JOINTS
from hrc_env.mocap.poses import pose_segments
from hrc_env.mocap.record import Capture
from hrc_env.mocap.retarget import retarget
from hrc_env.motion import controls as c
from hrc_env.motion import generator
from hrc_env.motion import state as st
from hrc_env.motion.activities.pieces import LONGEST_S, cut_clips, make_stage
from hrc_env.motion.activities.playing import PACE_S, SETTLE_S
from hrc_env.motion.blending import place_standing as settle_at
from hrc_env.motion.clip import load_clip, save_clip
from hrc_env.motion.floorplan import make_floorplan
from hrc_env.motion.paths import lay_path
from hrc_env.motion.points import Point
from hrc_env.motion.state import N_ROOTS
from hrc_env.motion.traffic import find_meeting
from hrc_env.motion.walk import plan_walk
from hrc_env.settings import resolve_settings
from hrc_env.worker.body import SEGMENT, load_body, worker_truth

BODY = load_body()
FPS = 50.0


@pytest.fixture(scope="module")
def clip():
    """A metre's walk, recorded."""
    motion = walk_straight(0.8, length_m=1.2, dt_s=1 / FPS).motion
    still = np.zeros_like(motion.position_world)
    record = WorkerMotion(motion.position_world, motion.quaternion_wxyz, still, still)
    joints = worker_truth(BODY, record).joints_world[0, :, 0]
    return retarget(Capture(joints, FPS, True, JOINTS, "walk"), BODY)[0]


@pytest.fixture(scope="module")
def played(clip):
    """Four workers who play whenever there is room, for 60 s."""
    config = generator.MotionConfig(motions=(clip,), motions_probability=1.0)
    state, rngs = started(4, seed=2, config=config)
    motions, doing = [], []
    for _ in range(int(60 * FPS)):
        motions.append(generator.advance(state, rngs, 1 / FPS, 1)[1])
        doing.append(generator.activity(state)[:, 0])
    return joined(motions), np.stack(doing, 1)


def test_workers_play_it_again_and_again(played):
    _, doing = played
    playing = doing == st.CLIP
    assert generator.activity_names[st.CLIP] == "clip"
    assert 0.2 < playing.mean() < 1.0
    begins = (playing[:, 1:] & ~playing[:, :-1]).sum()
    assert begins > 4


def test_nothing_jumps_where_a_clip_begins_and_ends(played):
    motion, _ = played
    velocity = motion.velocity_world[:, :, 0]
    acceleration = np.linalg.norm(np.diff(velocity, axis=1), axis=-1) * FPS
    trunk = [SEGMENT[name] for name in ("pelvis", "chest", "head")]
    assert np.percentile(acceleration[..., trunk], 99.9) < 25.0
    feet = [SEGMENT["left_foot"], SEGMENT["right_foot"]]
    assert np.percentile(acceleration[..., feet], 99.9) < 62.0
    moved = np.diff(motion.position_world[:, :, 0], axis=1) * FPS
    mean_velocity = 0.5 * (velocity[:, 1:] + velocity[:, :-1])
    assert np.abs(moved - mean_velocity).max() < 0.3  # a jump of 6 mm would show


def test_feet_stand_still_while_it_is_played(played):
    motion, doing = played
    for side in ("left", "right"):
        ball = motion.position_world[:, :, 0, SEGMENT[f"{side}_toes"]]
        speed = np.linalg.norm(motion.velocity_world[:, :, 0, SEGMENT[f"{side}_toes"], :2], axis=-1)
        loaded = ball[..., 2] < BODY.rest_position[SEGMENT[f"{side}_toes"], 2] + 5e-4
        assert np.percentile(speed[loaded & (doing == st.CLIP)], 95) < 0.05


def test_the_recorded_pose_is_the_one_that_is_seen(clip):
    config = generator.MotionConfig(motions=(clip,), motions_probability=1.0)
    state, rngs = started(1, seed=5, config=config)
    for _ in range(1000):
        generator.advance(state, rngs, 0.1, 1)
        at_s = state.workers["time_s"][0, 0] - SETTLE_S
        if state.workers["activity"][0, 0] == st.CLIP and PACE_S + 0.2 < at_s < PACE_S + 0.5:
            break
    position = generator.current(state).position_world[0, 0]
    k = round((at_s - 0.5 * PACE_S) * FPS)
    piece = state.mind.clips
    q = np.zeros((1, c.N_CONTROLS))
    q[0, : c.N_BLENDED] = piece.frames[k, : c.N_BLENDED]
    q[0, c.ANKLE : c.ANKLE + 12] = piece.frames[k, c.N_BLENDED :]
    recorded = pose_segments(q, one(state.mind.anatomy, 0))[0][0]
    between = np.linalg.norm(position[:, None] - position[None], axis=-1)
    assert (
        np.abs(between - np.linalg.norm(recorded[:, None] - recorded[None], axis=-1)).max() < 0.02
    )


def test_a_long_clip_is_played_in_pieces_from_both_feet_to_both_feet(clip):
    again = np.concatenate([clip.controls] * 20)
    step = np.repeat(np.arange(20), len(clip.controls))
    for at in (c.ROOT_X, c.ANKLE, c.ANKLE + 6):
        again[:, at : at + 2] += step[:, None] * (clip.controls[-1, :2] - clip.controls[0, :2])
    long = dataclasses.replace(clip, controls=again, contacts=np.concatenate([clip.contacts] * 20))
    hall = dataclasses.replace(generator.OPEN_FLOOR, walkable_x_m=(-99.0, 99.0))
    pieces = cut_clips(
        [long], clip.size[None], make_stage(make_floorplan(hall), generator.MotionConfig())
    )
    assert len(pieces.count) > 2
    assert (pieces.count / pieces.fps <= LONGEST_S + 1 / FPS).all()
    first = pieces.frames[pieces.row]
    assert np.allclose(first[:, [c.ROOT_X, c.ROOT_Y, c.HEADING]], 0.0)


def test_a_clip_that_is_never_on_both_feet_is_refused(clip):
    controls = clip.controls.copy()
    controls[:, c.ANKLE + 2] += 0.2
    hopping = dataclasses.replace(
        clip, controls=controls, contacts=np.zeros_like(clip.contacts), source="hops"
    )
    with pytest.raises(ConfigError, match="hops: both feet are within 5 cm of the floor at 0 fra"):
        started(1, config=generator.MotionConfig(motions=(hopping,)))


def test_who_arrives_early_does_not_stay_in_the_way_of_a_clip(clip):
    config = generator.MotionConfig(motions=(clip,))
    state, _ = started(1, n_workers=2, config=config)
    player, walker = state.workers[0]
    begin(player, st.CLIP, 20.0)
    player["clip_s"] = 20.0 - 2.0 * SETTLE_S
    player["roots"] = np.column_stack([np.linspace(0.0, 10.0, N_ROOTS), np.zeros(N_ROOTS)])
    for end_y_m, early in ((-0.2, True), (-2.0, False)):
        settle_at(8.0, -4.0, 0.0, walker)
        lay_path(Point(8.0, -4.0), np.zeros((0, 3)), Point(8.0, end_y_m), walker)
        begin(walker, st.WALK, plan_walk(0.0, 1.2, walker))
        assert walker["duration_s"] < 8.0  # the player comes by after 16 s
        assert (find_meeting(1, state.workers[0]).time_s > 0.0) == early


def test_motions_come_as_paths_or_clips(clip, tmp_path):
    path = tmp_path / "walk.npz"
    save_clip(clip, path)
    assert load_clip(path) == clip
    by_path = resolve_settings(config={"motion": {"motions": [str(path)]}}).config
    assert by_path == resolve_settings(motions=[path]).config
    assert resolve_settings(motions=[clip]).config.motion.motions == (clip,)
    assert resolve_settings(config=by_path, motions=None).config.motion is by_path.motion
    with pytest.raises(ConfigError, match=r"motions\[0\] must be a str, got 3"):
        resolve_settings(motions=[3])
    with pytest.raises(ConfigError, match=r"The clip .* does not exist"):
        generator.make_state(
            1, 1, BODY, resolve_settings(motions=[tmp_path / "none.npz"]).config.motion
        )


def test_the_same_seed_plays_the_same(clip):
    config = generator.MotionConfig(motions=(clip,))
    paths = [watched(*started(b, seed=4, config=config), 0.04, 200) for b in (1, 3)]
    assert np.array_equal(paths[0].position_world[0], paths[1].position_world[0])
