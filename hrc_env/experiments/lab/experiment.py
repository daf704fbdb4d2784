"""The laboratory study, which compares one camera with four cameras on films of six motions."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from hrc_env.config import HRCConfig
from hrc_env.core.results import Metric
from hrc_env.core.typing import Bools, Floats, Ints
from hrc_env.evaluation.counts import Bins
from hrc_env.evaluation.intervals import (
    MIN_SEEDS,
    adjust_metrics,
    compare_paired,
    estimate_clustered_share,
    estimate_quantile,
    make_binned_quantile,
)
from hrc_env.experiments.cache import Part, PartCache, PartProgress
from hrc_env.experiments.lab.declaration import ALL, ERRORS, ESTIMATORS, SINGLE
from hrc_env.experiments.lab.motions import MOTIONS, play
from hrc_env.experiments.lab.report import WARM_UP, make_report
from hrc_env.experiments.lab.sides import MISSED_SHARE, find_averted_joints, find_missed_joints
from hrc_env.experiments.recording import Recording, record, replay
from hrc_env.experiments.report import Metrics, Report, Table, describe_quick_run
from hrc_env.experiments.rigs import CAMERA_LABELS, CHOICES, DT_S, MULTI
from hrc_env.experiments.runner import check_at_least_one, is_as_short, override
from hrc_env.perception.detector import DetectorConfig
from hrc_env.scene.build import Scene, SceneConfig, build
from hrc_env.scene.rigs import RIGS
from hrc_env.worker.body import load_body, worker_names

RIG = "lab_gopro"
"""Name of the camera rig."""
CROPS = "particle"
"""Name of the estimator that the crops follow."""
QUANTILES = {"median": 0.5, "p95": 0.95}
"""Quantiles of errors by name."""
ERRORS_M = Bins(np.geomspace(1e-4, 30.0, 2500))
"""Bins for position errors [m], in steps of half a percent, from which differences are computed."""
FIRST_SEED = 200
"""Seed of the first film of each motion."""
Film = Mapping[str, Any]
Films = Mapping[tuple[str, int], Film]
"""Films by motion and seed."""


@dataclass(frozen=True, slots=True)
class Lab:
    """The laboratory study and its settings."""

    name = "lab"
    depends = ("env", "tracker", "emulator", "detector", "motion")
    n_seeds: int = 8
    """Number of films per motion."""
    max_frames: int = 250
    """Maximum number of frames in a film."""
    folded_network: str = "full"
    """Landmark network for folded postures; "heavy" must first be fetched with `python -m hrc_env
    setup --networks heavy`."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` if a setting is invalid."""
        check_at_least_one(self, "n_seeds")
        DetectorConfig(folded_network=self.folded_network)

    @property
    def seeds(self) -> list[int]:
        """Seeds, one per film of a motion."""
        return [FIRST_SEED + k for k in range(self.n_seeds)]

    @property
    def n_parts(self) -> int:
        """Number of films, which are the parts of the study."""
        return self.n_seeds * len(MOTIONS)

    @property
    def quick_note(self) -> str:
        """The warning on tables and figures of a quick run; "" for other runs."""
        is_short = is_as_short(self, QUICK) or self.n_seeds < MIN_SEEDS
        return describe_quick_run(self.n_seeds, self.max_frames * DT_S) if is_short else ""

    def settings(self) -> dict[str, Any]:
        """Return the settings on which all numbers depend."""
        return {**asdict(self), "rig": RIG, "estimators": ESTIMATORS, "crops": CROPS}

    def play(self, cache: PartCache) -> Films:
        """Record all films and return their errors."""
        keys = [(motion, seed) for seed in self.seeds for motion in MOTIONS]
        parts = [
            Part(f"{motion}.{seed}", partial(measure_film, self, motion, seed))
            for motion, seed in keys
        ]
        return dict(zip(keys, cache.make_parts(parts, one_core=True), strict=True))

    def metrics(self, played: Films) -> dict[str, Metric]:
        """Return all metrics by name."""
        return compute_metrics(played)

    def shown_tables(self) -> tuple[Table, ...]:
        """Return the table for the documentation."""
        return (ERRORS,)

    def report(self, played: Films, metrics: Metrics, figures: Path) -> Report:
        """Draw the figure and return the report."""
        take = partial(record_film, self, seed=self.seeds[0], tick=lambda share: None)
        return make_report(figures, take, metrics)


QUICK = Lab(n_seeds=2, max_frames=100)
"""The quick form of the study, with fewer and shorter films."""


def make_experiment(
    quick: bool = False, seeds: int | None = None, folded_network: str = "full"
) -> Lab:
    """Return the experiment for the options of the command line."""
    return override(QUICK if quick else Lab(), n_seeds=seeds, folded_network=folded_network)


class Laboratory(NamedTuple):
    """The scene of the study, with the configuration of the environment."""

    scene: Scene
    config: HRCConfig


def make_laboratory(seed: int, folded_network: str = "full") -> Laboratory:
    """Return the scene with the paper's four cameras; the seed selects one of the body models."""
    names = worker_names()
    config = HRCConfig(
        worker=names[seed % len(names)],
        detector=DetectorConfig(folded_network=folded_network),
        scene=SceneConfig(cameras=RIGS[RIG]),
    )
    return Laboratory(build(config.scene, "lab", 1, config.worker), config)


def record_film(config: Lab, motion: str, seed: int, tick: PartProgress) -> Recording:
    """Record one film of one motion."""
    scene, settings = make_laboratory(seed, config.folded_network)
    motions = play(scene, motion, seed, config.max_frames, settings.ctrl_dt)
    return record(scene, motions, settings, CROPS, seed, tick)


def measure_film(config: Lab, motion: str, seed: int, tick: PartProgress) -> dict[str, Any]:
    """Record one film and return the errors of all estimators on it, after the warm-up."""
    recording = record_film(config, motion, seed, lambda share: tick(0.8 * share))
    body = recording.scene.bodies[0]
    truth, errors = recording.joints_world[WARM_UP:], {}
    for name in ESTIMATORS:
        for column, cameras in CHOICES.items():
            estimate = replay(recording, name, cameras, WARM_UP, seed).mean_world
            off_m = np.linalg.norm(estimate[WARM_UP:, 0] - truth, axis=-1)
            errors[f"{name}.{column}"] = np.round(off_m, 4).tolist()
            tick(0.2 / len(ESTIMATORS) / len(CHOICES))
    return {
        "body": body,
        "stature_m": float(load_body(body).stature_m),
        "errors_m": errors,
        "missed": find_missed_joints(recording)[WARM_UP:].astype(int).tolist(),
        "away": find_averted_joints(recording)[WARM_UP:].astype(int).tolist(),
    }


def compute_metrics(played: Films) -> dict[str, Metric]:
    """Return all metrics of results.json by name."""
    metrics: dict[str, Metric] = {}
    for motion in (*MOTIONS, ALL):
        films = [each for (name, _), each in played.items() if motion in (name, ALL)]
        for key in (f"{name}.{column}" for name in ESTIMATORS for column in CAMERA_LABELS):
            errors = [_read_errors_m(film, key).ravel() for film in films]
            for word, q in QUANTILES.items():
                metrics[f"error_m.{key}.{motion}.{word}"] = estimate_quantile(errors, q, "m")
        metrics |= _measure_misses(films, motion)
    for column in CAMERA_LABELS:
        ours = _count_errors(played, f"{ESTIMATORS[0]}.{column}")
        for other, (word, q) in product(ESTIMATORS[1:], QUANTILES.items()):
            counts = [*ours, *_count_errors(played, f"{other}.{column}")]
            both = make_binned_quantile(ERRORS_M, counts, q)
            metrics |= compare_paired(f"error_m.{other}.{column}.{word}", both, len(ours), "m", 400)
    return metrics | adjust_metrics(metrics)


def _count_errors(played: Films, key: str) -> Ints:
    """Return histograms (n, bins) of the errors of an estimate, one per film."""
    errors = (_read_errors_m(film, key).ravel() for film in played.values())
    return np.concatenate([ERRORS_M.count(each[None]) for each in errors])


def _measure_misses(films: Sequence[Film], motion: str) -> dict[str, Metric]:
    """Return the fractions of joints missed, missed on the averted side, and recovered.

    A joint that one camera missed is recovered if all cameras together locate it.
    """
    metrics = {}
    counted = np.array([_count_joints(film) for film in films]).T
    for column, (n, missed, away, far, back) in zip(SINGLE, counted, strict=True):
        for name, above, below in (
            ("missed", missed, n), ("missed_far", far, away), ("recovered_far", back, far),
        ):  # fmt: skip
            metrics[f"{name}.{column}.{motion}"] = estimate_clustered_share(above, below)
    known = [_find_known(film) for film in films]
    lost, total = [(~each).sum() for each in known], [each.size for each in known]
    return metrics | {f"missed.multi.{motion}": estimate_clustered_share(lost, total)}


def _count_joints(film: Film) -> Floats:
    """Return counts of joints (5, C) for each camera.

    The five rows count all joints, missed joints, joints on the averted side, missed joints on the
    averted side, and those of the latter that all cameras together locate.
    """
    missed, away = (np.asarray(film[name], bool) for name in ("missed", "away"))
    far = missed & away
    marked = np.ones_like(far), missed, away, far, far & _find_known(film)[:, None]
    return np.sum(marked, axis=(1, 3), dtype=float)


def _read_errors_m(film: Film, key: str) -> Floats:
    """Return the distances (T, J) of an estimate from the truth [m]."""
    return np.asarray(film["errors_m"][key], float)


def _find_known(film: Film) -> Bools:
    """Return a mask (T, J) of the joints that all cameras together locate."""
    return _read_errors_m(film, f"{ESTIMATORS[0]}.{MULTI}") <= MISSED_SHARE * film["stature_m"]
