"""Calibrations, faults and findings that are wrong in one thing only are refused."""

import json
from pathlib import Path

import numpy as np
import pytest

from hrc_env.core.errors import ConfigError
from hrc_env.core.records import Roi
from hrc_env.perception import vino
from hrc_env.perception.calibration import FORMAT, PACKAGED, SHAPES, VERSION, read_calibration
from hrc_env.perception.detector import call_detector
from hrc_env.perception.emulator import EmulatorConfig, make_state
from hrc_env.perception.faults.fault import ALL, KINDS, FaultConfig, check_cameras
from hrc_env.perception.network import RUNTIMES, resolve_runtime
from hrc_env.perception.weights import find_weights

CONTENT = json.loads(PACKAGED.read_text())


def written(tmp_path: Path, **changes: object) -> Path:
    """Return the path of a copy of the package's file with other entries; None: left out."""
    path = tmp_path / "other.json"
    content = {name: value for name, value in (CONTENT | changes).items() if value is not None}
    path.write_text(json.dumps(content))
    return path


def tables_with(name: str, value: float) -> dict[str, object]:
    """Return the package's tables with the last number of one replaced."""
    array = np.array(CONTENT["tables"][name], float)
    array[(-1,) * array.ndim] = value
    return CONTENT["tables"] | {name: array.tolist()}


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"format": None}, "is not a calibration"),
        ({"format": FORMAT + "s"}, "is not a calibration"),
        ({"version": None}, "version None"),
        ({"version": VERSION + 1}, f"version {VERSION + 1}"),
        ({"version": VERSION - 1}, f"version {VERSION - 1}"),
        ({"tables": None}, "must have the tables"),
        ({"tables": list(SHAPES)}, "must have the tables"),
        ({"tables": {k: v for k, v in CONTENT["tables"].items() if k != "tail"}}, "missing: tail"),
        ({"tables": CONTENT["tables"] | {"more": 1.0}}, "missing: none; unknown: more"),
        ({"tables": CONTENT["tables"] | {"limb": CONTENT["tables"]["limb"][1:]}}, "'limb' must"),
        ({"tables": CONTENT["tables"] | {"limb": "none"}}, "table 'limb' must hold finite"),
        ({"tables": CONTENT["tables"] | {"common": [0.5]}}, "table 'common' must hold finite"),
    ],
)
def test_a_file_in_which_one_thing_is_wrong_is_refused(tmp_path, changes, said):
    assert read_calibration(written(tmp_path)).sigma.shape == SHAPES["sigma"]
    with pytest.raises(ConfigError, match=said):
        read_calibration(written(tmp_path, **changes))


BOUNDS = {
    **dict.fromkeys(("size", "slow_s", "slow_m", "swap_s", "miss_s", "sigma"), (1e-9, 1e9)),
    **dict.fromkeys(("common", "shares", "confidence", "swap_share", "miss_share"), (0.0, 1.0)),
    **dict.fromkeys(("limb", "space_limb", "follows"), (-1.0, 1.0)),
    "tail": (0.0, 3.0), "near_m": (0.0, 1e9), "novel": (0.0, 1e9), "offset_m": (-1e9, 1e9),
    "bias": (-1e9, 1e9),
}  # fmt: skip
WRONG = [
    (name, value)
    for name, (low, high) in BOUNDS.items()
    for value in (low - 1e-6, high + 1e-6, np.nan, np.inf)
    if not np.isfinite(value) or -1e8 < value < 1e8
]


@pytest.mark.parametrize("name", BOUNDS)
def test_numbers_at_the_bounds_of_a_table_are_taken(tmp_path, name):
    for value in BOUNDS[name]:
        known = read_calibration(written(tmp_path, tables=tables_with(name, value)))
        assert getattr(known, name).ravel()[-1] == value


@pytest.mark.parametrize(("name", "value"), WRONG)
def test_one_number_beyond_the_bounds_of_its_table_is_enough(tmp_path, name, value):
    with pytest.raises(ConfigError, match=f"table '{name}' must hold"):
        read_calibration(written(tmp_path, tables=tables_with(name, value)))


@pytest.mark.parametrize("kind", KINDS)
def test_amounts_of_faults_end_where_their_kind_says(kind):
    """None stands for the usual one."""
    low, high = KINDS[kind].bounds
    for amount in (low, high, None):
        FaultConfig(kind, ("all",), amount)
    for amount in (np.nextafter(low, -np.inf), np.nextafter(high, np.inf), np.nan):
        with pytest.raises(ConfigError, match="amount must be from"):
            FaultConfig(kind, ("all",), float(amount))


@pytest.mark.parametrize(
    "taken",
    [{"cameras": (0,)}, {"cameras": ("left", np.int64(1))}, {"start_s": 0.0, "end_s": 1e-9},
     {"amount": 1}, {"amount": 0}],
)  # fmt: skip
def test_a_fault_in_which_nothing_is_wrong_is_taken(taken):
    assert FaultConfig(**({"kind": "late", "cameras": ("all",)} | taken)).kind == "late"


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"kind": "later"}, "Did you mean 'late'"),
        ({"cameras": ()}, "must name its cameras"),
        ({"cameras": ["left"]}, "must name its cameras"),
        ({"cameras": "left"}, "must name its cameras"),
        ({"cameras": ("left", True)}, "must name its cameras"),
        ({"cameras": ("left", 0.5)}, "must name its cameras"),
        ({"cameras": (None, "left")}, "must name its cameras"),
        ({"amount": "0.2"}, "amount must be from 0 to 1 s"),
        ({"amount": True}, "amount must be from 0 to 1 s"),
        ({"start_s": -1e-9}, "must begin at 0 s or later"),
        ({"start_s": 1.0, "end_s": 1.0}, "must begin at 0 s or later"),
        ({"start_s": 1.0, "end_s": 0.5}, "must begin at 0 s or later"),
        ({"start_s": np.nan}, "must begin at 0 s or later"),
        ({"end_s": np.nan}, "must begin at 0 s or later"),
    ],
)
def test_a_fault_in_which_one_thing_is_wrong_is_refused(wrong, said):
    with pytest.raises(ConfigError, match=said):
        FaultConfig(**({"kind": "late", "cameras": ("all",)} | wrong))


@pytest.mark.parametrize(
    ("camera", "taken"),
    [("left", True), ("right", True), (0, True), (1, True), (ALL, True), ("middle", False),
     (-1, False), (2, False)],
)  # fmt: skip
def test_a_fault_is_of_cameras_that_are_in_use(camera, taken):
    faults = (FaultConfig("lost", ("left",)), FaultConfig("late", ("left", camera)))
    if taken:
        check_cameras(faults, ("left", "right"))
        return
    with pytest.raises(ConfigError, match=r"of fault 'late'"):
        check_cameras(faults, ("left", "right"))


@pytest.mark.parametrize("dt_s", [0.0, -0.04, np.nan])
def test_a_time_between_images_that_is_none_is_refused(dt_s):
    with pytest.raises(ConfigError, match="time between images must be positive"):
        make_state(1, 2, 1, dt_s, EmulatorConfig())
    assert make_state(1, 2, 1, 1e-9, EmulatorConfig()).dt_s == 1e-9


@pytest.mark.parametrize(
    ("joint", "confidence", "taken"),
    [(0, 0.0, True), (14, 1.0, True), (0, -1e-9, False), (14, 1.0 + 1e-9, False),
     (7, np.nan, False)],
)  # fmt: skip
def test_confidences_are_shares(joint, confidence, taken):
    found = np.full((15, 3), 0.5)
    found[joint, 2] = confidence
    crop, window = np.zeros((256, 256, 3), np.uint8), Roi((9.0, 9.0), 9.0, 0.0)
    if taken:
        assert call_detector(lambda crop: found, crop, window)[joint, 2] == confidence
        return
    with pytest.raises(ConfigError, match=r"confidences must be in \[0, 1\]"):
        call_detector(lambda crop: found, crop, window)


@pytest.mark.parametrize("shape", [(15, 2), (14, 3), (1, 15, 3)])
def test_findings_of_another_shape_are_refused(shape):
    crop, window = np.zeros((256, 256, 3), np.uint8), Roi((9.0, 9.0), 9.0, 0.0)
    with pytest.raises(ConfigError, match=r"keypoints must have shape \(15, 3\)"):
        call_detector(lambda crop: np.full(shape, 0.5), crop, window)


def test_nobody_found_is_no_mistake():
    crop, window = np.zeros((256, 256, 3), np.uint8), Roi((9.0, 9.0), 9.0, 0.0)
    assert call_detector(lambda crop: None, crop, window) is None


def test_openvino_is_wanted_where_it_is_chosen_only(monkeypatch):
    monkeypatch.setattr(vino, "is_installed", lambda: False)
    assert resolve_runtime("auto") == resolve_runtime("litert") == "litert"
    with pytest.raises(ConfigError, match="needs OpenVINO, which is not installed"):
        resolve_runtime("openvino")
    monkeypatch.setattr(vino, "is_installed", lambda: True)
    assert resolve_runtime("openvino") == "openvino"
    with pytest.raises(ConfigError, match="Unknown runtime"):
        resolve_runtime("tensorrt")
    assert set(RUNTIMES) == {"auto", "litert", "openvino"}


def test_weights_that_there_are_not_are_refused():
    with pytest.raises(ConfigError, match="Unknown weights 'fool'"):
        find_weights("fool")
