"""The experiment as a whole: walks are filmed once, everybody is given the same film."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from hrc_env.config import HRCConfig
from hrc_env.core.errors import ConfigError, unknown
from hrc_env.core.results import Metric, write_results
from hrc_env.experiments.site.figures import draw_figures
from hrc_env.experiments.site.metrics import Parts, metrics_of
from hrc_env.experiments.site.report import report
from hrc_env.experiments.site.rows import HEAD, WARM_UP_S, Row, head_path, rows_of
from hrc_env.experiments.site.walk import walk
from hrc_env.experiments.study.cache import PartCache, PartProgress, Progress, own_folder
from hrc_env.experiments.study.fingerprint import fingerprint_of
from hrc_env.experiments.study.recording import record, replay
from hrc_env.perception.faults.fault import FaultConfig
from hrc_env.scene.build import Scene, build
from hrc_env.tracking.config import TrackerConfig
from hrc_env.tracking.estimators import ESTIMATORS

SCENE = "site"
CROPS = "particle"
"""The estimator that the crops of the shared film follow."""
PRIOR_STD_M = 3.0
"""How far people may be from the middle of the work when nothing is known of them [m]: the walks go
all over the place."""
ALSO = ("kalman",)
"""Everybody's best must be known for a fair comparison: these are given the film, too."""


@dataclass(frozen=True, slots=True)
class SiteConfig:
    """How much is run."""

    n_seeds: int = 10
    """Walks."""
    first_seed: int = 100
    """Seed of the first walk; the others count up."""
    seconds: float = 20.0
    """How long each is."""
    estimators: tuple[str, ...] = ("particle", "paper")
    """Those of the table, which also make crops of their own."""
    n_closed: int = 2
    """So many of the walks are filmed again for everybody's own crops, which costs most."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` for what cannot work."""
        if self.n_seeds < 1:
            raise ConfigError(f"--seeds must be at least 1, got {self.n_seeds}.")
        if not self.estimators:
            raise ConfigError(f"--estimator needs a name of {', '.join(ESTIMATORS)}.")
        for name in self.estimators:
            if name not in ESTIMATORS:
                raise unknown("estimator", name, ESTIMATORS)
        if self.n_closed < 1:
            raise ConfigError(f"n_closed must be at least 1, got {self.n_closed}.")
        if not self.seconds >= 2.0:
            raise ConfigError(f"Walks must be at least 2 s long, got {self.seconds}.")


QUICK = SiteConfig(n_seeds=2, seconds=6.0, n_closed=1)
"""Every number, from fewer and shorter walks."""


def config_for(quick: bool, seeds: int | None, estimators: Sequence[str]) -> SiteConfig:
    """The settings that the command line asks for."""
    config = replace(QUICK if quick else SiteConfig(), estimators=tuple(dict.fromkeys(estimators)))
    return config if seeds is None else replace(config, n_seeds=seeds)


def run(
    config: SiteConfig,
    out: Path,
    say: Progress,
    overwrite: bool = False,
) -> dict[str, Metric]:
    """Run what is not yet there; writes results.json, figures and report.html into `out`."""
    own_folder(out, "site", overwrite)
    seeds = [config.first_seed + k for k in range(config.n_seeds)]
    closed = rows_of(config.estimators, (1, 4))
    settings = {**asdict(config), "also": ALSO, "crops": CROPS}
    again = seeds[: config.n_closed]
    n_parts = len(seeds) + len(closed) * len(again)
    cache = PartCache(out / "parts", fingerprint_of(settings, __name__), n_parts, say)
    parts = Parts(
        films={seed: cache.part(f"film.{seed}", partial(film, config, seed)) for seed in seeds},
        closed={
            (row.name, seed): cache.part(
                f"closed.{row.name}.{seed}", partial(closed_loop, config, row, seed)
            )
            for row in closed
            for seed in again
        },
        dt_s=HRCConfig().ctrl_dt,
        estimators=config.estimators,
        also=tuple(name for name in ALSO if name not in config.estimators),
    )
    metrics = metrics_of(parts)
    write_results(out / "results.json", {"experiment": "site", **settings}, seeds, metrics)
    draw_figures(out / "figures", site(), parts, metrics, walk(site(), seeds[0], 60, parts.dt_s))
    report(out, config, metrics)
    return metrics


def site() -> Scene:
    """The paper's site with its four cameras."""
    return build(HRCConfig().scene, SCENE, 1)


def settings_for(faults: tuple[FaultConfig, ...] = ()) -> HRCConfig:
    """Settings under which workers are expected anywhere on the site."""
    return HRCConfig(faults=faults, tracker=TrackerConfig(prior_std_m=PRIOR_STD_M))


def film(config: SiteConfig, seed: int, tick: PartProgress) -> dict[str, Any]:
    """One walk, filmed with the crops of the four-camera track, and everybody's word on it."""
    settings = settings_for()
    n_frames = round(config.seconds / settings.ctrl_dt)
    motions = walk(site(), seed, n_frames, settings.ctrl_dt)
    taken = record(site(), motions, settings, CROPS, seed, lambda share: tick(0.7 * share))
    asked = rows_of(config.estimators) + rows_of(
        [name for name in ALSO if name not in config.estimators], (1, 4)
    )
    said: dict[str, Any] = {}
    n_start = round(WARM_UP_S / settings.ctrl_dt)
    for row in asked:
        said[row.name] = head_path(
            replay(taken, row.estimator, row.cameras, n_start, settings, seed)
        )
        tick(0.3 / len(asked))
    confidence = np.stack([each.confidence[0, :, 0, HEAD] for each in taken.keypoints])
    return {
        "truth": np.round(taken.joints_world[:, HEAD], 4).tolist(),
        "found": np.round((confidence > 0).mean(0), 4).tolist(),
        "rows": said,
    }


def closed_loop(config: SiteConfig, row: Row, seed: int, tick: PartProgress) -> dict[str, Any]:
    """The same walk with eyes that make their own crops; after a second some cameras are lost."""
    others = tuple(f"camera_{c + 1}" for c in range(4) if c not in row.cameras)
    lost = (FaultConfig("lost", others, from_s=WARM_UP_S),) if others else ()
    settings = settings_for(lost)
    n_frames = round(config.seconds / settings.ctrl_dt)
    motions = walk(site(), seed, n_frames, settings.ctrl_dt)
    return head_path(record(site(), motions, settings, row.estimator, seed, tick).beliefs)
