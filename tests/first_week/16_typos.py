"""Names that are nearly right are answered with the right ones, wherever a name is given."""

import subprocess
import sys

import gymnasium

import hrc_env


def make(**arguments):
    return gymnasium.make("HRCReach-v0", **arguments)


def make_vec(**arguments):
    return gymnasium.make_vec("HRCReach-v0", num_envs=2, **arguments)


CALLS = {  # what is meant, and calls that nearly say it
    "perception": [
        lambda each=each: each(perceptoin="truth") for each in (make, make_vec, hrc_env.HRCEnv)
    ],
    "truth": [lambda: make(perception="thruth"), lambda: make_vec(perception="thruth")],
    "estimator": [lambda: hrc_env.HRCVecEnv(2, estimater="kalman")],
    "stagger": [lambda: hrc_env.HRCVecEnv(2, stager=True)],
    "num_threads": [lambda: make_vec(perception="truth", num_thread=1)],
    "safety/*": [lambda: hrc_env.HRCVecEnv(2, perception="none", infos=("safty/*",))],
    "proximity": [lambda: hrc_env.RewardConfig(proximty=1.0)],
    "reward.proximity": [lambda: make(config={"reward": {"proximty": 1.0}})],
    "margin_m": [lambda: hrc_env.ShieldConfig(kind="qp", margins_m=0.1)],
    "amount": [lambda: hrc_env.FaultConfig(kind="late", amuont=0.2)],
    "hfov_deg": [lambda: hrc_env.CameraConfig("a", (1.0, 1.0, 2.0), hfov=60.0)],
    "lost_after_s": [lambda: hrc_env.TrackerConfig(lost_after=0.5)],
    "needs_pairs": [lambda: hrc_env.EstimatorSpec("a", print, need_pairs=True)],
    "n_workers": [lambda: hrc_env.evaluate(print, 2, n_worker=1)],
    "HRCReach-v0": [lambda: hrc_env.find_task("HRCReech-v0")],
}
for right, calls in CALLS.items():
    for call in calls:
        try:
            call()
        except hrc_env.ConfigError as error:
            if f"Did you mean {right!r}" not in str(error):
                raise
            print(str(error).partition(" Valid")[0])
        else:
            raise AssertionError(right)

done = subprocess.run(
    [sys.executable, "-m", "hrc_env", "play", "--perceptoin", "truth"],
    capture_output=True, text=True, check=False,
)  # fmt: skip
assert done.returncode == 2
assert "--perception" in done.stdout + done.stderr
