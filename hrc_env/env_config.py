"""The arguments of an environment, declared once.

`gymnasium.make`, `gymnasium.make_vec`, `HRCEnv` and `HRCVectorEnv` take the fields of `EnvConfig`
as keyword arguments; the command line and the reference derive from them.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from inspect import Parameter, Signature, signature
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hrc_env.core.errors import ConfigError, unknown
from hrc_env.core.mapping import answer_unknown_fields, for_json, read_toml, to_toml
from hrc_env.core.results import write_whole
from hrc_env.tasks import DEFAULT

if TYPE_CHECKING:  # at run time they would import the simulator, which `--help` does without
    from hrc_env.config import HRCConfig
    from hrc_env.motion.clip import Clip
    from hrc_env.motion.config import PeopleConfig
    from hrc_env.perception.faults.fault import FaultConfig
    from hrc_env.safety.shield import ShieldChoice
    from hrc_env.scene.camera_images import ImageConfig
    from hrc_env.scene.domain_randomization import AppearanceConfig
    from hrc_env.scene.rig_distribution import RigDistribution
    from hrc_env.scene.robot import Robot
    from hrc_env.tasks.task import TaskType
    from hrc_env.tracking.estimators import EstimatorChoice

PICTURE_SIZE = (960, 720)
"""Width and height of a picture by default [px]."""
MANY = {"many": True}
"""Metadata of a field for which the command line takes several words."""
NO_WORD = {"words": False}
"""Metadata of a field that the command line has not: films have a form of their own."""


@answer_unknown_fields
@dataclass(frozen=True, slots=True, kw_only=True)
class EnvConfig:
    """The arguments of an environment: keyword arguments of `gymnasium.make` and `make_vec`.

    Names and values are checked when an environment is made; `arguments` gives the fields that
    differ from the defaults, as in `gymnasium.make(id, **config.arguments())`.
    """

    task: "str | TaskType" = DEFAULT
    """What the robot has to do: an id ("HRCReach-v0") or a subclass of `Task`
    (docs/bring_your_own.md)."""
    perception: str = "pixels"
    """How the robot sees people: "pixels" (rendered images through MediaPipe Pose), "keypoints" (an
    emulator of that), "truth" (the worker as they are) or "none". `HRCVectorEnv` and `HRCVecEnv`,
    which cannot draw images in a batch, have "keypoints" by default."""
    estimator: "EstimatorChoice" = "particle"
    """From keypoints to poses: "particle", "kalman" (the same with one hypothesis), "paper"
    (Algorithm 1 as printed), "paper_restarts" (with what it lacks), "triangulation" or "ransac";
    one that was registered, an `EstimatorSpec`, or a function that makes an estimator
    (docs/bring_your_own.md)."""
    cameras: "str | Path | Sequence[Any] | RigDistribution | Mapping[str, Any] | None" = field(
        default=None, metadata=MANY
    )
    """Indices or names of the scene's cameras to use; or a rig of your own: its name ("lab_gopro"),
    a TOML file's path, or a list of places (x, y, z) [m], `CameraConfig`s or mappings; or a
    `RigDistribution` (or mapping), from which every episode's rig is drawn; None: all cameras of
    the scene."""
    scene: str | None = None
    """Name of the place: "lab", a workshop, or "site", a construction site; None: that which the
    task is made for."""
    robot: "str | Robot | Mapping[str, Any] | None" = None
    """A name ("ur10e_like", "ur10e_gripper", "ur10e_cups", "mobile_base"), one that was registered,
    a `Robot` or a mapping of its fields; None: the one that the task is made for."""
    n_workers: int | tuple[int, int] | None = field(default=None, metadata=MANY)
    """0 or more workers; two numbers (fewest, most): each episode's number is drawn, and the
    observation has room for the most; None: as the task is made for."""
    people: "str | PeopleConfig | Mapping[str, Any] | None" = None
    """How workers are with the robot: "attentive", "hurried", "unaware", "headlong", a
    `PeopleConfig` or a mapping; None: as `config` has it (attentive)."""
    motions: "Sequence[str | Path | Clip] | None" = field(default=None, metadata=MANY)
    """Clips of recorded motion that workers play, too, or paths of such
    (docs/people_and_scenes.md); None: as `config` has it (none)."""
    faults: "Sequence[FaultConfig | Mapping[str, Any]] | None" = field(default=None, metadata=MANY)
    """What goes wrong with cameras: `FaultConfig`s or mappings, such as
    {"kind": "late", "cameras": ["camera_1"], "amount": 0.2} (docs/perception_and_estimators.md);
    None: as `config` has it (nothing)."""
    appearance: "str | AppearanceConfig | Mapping[str, Any] | None" = None
    """How scene and workers look, drawn for every episode: "as_built", "varied", "lights",
    "surfaces", "people", an `AppearanceConfig` or a mapping; None: as `config` has it (as built).
    Level "pixels" and `observe_images`; "keypoints" knows the strength of the light."""
    control: str = "joint"
    """What an action is: "joint" (joint velocities), "tool" (tool velocity) or "twist" (that and
    the tool's turn rate); a robot with a hand has one entry more, -1 open to 1 closed."""
    shield: "ShieldChoice" = None
    """What may change a command before the arm gets it: "qp", "ssm", "pfl", a `ShieldConfig` or a
    mapping such as {"kind": "qp", "margin_m": 0.1} (docs/reference/shields.md), a name that was
    registered or a function; None: nothing."""
    observe_images: "ImageConfig | Mapping[str, Any] | tuple[int, int] | None" = field(
        default=None, metadata=MANY
    )
    """Camera images in the observation, beside the belief: (height, width) [px] of all cameras, a
    mapping such as {"height": 84, "width": 84, "cameras": ["camera_1"]} or an `ImageConfig`; the
    observation is then a dictionary of "observation" and "image_<camera>", (H, W, 3) of uint8.
    None: no images."""
    config: "HRCConfig | Mapping[str, Any] | str | Path | None" = field(default=None, metadata=MANY)
    """All other settings (docs/reference/config.md): an `HRCConfig`, a nested mapping of changes to
    the default, or the path of a TOML file of such."""
    render_mode: str | None = field(default=None, metadata=NO_WORD)
    """"rgb_array", "depth_array" or None; `gymnasium.make` also takes "human", a window
    (docs/start.md)."""
    width: int = field(default=PICTURE_SIZE[0], metadata=NO_WORD)
    """Width of a picture that `render` gives [px]."""
    height: int = field(default=PICTURE_SIZE[1], metadata=NO_WORD)
    """Height of a picture that `render` gives [px]."""
    render_markers: bool = field(default=True, metadata=NO_WORD)
    """Whether `render` shows goals and other places that the task marks."""
    overlay: str | None = field(default=None, metadata=NO_WORD)
    """An overlay of `render`: "capsules", the shapes of robot and people of which distances are
    taken (docs/start.md); None: nothing."""

    def arguments(self) -> dict[str, Any]:
        """Return the fields that differ from the defaults, by name."""
        values = {each.name: getattr(self, each.name) for each in fields(self)}
        defaults = {each.name: each.default for each in fields(self)}
        plain = (str, int, bool)
        return {
            name: value
            for name, value in values.items()
            if value is not defaults[name]
            and not (isinstance(value, plain) and value == defaults[name])
        }

    def save(self, path: str | Path) -> None:
        """Write the fields that differ from the defaults to a TOML file.

        Raises:
            ConfigError: a value that a file cannot hold, such as a function or a clip in memory.
        """
        content = {name: for_json(value, name) for name, value in self.arguments().items()}
        write_whole(Path(path), to_toml(content))

    @classmethod
    def load(cls, path: str | Path) -> "EnvConfig":
        """Return the arguments that a TOML file holds.

        Args:
            path: of the file; nested parts are tables: `[shield]`, `[[faults]]`, `[config.reward]`.

        Raises:
            ConfigError: it cannot be read, or holds a name that is no field.
        """
        content = read_toml(path)
        if "task" in content and not isinstance(content["task"], str):
            raise ConfigError(
                f"{path}: task must be an id, got {content['task']!r}; its settings are "
                "[config.task]."
            )
        return cls(**content)


def signature_of_env(*first: Parameter) -> Signature:
    """Return the signature of a function that takes an environment's arguments.

    Args:
        first: parameters that come before them.
    """
    own = [
        Parameter(each.name, Parameter.KEYWORD_ONLY, default=each.default, annotation=each.type)
        for each in fields(EnvConfig)
    ]
    names = {each.name for each in first}
    return Signature([*first, *(each for each in own if each.name not in names)])


def check_keywords(kind: type, given: Iterable[str], *inner: type) -> None:
    """Raise `ConfigError` for a keyword that a class which passes on an environment's arguments
    does not take, with the nearest that it does.

    Args:
        kind: the class; its own parameters are taken, too.
        given: names of the keywords that it passes on.
        inner: further classes to which it passes them.
    """
    own = [name for each in (kind, *inner) for name in signature(each.__init__).parameters]
    names = [name for name in own if name not in ("self", "kwargs", "arguments")]
    for name in given:
        if name not in names and name not in EnvConfig.__dataclass_fields__:
            valid = dict.fromkeys((*names, *(each.name for each in fields(EnvConfig))))
            raise unknown(f"argument of {kind.__name__}", name, valid)
