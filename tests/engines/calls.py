"""A small study, and calls for engines: what they are computed on, and how they fail."""

import json
import os
import signal
from pathlib import Path

from hrc_env import Row, Study, columns
from hrc_env.core.errors import ConfigError, WeightsError
from hrc_env.core.machine import n_cores

STUDY = Study(
    name="engines", title="Engines", about="Where parts are played.", depends=("env",),
    first_seed=610_000,
    rows={
        "bare": Row("bare", 5, n_together=2, env={"max_episode_steps": 12}),
        "kept": Row("kept", 3, n_together=2, env={"max_episode_steps": 12, "shield": "qp"}),
    },
    columns=(columns.mean("cost"),),
)  # fmt: skip


def parts_of(folder: Path) -> dict[str, object]:
    """The parts that a study has left in its folder, by name."""
    found = sorted((folder / "parts").glob("*.json"))
    return {path.name: json.loads(path.read_text())["part"] for path in found}


def cores(tick):
    """How many cores the process may use."""
    return {"cores": n_cores(), "pid": os.getpid()}


def die_once(flag: Path, tick):
    """Kill this process, but not the next one."""
    if not flag.exists():
        flag.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return {"died": True}


def die(tick):
    """Kill this process, whichever it is."""
    os.kill(os.getpid(), signal.SIGKILL)


def fail(tick):
    """Raise one of our errors."""
    raise ConfigError("this cannot be")


def lacks_weights():
    """Miss weights."""
    raise WeightsError("no weights here")


def lacks_a_module():
    """Miss a module."""
    import no_such_module  # noqa: F401  # type: ignore[import-not-found]
