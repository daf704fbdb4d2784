"""Scripts of the workers of an environment, and the reaches that the package's search found.

`python -m benchmarks adversary` searched for the distributions in `assets/adversary/reaches.json`.
The file states its command, its seeds and the versions of the subsystems with which it was made.
"""

import json
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.mapping import from_mapping
from hrc_env.core.versions import read_versions
from hrc_env.motion.config import FOUND, MotionConfig
from hrc_env.motion.reaches import ReachDistribution, Script, draw_script
from hrc_env.worker.body import assets_dir

COMMAND = "python -m benchmarks adversary"
"""Command that searches for reaches, and writes them to `reaches.json` in its folder."""
FORMAT = 1
"""Version of the format: it changes if `reaches.PARAMETERS` or their ranges change."""
NEEDS = ("motion",)
"""Subsystems without which the reaches would be other ones; with other versions of the others
(`SEARCHED_WITH`), they are the same reaches, though perhaps no longer the worst ones."""
SEARCHED_WITH = ("env", "tracker", "emulator", "motion", "shield", "agents")
"""Subsystems with which the reaches were searched; the file states their versions."""


def make_reaches(
    config: MotionConfig, n_workers: int, is_mobile: bool
) -> Script | ReachDistribution:
    """Return the script of the workers, or the distribution from which episodes sample it.

    Args:
        config: settings of the motion.
        n_workers: maximum number of workers.
        is_mobile: whether the robot moves on the floor.

    Raises:
        ConfigError: the script does not combine with the other settings, or the reaches of the
            package are missing, invalid or of another version.
    """
    reaches = config.people.reaches
    if not reaches:
        return ()
    for invalid, valid in (
        (f"n_workers={n_workers}" if n_workers > 1 else "", "n_workers=1 or 0"),
        ("motions" if config.motions else "", "no motions"),
        ("a mobile robot" if is_mobile else "", "a robot arm"),
    ):
        if invalid:
            raise ConfigError(
                f"A script of reaches (people='adversary', PeopleConfig.reaches) requires {valid}, "
                f"got {invalid}. All other people, such as 'unaware', allow {invalid}."
            )
    if isinstance(reaches, str):
        return load_found_reaches()[reaches]
    return reaches


def draw_reaches(
    reaches: Script | ReachDistribution, config: MotionConfig, rng: np.random.Generator
) -> Script:
    """Return the script of an episode; a distribution is sampled with a child of `rng`."""
    if isinstance(reaches, tuple):
        return reaches
    return draw_script(reaches, config.reach_limits, rng.spawn(1)[0])


@cache
def load_found_reaches() -> Mapping[str, ReachDistribution]:
    """Return the distributions of the package by name of the shield, as `read_found_reaches`."""
    return read_found_reaches(assets_dir() / "adversary" / "reaches.json")


def read_found_reaches(path: Path) -> Mapping[str, ReachDistribution]:
    """Read the distributions that a search found (`describe_found_reaches`), by name of the shield.

    Raises:
        ConfigError: the file is missing or invalid, or is of another version.
    """
    renew = f"Search again, in a clone, by `{COMMAND}`, or use people='unaware'."
    if not path.is_file():
        raise ConfigError(f"The reaches of people='adversary', {path.name}, are missing. {renew}")
    try:
        content: dict[str, Any] = json.loads(path.read_text())
        version, made = content["format"], {name: content["versions"][name] for name in NEEDS}
        given = dict(content["distributions"])
    except (ValueError, KeyError, TypeError) as error:
        raise ConfigError(f"{path.name} must be found reaches, got {error!r}. {renew}") from error
    now = {"format": FORMAT, **{name: read_versions()[name] for name in NEEDS}}
    stale = [
        f"{name} {each} (now {now[name]})"
        for name, each in {"format": version, **made}.items()
        if each != now[name]
    ]
    if stale:
        raise ConfigError(f"{path.name} was made for {', '.join(stale)}. {renew}")
    if missing := [name for name in FOUND if name not in given]:
        raise ConfigError(f"{path.name} must have distributions {FOUND}, lacks {missing}. {renew}")
    try:
        return {
            name: from_mapping(ReachDistribution, given[name], f"distributions.{name}.")
            for name in FOUND
        }
    except (ConfigError, AttributeError, TypeError) as error:
        raise ConfigError(f"{path.name} must be found reaches: {error} {renew}") from error


def describe_found_reaches(
    distributions: Mapping[str, ReachDistribution], made: Mapping[str, Any]
) -> dict[str, Any]:
    """Return distributions by name of the shield as values for a JSON file.

    Args:
        distributions: distributions by name of the shield.
        made: command, seeds and numbers of the search.
    """
    versions = read_versions()
    return {
        "format": FORMAT,
        "made": dict(made),
        "versions": {name: versions[name] for name in SEARCHED_WITH},
        "distributions": {
            name: {"mean": each.mean, "deviation": each.deviation}
            for name, each in distributions.items()
        },
    }
