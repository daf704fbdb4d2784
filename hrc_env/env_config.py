"""The arguments of an environment, all declared in `EnvConfig`.

`gymnasium.make`, `gymnasium.make_vec`, `HRCEnv` and `HRCVectorEnv` take its fields as keyword
arguments; the options of the command line and the reference are derived from them.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from inspect import Parameter, Signature, signature
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hrc_env.core.errors import ConfigError, make_unknown_name_error
from hrc_env.core.mapping import answer_unknown_fields, for_json, read_toml, to_toml
from hrc_env.core.results import write_whole
from hrc_env.tasks import DEFAULT

if TYPE_CHECKING:  # importing them would load the simulator, which `--help` does not need
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
"""Default width and height of a picture [px]."""
MANY = {"many": True}
"""Metadata of a field that takes several values on the command line."""
NO_WORD = {"words": False}
"""Metadata of a field without a counterpart on the command line."""


@answer_unknown_fields
@dataclass(frozen=True, slots=True, kw_only=True)
class EnvConfig:
    """The arguments of an environment, as keyword arguments of `gymnasium.make` and `make_vec`.

    Names and values are checked when an environment is made. `arguments` returns the fields that
    differ from the defaults, as in `gymnasium.make(id, **config.arguments())`.
    """

    task: "str | TaskType" = DEFAULT
    """Task of the robot: an ID ("HRCReach-v0") or a subclass of `Task`
    (docs/bring_your_own/task.md)."""
    perception: str = "pixels"
    """Perception of people: "pixels" (rendered images, processed by MediaPipe Pose), "keypoints"
    (an emulator of both), "truth" (the workers' true poses) or "none". The default of
    `HRCVectorEnv` and `HRCVecEnv`, which cannot render images in batches, is "keypoints"."""
    estimator: "EstimatorChoice" = "particle"
    """Estimator of poses from keypoints: "particle", "kalman" ("particle" with a single
    hypothesis), "paper" (Algorithm 1 as printed), "paper_restarts" (Algorithm 1 with restarts),
    "triangulation" or "ransac"; the name of a registered estimator, an `EstimatorSpec`, or a
    function that makes an estimator (docs/bring_your_own/estimator.md)."""
    cameras: "str | Path | Sequence[Any] | RigDistribution | Mapping[str, Any] | None" = field(
        default=None, metadata=MANY
    )
    """Cameras: indices or names of cameras of the scene; a rig, given by its name ("lab_gopro"), by
    the path of a TOML file, or as a list of positions (x, y, z) [m], `CameraConfig`s or mappings;
    or a `RigDistribution` (or mapping), from which the rig of every episode is sampled. None for
    all cameras of the scene."""
    scene: str | None = None
    """Name of the scene: "lab", a workshop, or "site", a construction site; None for the task's
    default."""
    robot: "str | Robot | Mapping[str, Any] | None" = None
    """Robot: a name ("ur10e_like", "ur10e_gripper", "ur10e_cups", "mobile_base" or that of a
    registered robot), a `Robot` or a mapping of its fields; None for the task's default."""
    n_workers: int | tuple[int, int] | None = field(default=None, metadata=MANY)
    """Number of workers, at least 0, or a range (min, max) from which it is sampled for every
    episode; the observation has slots for the maximum. None for the task's default."""
    people: "str | PeopleConfig | Mapping[str, Any] | None" = None
    """Behaviour of workers towards the robot: "attentive", "hurried", "unaware", "headlong",
    "adversary", a `PeopleConfig` or a mapping; None for the value in `config` (attentive)."""
    motions: "Sequence[str | Path | Clip] | None" = field(default=None, metadata=MANY)
    """Clips of recorded motion, or their paths, which workers play in addition to synthetic motion
    (docs/motion_capture.md); None for the value in `config` (no clips)."""
    faults: "Sequence[FaultConfig | Mapping[str, Any]] | None" = field(default=None, metadata=MANY)
    """Faults of cameras: `FaultConfig`s or mappings, such as
    {"kind": "late", "cameras": ["camera_1"], "amount": 0.2} (docs/cameras.md);
    None for the value in `config` (no faults)."""
    appearance: "str | AppearanceConfig | Mapping[str, Any] | None" = None
    """Appearance of scene and workers, sampled for every episode: "as_built", "varied", "lights",
    "surfaces", "people", an `AppearanceConfig` or a mapping; None for the value in `config` (as
    built). It affects perception="pixels" and `observe_images`; with perception="keypoints", only
    the brightness of the light has an effect."""
    control: str = "joint"
    """Control mode, which defines the meaning of an action: "joint" (joint velocities), "tool"
    (velocity of the tool) or "twist" (linear and angular velocity of the tool). For a robot with a
    hand, a further entry commands the hand, from -1 (open) to 1 (closed)."""
    shield: "ShieldChoice" = None
    """Shield that may change a command before the robot executes it: "qp", "ssm", "pfl", "sara",
    a `ShieldConfig` or a mapping such as {"kind": "qp", "margin_m": 0.1}
    (docs/reference/shields.md), the name of a registered shield, or a function; None for no
    shield."""
    observe_images: "ImageConfig | Mapping[str, Any] | tuple[int, int] | None" = field(
        default=None, metadata=MANY
    )
    """Camera images in the observation, in addition to the belief: (height, width) [px] for images
    of all cameras, a mapping such as {"height": 84, "width": 84, "cameras": ["camera_1"]} or an
    `ImageConfig`. The observation becomes a dictionary with the keys "observation" and
    "image_<camera>", (H, W, 3) of uint8. None for no images."""
    config: "HRCConfig | Mapping[str, Any] | str | Path | None" = field(default=None, metadata=MANY)
    """All other settings (docs/reference/config.md): an `HRCConfig`, a nested mapping of changes to
    the defaults, or the path of a TOML file with such changes."""
    render_mode: str | None = field(default=None, metadata=NO_WORD)
    """Kind of pictures that `render` returns: "rgb_array", "depth_array" or None; `gymnasium.make`
    also takes "human", which opens a window (docs/pictures.md)."""
    width: int = field(default=PICTURE_SIZE[0], metadata=NO_WORD)
    """Width of a picture that `render` returns [px]."""
    height: int = field(default=PICTURE_SIZE[1], metadata=NO_WORD)
    """Height of a picture that `render` returns [px]."""
    render_markers: bool = field(default=True, metadata=NO_WORD)
    """Whether `render` shows the markers of the task, such as goals."""
    overlay: str | None = field(default=None, metadata=NO_WORD)
    """Overlay that `render` draws: "capsules", the capsules of robot and people from which
    distances are computed (docs/pictures.md); None for no overlay."""

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
            ConfigError: a value cannot be stored in a file, such as a function or a clip in memory.
        """
        content = {name: for_json(value, name) for name, value in self.arguments().items()}
        write_whole(Path(path), to_toml(content))

    @classmethod
    def load(cls, path: str | Path) -> "EnvConfig":
        """Return the arguments that a TOML file contains.

        Args:
            path: path of the file; nested parts are tables: `[shield]`, `[[faults]]`,
                `[config.reward]`.

        Raises:
            ConfigError: the file cannot be read, or contains an unknown name.
        """
        content = read_toml(path)
        if "task" in content and not isinstance(content["task"], str):
            raise ConfigError(
                f"{path}: task must be an id, got {content['task']!r}; settings of the task belong "
                "in [config.task]."
            )
        return cls(**content)


def signature_of_env(*first: Parameter) -> Signature:
    """Return the signature of a function that takes an environment's arguments.

    Args:
        first: parameters of the function that precede these arguments.
    """
    arguments = [
        Parameter(each.name, Parameter.KEYWORD_ONLY, default=each.default, annotation=each.type)
        for each in fields(EnvConfig)
    ]
    names = {each.name for each in first}
    return Signature([*first, *(each for each in arguments if each.name not in names)])


def check_keywords(kind: type, given: Iterable[str], *inner: type) -> None:
    """Raise `ConfigError` for an unknown keyword; the error suggests the most similar valid one.

    Args:
        kind: class that forwards arguments of an environment; its parameters are also valid.
        given: names of the keywords that the class forwards.
        inner: further classes to which the class forwards them.
    """
    parameters = [name for each in (kind, *inner) for name in signature(each.__init__).parameters]
    names = [name for name in parameters if name not in ("self", "kwargs", "arguments")]
    for name in given:
        if name not in names and name not in EnvConfig.__dataclass_fields__:
            valid = dict.fromkeys((*names, *(each.name for each in fields(EnvConfig))))
            raise make_unknown_name_error(f"argument of {kind.__name__}", name, valid)
