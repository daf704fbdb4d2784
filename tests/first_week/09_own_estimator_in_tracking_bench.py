"""An estimator of one's own in the tracking bench, on the sequences that one asks for."""

import json
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
ESTIMATOR = '''
import hrc_env


def slow_to_judge(P, ctrl_dt, config):
    """Triangulation of the package, under a name of one's own."""
    return hrc_env.make_estimator("triangulation", P, ctrl_dt, config)


hrc_env.register_estimator(hrc_env.EstimatorSpec("mine", slow_to_judge, needs_pairs=True))
'''

if not (ROOT / "benchmarks").is_dir():
    print("Skipped: the benches are not in the wheel; they run in a clone of the repository.")
    sys.exit(0)

out, file = Path("tracking").resolve(), Path("mine.py").resolve()
file.write_text(ESTIMATOR)
command = [sys.executable, "-m", "benchmarks", "--import", str(file), "tracking", "--quick"]
asked = ["--estimators", "mine", "--sequences", "lab.clean", "env.two_cameras", "--seeds", "2"]
done = subprocess.run(
    [*command, *asked, "--engine", "serial", "--out", str(out)],
    cwd=ROOT, capture_output=True, text=True, check=False,
)  # fmt: skip
print(done.stdout, done.stderr)
assert done.returncode == 0

metrics = json.loads((out / "results.json").read_text())["metrics"]
rows = {name.rsplit(".", 1)[0] for name in metrics if name.startswith("rmse_m.")}
assert rows == {"rmse_m.lab.clean", "rmse_m.env.two_cameras"}
for row in rows:
    assert metrics[f"{row}.mine"]["value"] > metrics[f"{row}.particle"]["value"]
assert "update_us.mine.1" in metrics

done = subprocess.run(
    [*command, "--estimators", "mnie"], cwd=ROOT, capture_output=True, text=True, check=False
)
assert done.returncode == 2
assert "Did you mean 'mine'?" in " ".join(done.stderr.split())
