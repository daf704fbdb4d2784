"""Two steps with a user's own parts, so that errors come before an episode begins."""

import warnings
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from hrc_env.core.errors import check_names
from hrc_env.pipeline.levels import CAMERA_LEVELS
from hrc_env.safety.config import PRESETS, ShieldConfig
from hrc_env.scene.domain_randomization import AS_BUILT
from hrc_env.scene.render import VIEWPOINTS
from hrc_env.settings import Settings
from hrc_env.simulation import Simulation
from hrc_env.tasks.check import check_counts
from hrc_env.tasks.hooks import Sizes, add_checks, protect_arrays
from hrc_env.tasks.task import is_known
from hrc_env.tracking.estimators import BUILT_IN, ESTIMATORS

_PLAYED: list[tuple[Any, ...]] = []
"""Parts that have passed, and need not be played again."""
_KEPT = 32
"""So many at most are remembered."""


def rehearse(settings: Settings) -> None:
    """Play two steps with a task, an estimator or a shield of a user's own, the first time that an
    environment is made of them.

    Raises:
        ConfigError: one of their functions returns a wrong kind, shape or value.
    """
    task = None if is_known(type(settings.task)) else type(settings.task)
    own = task, _own_estimator(settings), _own_shield(settings)
    key = (*own, settings.robot.name, settings.n_workers)
    if own == (None, None, None) or key in _PLAYED:
        return
    play_briefly(settings)
    _PLAYED[:] = [*_PLAYED[1 - _KEPT :], key]


def play_briefly(settings: Settings) -> None:
    """Play two steps of two environments without images, and check every result of hooks.

    There are no cameras unless the estimator is a user's own.
    """
    own = _own_estimator(settings)
    asked = replace(settings.asked, perception="none" if own is None else "keypoints")
    config = replace(settings.config, faults=(), appearance=AS_BUILT)
    check_names(f"viewpoint of {settings.task.id}", [settings.task.viewpoint], VIEWPOINTS)
    sizes = Sizes(2, settings.n_workers[1])
    task = protect_arrays(add_checks(settings.task, sizes))
    plain = replace(settings, asked=asked, config=config, task=task, images=None, rigs=None)
    with warnings.catch_warnings():  # the environment itself warns
        warnings.simplefilter("ignore")
        simulation = Simulation(sizes.batch, plain)
    sizes.objects, everyone = len(simulation.scene.objects.names), np.arange(sizes.batch)
    try:
        simulation.reset(everyone, [np.random.default_rng(seed) for seed in everyone.tolist()])
        task.markers(task.view(simulation.task_state, everyone))
        for _ in range(2):
            result = simulation.step(np.zeros((sizes.batch, simulation.n_actions)))
            check_counts(task, result.info)
        if own is not None:
            simulation.pipeline.forecast(simulation.estimate, everyone, 0.2)
    finally:
        simulation.close()


def _own_estimator(settings: Settings) -> Any:
    """The function that makes an estimator of a user's own, if there are cameras for it."""
    spec = settings.estimator
    known = spec in BUILT_IN or ESTIMATORS.name_of(spec) is not None
    return None if known or settings.asked.perception not in CAMERA_LEVELS else spec.make


def _own_shield(settings: Settings) -> Any:
    """A shield that is a user's own function."""
    asked = settings.asked.shield
    known = isinstance(asked, ShieldConfig | Mapping) or (
        isinstance(asked, str) and asked in PRESETS
    )
    return None if known else settings.shield
