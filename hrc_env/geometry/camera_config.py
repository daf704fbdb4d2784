"""What a camera is: where it hangs, what its lens and sensor do, when it takes images; rig files.

A rig file is TOML, a `[[camera]]` for each with the fields of `CameraConfig`:

[[camera]]
name = "left"
eye_world = [2.9, 2.6, 2.45]
lens = {model = "kannala_brandt", coefficients = [0.0667]}

or by `K`, `distortion` and `T_world_from_cam` (see `CameraConfig.from_matrices`), or the
calibration of another tool (see `calibrations`).
"""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from hrc_env.core.errors import ConfigError, check_names
from hrc_env.core.mapping import answer_unknown_fields, from_mapping, plain, read_toml, to_toml
from hrc_env.core.typing import Floats, Rotations, Transforms
from hrc_env.geometry.lens import COEFFICIENTS, Lens, distorted_radius, rays_cam
from hrc_env.geometry.rotations import about_axis, look_at

MOST_CAMERAS = 16
"""A rig has no more."""
SIZE_PX = (64, 16_384)
"""Least and greatest width and height of an image [px]."""
FIELD_DEG = (1.0, 340.0)
"""Least and greatest horizontal field of view; without a fisheye lens less than 179 degrees."""
LONGEST_S = 1.0
"""Greatest latency [s]: the tracker's memory is no longer."""


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class CameraConfig:
    """One fixed camera."""

    name: str
    """What the camera is called; unique in its rig."""
    eye_world: tuple[float, float, float]
    """Where it hangs [m], world frame."""
    target_world: tuple[float, float, float] = (0.2, 0.0, 1.0)
    """What it looks at [m]: by default the middle of the space that robot and worker share."""
    hfov_deg: float = 90.0
    """Horizontal field of view through the lens [degrees], unless `focal_px` is given."""
    width_px: int = 1920
    """Width of its images [px]."""
    height_px: int = 1080
    """Height of its images [px]."""
    roll_deg: float = 0.0
    """How far it is turned about its axis [degrees], clockwise as it looks."""
    focal_px: tuple[float, ...] = ()
    """Focal lengths fx, fy [px]; none: the same in x and y, from `hfov_deg`."""
    centre_px: tuple[float, ...] = ()
    """Principal point cx, cy [px]; none: the middle of the image."""
    lens: Lens = field(default_factory=Lens)
    """How the lens distorts the image."""
    rate_hz: float = 0.0
    """Images a second; 0: one at every control step. Images are taken at control steps."""
    latency_s: float = 0.0
    """Time from taking an image to having it [s], up to 1; the tracker uses it at its own time."""
    exposure_s: float = 0.0
    """How long the shutter is open [s], up to 0.1; what moves is smeared (`pixels` only)."""

    def __post_init__(self) -> None:
        places = (*self.eye_world, *self.target_world, self.roll_deg)
        if not np.isfinite(places).all():
            _refuse(self, "eye_world, target_world and roll_deg must be finite", places)
        if math.dist(self.eye_world, self.target_world) < 1e-3:
            _refuse(self, "it must look at another place than where it hangs", self.eye_world)
        for name, least, most in (
            ("width_px", *SIZE_PX), ("height_px", *SIZE_PX), ("rate_hz", 0, math.inf),
            ("latency_s", 0, LONGEST_S), ("exposure_s", 0, 0.1),
        ):  # fmt: skip
            value = getattr(self, name)
            if not least <= value <= most or not math.isfinite(value):
                _refuse(self, f"{name} must be from {least} to {most}", value)
        for name in ("focal_px", "centre_px"):
            if len(getattr(self, name)) not in (0, 2):
                _refuse(self, f"{name} must be empty or two numbers (x, y)", getattr(self, name))
        _check_image(self, intrinsics(self))

    @classmethod
    def from_make(
        cls,
        make: str,
        name: str,
        eye_world: tuple[float, float, float],
        target_world: tuple[float, float, float] = (0.2, 0.0, 1.0),
    ) -> "CameraConfig":
        """Return a camera as it can be bought, at a place.

        Args:
            make: a key of `MAKES`; "gopro_hero8_wide" is the paper's camera.
            name: of the camera, unique in its rig.
            eye_world: where it hangs [m], world frame.
            target_world: the point that it looks at [m], world frame.

        Raises:
            ConfigError: there is no such make.
        """
        check_names("make of camera", [make], MAKES)
        return replace(MAKES[make], name=name, eye_world=eye_world, target_world=target_world)

    @classmethod
    def from_matrices(
        cls, name: str, K: Floats, T_world_from_cam: Transforms, size_px: tuple[int, int],
        distortion: Lens | Sequence[float] = (), fisheye: bool = False,
    ) -> "CameraConfig":  # fmt: skip
        """Return the camera that projects as OpenCV does with these matrices.

        Args:
            name: of the camera, unique in its rig.
            K: (3, 3) intrinsics without skew [px]. Pixels count from the image's corner; to a K of
                pixels that count from the middle of the first one, add 0.5 to cx and cy.
            T_world_from_cam: (4, 4) from OpenCV's camera axes to the world, which is z up [m].
            size_px: width and height of the image [px].
            distortion: a lens, or OpenCV's coefficients.
            fisheye: whether the coefficients are those of OpenCV's fisheye model.

        Raises:
            ConfigError: K has skew, the transform is none, or the lens is not known here.
        """
        K, T = np.asarray(K, float), np.asarray(T_world_from_cam, float)
        below = K[[1, 2, 2, 2], [0, 0, 1, 2]] if K.shape == (3, 3) else np.full(4, np.nan)
        if not np.isfinite(K).all() or not np.allclose([*below, K[0, 1]], [0, 0, 0, 1, 0], 0, 1e-3):
            valid = "K must be [[fx, 0, cx], [0, fy, cy], [0, 0, 1]], without skew"
            raise ConfigError(f"Camera {name!r}: {valid}, got {K.tolist()}.")
        if T.shape != (4, 4) or not _is_pose(T):
            valid = "T_world_from_cam must be (4, 4), a rotation and a place above 0, 0, 0, 1"
            raise ConfigError(f"Camera {name!r}: {valid}, got {T.tolist()}.")
        lens = distortion if isinstance(distortion, Lens) else lens_of(distortion, fisheye)
        eye, target = T[:3, 3], T[:3, 3] + T[:3, 2]
        rolled = look_at(eye, target).T @ T[:3, :3]
        (fx, fy), (cx, cy) = K[[0, 1], [0, 1]].tolist(), K[:2, 2].tolist()
        return cls(
            name, tuple(eye.tolist()), tuple(target.tolist()), width_px=size_px[0],
            height_px=size_px[1], roll_deg=math.degrees(math.atan2(rolled[1, 0], rolled[0, 0])),
            focal_px=(fx, fy), centre_px=(cx, cy), lens=lens,
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class _Matrices:
    """The arguments of `CameraConfig.from_matrices` as mappings and rig files hold them."""

    name: str
    K: tuple[tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]]
    T_world_from_cam: tuple[tuple[float, float, float, float], ...]
    width_px: int = 1920
    height_px: int = 1080
    distortion: tuple[float, ...] = ()
    fisheye: bool = False
    rate_hz: float = 0.0
    latency_s: float = 0.0
    exposure_s: float = 0.0


def camera_of(content: Mapping[str, Any], where: str) -> CameraConfig:
    """Return the camera of a mapping: the fields of `CameraConfig`, or K, distortion and
    T_world_from_cam. `ConfigError` by `where` it is if that cannot be."""
    if "T_world_from_cam" not in content:
        return from_mapping(CameraConfig, content, f"{where}.")
    given = from_mapping(_Matrices, plain(content), f"{where}.")
    size = given.width_px, given.height_px
    K, T_world_from_cam = np.array(given.K), np.array(given.T_world_from_cam)
    camera = CameraConfig.from_matrices(
        given.name, K, T_world_from_cam, size, given.distortion, given.fisheye
    )
    times = {name: getattr(given, name) for name in ("rate_hz", "latency_s", "exposure_s")}
    return replace(camera, **times)


def lens_of(distortion: Sequence[float] | Floats, fisheye: bool = False) -> Lens:
    """Return the lens of OpenCV's coefficients; `ConfigError` for more than this package knows."""
    values = [float(each) for each in distortion]
    while values and values[-1] == 0.0:
        values.pop()
    model = ("kannala_brandt" if fisheye else "brown_conrady") if values or fisheye else "none"
    if len(values) > len(COEFFICIENTS[model]):
        raise ConfigError(
            f"Distortion of a lens may have {', '.join(COEFFICIENTS[model])}; got "
            f"{len(values)} coefficients. Calibrate it with no more, or undistort its images."
        )
    return Lens(model, tuple(values))


def axes_of(camera: CameraConfig) -> Rotations:
    """Return R_world_from_cam, of OpenCV's camera axes."""
    look = look_at(np.array(camera.eye_world, float), np.array(camera.target_world, float))
    return look @ about_axis("z", np.radians(camera.roll_deg)) if camera.roll_deg else look


def _is_pose(T: Transforms) -> bool:
    """Whether (4, 4) is a rotation, no mirror, and a place."""
    R = T[:3, :3]
    is_rotation = np.allclose(R @ R.T, np.eye(3), atol=1e-4) and np.linalg.det(R) > 0.0
    return bool(is_rotation and np.isfinite(T).all() and np.allclose(T[3], [0.0, 0.0, 0.0, 1.0]))


def _refuse(camera: CameraConfig, expected: str, got: object) -> NoReturn:
    raise ConfigError(f"Camera {camera.name!r}: {expected}, got {got}.")


def intrinsics(camera: CameraConfig) -> Floats:
    """(3, 3) K [px], pixels continuous from the image's corner."""
    fx, fy = camera.focal_px or (_focal_px(camera),) * 2
    cx, cy = camera.centre_px or (camera.width_px / 2, camera.height_px / 2)
    return np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]])


def _focal_px(camera: CameraConfig) -> float:
    most = FIELD_DEG[1] if camera.lens.model == "kannala_brandt" else 179.0
    if not FIELD_DEG[0] <= camera.hfov_deg < most:
        valid = f"horizontal field of view must be in [{FIELD_DEG[0]:g}, {most:g}) degrees"
        _refuse(camera, valid, camera.hfov_deg)
    half_rad = math.radians(camera.hfov_deg) / 2
    if camera.lens.model == "none":
        return float(camera.width_px / 2 / np.tan(half_rad))
    radius = distorted_radius(camera.lens, half_rad)
    if math.isnan(radius):
        half = f"{camera.hfov_deg / 2:g} degrees from the axis"
        _refuse(camera, f"its lens must not fold the image over before {half}", camera.lens)
    return camera.width_px / 2 / radius


def _check_image(camera: CameraConfig, K: Floats) -> None:
    size = np.array([camera.width_px, camera.height_px])
    focal, centre = K[[0, 1], [0, 1]], K[:2, 2]
    if not (np.isfinite(K).all() and (focal > 0).all()):
        _refuse(camera, "focal lengths must be positive and finite", f"{focal} px")
    if not ((centre > 0) & (centre < size)).all():
        _refuse(camera, f"the principal point must lie in the image of {size} px", centre)
    (cx, cy), (right, low) = centre, size
    middles = np.array([[0, cy], [right, cy], [cx, 0], [cx, low]])  # of the edges
    if np.isnan(rays_cam(camera.lens, (middles - centre) / focal * (1 - 1e-9))).any():
        _refuse(
            camera,
            "its lens must let light through to the middle of each of the image's edges (weaker "
            "coefficients or longer focal lengths)",
            f"{camera.lens} with focal lengths {focal} px",
        )


MAKES: dict[str, CameraConfig] = {
    "gopro_hero8_wide": CameraConfig(
        "gopro_hero8_wide", (0.0, 0.0, 2.4), hfov_deg=118.2, lens=Lens("kannala_brandt", (0.0667,))
    )
}
"""Cameras as they are made (`CameraConfig.from_make`). The GoPro HERO8 Black with its wide lens
is the paper's: 118.2 x 69.5 degrees on 1920 x 1080. No pinhole with square pixels has both; the
fisheye polynomial with this coefficient does."""


def read_rig(path: Path | str) -> tuple[CameraConfig, ...]:
    """Return the cameras of a rig file, or of a calibration file of another tool.

    Args:
        path: a TOML file: a [[camera]] for each camera with the fields of `CameraConfig`, or with
            K, distortion and T_world_from_cam (`CameraConfig.from_matrices`); or a file as anipose,
            FreeMoCap, Caliscope and Pose2Sim write it.

    Raises:
        ConfigError: a file that cannot be read, or a field that cannot be.
    """
    from hrc_env.geometry import calibrations  # it makes cameras

    content = read_toml(path)
    if calibrations.is_calibration(content):
        return calibrations.cameras_of(content, path)
    others, entries = sorted(set(content) - {"camera"}), content.get("camera", [])
    tables = isinstance(entries, list) and all(isinstance(entry, dict) for entry in entries)
    if others or not tables or not entries:
        raise ConfigError(
            f"{path} must hold a [[camera]] for each camera and nothing else, "
            f"got {', '.join(map(repr, others)) or 'no camera'}. A calibration of another tool has "
            "a table with size, matrix, distortions, rotation and translation for each."
        )
    try:
        return tuple(camera_of(entry, f"camera[{k}]") for k, entry in enumerate(entries))
    except ConfigError as error:
        raise ConfigError(f"{path}: {error}") from error


def write_rig(path: Path | str, cameras: Sequence[CameraConfig]) -> None:
    """Write a rig, every field of every camera, so that `read_rig` gives the same back."""
    content = to_toml({"camera": [dataclasses.asdict(camera) for camera in cameras]})
    Path(path).write_text(content, encoding="utf-8")
