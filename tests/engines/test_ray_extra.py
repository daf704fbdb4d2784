"""The extra `ray` is resolved from nothing, beside all others and beside RLlib's own extra."""

import json
import subprocess
import venv

import pytest
from commands import ROOT

pytestmark = pytest.mark.long


def canonical(name: str) -> str:
    """The name of a package as indices have it."""
    return name.lower().replace("_", "-")


@pytest.mark.parametrize(
    "asked",
    [(f"{ROOT}[ray,view,video,minari,openvino]",), (f"{ROOT}[ray]", "ray[rllib]")],
    ids=["beside every other extra", "beside RLlib's own"],
)
def test_the_extra_is_resolved_from_nothing(asked, tmp_path):
    venv.create(tmp_path / "empty", with_pip=True)
    python, report = tmp_path / "empty" / "bin" / "python", tmp_path / "report.json"
    words = [python, "-m", "pip", "install", "--quiet", "--dry-run", "--report", report, *asked]
    found = subprocess.run(map(str, words), capture_output=True, text=True, check=False)
    assert found.returncode == 0, found.stderr
    chosen = {
        canonical(each["metadata"]["name"]): each["metadata"]["version"]
        for each in json.loads(report.read_text())["install"]
    }
    assert chosen["ray"].startswith("2.60.")
    assert {"gymnasium", "torch", "stable-baselines3", "dm-tree", "mujoco"} <= {*chosen}
