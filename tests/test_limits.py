"""Every setting that is a number takes the values that make sense of it, and no others.

`limits.toml` says, by record and field, the least and the greatest of `TRIED` that it takes; of
tuples the last entry is tried. `python -m tests.test_limits` prints it as it is today.
"""

import contextlib
import dataclasses
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hrc_env
from hrc_env.core.errors import ConfigError
from hrc_env.geometry.camera_config import CameraConfig
from hrc_env.perception.faults.fault import FaultConfig
from hrc_env.safety.config import ShieldConfig
from hrc_env.settings import resolve_settings
from hrc_env.tracking.estimators import ESTIMATORS

TRIED = (-np.inf, -1.0, 0.0, 1e-9, 0.5, 1.0, 1.0 + 1e-9, 2.0, 3.0, 10.0, 1e9, np.inf)
LIMITS = Path(__file__).with_name("limits.toml")


def records() -> Iterator[Any]:
    """Yield one record of every type that holds settings."""
    waiting: list[Any] = [resolve_settings(task=task, config={}).config for task in hrc_env.IDS]
    waiting += [spec.config() for spec in ESTIMATORS.values() if spec.config is not None]
    waiting += [CameraConfig("camera_1", (2.9, 2.6, 2.45)), FaultConfig("noise", ("all",), 15.0)]
    waiting += [ShieldConfig("qp")]
    known: set[type] = set()
    while waiting:
        record = waiting.pop(0)
        values = [getattr(record, field.name) for field in dataclasses.fields(record)]
        waiting += [value for value in values if dataclasses.is_dataclass(value)]
        if type(record) not in known:
            known.add(type(record))
            yield record


def limits_of(record: Any) -> dict[str, str]:
    """Return what each numeric setting of a record takes, as "1e-09 to 2", in words if nothing."""
    found = {}
    for name in sorted(field.name for field in dataclasses.fields(record)):
        default = getattr(record, name)
        last = default[-1] if isinstance(default, tuple) and default else default
        if isinstance(last, bool) or not isinstance(last, int | float):
            continue
        taken = [value for value in TRIED if takes(record, name, default, value)]
        odd = " and nan" if takes(record, name, default, np.nan) else ""
        found[name] = f"{taken[0]:.10g} to {taken[-1]:.10g}{odd}" if taken else "none of these"
    return found


def takes(record: Any, name: str, default: Any, value: float) -> bool:
    """Return whether a setting takes a value; its refusal must be in words."""
    last = default[-1] if isinstance(default, tuple) else default
    if isinstance(last, int) and np.isfinite(value):
        if value != int(value):
            return False
        value = int(value)
    with contextlib.suppress(ConfigError):
        whole = (*default[:-1], value) if isinstance(default, tuple) else value
        dataclasses.replace(record, **{name: whole})
        return True
    return False


RECORDS = {type(record).__name__: record for record in records()}


@pytest.mark.parametrize("name", RECORDS)
def test_settings_take_what_makes_sense_of_them(name):
    assert limits_of(RECORDS[name]) == tomllib.loads(LIMITS.read_text()).get(name, {})


if __name__ == "__main__":
    for kind, each in RECORDS.items():
        print(f"[{kind}]", *(f'{k} = "{v}"' for k, v in limits_of(each).items()), "", sep="\n")
