"""OpenVINO, the extra: the same landmarks as LiteRT's, and words where it is missing."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from stored import Stills

from hrc_env.core.errors import ConfigError
from hrc_env.core.records import Roi
from hrc_env.geometry.cameras import pinhole
from hrc_env.perception import vino
from hrc_env.perception.blazepose import crop_window, decode_landmarks, landmark_input
from hrc_env.perception.detector import DetectorConfig, PoseDetector
from hrc_env.perception.network import LANDMARK_OUTPUTS, load_landmarker, resolve_runtime

MIDDLE = Roi((118.0, 138.0), 220.0, 0.1)
needs_openvino = pytest.mark.skipif(
    not vino.is_installed(), reason=f"OpenVINO, an extra, is not installed: {vino.INSTALL}"
)


@pytest.fixture(scope="module")
def shift_px(weights, pictures):
    """(pictures, 33) how far landmarks on OpenVINO are from LiteRT's [px of 256], by precision."""
    crops = [landmark_input(crop_window(picture, MIDDLE)) for picture in pictures.values()]
    official = [_places(*load_landmarker()(crop)) for crop in crops]

    def measure(bits):
        run = vino.load(weights["pose_landmark_full"], LANDMARK_OUTPUTS, bits)
        found = [run(crop) for crop in crops]
        ours = [_places(points.reshape(39, 5), flag[0, 0], heat[0]) for points, flag, heat in found]
        return np.linalg.norm(np.array(ours) - np.array(official), axis=-1)

    return measure


def _places(points, _flag, heat):
    return 256 * decode_landmarks(points, heat)[:33, :2]


@needs_openvino
def test_in_32_bits_landmarks_are_those_of_litert(shift_px):
    assert shift_px("f32").max() < 0.2


@needs_openvino
def test_in_16_bits_landmarks_move_by_a_fraction_of_a_pixel(shift_px):
    if vino.precision() != "bf16":
        pytest.skip("this processor does not multiply 16-bit floats")
    assert np.median(shift_px("bf16")) < 0.5
    assert np.percentile(shift_px("bf16"), 90) < 4


@needs_openvino
def test_two_copies_agree_bit_for_bit_and_keep_what_they_said(weights, pictures):
    ours, theirs = load_landmarker(runtime="openvino"), load_landmarker(runtime="openvino")
    first, second = (landmark_input(crop_window(p, MIDDLE)) for p in list(pictures.values())[:2])
    kept = ours(first)
    ours(second)
    for a, b in zip(kept, theirs(first), strict=True):
        np.testing.assert_array_equal(a, b)


@needs_openvino
def test_eyes_see_the_same_worker_on_either_runtime(weights, pictures):
    camera = pinhole("still", np.array([4.0, 0, 1]), np.array([0, 0, 1.0]), 60, 256, 256)
    sights = []
    for runtime in ("litert", "openvino"):
        detector = PoseDetector([camera], DetectorConfig(runtime=runtime))
        sights.append(detector.detect(Stills([pictures["walk.png"]]), [MIDDLE]))
        detector.close()
    assert np.median(np.linalg.norm(sights[0].px - sights[1].px, axis=-1)) < 0.5


@needs_openvino
def test_no_telemetry_is_loaded(weights):
    vino.precision()
    assert sys.modules["openvino_telemetry"] is None


def test_where_openvino_is_missing_auto_is_litert_and_an_order_names_the_remedy(
    weights, monkeypatch
):
    monkeypatch.setattr(vino.importlib.util, "find_spec", lambda _: None)
    assert resolve_runtime("auto") == "litert"
    camera = pinhole("still", np.array([4.0, 0, 1]), np.array([0, 0, 1.0]), 60, 256, 256)
    with pytest.raises(ConfigError, match=r"hrc_env\[openvino\].*litert"):
        PoseDetector([camera], DetectorConfig(runtime="openvino"))


def test_an_unknown_runtime_is_told_the_valid_ones():
    with pytest.raises(ConfigError, match="Did you mean 'openvino'"):
        DetectorConfig(runtime="openvinno")


def test_what_it_would_gain_is_said_where_it_is_missing(monkeypatch):
    monkeypatch.setattr(vino, "is_installed", lambda: False)
    assert f"by {1 - vino.TIME_SHARE:.0%}: {vino.INSTALL}" in vino.describe_gain()
    monkeypatch.setattr(vino, "is_installed", lambda: True)
    monkeypatch.setattr(vino, "precision", lambda: "bf16")
    assert "computes in bf16" in vino.describe_gain()


def test_the_gain_is_the_measured_one():
    measured = json.loads(Path("docs/results/whole/pixels.json").read_text())["metrics"]
    assert round(measured["openvino.time_ratio"]["value"], 2) == vino.TIME_SHARE
