"""Configuration of cameras (pose, lens, sensor, timing), and rig files.

A rig file is TOML with a `[[camera]]` table for each camera, with the fields of `CameraConfig`:

[[camera]]
name = "left"
eye_world = [2.9, 2.6, 2.45]
lens = {model = "kannala_brandt", coefficients = [0.0667]}

Alternatively, a table may have `K`, `distortion` and `T_world_from_cam` (see
`CameraConfig.from_matrices`), or the file may be a calibration of another tool (see
`calibrations`).
"""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NoReturn, cast

import numpy as np

from hrc_env.core.errors import ConfigError, check_names
from hrc_env.core.mapping import (
    answer_unknown_fields,
    convert_to_plain,
    from_mapping,
    read_toml,
    to_toml,
)
from hrc_env.core.typing import Floats, Rotations, Transforms
from hrc_env.geometry.lens import COEFFICIENTS, Lens, distorted_radius, rays_cam
from hrc_env.geometry.rotations import about_axis, look_at

MOST_CAMERAS = 16
"""Maximum number of cameras in a rig."""
SIZE_PX = (64, 16_384)
"""Minimum and maximum width and height of an image [px]."""
HFOV_DEG = (1.0, 340.0)
"""Minimum and maximum horizontal field of view [degrees]. Without a fisheye lens, the maximum is
179."""
MAX_LATENCY_S = 1.0
"""Maximum latency of a camera, which is limited by the tracker's memory [s]."""


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class CameraConfig:
    """Configuration of a fixed camera."""

    name: str
    """Name of the camera, unique in its rig."""
    eye_world: tuple[float, float, float]
    """Position of the camera in the world frame [m]."""
    target_world: tuple[float, float, float] = (0.2, 0.0, 1.0)
    """Point in the world frame at which the camera is aimed [m]. The default is the centre of the
    workspace shared by robot and worker."""
    hfov_deg: float = 90.0
    """Horizontal field of view through the lens [degrees]; ignored if `focal_px` is given."""
    width_px: int = 1920
    """Width of the images [px]."""
    height_px: int = 1080
    """Height of the images [px]."""
    roll_deg: float = 0.0
    """Rotation of the camera about its optical axis [degrees], clockwise as seen from behind it."""
    focal_px: tuple[float, ...] = ()
    """Focal lengths fx, fy [px]; if empty, both follow from `hfov_deg`."""
    centre_px: tuple[float, ...] = ()
    """Principal point cx, cy [px]; if empty, the centre of the image."""
    lens: Lens = field(default_factory=Lens)
    """Distortion model of the lens."""
    rate_hz: float = 0.0
    """Frame rate [Hz]. Images are taken at control steps; with 0, at every control step."""
    latency_s: float = 0.0
    """Delay from the exposure of an image to its arrival, at most 1 [s]. The tracker applies an
    image at the time of its exposure."""
    exposure_s: float = 0.0
    """Exposure time, at most 0.1 [s]. It causes motion blur, but only at perception level
    `pixels`."""

    def __post_init__(self) -> None:
        places = (*self.eye_world, *self.target_world, self.roll_deg)
        if not np.isfinite(places).all():
            _refuse(self, "eye_world, target_world and roll_deg must be finite", places)
        if math.dist(self.eye_world, self.target_world) < 1e-3:
            _refuse(self, "its target must differ from its position", self.eye_world)
        for name, least, most in (
            ("width_px", *SIZE_PX),
            ("height_px", *SIZE_PX),
            ("rate_hz", 0, math.inf),
            ("latency_s", 0, MAX_LATENCY_S),
            ("exposure_s", 0, 0.1),
        ):
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
        """Return a camera of a commercial model at a given position.

        Args:
            make: a key of `MAKES`; "gopro_hero8_wide" is the paper's camera.
            name: name of the camera, unique in its rig.
            eye_world: position of the camera in the world frame [m].
            target_world: point in the world frame at which the camera points [m].

        Raises:
            ConfigError: `make` is not a key of `MAKES`.
        """
        check_names("make of camera", [make], MAKES)
        return replace(MAKES[make], name=name, eye_world=eye_world, target_world=target_world)

    @classmethod
    def from_matrices(
        cls,
        name: str,
        K: Floats,
        T_world_from_cam: Transforms,
        size_px: tuple[int, int],
        distortion: Lens | Sequence[float] = (),
        fisheye: bool = False,
    ) -> "CameraConfig":
        """Return the camera with the given matrices, in the conventions of OpenCV.

        Args:
            name: name of the camera, unique in its rig.
            K: (3, 3) intrinsics without skew [px]. Pixel coordinates are measured from the image's
                corner; if a calibration measures them from the centre of the first pixel, add 0.5
                to cx and cy.
            T_world_from_cam: (4, 4) pose of OpenCV's camera axes in the world, with z up [m].
            size_px: width and height of the image [px].
            distortion: a lens, or OpenCV's coefficients.
            fisheye: whether the coefficients are those of OpenCV's fisheye model.

        Raises:
            ConfigError: K has skew, the transform is not a pose, or the lens is not supported.
        """
        matrix, T = np.asarray(K, float), np.asarray(T_world_from_cam, float)
        fixed = np.full(5, np.nan)
        if matrix.shape == (3, 3) and np.isfinite(matrix).all():
            fixed = matrix[[1, 2, 2, 2, 0], [0, 0, 1, 2, 1]]
        if not np.allclose(fixed, [0, 0, 0, 1, 0], 0, 1e-3):
            valid = "K must be [[fx, 0, cx], [0, fy, cy], [0, 0, 1]], without skew"
            raise ConfigError(f"Camera {name!r}: {valid}, got {matrix.tolist()}.")
        if T.shape != (4, 4) or not _is_pose(T):
            valid = (
                "T_world_from_cam must be (4, 4): a rotation and a position, with the last row "
                "0, 0, 0, 1"
            )
            raise ConfigError(f"Camera {name!r}: {valid}, got {T.tolist()}.")
        lens = distortion if isinstance(distortion, Lens) else make_lens(distortion, fisheye)
        eye, target = T[:3, 3], T[:3, 3] + T[:3, 2]
        rolled = look_at(eye, target).T @ T[:3, :3]
        (fx, fy), (cx, cy) = matrix[[0, 1], [0, 1]].tolist(), matrix[:2, 2].tolist()
        return cls(
            name,
            tuple(eye.tolist()),
            tuple(target.tolist()),
            width_px=size_px[0],
            height_px=size_px[1],
            roll_deg=math.degrees(math.atan2(rolled[1, 0], rolled[0, 0])),
            focal_px=(fx, fy),
            centre_px=(cx, cy),
            lens=lens,
        )


@dataclass(frozen=True, slots=True)
class _Matrices:
    """The arguments of `CameraConfig.from_matrices`, as entries of mappings and rig files."""

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


def parse_camera(content: Mapping[str, Any], path: str) -> CameraConfig:
    """Return the camera that a mapping describes.

    Args:
        content: the fields of `CameraConfig`, or K, distortion and T_world_from_cam.
        path: name of the mapping in error messages, such as "cameras[0]".

    Raises:
        ConfigError: a field is unknown, missing or invalid.
    """
    if "T_world_from_cam" not in content:
        return from_mapping(CameraConfig, content, f"{path}.")
    given = from_mapping(_Matrices, convert_to_plain(content), f"{path}.")
    size = given.width_px, given.height_px
    K, T_world_from_cam = np.array(given.K), np.array(given.T_world_from_cam)
    camera = CameraConfig.from_matrices(
        given.name, K, T_world_from_cam, size, given.distortion, given.fisheye
    )
    times = {name: getattr(given, name) for name in ("rate_hz", "latency_s", "exposure_s")}
    return replace(camera, **times)


def make_lens(distortion: Sequence[float] | Floats, fisheye: bool = False) -> Lens:
    """Return a lens with OpenCV's coefficients; raise `ConfigError` if there are too many."""
    values = [float(each) for each in distortion]
    while values and values[-1] == 0.0:
        values.pop()
    model = ("kannala_brandt" if fisheye else "brown_conrady") if values or fisheye else "none"
    if len(values) > len(COEFFICIENTS[model]):
        raise ConfigError(
            f"Distortion of a lens may have {', '.join(COEFFICIENTS[model])}; got {len(values)} "
            "coefficients. Calibrate it with at most as many, or undistort its images."
        )
    return Lens(model, tuple(values))


def axes_of(camera: CameraConfig) -> Rotations:
    """Return the orientation R_world_from_cam of a camera, with OpenCV's camera axes."""
    look = look_at(np.array(camera.eye_world, float), np.array(camera.target_world, float))
    return look @ about_axis("z", np.radians(camera.roll_deg)) if camera.roll_deg else look


def _is_pose(T: Transforms) -> bool:
    """Return whether a matrix (4, 4) consists of a rotation and a finite translation."""
    R = T[:3, :3]
    is_rotation = np.allclose(R @ R.T, np.eye(3), atol=1e-4) and np.linalg.det(R) > 0.0
    return bool(is_rotation and np.isfinite(T).all() and np.allclose(T[3], [0.0, 0.0, 0.0, 1.0]))


def _refuse(camera: CameraConfig, expected: str, got: object) -> NoReturn:
    """Raise a `ConfigError` about an invalid value of a camera."""
    raise ConfigError(f"Camera {camera.name!r}: {expected}, got {got}.")


def intrinsics(camera: CameraConfig) -> Floats:
    """Return the intrinsics K (3, 3) [px] for pixel coordinates from the image's corner."""
    fx, fy = camera.focal_px or (_focal_px(camera),) * 2
    cx, cy = camera.centre_px or (camera.width_px / 2, camera.height_px / 2)
    return np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]])


def _focal_px(camera: CameraConfig) -> float:
    """Return the focal length that gives the horizontal field of view [px]."""
    most = HFOV_DEG[1] if camera.lens.model == "kannala_brandt" else 179.0
    if not HFOV_DEG[0] <= camera.hfov_deg < most:
        valid = f"horizontal field of view must be in [{HFOV_DEG[0]:g}, {most:g}) degrees"
        _refuse(camera, valid, camera.hfov_deg)
    half_rad = math.radians(camera.hfov_deg) / 2
    if camera.lens.model == "none":
        return float(camera.width_px / 2 / np.tan(half_rad))
    radius = distorted_radius(camera.lens, half_rad)
    if math.isnan(radius):
        half = f"{camera.hfov_deg / 2:g} degrees from the axis"
        _refuse(camera, f"the projection by its lens must be monotonic up to {half}", camera.lens)
    return camera.width_px / 2 / radius


def _check_image(camera: CameraConfig, K: Floats) -> None:
    """Raise an error unless intrinsics K (3, 3) and lens fill the image up to all of its edges."""
    size = np.array([camera.width_px, camera.height_px])
    focal, centre = K[[0, 1], [0, 1]], K[:2, 2]
    if not (np.isfinite(K).all() and (focal > 0).all()):
        _refuse(camera, "focal lengths must be positive and finite", f"{focal} px")
    if not ((centre > 0) & (centre < size)).all():
        _refuse(camera, f"the principal point must lie in the image of {size} px", centre)
    (cx, cy), (right, low) = centre, size
    middles = np.array([[0, cy], [right, cy], [cx, 0], [cx, low]])  # midpoints of the edges
    if np.isnan(rays_cam(camera.lens, (middles - centre) / focal * (1 - 1e-9))).any():
        _refuse(
            camera,
            "its lens must reach the center of each edge of the image (use weaker coefficients or "
            "longer focal lengths)",
            f"{camera.lens} with focal lengths {focal} px",
        )


MAKES: dict[str, CameraConfig] = {
    "gopro_hero8_wide": CameraConfig(
        "gopro_hero8_wide", (0.0, 0.0, 2.4), hfov_deg=118.2, lens=Lens("kannala_brandt", (0.0667,))
    )
}
"""Commercial cameras for `CameraConfig.from_make`. The GoPro HERO8 Black with its wide lens is the
paper's camera, with 118.2 x 69.5 degrees on 1920 x 1080 px. No pinhole camera with square pixels
has both fields of view, but the fisheye polynomial with this coefficient has."""


def read_rig(path: Path | str) -> tuple[CameraConfig, ...]:
    """Return the cameras of a rig file, or of a calibration file of another tool.

    Args:
        path: a TOML file with a [[camera]] table for each camera, which has the fields of
            `CameraConfig`, or K, distortion and T_world_from_cam (`CameraConfig.from_matrices`); or
            a calibration of anipose, FreeMoCap, Caliscope or Pose2Sim.

    Raises:
        ConfigError: the file cannot be read, or a field is invalid.
    """
    from hrc_env.geometry import calibrations  # calibrations imports this module

    content = read_toml(path)
    if calibrations.is_calibration(content):
        return calibrations.parse_calibration(content, path)
    others, entries = (
        sorted(set(content) - {"camera"}),
        cast("list[Any]", content.get("camera", [])),
    )
    tables = type(entries) is list and all(isinstance(entry, dict) for entry in entries)
    if others or not tables or not entries:
        raise ConfigError(
            f"{path} must contain a [[camera]] table for each camera and nothing else, got "
            f"{', '.join(map(repr, others)) or 'no camera'}. A calibration by another tool has a "
            "table with size, matrix, distortions, rotation and translation for each."
        )
    try:
        return tuple(parse_camera(entry, f"camera[{k}]") for k, entry in enumerate(entries))
    except ConfigError as error:
        raise ConfigError(f"{path}: {error}") from error


def write_rig(path: Path | str, cameras: Sequence[CameraConfig]) -> None:
    """Write a rig file with all fields of the cameras, from which `read_rig` restores them."""
    content = to_toml({"camera": [dataclasses.asdict(camera) for camera in cameras]})
    Path(path).write_text(content, encoding="utf-8")
