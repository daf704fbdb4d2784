"""report.html and report.md: question by question what was asked, done and found."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from hrc_env.core.provenance import provenance
from hrc_env.experiments.beyond.metrics import Found, Metrics
from hrc_env.experiments.beyond.study import Study
from hrc_env.experiments.beyond.trial.setting import WARM_UP_S
from hrc_env.experiments.study.page import Part, Picture, Section, Table, said, write_report

if TYPE_CHECKING:
    from hrc_env.experiments.beyond.experiment import BeyondConfig

TITLE = "Beyond the paper: what rigs, estimators and their parts are worth"


def report(out: Path, config: "BeyondConfig", studies: Sequence[Study], metrics: Metrics) -> None:
    """Write report.html and report.md into `out`; the figures are there."""
    founds = {study.name: Found(study.name, metrics) for study in studies}
    sections = [
        Section("What was asked", (_ASKED,)),
        Section("What was done", _done(config)),
        *(_section(out / "figures", study, founds[study.name]) for study in studies),
        Section("What it does not mean", _LIMITS),
    ]
    write_report(out, TITLE, _lead(config, studies), sections)


def _lead(config: "BeyondConfig", studies: Sequence[Study]) -> str:
    n_settings = sum(len(study.settings) for study in studies)
    return (
        f"{len(studies)} questions that the paper's two experiments leave open, from {n_settings} "
        f"settings of {config.n_seeds} episodes in which the truth is known. Each section begins "
        "with what was asked; the sentence below it is the answer, in numbers."
    )


_ASKED = (
    "The paper compares one camera with four, with one estimator. How many cameras does it take, "
    "and where; how many particles; how late, how badly calibrated, how blocked may they be; how "
    "many workers; and what do the parts of a better filter contribute?"
)


def _done(config: "BeyondConfig") -> tuple[Part, ...]:
    last = config.first_seed + config.n_seeds - 1
    return (
        f"{config.n_seeds} episodes of {config.seconds:g} s in every setting (seeds "
        f"{config.first_seed} to {last}), at 25 images a second; commit {provenance()['git']}. "
        "Workers of all bodies go about their work beside an arm that rests; their walks are the "
        "same in all settings of a scene and number of workers, and so are the detector's errors "
        "wherever the same cameras hang.",
        "Detections are those of the calibrated emulator (perception level `keypoints`), not of "
        "rendered pixels: these are questions about estimators and rigs, and answers need many "
        "episodes. The filter is the default, `particle`, unless a setting says otherwise.",
        "Judged is every joint in every frame after the first "
        f"{WARM_UP_S:g} s, also where the track is lost: the last word, or the prior, is then the "
        "answer. Coverage is the share of joints within the reported 95 % region; lost is the "
        "share of time without a track. Intervals are 95 % bootstraps over episodes. In the "
        "figures: medians and 95th percentiles, logarithmic.",
    )


def _section(figures: Path, study: Study, found: Found) -> Section:
    picture = Picture(figures / f"{study.name}.png", f"Errors of single joints: {study.title}")
    return Section(study.title, (study.asked, study.says(found), picture, _table(study, found)))


def _table(study: Study, found: Found) -> Table:
    """A line for each setting, and for what its joints were sorted into."""
    names = [
        key.removeprefix(f"rmse_m.{study.name}.")
        for key in found.metrics
        if key.startswith(f"rmse_m.{study.name}.")
    ]
    is_timed = any(found.has("update_us", name) for name in names)
    header = ("setting", "median [mm]", "95th percentile [mm]", "RMSE [mm]", "coverage [%]",
              "lost [%]", *(["us an update"] if is_timed else []))  # fmt: skip
    rows = []
    for name in names:
        cells = [
            said(found.error(name), 1000, 1),
            said(found.error(name, "p95"), 1000, 0),
            said(found.of("rmse_m", name), 1000, 0),
            said(found.of("coverage95", name), 100, 1),
            said(found.of("lost", name), 100, 2) if found.has("lost", name) else "-",
        ]
        if is_timed:
            timed = found.has("update_us", name)
            cells.append(said(found.of("update_us", name), 1, 0) if timed else "-")
        rows.append((study.words(name), *cells))
    return Table(header, tuple(rows))


_LIMITS = (
    "An emulator's errors are those of one network on rendered workers, as far as they were "
    "fitted. What a setting does to the network itself (a worker who is small in the image, "
    "seen from far above) is in them only as far as it was among the renders; wrong calibration, "
    "lateness and lost cameras are exact.",
    "A laboratory and a site, nobody but workers, an arm that rests, workers whom nobody pushes "
    "to move fast: lateness costs more where people run.",
    "Settings are compared one at a time, with everything else at its default: what two parts "
    "do together is not known. Times an update are processor time of one thread.",
)
