"""Weights are the official ones or an error says what to do."""

import hashlib
import importlib.util
import io
import shutil
import subprocess
import sys
import tarfile
import tempfile
import time
import urllib.error
import urllib.request
import zipfile
from dataclasses import replace

import gymnasium
import pytest

from hrc_env.core import folders
from hrc_env.core.errors import ConfigError, WeightsError
from hrc_env.perception import downloads
from hrc_env.perception import weights as w

SETUP = "python -m hrc_env setup"


@pytest.fixture
def empty_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("HRC_ENV_CACHE", str(tmp_path))
    return tmp_path


def pip_says(monkeypatch, stderr):
    """From now on pip says this, and fails."""

    def run(command, **_):
        return subprocess.CompletedProcess(command, 1, stdout="", stderr=stderr)

    monkeypatch.setattr(subprocess, "run", run)


def test_missing_weights_name_the_file_the_folder_and_the_command(empty_cache):
    with pytest.raises(WeightsError) as error:
        w.find_weights("pose_detection")
    for part in ("pose_detection.tflite", str(empty_cache), SETUP):
        assert part in str(error.value)


def test_a_changed_byte_is_refused_with_both_checksums(empty_cache, weights):
    content = bytearray(weights["pose_detection"].read_bytes())
    content[1000] ^= 1
    (empty_cache / "pose_detection.tflite").write_bytes(content)
    with pytest.raises(WeightsError) as error:
        w.find_weights("pose_detection")
    assert w.WEIGHTS["pose_detection"].sha256 in str(error.value)
    assert "2959046 bytes" in str(error.value)
    assert SETUP in str(error.value)


def test_a_file_that_changes_after_it_was_verified_is_verified_again(empty_cache, weights):
    place = empty_cache / "pose_detection.tflite"
    shutil.copy(weights["pose_detection"], place)
    assert w.find_weights("pose_detection") == place
    place.write_bytes(b"not a network")
    with pytest.raises(WeightsError, match="got 13 bytes"):
        w.find_weights("pose_detection")


def test_weights_that_are_there_need_no_network(weights, monkeypatch):
    pip_says(monkeypatch, "there must be no download")
    assert w.fetch_weights() == weights


def test_without_a_network_the_error_repeats_what_pip_said(empty_cache, monkeypatch):
    pip_says(monkeypatch, "ERROR: No matching distribution found for mediapipe==0.10.21")
    with pytest.raises(WeightsError, match="No matching distribution") as error:
        w.fetch_weights()
    assert SETUP in str(error.value)


@pytest.fixture
def pip_brings(weights, monkeypatch):
    """From now on pip brings a wheel that holds the official files; its commands."""
    commands = []

    def run(command, **_):
        commands.append(command)
        wheel = f"{command[command.index('--dest') + 1]}/mediapipe-0.10.21-py3-none-any.whl"
        with zipfile.ZipFile(wheel, "w") as archive:
            for name, path in weights.items():
                archive.write(path, w.WEIGHTS[name].member)
        time.sleep(0.3)
        return subprocess.CompletedProcess(command, 0, stdout="", stderr="")

    monkeypatch.setattr(subprocess, "run", run)
    return commands


def test_the_first_make_at_pixels_fetches_what_is_missing_and_says_so(
    empty_cache, pip_brings, caplog
):
    for _ in range(2):
        gymnasium.make("HRCReach-v0", perception="pixels").close()
    assert len(pip_brings) == 1
    (said,) = [each.message for each in caplog.records if each.name == "hrc_env.weights"]
    assert said.startswith(
        "Downloading the weights of the pose network (mediapipe==0.10.21, 36 MB)"
    )
    assert str(empty_cache) in said


@pytest.mark.usefixtures("empty_cache", "pip_brings")
def test_a_long_download_says_how_much_time_is_left(monkeypatch, caplog):
    monkeypatch.setattr(downloads, "SAY_EVERY_S", 0.1)
    w.fetch_weights()
    said = [each.message for each in caplog.records if each.name == "hrc_env.downloads"]
    assert "s left" in said[0]
    assert "MB of 36" in said[0]


@pytest.fixture
def read_only_home(tmp_path, monkeypatch):
    """The user's caches, which cannot be written; and where temporary files lie."""
    home, elsewhere = tmp_path / "home", tmp_path / "tmp"
    elsewhere.mkdir()
    monkeypatch.delenv("HRC_ENV_CACHE", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(home))
    monkeypatch.setattr(tempfile, "tempdir", str(elsewhere))
    monkeypatch.setattr(folders, "can_write", lambda folder: home not in folder.parents)
    folders.temporary_cache.cache_clear()
    yield home / "hrc_env", elsewhere
    folders.temporary_cache.cache_clear()


@pytest.mark.usefixtures("pip_brings")
def test_where_home_can_only_be_read_a_temporary_folder_keeps_them(read_only_home):
    home, elsewhere = read_only_home
    for path in w.fetch_weights().values():
        assert path.parent.parent == elsewhere
    assert not home.exists()


def test_weights_in_a_home_that_can_only_be_read_are_found(read_only_home, weights, monkeypatch):
    home, _ = read_only_home
    home.mkdir(parents=True)
    for path in weights.values():
        shutil.copy(path, home)
    pip_says(monkeypatch, "there must be no download")
    assert {path.parent for path in w.fetch_weights().values()} == {home}


@pytest.mark.parametrize(
    ("there", "words"),
    [
        ({"pip": "/usr/bin/pip", "uv": "/usr/bin/uv"}, ["/usr/bin/pip"]),
        ({"uv": "/usr/bin/uv"}, ["/usr/bin/uv", "tool", "run", "--python", sys.executable, "pip"]),
    ],
)
@pytest.mark.usefixtures("empty_cache")
def test_an_environment_without_pip_takes_another(there, words, pip_brings, monkeypatch):
    """Those that uv makes have none."""
    real = importlib.util.find_spec
    monkeypatch.delenv("UV", raising=False)
    monkeypatch.setattr(shutil, "which", there.get)
    monkeypatch.setattr(
        importlib.util,
        "find_spec",
        lambda name: None if name in ("pip", "ensurepip") else real(name),
    )
    w.fetch_weights()
    assert pip_brings[0][: len(words)] == words


def test_a_chosen_folder_that_cannot_be_written_is_refused_before_a_download(
    tmp_path, pip_brings, monkeypatch
):
    (tmp_path / "file").touch()
    monkeypatch.setenv("HRC_ENV_CACHE", str(tmp_path / "file" / "folder"))
    with pytest.raises(WeightsError, match="Choose another folder"):
        w.fetch_weights()
    assert pip_brings == []


def test_without_pip_the_error_says_how_to_get_it(empty_cache, monkeypatch):
    pip_says(monkeypatch, f"{sys.executable}: No module named pip")
    with pytest.raises(WeightsError, match="python -m ensurepip"):
        w.fetch_weights()


def test_a_wheel_with_other_weights_leaves_nothing_in_the_cache(empty_cache, monkeypatch):
    def run(command, **_):
        wheel = f"{command[command.index('--dest') + 1]}/mediapipe-0.10.21-py3-none-any.whl"
        with zipfile.ZipFile(wheel, "w") as archive:
            for file in w.WEIGHTS.values():
                archive.writestr(file.member, b"other weights")
        return subprocess.CompletedProcess(command, 0, stdout="", stderr="")

    monkeypatch.setattr(subprocess, "run", run)
    with pytest.raises(WeightsError, match="not the official"):
        w.fetch_weights()
    assert list(empty_cache.iterdir()) == []


@pytest.fixture
def tarball(tmp_path_factory, monkeypatch):
    """The npm registry has an archive whose networks say other things; the names asked of it."""
    asked = []

    def urlopen(url, timeout):
        asked.append(url)
        packed = io.BytesIO()
        with tarfile.open(fileobj=packed, mode="w:gz") as archive:
            for network in ("lite", "heavy"):
                content = f"{network} weights".encode()
                about = tarfile.TarInfo(f"package/pose_landmark_{network}.tflite")
                about.size = len(content)
                archive.addfile(about, io.BytesIO(content))
        packed.seek(0)
        return packed

    monkeypatch.setattr(urllib.request, "urlopen", urlopen)
    return asked


def official(content, monkeypatch):
    """From now on this is what `pose_landmark_heavy` must be."""
    heavy = w.WEIGHTS["pose_landmark_heavy"]
    checksum = hashlib.sha256(content).hexdigest()
    changed = replace(heavy, size_bytes=len(content), sha256=checksum)
    monkeypatch.setitem(w.WEIGHTS, "pose_landmark_heavy", changed)


def test_other_networks_come_out_of_the_npm_archive_when_asked_for(
    empty_cache, tarball, monkeypatch
):
    official(b"heavy weights", monkeypatch)
    found = w.fetch_weights(names=["pose_landmark_heavy"])
    assert found["pose_landmark_heavy"].read_bytes() == b"heavy weights"
    assert tarball == [w.TARBALL]
    assert [path.name for path in empty_cache.iterdir()] == ["pose_landmark_heavy.tflite"]


def test_an_npm_archive_with_other_weights_leaves_nothing_in_the_cache(empty_cache, tarball):
    with pytest.raises(WeightsError, match="not the official pose_landmark_lite"):
        w.fetch_weights(names=["pose_landmark_lite"])
    assert list(empty_cache.iterdir()) == []


def test_without_a_network_the_error_names_the_address_and_the_command(empty_cache, monkeypatch):
    def offline(url, timeout):
        raise urllib.error.URLError("no route")

    monkeypatch.setattr(urllib.request, "urlopen", offline)
    with pytest.raises(WeightsError, match=r"registry\.npmjs\.org.*no route") as error:
        w.fetch_weights(names=["pose_landmark_heavy"])
    assert f"{SETUP} --networks heavy" in str(error.value)


def test_a_network_that_was_never_fetched_names_its_own_command(empty_cache):
    with pytest.raises(WeightsError, match=f"{SETUP} --networks lite"):
        w.find_weights("pose_landmark_lite")


def test_an_unknown_name_is_answered_with_the_nearest():
    with pytest.raises(ConfigError, match="Did you mean 'pose_landmark_full'"):
        w.find_weights("pose_landmarks_full")


def test_the_cache_is_where_the_user_says_it_is(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.delenv("HRC_ENV_CACHE", raising=False)
    assert w.cache_dir() == tmp_path / "hrc_env"
    monkeypatch.setenv("HRC_ENV_CACHE", str(tmp_path / "mine"))
    assert w.cache_dir() == tmp_path / "mine"
