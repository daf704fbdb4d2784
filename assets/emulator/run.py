"""Complete run of `python -m assets.emulator.calibrate`: render, fit, write, compare."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from assets.emulator.bodies import compute_spread
from assets.emulator.clips import FIT_RIGS, list_fit_clips, list_recorded_clips, list_unseen_clips
from assets.emulator.fit.fit import fit
from assets.emulator.fit.novelty import poses_of
from assets.emulator.matching import matched
from assets.emulator.plot import plot_comparison
from assets.emulator.samples import make_samples
from assets.emulator.shelf import watch_cached
from assets.emulator.validate import Compared, compared
from assets.emulator.writing import write_calibration
from hrc_env.config import HRCConfig
from hrc_env.core.errors import ConfigError
from hrc_env.core.results import provenance
from hrc_env.perception.calibration import Calibration
from hrc_env.perception.emulator import EmulatorConfig
from hrc_env.worker.body import worker_names

Say = Callable[[float, str], None]
"""Callback with the increase of the completed share, and with the current work."""


@dataclass(frozen=True, slots=True)
class CalibrationRun:
    """Extent of a calibration."""

    rounds: int = 4
    """Number of times that each motion is played in each scene; 0: once, in one of the scenes."""
    seed: int = 0
    """Seed of the clips."""
    recordings: bool = False
    """True to fit also to recordings of people, which are downloaded."""

    def __post_init__(self) -> None:
        if self.rounds < 0 or self.seed < 0:
            raise ConfigError(f"rounds and seed must be 0 or more, got {self.rounds}, {self.seed}.")


def calibrate(run: CalibrationRun, out: Path, say: Say) -> Calibration:
    """Render, fit and write the file; rendered clips stay in a folder beside it.

    Args:
        run: extent of the calibration.
        out: the calibration file.
        say: callback of the progress; its shares sum to 1.
    """
    clips, pixels = list_fit_clips(run.rounds, run.seed), []
    n_known = len(clips)
    if run.recordings:
        clips += list_recorded_clips("fitted", 1, run.seed, FIT_RIGS)
    for clip, seen in zip(
        clips, watch_cached("pixels", clips, HRCConfig(), folder_of(out)), strict=True
    ):
        pixels.append(seen)
        say(0.85 / len(clips), f"{clip.scene}: {clip.motion}")
    known, rest = poses_of(pixels[:n_known]), part_of(say, 0.15)
    draft = fit(make_samples(pixels), known, compute_spread(worker_names()))
    calibration = matched(draft, clips, pixels, out.with_suffix(".fit"), rest)
    write_calibration(out, calibration, _made(run, out, len(clips)))
    return calibration


def part_of(say: Say, part: float) -> Say:
    """Return a callback that reports the progress of a part of the whole."""
    return lambda share, label: say(part * share, label)


def compare(run: CalibrationRun, out: Path, say: Say) -> Compared:
    """Compare pixels and emulator with this file on clips that the fit has not used, with a
    plot."""
    config = replace(HRCConfig(), emulator=EmulatorConfig(calibration=str(out)))
    clips = list_unseen_clips(run.rounds, run.seed)
    seen = compared(clips, say, config, folder_of(out))
    plot_comparison(out.with_suffix(".png"), seen)
    return seen


def folder_of(out: Path) -> Path:
    """Return the folder of the rendered clips."""
    return out.with_name(f"{out.stem}_clips")


def _made(run: CalibrationRun, out: Path, n_clips: int) -> dict[str, object]:
    words = f"python -m assets.emulator.calibrate --rounds {run.rounds} --seed {run.seed}"
    words += " --recordings" * run.recordings
    command = f"{words} --out {out.name}"
    return {"command": command, "seed": run.seed, "git": provenance()["git"], "clips": n_clips}
