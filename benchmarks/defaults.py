"""The settings with which the commands of the studies run (`benchmarks/studies.py`)."""

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict
from importlib import import_module
from typing import Any

from hrc_env.experiments.runner import Study

Made = tuple[Study[Any, Any], Any]
"""A study and its configuration."""


def _site() -> Made:
    from hrc_env.experiments.site.experiment import STUDY, config_for

    return STUDY, config_for()


def _lab() -> Made:
    from hrc_env.experiments.lab.experiment import STUDY, config_for

    return STUDY, config_for(folded="heavy")


def _ablations() -> Made:
    from hrc_env.experiments.ablations.experiment import STUDY, config_for

    return STUDY, config_for()


def _impact() -> Made:
    from hrc_env.experiments.impact.experiment import STUDY, config_for

    return STUDY, config_for()


def _price() -> Made:
    from hrc_env.experiments.price.experiment import STUDY, config_for

    return STUDY, config_for(quick=True)


def _frontier() -> Made:
    from hrc_env.experiments.price.experiment import STUDY, config_for

    return STUDY, config_for(trainings=True)


def _tracking() -> Made:
    from benchmarks.tracking.bench import TRACKING, TrackingBenchConfig

    return TRACKING, TrackingBenchConfig()


def _perception() -> Made:
    from benchmarks.perception.bench import PERCEPTION, PerceptionBenchConfig

    return PERCEPTION, PerceptionBenchConfig()


def _footage() -> Made:
    from benchmarks.recorded.bench import RECORDED

    return RECORDED, None


def _speed() -> Made:
    from benchmarks.speed.bench import SPEED, SpeedBenchConfig

    return SPEED, SpeedBenchConfig()


def _speed_tasks() -> Made:
    from benchmarks.speed.bench import EVERY, SPEED, SpeedBenchConfig

    return SPEED, SpeedBenchConfig(task=EVERY)


MADE: dict[str, Callable[[], Made]] = {
    "site": _site, "lab": _lab, "ablations": _ablations, "impact": _impact, "price": _price,
    "frontier": _frontier, "tracking": _tracking, "perception": _perception, "footage": _footage,
    "speed": _speed, "speed_tasks": _speed_tasks,
}  # fmt: skip
"""By command."""
SCRIPTS = ("experts", "shielded", "baselines", "learners", "limited", "kept", "facing")
"""Commands whose settings are the `Arguments` of the module of that name."""


def settings_of(command: str) -> dict[str, Any]:
    """Return the settings of a command as results.json has them; empty where it has none."""
    if command in MADE:
        study, config = MADE[command]()
        settings = {"experiment": study.name, **study.settings(config)}
    elif command in SCRIPTS:
        arguments = import_module(f"benchmarks.{command}").Arguments()
        settings = {name: each for name, each in asdict(arguments).items() if name != "out"}
    else:
        settings = {}
    return json.loads(json.dumps(settings))


def changed_settings(recorded: Mapping[str, Any], now: Mapping[str, Any]) -> Iterator[str]:
    """Yield the settings that have other values now: "n_seeds 10 -> 9".

    A setting that only one of them has is left out: a new one begins with what was done before,
    and one whose name was changed has kept its value.
    """
    for name in recorded:
        if name not in now or recorded[name] == now[name]:
            continue
        if isinstance(recorded[name], Mapping) and isinstance(now[name], Mapping):
            yield from changed_settings(recorded[name], now[name])
        else:
            yield f"{name} {_brief(recorded[name])} -> {_brief(now[name])}"


def _brief(value: Any) -> str:
    """Return a value in a few letters."""
    text = json.dumps(value, ensure_ascii=False)
    return text if len(text) <= 24 else f"{text[:20]} ..."
