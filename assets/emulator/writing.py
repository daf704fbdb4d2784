"""Writer of calibration files."""

import dataclasses
import json
from pathlib import Path
from typing import Any

from hrc_env.core.results import write_whole
from hrc_env.perception.calibration import FORMAT, VERSION, Calibration


def write_calibration(path: Path | str, calibration: Calibration, made: dict[str, Any]) -> None:
    """Write a calibration, completely or not at all.

    Args:
        path: path of the file.
        calibration: the numbers, which are rounded to four digits.
        made: command, seed, commit and further information on its origin.
    """
    path = Path(path)
    lines = [
        f" {json.dumps(each.name)}: "
        f"{json.dumps(_rounded(getattr(calibration, each.name).tolist()))}"
        for each in dataclasses.fields(calibration)
    ]
    head = {"format": FORMAT, "version": VERSION, "made": made}
    text = json.dumps(head)[:-1] + ',\n"tables": {\n' + ",\n".join(lines) + "\n}}\n"
    write_whole(path, text)


def _rounded(value: Any) -> Any:
    if isinstance(value, list):
        return [_rounded(each) for each in value]
    return float(f"{value:.4g}")
