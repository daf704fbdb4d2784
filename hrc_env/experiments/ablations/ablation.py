"""An ablation: one question, and the settings that answer it."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from hrc_env.core.errors import ConfigError, check_names
from hrc_env.experiments.ablations.handicaps import BONES, MOTION, TREES
from hrc_env.experiments.rigs import Turn
from hrc_env.tracking.config import TrackerConfig


@dataclass(frozen=True, slots=True)
class Setting:
    """What is the same in all episodes of a row: who walks where, tracked how."""

    name: str
    """As in results.json."""
    words: str
    """As in tables and figures."""
    scene: str = "lab"
    n_workers: int = 1
    estimator: str = "particle"
    tracker: TrackerConfig = field(default_factory=TrackerConfig)
    bones: str = "learnt"
    """One of `handicaps.BONES`."""
    motion: str = "model"
    """One of `handicaps.MOTION`."""
    turns: tuple[Turn, ...] = (Turn(),)
    """Episodes take turns in them, so that nothing hangs on one camera's place."""
    by_sight: bool = False
    """Whether errors are also kept by how many cameras see the joint."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` for what cannot be played."""
        for name, valid in (("bones", BONES), ("motion", MOTION)):
            given = getattr(self, name)
            check_names(name, [given], valid)
            if given != valid[0] and self.estimator not in TREES:
                raise ConfigError(
                    f"Setting {self.name!r}: {name}={given!r} is for {' and '.join(TREES)}, which "
                    f"have a body on a tree; got {self.estimator!r}."
                )


@dataclass(frozen=True, slots=True)
class Ablation:
    """One question."""

    name: str
    """As in results.json and on the command line."""
    title: str
    asked: str
    """The question, and what is played for it."""
    settings: tuple[Setting, ...]
    also: Mapping[str, str] = field(default_factory=dict)
    """What is sorted out of the settings' joints, and its words."""
    against: tuple[str, ...] = ()
    """Settings with which others of their scene are compared: each with the last before it."""

    def setting(self, name: str) -> Setting:
        """Return a setting by its name."""
        known = {each.name: each for each in self.settings}
        check_names(f"setting of {self.name!r}", [name], known)
        return known[name]

    def reference(self, setting: Setting) -> str:
        """What a setting is compared with, walk by walk; "" if with nothing."""
        alike = [each for each in self.settings if each.scene == setting.scene]
        known = [k for k, each in enumerate(alike) if each.name in self.against]
        before = [k for k in known if k <= alike.index(setting)]
        return alike[(before[-1:] or known)[0]].name if known else ""
