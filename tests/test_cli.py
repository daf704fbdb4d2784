"""The command line as people use it."""

from pathlib import Path

import numpy as np
import pytest
from commands import hrc

from hrc_env.motion.clip import load_clip
from hrc_env.worker.body import load_body


@pytest.mark.parametrize(
    "command", ["setup", "demo", "check", "list", "play", "experiment", "import-motion"]
)
def test_help_explains_every_command(command):
    done = hrc(command, "--help")
    assert done.returncode == 0
    assert len(done.stdout.split()) > 12


def test_list_names_what_arguments_take():
    said = hrc("list").stdout
    for name in ("HRCReach-v0", "keypoints", "triangulation", "camera_4", "scripted"):
        assert name in said


def test_check_says_ok_line_by_line():
    done = hrc("check")
    assert done.returncode == 0, done.stdout
    assert "weights" in done.stdout
    assert "TODO" not in done.stdout


def test_check_says_what_to_do_without_weights(tmp_path, monkeypatch):
    monkeypatch.setenv("HRC_ENV_CACHE", str(tmp_path / "empty"))
    done = hrc("check")
    assert done.returncode == 1
    assert "python -m hrc_env setup" in done.stdout.replace("\n", " ")


def test_pixels_without_opengl_says_what_to_install():
    done = hrc("play", "--perception", "pixels", MUJOCO_GL="disabled")
    assert done.returncode == 2
    assert "RenderingError" in done.stderr
    assert "MUJOCO_GL" in done.stderr
    assert "Traceback" not in done.stderr


def test_other_levels_need_no_opengl():
    done = hrc("play", "--perception", "keypoints", MUJOCO_GL="disabled")
    assert done.returncode == 0, done.stderr
    assert "goals" in done.stdout


def test_every_task_has_an_agent_that_plays_it():
    """In the robot that the task is made for, which nobody names."""
    done = hrc("play", "HRCPickPlace-v0", "--agent", "scripted", "--perception", "truth")
    assert done.returncode == 0, done.stderr
    assert "studs placed" in done.stdout
    assert "studs remaining" in done.stdout


def test_an_unknown_id_is_answered_without_a_traceback():
    done = hrc("play", "HRCReach-v1")
    assert done.returncode == 2
    assert "Did you mean 'HRCReach-v0'" in done.stderr.replace("\n", " ")
    assert "Traceback" not in done.stderr


def test_a_film_is_written_whole(tmp_path: Path):
    film = tmp_path / "film.mp4"
    done = hrc("demo", "--perception", "keypoints", "--seconds", "0.4", "--out", str(film))
    assert done.returncode == 0, done.stderr
    assert film.stat().st_size > 10_000
    assert [path.name for path in tmp_path.iterdir() if "draft" in path.name] == []


def test_a_recording_becomes_a_clip(tmp_path: Path):
    joints = np.repeat((load_body().rest_position[None, load_body().joint_segment]), 60, axis=0)
    joints = joints + load_body().joint_offset
    joints[:, :7, 0] += 0.05 * np.sin(np.arange(60) / 10)[:, None]
    np.savez(tmp_path / "bow.npz", joints=100 * joints, fps=30)
    clip = tmp_path / "clip.npz"
    done = hrc("import-motion", str(tmp_path / "bow.npz"), "--out", str(clip))
    assert done.returncode == 0, done.stderr
    assert "centimetres" in done.stdout
    assert len(load_clip(clip).controls) == 60
    assert sorted(path.name for path in tmp_path.iterdir()) == ["bow.npz", "clip.npz"]


def test_a_recording_of_nobody_is_refused_without_a_traceback(tmp_path: Path):
    np.savez(tmp_path / "dust.npz", joints=np.zeros((60, 15, 3)), fps=30)
    done = hrc("import-motion", str(tmp_path / "dust.npz"), "--out", str(tmp_path / "clip.npz"))
    assert done.returncode == 2
    assert "ConfigError" in done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "clip.npz").exists()
