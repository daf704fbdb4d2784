"""What the importer calls ready plays: imported by the command, played in every scene."""

import gymnasium
import numpy as np
import pytest
from recorded import joined, started
from strides import FORMS, FPS, N_STRIDES, stride, written_as

from benchmarks.tracking.walks import walk
from hrc_env.cli.import_motion import ImportMotion
from hrc_env.core.errors import ConfigError
from hrc_env.core.skeleton import JOINT, JOINTS
from hrc_env.mocap.record import Capture
from hrc_env.mocap.retarget import retarget
from hrc_env.motion import controls as c
from hrc_env.motion import generator
from hrc_env.motion import state as st
from hrc_env.motion.clip import load_clip, move_to_origin
from hrc_env.motion.fit import describe_fit, measure_played_s
from hrc_env.scene.build import all_grounds, build
from hrc_env.scene.places import SCENES
from hrc_env.worker.body import load_body

PATIENCE_S = 60
"""Simulated time in which a worker who always plays if there is room has played [s]."""


def imported(path, source_fps=None, **options):
    """The clip that the command makes of a recording."""
    out = path.with_name("clip.npz")
    assert ImportMotion(path, out, source_fps=source_fps, **options).run() == 0
    return out


def plays(clip, scene, worker="worker_1"):
    """Whether a worker plays a clip in a scene."""
    env = gymnasium.make(
        "HRCReach-v0", perception="none", scene=scene, motions=[clip],
        config={"motion": {"motions_probability": 1.0}, "worker": worker},
        max_episode_steps=100_000,
    )  # fmt: skip
    env.reset(seed=0)
    still = np.zeros(env.action_space.shape, np.float32)
    for _ in range(PATIENCE_S * 25):
        *_, info = env.step(still)
        if env.unwrapped.words(info)["worker/activity"] == ("clip",):
            env.close()
            return True
    env.close()
    return False


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("seed", range(N_STRIDES))
def test_every_walk_in_every_form_plays_in_every_scene(tmp_path, seed, form, capsys):
    path = written_as(form, stride(seed), tmp_path, seed)
    clip = imported(path, FPS if form == "amc" else None)
    said = " ".join(capsys.readouterr().out.split())
    played = measure_played_s(load_clip(clip), all_grounds(), "any")
    assert set(played) == set(SCENES)
    for scene, seconds in played.items():
        assert seconds > 1.0
        assert f"{scene} ({seconds:.1f} of its" in said
        assert plays(clip, scene, "any")


def test_nothing_jumps_while_walks_are_played():
    clips = []
    for seed in range(N_STRIDES):
        walked = stride(seed)
        capture = Capture(walked.joints, FPS, True, JOINTS, f"walk {seed}")
        clips.append(retarget(capture, load_body())[0])
        assert not clips[-1].contacts.all(1).any()  # nobody stands on both feet
    config = generator.MotionConfig(motions=tuple(clips), motions_probability=1.0)
    state, rngs = started(4, seed=3, config=config)
    motions, doing = [], []
    for _ in range(2000):
        motions.append(generator.advance(state, rngs, 0.02, 1)[1])
        doing.append(generator.activity(state)[:, 0])
    assert (np.stack(doing) == st.CLIP).mean() > 0.2
    position = joined(motions).position_world
    assert np.linalg.norm(np.diff(position, axis=1), axis=-1).max() / 0.02 < 12.0


def test_what_is_accepted_off_the_floor_is_played_from_the_floor_to_the_floor(tmp_path, work):
    t = np.arange(len(work.joints)) / work.fps
    joints = work.joints.copy()
    joints[..., 2] += 0.5 * np.clip(np.minimum(t - 1.0, t[-1] - 1.0 - t) / 0.3, 0.0, 1.0)[:, None]
    np.savez(tmp_path / "box.npz", joints=joints, fps=work.fps)
    with pytest.raises(ConfigError, match="Feet rest at heights"):
        imported(tmp_path / "box.npz")
    clip = imported(tmp_path / "box.npz", allow_off_floor=True)
    config = generator.MotionConfig(motions=(str(clip),))
    pieces = generator.make_state(1, 1, load_body(), config, build(name="site").grounds).mind.clips
    ankles = pieces.frames[:, [c.N_BLENDED + 2, c.N_BLENDED + 8]]
    ends = np.concatenate([pieces.row, pieces.row + pieces.count - 1])
    assert ankles[ends].max() < 0.2
    assert ankles.min(1).max() > 0.4
    assert plays(clip, "site")


@pytest.mark.parametrize("n_frames", [14, 16, 20])
def test_the_shortest_clips_play(tmp_path, n_frames, capsys):
    short = stride(0)
    clip = imported(written_as("npz", short._replace(joints=short.joints[:n_frames]), tmp_path))
    assert "can be played in lab (0." in " ".join(capsys.readouterr().out.split())
    assert plays(clip, "lab")


def test_a_clip_that_fits_nowhere_is_not_called_ready(tmp_path, work, capsys):
    """Somebody hops 30 m on one leg: both feet are low at the two ends only."""
    joints, share = work.joints.copy(), np.linspace(0.0, 1.0, len(work.joints))
    lifted = [JOINT[f"left_{part}"] for part in ("knee", "ankle", "foot")]
    joints[:, lifted, 2] += 0.3 * np.minimum(10.0 * np.minimum(share, 1.0 - share), 1.0)[:, None]
    joints[..., 0] += 30.0 * share[:, None]
    np.savez(tmp_path / "hop.npz", joints=joints, fps=work.fps)
    imported(tmp_path / "hop.npz")
    said = " ".join(capsys.readouterr().out.split())
    assert "There is no room for it in lab, site." in said
    assert "play it" not in said


def retargeted(joints):
    return retarget(Capture(joints, FPS, True, JOINTS, "long"), load_body())[0]


@pytest.mark.parametrize(("seconds", "area_m"), [(30, (40.0, 40.0)), (60, (3.0, 3.0))])
def test_long_clips_are_played_in_pieces_that_fit(seconds, area_m):
    clip = retargeted(walk(area_m, [seconds], seconds * 25)[:, 0])
    for scene, played in measure_played_s(clip, all_grounds()).items():
        assert played > 0.9 * seconds
        assert plays(clip, scene)


def leap(length_m):
    """A straight walk with both feet on the floor at its ends only."""
    clip = retargeted(walk((40.0, 40.0), [2], 100)[:, 0])
    q = move_to_origin(clip.controls)
    ahead = np.linspace(0.0, length_m, len(q))
    for at in (c.ROOT_X, c.ANKLE, c.ANKLE + 6):
        q[:, at : at + 2] += np.column_stack([ahead, 0.0 * ahead]) - q[:, [c.ROOT_X, c.ROOT_Y]]
    q[5:-5, [c.ANKLE + 2, c.ANKLE + 8]] += 0.2
    return generator.Clip(q, FPS, clip.contacts, clip.size, "leap")


def test_a_clip_without_room_is_refused_with_the_scenes_that_have_it():
    clip = leap(5.5)
    assert measure_played_s(clip, all_grounds())["lab"] == 0.0
    with pytest.raises(ConfigError, match=r"leap: there is no room.*played in site \(.*lab\."):
        gymnasium.make("HRCReach-v0", perception="none", motions=[clip])
    assert plays(clip, "site")
    far = leap(30.0)
    assert (
        describe_fit(far, measure_played_s(far, all_grounds()))
        == "There is no room for it in lab, site."
    )
    with pytest.raises(ConfigError, match="leap: there is no room"):
        gymnasium.make("HRCReach-v0", perception="none", scene="site", motions=[far])
