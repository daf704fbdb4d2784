"""Trial runs of custom tasks, estimators and shields, which raise their errors early."""

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
"""Combinations of custom task, estimator and shield that have passed a trial run."""
_KEPT = 32
"""Largest number of combinations in `_PLAYED`."""


def rehearse(settings: Settings) -> None:
    """Play two steps with a custom task, estimator or shield, unless their combination was checked.

    Raises:
        ConfigError: a function of the task, the estimator or the shield returns a wrong type, shape
            or value.
    """
    task = None if is_known(type(settings.task)) else type(settings.task)
    parts = task, _find_own_estimator(settings), _find_own_shield(settings)
    key = (*parts, settings.robot.name, settings.n_workers)
    if parts == (None, None, None) or key in _PLAYED:
        return
    play_briefly(settings)
    _PLAYED[:] = [*_PLAYED[1 - _KEPT :], key]


def play_briefly(settings: Settings) -> None:
    """Play two steps of two environments without images, and check every result of task hooks.

    Cameras are emulated only if the estimator is a custom one.
    """
    has_estimator = _find_own_estimator(settings) is not None
    asked = replace(settings.asked, perception="keypoints" if has_estimator else "none")
    config = replace(settings.config, faults=(), appearance=AS_BUILT)
    check_names(f"viewpoint of {settings.task.id}", [settings.task.viewpoint], VIEWPOINTS)
    sizes = Sizes(2, settings.n_workers[1])
    task = protect_arrays(add_checks(settings.task, sizes))
    plain = replace(settings, asked=asked, config=config, task=task, images=None, rigs=None)
    with warnings.catch_warnings():  # the environment itself issues them again
        warnings.simplefilter("ignore")
        simulation = Simulation(sizes.batch, plain)
    sizes.objects, everyone = len(simulation.scene.objects.names), np.arange(sizes.batch)
    try:
        simulation.reset(everyone, [np.random.default_rng(seed) for seed in everyone.tolist()])
        task.markers(task.view(simulation.task_state, everyone))
        for _ in range(2):
            result = simulation.step(np.zeros((sizes.batch, simulation.n_actions)))
            check_counts(task, result.info)
        if has_estimator:
            simulation.pipeline.forecast(simulation.estimate, everyone, 0.2)
    finally:
        simulation.close()


def _find_own_estimator(settings: Settings) -> Any:
    """Return the function that makes a custom estimator; None without one, or without cameras."""
    spec = settings.estimator
    known = spec in BUILT_IN or ESTIMATORS.name_of(spec) is not None
    return None if known or settings.asked.perception not in CAMERA_LEVELS else spec.make


def _find_own_shield(settings: Settings) -> Any:
    """Return the user's custom shield, or None if there is none."""
    asked = settings.asked.shield
    known = isinstance(asked, ShieldConfig | Mapping) or (
        isinstance(asked, str) and asked in PRESETS
    )
    return None if known else settings.shield
