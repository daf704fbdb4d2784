"""What is registered during a test, taken away after it."""

import sys
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

import gymnasium

import hrc_env
from hrc_env.core.registry import FILES, Registry
from hrc_env.perception.detector import DETECTORS
from hrc_env.safety.shield import SHIELDS
from hrc_env.scene.robot import ROBOTS
from hrc_env.tasks.task import TASKS
from hrc_env.tracking.estimators import ESTIMATORS


@contextmanager
def registrations_restored() -> Generator[None]:
    """Take away, in the end, what is registered and which files are imported in between."""
    tables: list[Registry] = [TASKS, ESTIMATORS, DETECTORS, ROBOTS, SHIELDS]
    before = [set(table.own) for table in tables]
    files = set(FILES)
    yield
    for file in set(FILES) - files:
        sys.modules.pop(f"hrc_env_import_{Path(file).stem}", None)
        del FILES[file]
    for table, had in zip(tables, before, strict=True):
        for added in set(table.own) - had:
            del table[added]
            gymnasium.registry.pop(added, None)
            hrc_env.IDS[:] = [each for each in hrc_env.IDS if each != added]
