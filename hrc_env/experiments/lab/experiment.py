"""The experiment as a whole: every motion filmed by four cameras, one camera against all."""

from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from hrc_env.config import HRCConfig
from hrc_env.core.errors import ConfigError
from hrc_env.core.results import Metric, write_results
from hrc_env.experiments.lab.figures import draw_figures
from hrc_env.experiments.lab.metrics import Parts, metrics_of
from hrc_env.experiments.lab.motions import MOTIONS, body_of, play
from hrc_env.experiments.lab.report import report
from hrc_env.experiments.lab.sides import missed_by_camera, turned_away
from hrc_env.experiments.study.fingerprint import fingerprint_of
from hrc_env.experiments.study.folder import claim
from hrc_env.experiments.study.recording import Recording, record, replay
from hrc_env.experiments.study.shelf import Say, Shelf, Tick
from hrc_env.perception.detector import DetectorConfig
from hrc_env.scene.build import Scene, SceneConfig, build
from hrc_env.scene.rigs import RIGS
from hrc_env.worker.body import load_body

RIG = "lab_gopro"
CROPS = "particle"
"""The estimator that the crops follow."""
ESTIMATORS = ("particle", "paper", "kalman")
"""Who is given the films."""
CAMERAS: tuple[tuple[int, ...], ...] = ((0,), (1,), (2,), (3,), (0, 1, 2, 3))
FIRST_SEED = 200
WARM_UP = 13
"""In the first half second everybody has all cameras, and is not judged [frames]."""


@dataclass(frozen=True, slots=True)
class LabConfig:
    """How much is run."""

    n_seeds: int = 10
    """Films of every motion."""
    max_frames: int = 250
    """No film is longer."""
    folded: str = "full"
    """The landmark network for workers who are folded up; "heavy" is fetched once with
    `python -m hrc_env setup --networks heavy`."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` for what cannot work."""
        if self.n_seeds < 1:
            raise ConfigError(f"--seeds must be at least 1, got {self.n_seeds}.")
        if self.max_frames < 2 * WARM_UP:
            raise ConfigError(f"Films need at least {2 * WARM_UP} frames, got {self.max_frames}.")
        DetectorConfig(folded=self.folded)


QUICK = LabConfig(n_seeds=2, max_frames=100)
"""Every number, from fewer and shorter films."""


def config_for(quick: bool, seeds: int | None, folded: str = "full") -> LabConfig:
    """The settings that the command line asks for."""
    config = replace(QUICK if quick else LabConfig(), folded=folded)
    return config if seeds is None else replace(config, n_seeds=seeds)


def run(config: LabConfig, out: Path, say: Say, overwrite: bool = False) -> dict[str, Metric]:
    """Run what is not yet there; writes results.json, figures and report.html into `out`."""
    claim(out, "lab", overwrite)
    seeds = [FIRST_SEED + k for k in range(config.n_seeds)]
    settings = {**asdict(config), "rig": RIG, "estimators": ESTIMATORS, "crops": CROPS}
    shelf = Shelf(
        out / "parts", fingerprint_of(settings, __name__), len(seeds) * len(MOTIONS) + 1, say
    )
    films = {
        (motion, seed): shelf.part(f"{motion}.{seed}", partial(film, config, motion, seed))
        for seed in seeds
        for motion in MOTIONS
    }
    metrics = metrics_of(Parts(films, ESTIMATORS))
    write_results(out / "results.json", {"experiment": "lab", **settings}, seeds, metrics)
    shelf.say(0.0, "figures")
    draw_figures(out / "figures", partial(taken, config), WARM_UP, seeds, metrics)
    report(out, config, seeds, metrics)
    return metrics


def laboratory(seed: int, folded: str = "full") -> tuple[Scene, HRCConfig]:
    """The room with the paper's four cameras, and whose body is in it."""
    config = HRCConfig(
        worker=body_of(seed),
        detector=DetectorConfig(folded=folded),
        scene=SceneConfig(cameras=RIGS[RIG]),
    )
    return build(config.scene, "lab", 1, config.worker), config


def taken(config: LabConfig, motion: str, seed: int, tick: Tick) -> Recording:
    """One film of one motion."""
    scene, settings = laboratory(seed, config.folded)
    motions = play(scene, motion, seed, config.max_frames, settings.ctrl_dt)
    return record(scene, motions, settings, CROPS, seed, tick)


def film(config: LabConfig, motion: str, seed: int, tick: Tick) -> dict[str, Any]:
    """What everybody made of one film, after the warm-up."""
    recording = taken(config, motion, seed, lambda share: tick(0.8 * share))
    _, settings = laboratory(seed, config.folded)
    truth = recording.joints_world[WARM_UP:]
    errors: dict[str, Any] = {}
    for name in ESTIMATORS:
        for cameras in CAMERAS:
            said = replay(recording, name, cameras, WARM_UP, settings, seed).mean_world[WARM_UP:]
            off_m = np.linalg.norm(said - truth, axis=-1)
            errors[f"{name}.{label(cameras)}"] = np.round(off_m, 4).tolist()
            tick(0.2 / len(ESTIMATORS) / len(CAMERAS))
    stature_m = load_body(recording.scene.bodies[0]).stature_m
    frames = range(WARM_UP, len(recording.joints_world))
    cameras = recording.scene.cameras
    missed = [
        [
            missed_by_camera(
                recording.keypoints[t], c, camera, recording.joints_world[t], stature_m
            )
            for c, camera in enumerate(cameras)
        ]
        for t in frames
    ]
    away = [
        [turned_away(recording.joints_world[t], camera.eye_world) for camera in cameras]
        for t in frames
    ]
    return {
        "body": recording.scene.bodies[0],
        "stature_m": stature_m,
        "errors_m": errors,
        "missed": np.array(missed, int).tolist(),
        "away": np.array(away, int).tolist(),
    }


def label(cameras: tuple[int, ...]) -> str:
    """`camera_2`, or `multi` for all of them."""
    if len(cameras) == 1:
        return f"camera_{cameras[0] + 1}"
    return "multi"
