"""The paper's laboratory, again: every motion filmed by four cameras, one camera against all."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from hrc_env.config import HRCConfig
from hrc_env.core.results import Metric
from hrc_env.core.typing import Bools, Floats
from hrc_env.evaluation.intervals import compare_paired, make_quantile, estimate_quantile, estimate_ratio
from hrc_env.experiments.cache import Part, PartCache, PartProgress
from hrc_env.experiments.lab.declaration import ALL, ERRORS, ESTIMATORS, SINGLE
from hrc_env.experiments.lab.motions import MOTIONS, play
from hrc_env.experiments.lab.report import WARM_UP, report
from hrc_env.experiments.lab.sides import MISSED_SHARE, away_from_cameras, missed_by_camera
from hrc_env.experiments.recording import Recording, record, replay
from hrc_env.experiments.report import Metrics, Report, Table, quick_words
from hrc_env.experiments.rigs import CHOICES, DT_S, MULTI, SPOKEN
from hrc_env.experiments.runner import at_least_one, changed, is_as_short
from hrc_env.perception.detector import DetectorConfig
from hrc_env.scene.build import Scene, SceneConfig, build
from hrc_env.scene.rigs import RIGS
from hrc_env.worker.body import load_body, worker_names

RIG = "lab_gopro"
CROPS = "particle"
"""The estimator that the crops follow."""
QUANTILES = {"median": 0.5, "p95": 0.95}
FIRST_SEED = 200
Film = Mapping[str, Any]
Films = Mapping[tuple[str, int], Film]
"""By motion and seed."""


@dataclass(frozen=True, slots=True)
class Lab:
    """The experiment, and how much is run."""

    name = "lab"
    depends = ("env", "tracker", "emulator", "detector", "motion")
    n_seeds: int = 7
    """Films of every motion."""
    max_frames: int = 250
    """No film is longer."""
    folded: str = "full"
    """The landmark network for workers who are folded up; "heavy" is fetched once with
    `python -m hrc_env setup --networks heavy`."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` for what cannot work."""
        at_least_one(self, "n_seeds")
        DetectorConfig(folded=self.folded)

    @property
    def seeds(self) -> list[int]:
        """One a film of every motion."""
        return [FIRST_SEED + k for k in range(self.n_seeds)]

    @property
    def n_parts(self) -> int:
        """Films."""
        return self.n_seeds * len(MOTIONS)

    @property
    def quick_note(self) -> str:
        """The warning on tables and figures of a short run; "" if it is long enough."""
        is_short = is_as_short(self, QUICK)
        return quick_words(self.n_seeds, self.max_frames * DT_S) if is_short else ""

    def settings(self) -> dict[str, Any]:
        """Return what all numbers depend on."""
        return {**asdict(self), "rig": RIG, "estimators": ESTIMATORS, "crops": CROPS}

    def play(self, cache: PartCache) -> Films:
        """Return every film."""
        asked = [(motion, seed) for seed in self.seeds for motion in MOTIONS]
        parts = [
            Part(f"{motion}.{seed}", partial(film, self, motion, seed)) for motion, seed in asked
        ]
        return dict(zip(asked, cache.parts(parts, one_core=True), strict=True))

    def metrics(self, played: Films) -> dict[str, Metric]:
        """Return every number of results.json."""
        return metrics_of(played)

    def shown_tables(self) -> tuple[Table, ...]:
        """Return the table of the documentation."""
        return (ERRORS,)

    def report(self, played: Films, metrics: Metrics, figures: Path) -> Report:
        """Draw the figure; return the tables beside it."""
        take = partial(taken, self, seed=self.seeds[0], tick=lambda share: None)
        return report(figures, take, metrics)


QUICK = Lab(n_seeds=2, max_frames=100)
"""Every number, from fewer and shorter films."""


def make_experiment(quick: bool = False, seeds: int | None = None, folded: str = "full") -> Lab:
    """The settings that the command line asks for."""
    return changed(QUICK if quick else Lab(), n_seeds=seeds, folded=folded)


def laboratory(seed: int, folded: str = "full") -> tuple[Scene, HRCConfig]:
    """The room with the paper's four cameras, in which baked bodies take turns."""
    names = worker_names()
    config = HRCConfig(
        worker=names[seed % len(names)],
        detector=DetectorConfig(folded=folded),
        scene=SceneConfig(cameras=RIGS[RIG]),
    )
    return build(config.scene, "lab", 1, config.worker), config


def taken(config: Lab, motion: str, seed: int, tick: PartProgress) -> Recording:
    """One film of one motion."""
    scene, settings = laboratory(seed, config.folded)
    motions = play(scene, motion, seed, config.max_frames, settings.ctrl_dt)
    return record(scene, motions, settings, CROPS, seed, tick)


def film(config: Lab, motion: str, seed: int, tick: PartProgress) -> dict[str, Any]:
    """What everybody made of one film, after the warm-up."""
    recording = taken(config, motion, seed, lambda share: tick(0.8 * share))
    body = recording.scene.bodies[0]
    truth, errors = recording.joints_world[WARM_UP:], {}
    for name in ESTIMATORS:
        for column, cameras in CHOICES.items():
            said = replay(recording, name, cameras, WARM_UP, seed).mean_world
            off_m = np.linalg.norm(said[WARM_UP:, 0] - truth, axis=-1)
            errors[f"{name}.{column}"] = np.round(off_m, 4).tolist()
            tick(0.2 / len(ESTIMATORS) / len(CHOICES))
    return {
        "body": body,
        "stature_m": float(load_body(body).stature_m),
        "errors_m": errors,
        "missed": missed_by_camera(recording)[WARM_UP:].astype(int).tolist(),
        "away": away_from_cameras(recording)[WARM_UP:].astype(int).tolist(),
    }


def metrics_of(played: Films) -> dict[str, Metric]:
    """Every number of results.json."""
    metrics: dict[str, Metric] = {}
    for motion in (*MOTIONS, ALL):
        films = [each for (name, _), each in played.items() if motion in (name, ALL)]
        for key in (f"{name}.{column}" for name in ESTIMATORS for column in SPOKEN):
            errors = [_errors_m(each, key).ravel() for each in films]
            for word, q in QUANTILES.items():
                metrics[f"error_m.{key}.{motion}.{word}"] = estimate_quantile(errors, q, "m")
        metrics |= _misses(films, motion)
    for column in SPOKEN:
        errors = [_errors_m(each, f"{ESTIMATORS[0]}.{column}") for each in played.values()]
        for other, (word, q) in product(ESTIMATORS[1:], QUANTILES.items()):
            theirs = [_errors_m(each, f"{other}.{column}") for each in played.values()]
            both = make_quantile([each.ravel() for each in (*errors, *theirs)], q)
            metrics |= compare_paired(f"error_m.{other}.{column}.{word}", both, len(errors), "m", 400)
    return metrics


def _misses(films: Sequence[Film], motion: str) -> dict[str, Metric]:
    """Shares of joints missed, on the far side apart, of which some are known with all cameras."""
    metrics = {}
    counted = np.array([_joints_counted(each) for each in films]).T
    for column, (n, missed, away, far, back) in zip(SINGLE, counted, strict=True):
        for what, above, below in (
            ("missed", missed, n), ("missed_far", far, away), ("recovered_far", back, far),
        ):  # fmt: skip
            metrics[f"{what}.{column}.{motion}"] = estimate_ratio(above, below, "share")
    known = [_known(each) for each in films]
    lost, total = [(~each).sum() for each in known], [each.size for each in known]
    return metrics | {f"missed.multi.{motion}": estimate_ratio(lost, total, "share")}


def _joints_counted(film: Film) -> Floats:
    """(5, C) all, those missed, turned away, of these missed, of these known with all cameras."""
    missed, away = (np.asarray(film[what], bool) for what in ("missed", "away"))
    far = missed & away
    marked = np.ones_like(far), missed, away, far, far & _known(film)[:, None]
    return np.sum(marked, axis=(1, 3), dtype=float)


def _errors_m(film: Film, key: str) -> Floats:
    """(T, J) distances of an estimate from the truth [m]."""
    return np.asarray(film["errors_m"][key], float)


def _known(film: Film) -> Bools:
    """(T, J) which joints the estimate of all cameras has near enough."""
    return _errors_m(film, f"{ESTIMATORS[0]}.{MULTI}") <= MISSED_SHARE * film["stature_m"]
