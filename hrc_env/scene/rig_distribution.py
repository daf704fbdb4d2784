"""Distribution of camera rigs, from which a rig is sampled for every episode."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, NamedTuple

import numpy as np

from hrc_env.core.brought import check_kinds
from hrc_env.core.errors import ConfigError, check_fields, check_integer, make_unknown_name_error
from hrc_env.core.mapping import answer_unknown_fields
from hrc_env.core.streams import children
from hrc_env.core.typing import Floats
from hrc_env.geometry.camera_config import MOST_CAMERAS, CameraConfig, axes_of, intrinsics
from hrc_env.geometry.lens import Lens
from hrc_env.geometry.rotations import from_rotation_vector, look_at
from hrc_env.scene.build import Scene, with_rig
from hrc_env.scene.rigs import RIGS, describe_poor_cameras

TRIES = 100
"""Maximum number of samples of a camera until it sees the workspace."""
STREAM = 0x10076
"""Key of the random stream for rigs, distinct from those of `Generator.spawn`, which count from
0."""


class CameraCounts(NamedTuple):
    """Bounds on the number of cameras in an episode."""

    fewest: int
    """Smallest number of cameras."""
    most: int
    """Largest number of cameras."""


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class RigDistribution:
    """Distribution of rigs around a nominal rig, with random poses, lenses and number of cameras.

    Estimators know the rig of their episode, as after a calibration; calibration errors are faults
    ("wrong_rotation", "wrong_translation", "wrong_focal"). A camera that is inside or behind an
    obstacle, outside of the room, or sees too little of the workspace is sampled again. At
    perception levels without cameras, no rig is sampled.
    """

    RENAMED: ClassVar[Mapping[str, str]] = {
        "around": "nominal",
        "place_m": "max_shift_m",
        "turn_rad": "max_rotation_rad",
        "focal_share": "max_focal_change",
    }
    """Current names of renamed fields, by former name."""

    nominal: str | tuple[CameraConfig, ...] = ()
    """Nominal rig, given by its name ("lab_gopro") or its cameras; empty for the rig of the
    scene."""
    max_shift_m: float = 0.0
    """Largest shift of each camera from its nominal position along each axis [m]."""
    max_rotation_rad: float = 0.0
    """Largest rotation of each camera about any axis [rad]."""
    max_focal_change: float = 0.0
    """Largest fraction by which a focal length is increased or decreased."""
    lenses: tuple[Lens, ...] = ()
    """Lenses from which the lens of each camera is sampled; empty for the nominal lenses."""
    n_cameras: int | tuple[int, int] | None = None
    """Number of cameras, or a range (min, max) from which it is sampled; None for all cameras. The
    choice of cameras is also random; images of unused cameras (`observe_images`) are black."""

    def __post_init__(self) -> None:
        if isinstance(self.nominal, str) and self.nominal not in RIGS:
            raise make_unknown_name_error("rig in RigDistribution.nominal", self.nominal, RIGS)
        check_fields(self, "not be negative", "max_shift_m", "max_rotation_rad")
        check_fields(self, "be in [0, 1)", "max_focal_change")
        if self.lenses:
            check_kinds("RigDistribution.lenses", self.lenses, Lens)
        if self.n_cameras is not None:
            ends = self.n_cameras if isinstance(self.n_cameras, tuple) else (self.n_cameras,) * 2
            low, high = (
                check_integer("RigDistribution.n_cameras", k, 1, MOST_CAMERAS) for k in ends
            )
            if low > high:
                raise ConfigError(
                    f"RigDistribution.n_cameras must be (fewest, most), got {self.n_cameras}."
                )

    def possible(self, rig: Sequence[CameraConfig]) -> list[CameraConfig]:
        """Return all combinations of a camera of a rig and a lens that it may have."""
        return [replace(each, lens=lens) for each in rig for lens in self.lenses or (each.lens,)]

    @property
    def bends(self) -> bool:
        """Whether a camera may have a lens with distortion."""
        return any(lens.model != "none" for lens in self.lenses)

    @property
    def rig(self) -> tuple[CameraConfig, ...]:
        """The nominal rig; empty for the rig of the scene."""
        return RIGS[self.nominal] if isinstance(self.nominal, str) else self.nominal

    def counts(self, n_cameras: int) -> CameraCounts:
        """Return the bounds on the number of cameras in an episode, for a rig of `n_cameras`."""
        if self.n_cameras is None:
            return CameraCounts(n_cameras, n_cameras)
        low, high = self.n_cameras if isinstance(self.n_cameras, tuple) else (self.n_cameras,) * 2
        if high > n_cameras:
            raise ConfigError(
                f"RigDistribution.n_cameras={self.n_cameras}: the nominal rig has {n_cameras} "
                "cameras. Choose at most as many, or a `nominal` rig with more."
            )
        return CameraCounts(low, high)


def draw_rig(
    distribution: RigDistribution, scene: Scene, rng: np.random.Generator
) -> tuple[CameraConfig, ...]:
    """Sample the rig of an episode.

    Args:
        distribution: the distribution.
        scene: the scene with the nominal rig.
        rng: random generator of the episode.

    Raises:
        ConfigError: none of `TRIES` samples of a camera sees the workspace.
    """
    rig = scene.rig
    fewest, most = distribution.counts(len(rig))
    n = int(rng.integers(fewest, most + 1))
    used = sorted(rng.permutation(len(rig))[:n].tolist())
    streams = children(rng, len(rig))  # a camera's draws depend only on its index in the rig
    return tuple(_draw_camera(distribution, scene, rig[c], streams[c]) for c in used)


def _draw_camera(
    distribution: RigDistribution, scene: Scene, camera: CameraConfig, rng: np.random.Generator
) -> CameraConfig:
    """Sample a camera repeatedly until it is in the room and sees the workspace.

    Args:
        distribution: the distribution.
        scene: the scene with the nominal rig.
        camera: the nominal camera.
        rng: random generator of this camera.
    """
    refused = ""
    for _ in range(TRIES):
        lens, axis = camera.lens, rng.standard_normal(3)
        by_m = distribution.max_shift_m * rng.uniform(-1, 1, 3)
        turn_rad = distribution.max_rotation_rad * rng.uniform() * axis / np.linalg.norm(axis)
        focal = 1.0 + distribution.max_focal_change * rng.uniform(-1, 1)
        if distribution.lenses:
            lens = distribution.lenses[rng.integers(len(distribution.lenses))]
        try:
            drawn = _move(replace(camera, lens=lens), by_m, turn_rad, focal)
        except ConfigError as error:  # an invalid camera
            refused = str(error)
            continue
        poor = describe_poor_cameras(with_rig(scene, (drawn,)))
        if not poor:
            return drawn
        refused = poor[0]
    raise ConfigError(
        f"{distribution}: in {TRIES} draws, no pose was found from which camera {camera.name!r} "
        f"sees the workspace. The last draw: {refused} Reduce the deviations, or change the "
        "nominal pose."
    )


def _move(camera: CameraConfig, by_m: Floats, turn_rad: Floats, focal: float) -> CameraConfig:
    """Return a camera with another pose and focal length.

    Args:
        camera: the nominal camera.
        by_m: (3,) shift [m].
        turn_rad: (3,) rotation vector [rad].
        focal: factor on the focal length.
    """
    eye = np.array(camera.eye_world) + by_m
    R_world_from_cam = from_rotation_vector(turn_rad) @ axes_of(camera)
    away_m = math.dist(camera.eye_world, camera.target_world)
    target = eye + away_m * R_world_from_cam[:, 2]
    rolled = look_at(eye, target).T @ R_world_from_cam
    K = intrinsics(camera)
    return replace(
        camera,
        eye_world=tuple(eye.tolist()),
        target_world=tuple(target.tolist()),
        roll_deg=math.degrees(math.atan2(rolled[1, 0], rolled[0, 0])),
        focal_px=camera.focal_px if focal == 1.0 else (focal * K[0, 0], focal * K[1, 1]),
    )
