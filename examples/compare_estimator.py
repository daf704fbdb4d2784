"""Compare an estimator of your own with two of the package, on the same detections and in use.

python examples/compare_estimator.py --file examples/bring_your_own/estimator.py
"""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

import hrc_env
from hrc_env import PerceptionSetup, Row, Study, columns

NAMES = ["dlt_kalman", "triangulation", "particle"]
INSIDE = 7.815  # 95 % of a chi-squared variable with 3 degrees of freedom are smaller


def record(estimator, file, options):
    """Return episodes with estimated and true joints; the seeds are always the same."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "hrc_env", "--import", file, "record", "HRCReach-v0"]
        command += ["--people", "unaware", "--poses", "--keypoints", "--estimator", estimator]
        subprocess.run([*command, "--folder", f"{folder}/episodes", *options], check=True)
        return list(hrc_env.load_episodes(f"{folder}/episodes"))


def score(episode):
    """Return mean error [mm], coverage [%] and tracked time [%] of an episode with one worker."""
    tracked = episode.belief["tracked"]
    cov_world = episode.belief["joints_cov_world"][tracked]
    error = (episode.belief["joints_world"] - episode.truth["joints_world"])[tracked]
    distance = np.einsum("...i,...ij,...j", error, np.linalg.inv(cov_world), error)
    error_mm = 1e3 * np.linalg.norm(error, axis=-1)
    return error_mm.mean(), 1e2 * (distance < INSIDE).mean(), 1e2 * tracked.mean()


def show(metric):
    """Return a number with its 95 % interval."""
    return f"{metric.value:.1f} ({metric.low:.1f} to {metric.high:.1f})"


def compare_accuracy(names, file, options):
    """Print the scores of each estimator, and the differences between the first and the last."""
    recorded = {name: record(name, file, options) for name in names}
    for episodes in zip(*recorded.values(), strict=True):  # all received the same detections
        for episode in episodes:
            np.testing.assert_array_equal(episode.keypoints.px, episodes[0].keypoints.px)
    scores = {name: np.transpose([score(each) for each in recorded[name]]) for name in names}
    print(f"\n{'':14} {'error [mm]':>22} {'coverage [%]':>22} {'tracked [%]':>12}")
    for name in names:
        error, coverage, tracked = map(hrc_env.estimate_mean, scores[name])
        print(f"{name:14} {show(error):>22} {show(coverage):>22} {tracked.value:12.1f}")
    pairs = zip(scores[names[0]][:2], scores[names[-1]][:2], strict=True)
    error, coverage = (hrc_env.compare_means(*pair).difference for pair in pairs)
    print(f"{'first - last':14} {show(error):>22} {show(coverage):>22}", end="\n\n")


def compare_safety(names, n_episodes, folder):
    """Play the same episodes with each estimator under a shield, and print the report."""
    env = {"people": "unaware", "shield": "qp"}
    setups = {name: PerceptionSetup(estimator=name) for name in names}
    study = Study(
        name="estimators",
        title="Estimators in use",
        about="A scripted robot under the shield `qp`, beside people who do not avoid it.",
        depends=("env", "tracker", "emulator", "motion", "shield", "agents"),
        first_seed=30_000_000,
        rows={name: Row(name, n_episodes, setup=setups[name], env=env) for name in names},
        columns=(
            columns.per_minute("goals_reached", "goals [1/min]"),
            columns.mean("cost", "cost [control steps]"),
            columns.rate("contacts_towards", "contacts towards [in 1,000]", per="1000 episodes"),
        ),
    )
    hrc_env.run_experiment(study, folder)
    print((folder / "report.md").read_text())


if __name__ == "__main__":
    parser = argparse.ArgumentParser(epilog="Further options are passed to hrc_env record.")
    parser.add_argument("--file", default="examples/bring_your_own/estimator.py")
    parser.add_argument("--estimators", nargs="+", default=NAMES)
    parser.add_argument("--episodes", default="40", help="number of recorded episodes")
    parser.add_argument("--safety-episodes", type=int, default=200)
    parser.add_argument("--out", type=Path, default=Path("out/compare_estimator"))
    args, options = parser.parse_known_args()
    hrc_env.import_files(args.file)
    compare_accuracy(args.estimators, args.file, ["--episodes", args.episodes, *options])
    # each comparison has a folder, in which it continues if it was stopped
    folder = args.out / "-".join([*args.estimators, str(args.safety_episodes)])
    compare_safety(args.estimators, args.safety_episodes, folder)
