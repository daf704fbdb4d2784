"""Compare an estimator of your own with two of the package, on the same detections and in use.

python -m hrc_env record HRCReach-v0 --people unaware --episodes 40 --poses --keypoints \
    --folder out/detections
python examples/compare_estimator.py out/detections
"""

import argparse
from pathlib import Path

import numpy as np

import hrc_env
from hrc_env import PerceptionSetup, Row, Study, columns

NAMES = ["dlt_kalman", "triangulation", "particle"]
INSIDE = 7.815  # 95 % of a chi-squared variable with 3 degrees of freedom are smaller


def track(estimator, detections):
    """Return the mean error [mm], coverage [%] and tracked time [%] of each episode, (3, n)."""
    episodes, dt_s = list(detections), detections.metadata["ctrl_dt_s"]
    P = np.array([camera["P"] for camera in detections.metadata["cameras"]])
    made = hrc_env.make_estimator(estimator, P, dt_s)
    state = made.init(len(episodes), episodes[0].keypoints.px.shape[2])
    rngs = [np.random.default_rng(episode.seed) for episode in episodes]
    made.reset(state, np.arange(len(episodes)), rngs)
    scores = []
    for t in range(1 + len(episodes[0])):
        px, confidence, sigma_px = (
            np.stack([getattr(episode.keypoints, name)[t] for episode in episodes])
            for name in ("px", "confidence", "sigma_px")
        )
        if t:
            made.predict(state, dt_s, rngs)
        made.update(state, hrc_env.Keypoints(px, confidence, sigma_px), rngs)
        estimate = made.estimate(state)
        error = estimate.mean_world - [episode.truth["joints_world"][t] for episode in episodes]
        distance = np.einsum("...i,...ij,...j", error, np.linalg.inv(estimate.cov_world), error)
        score = np.stack([1e3 * np.linalg.norm(error, axis=-1), 1e2 * (distance < INSIDE)])
        tracked = np.where(estimate.tracked, 1.0, np.nan)[..., None]
        scores.append([*(score * tracked).mean((-2, -1)), 1e2 * estimate.tracked.mean(-1)])
    return np.nanmean(scores, axis=0)


def show(metric):
    """Return a number with its 95 % interval."""
    return f"{metric.value:.1f} ({metric.low:.1f} to {metric.high:.1f})"


def print_accuracy(names, detections):
    """Print the scores of each estimator, and the differences between the first and the last."""
    scores = {name: track(name, detections) for name in names}
    print(f"{'':14} {'error [mm]':>22} {'coverage [%]':>22} {'tracked [%]':>12}")
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
    parser = argparse.ArgumentParser()
    parser.add_argument("detections", type=Path, help="folder that `record` wrote")
    parser.add_argument("--file", default="examples/bring_your_own/estimator.py")
    parser.add_argument("--estimators", nargs="+", default=NAMES)
    parser.add_argument("--episodes", type=int, default=200, help="episodes of the safety study")
    parser.add_argument("--out", type=Path, default=Path("out/compare_estimator"))
    args = parser.parse_args()
    hrc_env.import_files(args.file)
    print_accuracy(args.estimators, hrc_env.load_episodes(args.detections))
    compare_safety(args.estimators, args.episodes, args.out)
