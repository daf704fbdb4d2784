"""Beyond the paper: the experiment, setting by setting."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from hrc_env.core.errors import ConfigError
from hrc_env.core.machine import n_cores
from hrc_env.core.results import Metric, write_results
from hrc_env.experiments.beyond.figures import draw_figures
from hrc_env.experiments.beyond.metrics import metrics_of
from hrc_env.experiments.beyond.report import report
from hrc_env.experiments.beyond.studies.all import STUDIES, check_studies
from hrc_env.experiments.beyond.study import Study
from hrc_env.experiments.beyond.trial.play import DT_S, N_WARM_UP, play
from hrc_env.experiments.beyond.trial.setting import WARM_UP_S, Setting
from hrc_env.experiments.beyond.trial.tally import Rows
from hrc_env.experiments.beyond.trial.timing import update_us
from hrc_env.experiments.beyond.trial.walks import walks_of
from hrc_env.experiments.study.cache import PartCache, PartProgress, Progress, own_folder
from hrc_env.experiments.study.fingerprint import fingerprint_of

NAME = "beyond"


@dataclass(frozen=True, slots=True)
class BeyondConfig:
    """How much is played."""

    n_seeds: int = 80
    """Episodes of every setting."""
    first_seed: int = 2_000_000
    """Seed of the first episode; the others count up."""
    seconds: float = 10.0
    """How long each is, the warm-up included."""
    n_timed: int = 50
    """Updates that are timed, where they are."""
    studies: tuple[str, ...] = tuple(STUDIES)
    """Which questions are asked."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` for what cannot work."""
        if self.n_seeds < 1:
            raise ConfigError(f"--seeds must be at least 1, got {self.n_seeds}.")
        if not self.seconds > WARM_UP_S:
            raise ConfigError(
                f"Episodes must be longer than the warm-up of {WARM_UP_S:g} s, got {self.seconds}."
            )
        if self.n_timed < 1:
            raise ConfigError(f"n_timed must be at least 1, got {self.n_timed}.")
        check_studies(self.studies)

    @property
    def seeds(self) -> tuple[int, ...]:
        """One an episode."""
        return tuple(self.first_seed + k for k in range(self.n_seeds))


QUICK = BeyondConfig(n_seeds=4, seconds=5.0, n_timed=20)
"""Every number, from little."""


def config_for(
    quick: bool = False, seeds: int | None = None, studies: Sequence[str] | None = None
) -> BeyondConfig:
    """The settings that the command line asks for; None: as usual."""
    config = QUICK if quick else BeyondConfig()
    if studies is not None:
        config = replace(config, studies=tuple(dict.fromkeys(studies)))
    return config if seeds is None else replace(config, n_seeds=seeds)


def run(
    config: BeyondConfig, out: Path, say: Progress, overwrite: bool = False
) -> dict[str, Metric]:
    """Play everything that is not there yet; results.json, figures, report.html into `out`.

    Args:
        config: how much.
        out: a folder; what an earlier run with the same settings and code finished is used.
        say: hears of the progress: shares that sum to 1.
        overwrite: throw away what something else left there.

    Raises:
        ConfigError: the folder holds other results.
    """
    own_folder(out, NAME, overwrite)
    asked = tuple(study for name, study in STUDIES.items() if name in config.studies)
    settings = _settings(config)
    played = _played(config, asked, PartCache(out / "parts", "", 1, say), settings)
    metrics: dict[str, Metric] = {}
    for study in asked:
        metrics |= metrics_of(study.name, played[study.name])
    write_results(out / "results.json", settings, config.seeds, metrics)
    draw_figures(out / "figures", asked, metrics)
    report(out, config, asked, metrics)
    return metrics


def _played(
    config: BeyondConfig, asked: tuple[Study, ...], cache: PartCache, settings: Mapping[str, Any]
) -> dict[str, dict[str, Rows]]:
    """Every setting's sums, study by study; those that share their walks are played together."""
    order = sorted(
        ((study.name, setting) for study in asked for setting in study.settings),
        key=lambda each: (each[1].scene, each[1].n_workers),
    )
    rows: dict[tuple[str, str], Rows] = {}
    for study, setting in order:
        own = fingerprint_of(
            {**settings, "setting": setting.numbers()}, "hrc_env.experiments.beyond.trial.play"
        )
        own_shelf = replace(cache, fingerprint=own, n_parts=len(order))
        label = f"{study}.{setting.name}"
        rows[study, setting.name] = own_shelf.part(label, partial(_part, config, setting))
    return {
        study.name: {each.name: rows[study.name, each.name] for each in study.settings}
        for study in asked
    }


def _part(config: BeyondConfig, setting: Setting, tick: PartProgress) -> Rows:
    """Sums of one setting's episodes, and the time that its updates take."""
    n_steps = round(config.seconds / DT_S)
    walks = walks_of(setting.scene, setting.n_workers, config.seeds, n_steps)
    rows = play(setting, walks, config.seeds, n_cores(), tick)
    if setting.is_timed:
        n_frames = min(config.n_timed, n_steps - N_WARM_UP)
        rows["update_us"] = update_us(setting, walks, config.seeds, n_frames)
    return rows


def _settings(config: BeyondConfig) -> dict[str, Any]:
    """What all numbers depend on; which studies are asked for changes none of them."""
    values = asdict(config)
    del values["studies"]
    return {"experiment": NAME, **values}
