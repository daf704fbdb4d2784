"""What perception is worth to a policy of one's own: no learning, only what is asked."""

import json
import subprocess
import sys
from pathlib import Path

POLICY = '''
import numpy as np


class Timid:
    """Go to the goal at a speed that falls with the estimated separation."""

    def __init__(self, info):
        self.layout = info.layout

    def act(self, observation):
        def term(name):
            part = self.layout.slices[name]
            return observation[..., part] * self.layout.scale[part]

        way, gap_m = term("goal_from_tool"), term("worker_separation")
        speed = np.clip(gap_m.min(axis=-1, keepdims=True), 0.0, 1.0)
        return np.clip(4.0 * speed * way, -1.0, 1.0).astype(np.float32)


def make(info):
    return Timid(info)
'''
Path("timid.py").write_text(POLICY)
words = ["--robots", "timid:make", "--control", "tool", "--estimator", "triangulation"]
command = [sys.executable, "-m", "hrc_env", "experiment", "impact", "--quick", "--seeds", "3"]
done = subprocess.run(
    [*command, *words, "--out", "impact"], capture_output=True, text=True, check=False
)
print(done.stdout, done.stderr)
assert done.returncode == 0

metrics = json.loads(Path("impact/results.json").read_text())["metrics"]
assert metrics["timid-make.truth.goals_per_min"]["value"] > 0
assert not any(name.startswith(("ppo.", "scripted.")) for name in metrics)  # nothing else acts
assert not list(Path("impact/parts").glob("ppo*"))  # and nothing learns
report = Path("impact/report.md").read_text()
tables = report.count("\n|---")
assert report.count("*Quick run, 3 seeds of 4 s: too few") >= tables + 1  # each says it is quick
assert "●" not in report  # and marks nothing

price = [sys.executable, "-m", "hrc_env", "experiment", "price", "--robots", "timid:mke"]
done = subprocess.run(price, capture_output=True, text=True, check=False)
assert done.returncode == 2
assert "There is no agent 'timid:mke'" in done.stderr
