"""Emulation of keypoints without images: projections of true joints with errors of BlazePose.

The errors are sampled from distributions that were fitted to the network's detections in rendered
images of workers (docs/emulator.md).

In every camera's image, a window with side s surrounds the worker. Like the detector's window, it
is rotated with the torso. The pixel of joint j of kind k in camera c is

    pixel = projection of (p_j + R (o_k + w_k far n)) + s T (b_k(view) + size whole m_j)

- R is the frame of the body: ahead, to the joint's side, up. o and w are the mean and the standard
  deviation of an offset in space (`offset_m`, `wander_m`). n is a normal vector that all cameras
  share, correlated along limbs and between hips and shoulders (`space_limb`). Because of the factor
  far = 1 + tail n.n / 3, all cameras occasionally agree on a wrong, distant position.
- b is the mean error in the image for 8 viewing directions, mirrored for right joints (`bias`).
  size = exp(log size + spread z), with normal z, is given for seen, hidden and outside joints
  (`size`, `spread`). whole is a factor on all joints of a body in a camera, sampled from its
  measured quantiles (`body`).
- m is the sum of a cos(view) + b sin(view) with a and b sampled once per episode, a slowly varying
  part and an independent part for every image. It is mixed with m of the next joint towards the
  trunk (`shares`, `limb`). T is the rotation of the window.
- n, z, whole and the slowly varying part of m are first-order autoregressive processes with the
  coefficient exp(-dt / `slow_s` - dt v / `slow_m`) per step, where v is the mean speed of the
  joints.
- The reported visibility is sampled from its measured quantiles (`confidence`) by a normal variable
  that is correlated with the negative size of the errors (`follows`, `common`).
- Tables are given for bodies that stand, walk, handle objects, bend or squat (`folded`), and kneel;
  the posture is computed from the joints (`hrc_env/perception/outline.py`).
- Occlusion is computed geometrically, by intersections of rays with the scene, the robot, bodies
  and carried objects.
- The labels left and right (of all joints, or of the legs only) are swapped, and a worker is
  missed, while a slow normal variable is in its lower tail (`swap_share`, `miss_share`, `swap_s`,
  `miss_s`); both errors therefore last for several images.
"""

import functools
import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from hrc_env.core.declared import Records1, Records3, make_records
from hrc_env.core.errors import ConfigError, check_fields, check_shape
from hrc_env.core.records import Keypoints, PoseEstimate, WorkerTruth
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Floats, Ints, Rngs
from hrc_env.geometry.cameras import PinholeCamera
from hrc_env.geometry.lens import lens_row
from hrc_env.geometry.sight import Surroundings
from hrc_env.perception import emulator_kernel as kernels
from hrc_env.perception.calibration import Calibration, changed_ns, read_calibration
from hrc_env.perception.dimness import Quality
from hrc_env.perception.emulator_kernel import Errors, Settings
from hrc_env.perception.searching import STATURE_OF_SIDE
from hrc_env.perception.sightlines import N_LOOK, ImageCamera, World, view_workers


@dataclass(frozen=True, slots=True)
class EmulatorConfig:
    """Settings of the detector's emulator."""

    calibration: str = ""
    """Path of a calibration written by `python -m assets.emulator.calibrate`; if empty, that of the
    package is used. The tracker uses the standard deviations and offsets of the calibration at
    perception level `pixels`, too."""
    error_scale: float = 1.0
    """Factor on all position errors; 0 gives the projected true joints. It does not change the
    reported standard deviations."""
    max_error: float = 0.4
    """Maximum error of a joint in an image, as a fraction of the side of the window around the
    worker."""
    swap_share: float | None = None
    """Fraction of the time in which left and right labels are swapped in a camera; None for the
    calibrated fractions, which depend on the view."""
    miss_share: float | None = None
    """Fraction of the time in which a worker is not detected in a camera; None for the calibrated
    fractions, which depend on the number of visible joints."""
    min_joints: int = 1
    """Minimum number of joints (of 15) that must be visible to a camera for a detection."""
    outside_confidence: float = 0.1
    """Maximum confidence of joints outside the image, as in `DetectorConfig`."""

    def __post_init__(self) -> None:
        check_fields(self, "not be negative", "error_scale", "max_error")
        chosen = [n for n in ("swap_share", "miss_share") if getattr(self, n) is not None]
        check_fields(self, "be in [0, 1]", "outside_confidence", *chosen)
        self.make_calibration()

    def make_calibration(self) -> Calibration:
        """Return the calibration modified by the settings; raise `ConfigError` if it is invalid."""
        known = read_calibration(self.calibration or None)
        if self.swap_share is not None:
            share = np.zeros_like(known.swap_share)
            share[..., 0] = self.swap_share
            known = replace(known, swap_share=share)
        if self.miss_share is not None:
            known = replace(known, miss_share=np.full_like(known.miss_share, self.miss_share))
        return known


@dataclass(frozen=True, slots=True)
class EmulatorState:
    """State of the detector's errors, which evolve between images, in standard deviations."""

    errors: Records3[Errors]
    """(B, C, W) errors in each camera."""
    wander: Floats
    """(B, W, J, 3) errors in space, which all cameras have in common: ahead, to the joint's side,
    up."""
    dt_s: float
    """Time between images [s]."""


class Sights(NamedTuple):
    """Visibilities of joints, and views of workers, in cameras."""

    sight: Ints
    """(B, C, W, J) visibility of each joint: `sightlines.SEEN`, `HIDDEN`, `OUTSIDE` or `BEHIND`."""
    look: Floats
    """(B, C, W, `N_LOOK`) view of each worker, in the columns `sightlines.SIDE` to `STEPPING`."""


def make_state(
    batch: int, n_cameras: int, n_workers: int, dt_s: float, config: EmulatorConfig
) -> EmulatorState:
    """Return a state of the errors, which must be `reset` before use.

    Args:
        batch: number of environments.
        n_cameras: number of cameras.
        n_workers: number of workers.
        dt_s: time between images [s].
        config: settings of the emulator.

    Raises:
        ConfigError: `dt_s` is not positive.
    """
    if not dt_s > 0:
        raise ConfigError(f"The time between images must be positive, got {dt_s} s.")
    errors = make_records(Errors, (batch, n_cameras, n_workers))
    return EmulatorState(errors, np.zeros((batch, n_workers, N_JOINTS, 3)), dt_s)


def reset(state: EmulatorState, ids: Ints, rngs: Rngs) -> None:
    """Reset environments `ids`, with errors sampled from their stationary distribution."""
    *names, last = (state.errors[name] for name in kernels.ERRORS.names or ())
    arrays = (*names, state.wander, last)
    sizes = [math.prod(array.shape[1:]) for array in arrays]
    drawn = np.array([rngs[b].standard_normal(sum(sizes)) for b in ids]).reshape(len(ids), -1)
    for array, part in zip(arrays, np.split(drawn, np.cumsum(sizes)[:-1], 1), strict=True):
        array[ids] = part.reshape(len(ids), *array.shape[1:])


def emulate(
    state: EmulatorState,
    rngs: Rngs,
    truth: WorkerTruth,
    surroundings: Surroundings,
    cameras: tuple[PinholeCamera, ...],
    config: EmulatorConfig,
    expected: PoseEstimate | None = None,
    dim: Quality | None = None,
) -> Keypoints:
    """Return the keypoints that a detector would report in one image of every camera.

    Args:
        state: state of the errors, which is advanced by one image in place.
        rngs: one generator for each environment.
        truth: (B, W, ...) true state of the workers, with the capsules that occlude joints of all
            workers.
        surroundings: (B, ...) scene, carried objects and robot, which also occlude joints.
        cameras: (C,) cameras of the rig.
        config: settings, as given to `make_state`.
        expected: (B, W, ...) prediction of the tracker, on which the reported standard deviations
            depend. If it is None or a worker has no nearby track, they are those of an upright
            person found by a search.
        dim: (B, C) quality of the images; None for normal light.

    Returns:
        Keypoints in pixels of the images. For a worker that is not found, pixels are NaN,
        confidences 0 and standard deviations infinite.
    """
    batch, n_cameras, n_workers = state.errors.shape
    shape = (batch, n_cameras, n_workers, N_JOINTS)
    robot = surroundings.capsules_world
    check_shape("surroundings.capsules_world", (len(robot),), (batch,), "environments")
    n_image = kernels.N_NORMALS * N_JOINTS + kernels.N_OF_BODY
    normals = np.empty((batch, n_workers * (3 * N_JOINTS + n_cameras * n_image)))
    for rng, normal in zip(rngs, normals, strict=True):
        rng.standard_normal(out=normal)
    written_ns = changed_ns(config.calibration) if config.calibration else 0
    report = kernels.Report(np.empty((*shape, 2)), np.empty(shape), np.empty(shape))
    kernels.emulate_batch(
        state.errors,
        state.wander,
        normals,
        _make_world(truth, surroundings),
        _make_expected(expected, truth.joints_world.shape),
        _make_rig(cameras),
        _make_quality(dim, (batch, n_cameras)),
        _make_tables(config, state.dt_s, written_ns),
        report,
    )
    return Keypoints(*report)


def _make_expected(expected: PoseEstimate | None, shape: tuple[int, ...]) -> kernels.Expected:
    """Convert a prediction for the kernels; None is converted to a prediction without tracks."""
    if expected is None:
        nowhere = np.zeros(shape)
        return kernels.Expected(nowhere, nowhere, np.zeros(shape[:2], np.bool_))
    joints, velocity = map(np.ascontiguousarray, (expected.mean_world, expected.velocity_world))
    return kernels.Expected(joints, velocity, np.ascontiguousarray(expected.tracked))


def _make_quality(dim: Quality | None, shape: tuple[int, int]) -> Floats:
    """Convert the quality of images to an array (B, C, 2) for the kernels; None is normal light."""
    quality = np.zeros((*shape, 2))
    quality[..., kernels.DOUBT] = 1.0 if dim is None else dim.doubt
    quality[..., kernels.OVERLOOKED] = 0.0 if dim is None else dim.missed
    return quality


def lines_of_sight(
    truth: WorkerTruth, surroundings: Surroundings, cameras: tuple[PinholeCamera, ...]
) -> Sights:
    """Return the true visibility of each joint and view of each worker in each camera.

    Args:
        truth: (B, W, ...) true state of the workers.
        surroundings: (B, ...) scene, carried objects and robot.
        cameras: (C,) cameras of the rig.
    """
    batch, n_workers, n_joints = truth.joints_world.shape[:3]
    sight = np.empty((batch, len(cameras), n_workers, n_joints), np.int64)
    look = np.empty((batch, len(cameras), n_workers, N_LOOK))
    view_workers(_make_world(truth, surroundings), _make_rig(cameras), sight, look)
    return Sights(sight, look)


def _make_world(truth: WorkerTruth, surroundings: Surroundings) -> World:
    """Convert workers and surroundings for the kernels."""
    return World(
        joints=np.ascontiguousarray(truth.joints_world),
        velocity=np.ascontiguousarray(truth.velocity_world),
        capsules=np.ascontiguousarray(truth.capsules_world),
        radius=np.ascontiguousarray(truth.capsule_radius_m),
        still=surroundings.still,
        moving=surroundings.moving,
        robot=surroundings.capsules_world,
        robot_radius=surroundings.capsule_radius_m,
    )


def shuffle_workers(keypoints: Keypoints, rngs: Rngs) -> Keypoints:
    """Shuffle the poses (B, C, W, ...) of each camera, so that workers cannot be identified."""
    batch, n_cameras, n_workers = keypoints.confidence.shape[:3]
    order = np.tile(np.arange(n_workers), (batch, n_cameras, 1))
    for b in range(batch):
        order[b] = rngs[b].permuted(order[b], axis=-1)
    pick = (np.arange(batch)[:, None, None], np.arange(n_cameras)[:, None], order)
    parts = (keypoints.px[pick], keypoints.confidence[pick], keypoints.sigma_px[pick])
    return Keypoints(*parts, keypoints.time_s)


@functools.lru_cache(maxsize=16)
def _make_rig(cameras: tuple[PinholeCamera, ...]) -> Records1[ImageCamera]:
    """Convert cameras (C,) for the kernels."""
    rig = make_records(ImageCamera, len(cameras))
    for row, camera in zip(rig, cameras, strict=True):
        row["P"], row["eye"] = camera.P, camera.eye_world
        row["size_px"] = camera.width_px, camera.height_px
        row["focal_px"], row["centre_px"] = camera.K[[0, 1], [0, 1]], camera.K[:2, 2]
        if camera.lens is not None:
            row["has_lens"], row["lens"] = True, lens_row(camera.lens)
    return rig


@functools.lru_cache(maxsize=16)
def _make_tables(config: EmulatorConfig, dt_s: float, written_ns: int) -> kernels.Tables:
    """Return the calibration in the format of the kernels.

    The argument `written_ns` identifies the version of the calibration file.
    """
    known = config.make_calibration()
    confidence = np.clip(known.confidence, 1e-6, 1 - 1e-6)
    of_posture = {name: getattr(known, name) for name in kernels.POSTURE.names or ()}
    of_posture["size"] = np.log(known.size)
    of_posture["confidence"] = np.log(confidence / (1 - confidence))
    rows = [table.reshape(len(table), -1) for table in of_posture.values()]
    settings = make_records(Settings, 1)
    for name in ("space_limb", "bias", "limb", "follows"):
        settings[name][:] = getattr(known, name)
    for name in ("error_scale", "max_error", "min_joints", "outside_confidence"):
        settings[name][:] = getattr(config, name)
    settings["shares"][:] = np.sqrt(known.shares)
    settings["at_rest"][:], settings["per_speed"][:] = dt_s / known.slow_s, dt_s / known.slow_m
    settings["common"][:], settings["own"][:] = np.sqrt(known.common), np.sqrt(1 - known.common)
    settings["keep"][:] = [np.exp(-dt_s / lasts_s) for lasts_s in (*known.swap_s, known.miss_s)]
    settings["stature_of_side"][:] = STATURE_OF_SIDE
    return kernels.Tables(np.concatenate(rows, 1), settings)
