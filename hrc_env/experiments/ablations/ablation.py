"""Ablations, each of which compares settings to answer one question."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from hrc_env.core.errors import ConfigError, check_names
from hrc_env.experiments.ablations.handicaps import BONES, MOTION, TREES
from hrc_env.experiments.rigs import Turn
from hrc_env.tracking.config import TrackerConfig


@dataclass(frozen=True, slots=True)
class Setting:
    """The settings of all episodes in a row of results: scene, workers, estimator and cameras."""

    name: str
    """Name of the setting in results.json."""
    words: str
    """Description of the setting in tables and figures."""
    scene: str = "lab"
    """Name of the scene."""
    n_workers: int = 1
    """Number of workers."""
    estimator: str = "particle"
    """Name of the estimator."""
    tracker: TrackerConfig = field(default_factory=TrackerConfig)
    """Settings of the estimator."""
    bones: str = "learnt"
    """Treatment of bone lengths, one of `handicaps.BONES`."""
    motion: str = "model"
    """Treatment of velocities, one of `handicaps.MOTION`."""
    turns: tuple[Turn, ...] = (Turn(),)
    """Choices of cameras. Successive episodes use them in turn, so that results do not depend on
    the position of one camera."""
    by_sight: bool = False
    """Whether errors are also reported by the number of cameras that see the joint."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` if the setting cannot be played."""
        for name, valid in (("bones", BONES), ("motion", MOTION)):
            value = getattr(self, name)
            check_names(name, [value], valid)
            if value != valid[0] and self.estimator not in TREES:
                raise ConfigError(
                    f"Setting {self.name!r}: {name}={value!r} needs {' or '.join(TREES)}, which "
                    f"model the body as a tree; got {self.estimator!r}."
                )


@dataclass(frozen=True, slots=True)
class Ablation:
    """An ablation: settings that are compared to answer one question."""

    name: str
    """Name of the ablation in results.json and on the command line."""
    title: str
    """Title of the ablation in the report."""
    question: str
    """The question, with a description of the episodes that answer it."""
    settings: tuple[Setting, ...]
    """Settings to compare, one per row."""
    also: Mapping[str, str] = field(default_factory=dict)
    """Groups of joints that are also evaluated, with their descriptions."""
    against: tuple[str, ...] = ()
    """Names of reference settings. Every other setting is compared with the last reference that
    precedes it and has the same scene."""

    def find_setting(self, name: str) -> Setting:
        """Return a setting by name, or raise `ConfigError` if it does not exist."""
        known = {setting.name: setting for setting in self.settings}
        check_names(f"setting of {self.name!r}", [name], known)
        return known[name]

    def find_reference(self, setting: Setting) -> str:
        """Return the name of the reference for a setting, or "" if there is none."""
        alike = [each for each in self.settings if each.scene == setting.scene]
        known = [k for k, each in enumerate(alike) if each.name in self.against]
        before = [k for k in known if k <= alike.index(setting)]
        return alike[(before[-1:] or known)[0]].name if known else ""
