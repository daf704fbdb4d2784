"""Recordings of people that nothing was fitted on, seen by pixels and by the emulator.

    python -m assets.emulator.imported --out out/imported

Each is imported by `hrc_env.mocap`, played by workers in both scenes, and tracked as the default
does it. Clips are kept in the folder, so that a run that was stopped goes on.
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import tyro
from rich.console import Console

from assets.emulator.clips import UNSEEN_RIG, UNSEEN_SEEDS, recorded_clips
from assets.emulator.recorded import MADE, RECORDINGS
from assets.emulator.validate import (
    Compared,
    accuracy,
    apart,
    compared,
    in_space,
    over_clips,
)
from hrc_env.cli.progress import progress_bar
from hrc_env.config import HRCConfig
from hrc_env.core.results import Metric, write_results
from hrc_env.core.skeleton import JOINTS
from hrc_env.core.typing import Ints
from hrc_env.perception.calibration import KIND, KINDS
from hrc_env.perception.emulator import EmulatorConfig


def main(out: Path = Path("out/imported"), rounds: int = 2, calibration: str = "") -> None:
    """Compare pixels and emulator on recordings; writes results.json.

    Args:
        out: folder of clips and results.
        rounds: how often each is played in each scene, from another moment on.
        calibration: a file of `calibrate-keypoints`; the package's, if not given.
    """
    console = Console()
    config = replace(HRCConfig(), emulator=EmulatorConfig(calibration=calibration))
    clips = recorded_clips("validated", rounds, UNSEEN_SEEDS, (UNSEEN_RIG,))
    with progress_bar(console, "imported") as say:
        seen = compared(clips, say, config, out)
    metrics = dict(metrics_of(seen))
    names = [name for name, role in RECORDINGS.items() if role == "validated"]
    write_results(out / "results.json", {"rounds": rounds, "clips": names}, [0], metrics)
    for key, each in metrics.items():
        console.print(f"{key:45s} {each.value:8.3f} ({each.low:.3f} to {each.high:.3f})")


def metrics_of(seen: Compared) -> Iterator[tuple[str, Metric]]:
    """Accuracy of pixels on people's recordings, on made ones and on all, of each joint and each
    recording; and how far the emulator is from it."""
    made = np.array([clip.motion in MADE for clip in seen.clips])
    pixels = [in_space([each]) for each in seen.pixels]
    emulated = [in_space(each) for each in seen.emulated]
    for group, mine in (("people", ~made), ("made", made), ("all", np.ones(len(made), bool))):
        rows = np.flatnonzero(mine).tolist()
        if not rows:
            continue
        yield f"clips.{group}", Metric(len(rows), len(rows), len(rows), "", len(rows))
        for what, metric in zip(
            ("median", "p95", "coverage"), accuracy([pixels[k] for k in rows]), strict=True
        ):
            yield f"{what}.{group}", metric
        yield from apart(group, [pixels[k] for k in rows], [emulated[k] for k in rows]).items()
    yield from _of_joints([inside.reshape(-1, len(JOINTS)) for _, inside in pixels])
    for name in dict.fromkeys(clip.motion for clip in seen.clips):
        rows = [k for k, clip in enumerate(seen.clips) if clip.motion == name]
        median, _, coverage = accuracy([pixels[k] for k in rows])
        yield f"median.{name}", median
        yield f"coverage.{name}", coverage


def _of_joints(inside: list[np.ndarray]) -> Iterator[tuple[str, Metric]]:
    """Coverage of each kind of joint; inside: of clips, (N, J)."""
    for kind, word in enumerate(KINDS):
        mine = [each[:, kind == KIND] for each in inside]

        def share(ks: Ints, mine: list[np.ndarray] = mine) -> list[float]:
            return [float(np.concatenate([mine[k] for k in ks.tolist()]).mean())]

        n = sum(each.size for each in mine)
        (metric,) = over_clips(share, len(mine), ("share",), n)
        yield f"coverage.joint.{word}", metric


if __name__ == "__main__":
    tyro.cli(main)
