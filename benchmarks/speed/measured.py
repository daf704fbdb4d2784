"""What the bench measured, and the numbers that come of it."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from hrc_env.core.results import Metric, over

SINGLE = "single"
"""The environment that `gymnasium.make` gives, as opposed to a vector of one."""
REACHER = "reacher"
"""Gymnasium's Reacher where levels are named."""
RESET, REST, TOTAL = "reset", "rest", "total"
"""What stands in the organs' table besides organs: resets, what nobody does, and the sum."""


@dataclass(frozen=True, slots=True)
class Measured:
    """One number a round. Configurations are "single" and "<num_envs>.<threads>"."""

    env_steps_per_s: dict[str, list[float]] = field(default_factory=dict)
    """By "<level>.<configuration>"."""
    us_per_env_step: dict[str, list[float]] = field(default_factory=dict)
    """By "<organ>.<configuration>", at level `keypoints`."""
    reset_ms: dict[str, list[float]] = field(default_factory=dict)
    """By "<environments that are reset>_of_<num_envs>"."""


def metrics_of(measured: Measured) -> dict[str, Metric]:
    """Medians over rounds with smallest and largest; ratios to Reacher, round by round."""
    peer = measured.env_steps_per_s[f"{REACHER}.{SINGLE}"]
    metrics: dict[str, Metric] = {}
    for name, values in measured.env_steps_per_s.items():
        metrics[f"env_steps_per_s.{name}"] = over(values, "1/s")
        if name != f"{REACHER}.{SINGLE}":
            ratios = [ours / theirs for ours, theirs in zip(values, peer, strict=True)]
            metrics[f"ratio_to_reacher.{name}"] = over(ratios, "")
    for name, values in measured.us_per_env_step.items():
        metrics[f"us_per_env_step.{name}"] = over(values, "us")
    for name, values in measured.reset_ms.items():
        metrics[f"reset_ms.{name}"] = over(values, "ms")
    return metrics


def configurations_of(metrics: Mapping[str, Metric]) -> list[str]:
    """Those whose organs were timed: "single" and "<num_envs>.<threads>"."""
    start = f"us_per_env_step.{TOTAL}."
    return [name.removeprefix(start) for name in metrics if name.startswith(start)]


def title(configuration: str) -> str:
    """A configuration as people say it."""
    if configuration == SINGLE:
        return SINGLE
    size, threads = configuration.split(".")
    return f"{size} on {threads} thread{'s' if threads != '1' else ''}"
