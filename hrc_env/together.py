"""Check that environments of a task depend neither on each other nor on hidden state."""

import warnings
from collections.abc import Iterator, Sequence
from contextlib import closing
from typing import Any

import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.settings import Settings
from hrc_env.simulation import Simulation
from hrc_env.step_result import StepResult

SEEDS = (0, 1)
"""Seed of the first episode of each environment."""
N_STEPS = 4
"""Number of control steps after each reset and each restored state."""
RULE = (
    "All methods work on rows: draw random numbers for environment b from rngs[b], write and "
    "return only the rows of `ids`, and do not reduce (sum, mean, maximum) over the first axis."
)
Numbers = dict[str, Any]
"""Type of the arrays (B, ...) of a result, by name."""


def check_rows(settings: Settings) -> None:
    """Compare two environments of a task that run together, each alone, and from a restored state.

    Raises:
        ConfigError: the results of an environment change if another one runs beside it, or after
            `set_state`; the error names the first difference.
    """
    together = _collect(settings, SEEDS)
    for row, seed in enumerate(SEEDS):
        for alone, several in zip(_collect(settings, (seed,)), together, strict=True):
            beside = {name: value[row] for name, value in several.items()}
            if wrong := _find_difference({name: value[0] for name, value in alone.items()}, beside):
                raise ConfigError(
                    f"{settings.task.id}: {wrong} of an environment differs between a batch and a "
                    f"single environment. {RULE}"
                )


def _collect(settings: Settings, seeds: Sequence[int]) -> list[Numbers]:
    """Collect all results of `_play`, without the warnings of making an environment."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return list(_play(settings, seeds))
        except (ValueError, IndexError, TypeError) as error:
            raise ConfigError(
                f"{settings.task.id} fails with a batch of {len(seeds)} environments, or at the "
                f"reset of one of them: {type(error).__name__}: {error}. {RULE}"
            ) from error


def _play(settings: Settings, seeds: Sequence[int]) -> Iterator[Numbers]:
    """Yield the results of resets and steps; repeat some steps from a restored state."""
    batch = len(seeds)
    with closing(Simulation(batch, settings)) as simulation:
        everyone = np.arange(batch)
        rngs = [np.random.default_rng(seed) for seed in seeds]
        draws = [np.random.default_rng((seed, 1)) for seed in seeds]

        def steps() -> Iterator[Numbers]:
            for _ in range(N_STEPS):
                action = [each.uniform(-1, 1, simulation.n_actions) for each in draws]
                yield _numbers(simulation.step(np.array(action)))

        yield _numbers(simulation.reset(everyone, rngs))
        yield from steps()
        state, drawn = simulation.get_state(), [each.bit_generator.state for each in draws]
        first = list(steps())
        simulation.set_state(state)
        for each, before in zip(draws, drawn, strict=True):
            each.bit_generator.state = before
        for before, after in zip(first, steps(), strict=True):
            if wrong := _find_difference(before, after):
                raise ConfigError(
                    f"{settings.task.id}: {wrong} differs when an environment continues from the "
                    "same state again. Everything that changes must be in the state that "
                    "make_state returns, nothing in self, and all random numbers must come from "
                    "rngs."
                )
            yield after
        again: dict[int, Numbers] = {}
        for b in everyone.tolist():  # one after the other, in the way that episodes end
            rng = np.random.default_rng((seeds[b], 2))
            again[b] = _numbers(simulation.reset(everyone[b : b + 1], [rng]))
        yield {k: np.concatenate([again[b][k] for b in again]) for k in again[0]}
        yield from steps()


def _numbers(result: StepResult) -> Numbers:
    """Return the arrays of a result by name."""
    observation = result.observation
    parts = dict(observation) if isinstance(observation, dict) else {"observation": observation}
    named = {"the reward": result.reward, "the end": result.terminated}
    named |= {f"info[{name!r}]": value for name, value in result.info.items()}
    return named | {f"{name!r}": value for name, value in parts.items()}


def _find_difference(one: Numbers, other: Numbers) -> str:
    """Return the name of the first array that differs by more than rounding; "" if none does."""
    for name, value in one.items():
        x, y = np.asarray(value, float), np.asarray(other[name], float)
        if x.shape != y.shape or not np.allclose(x, y, 1e-5, 1e-7, equal_nan=True):
            return name
    return ""
