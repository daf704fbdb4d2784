"""Keypoints without pixels: the projected truth with BlazePose's errors, drawn from a calibration
that was fitted to what the network made of rendered workers (docs/emulator.md).

A window of side s surrounds the worker in every camera, turned as the torso is, as the detector
would choose it. In it, of joint j of kind k in camera c:

    pixel = projection of (p_j + R (o_k + w_k far n)) + s T (b_k(view) + size whole m_j)

R is the frame of the body: ahead, to the joint's own side, up; o and w an offset in space and its
standard deviation (`offset_m`, `wander_m`); n is normal, shared by all cameras, and correlated
along limbs and between hips and shoulders (`space_limb`); far = 1 + tail n.n / 3, so that now and
then all cameras agree on a joint that is far off. In the image, b is the mean error from 8 views,
mirrored for right joints (`bias`); size = exp(log size + spread z), z normal, of seen, hidden and
outside joints (`size`, `spread`); whole a factor of all joints of a body in a camera, drawn from
its measured quantiles (`body`); m = a cos(view) + b sin(view) drawn for the episode, a part that
lasts and a part that is new, mixed with the next joint's towards the trunk (`shares`, `limb`); T
the turn of the window.

- n, z, whole and the lasting part of m are first-order autoregressions that keep
  exp(-dt / `slow_s` - dt v / `slow_m`) a step, with v the mean speed of the joints.
- The reported visibility is drawn from its measured quantiles (`confidence`) by a normal variable
  that is correlated with the smallness of the errors (`follows`, `common`).
- Tables are given for bodies that stand, walk, handle something, are folded, and kneel; the
  posture is computed from the joints (`hrc_env/perception/outline.py`).
- Occlusion is geometry: rays against scene, robot, bodies and things that are carried.
- Left and right (of all joints, or of the legs) are exchanged, and a worker is missed, while a
  slow normal variable is in its lower tail (`swap_share`, `miss_share`, `swap_s`, `miss_s`), so
  that both last.
"""

import functools
import math
from dataclasses import dataclass, replace

import numpy as np

from hrc_env.core.errors import ConfigError, check_fields, check_shape
from hrc_env.core.records import Keypoints, PoseEstimate, WorkerTruth
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Floats, Ints, Records, Rngs
from hrc_env.geometry.cameras import PinholeCamera
from hrc_env.geometry.lens import lens_row
from hrc_env.geometry.sight import Surroundings
from hrc_env.perception import emulator_kernel as kernels
from hrc_env.perception.calibration import POSTURED, Calibration, changed_ns, read_calibration
from hrc_env.perception.dimness import Quality
from hrc_env.perception.searching import STATURE_OF_SIDE
from hrc_env.perception.sightlines import CAMERA, N_LOOK, World, sight_batch


@dataclass(frozen=True, slots=True)
class EmulatorConfig:
    """What is known of the detector's errors, and what is different where they are drawn."""

    calibration: str = ""
    """A file that `python -m assets.emulator.calibrate` wrote; empty: the package's own. What it
    says of deviations and offsets the tracker is told at `pixels` too."""
    error_scale: float = 1.0
    """Factor on all errors of position; 0: the projected truth. What is told of them stays."""
    max_error: float = 0.4
    """No camera's error is larger than this share of the window's side: it holds one body."""
    swap_share: float | None = None
    """Share of the time that a camera exchanges left and right; None: as calibrated, by view."""
    miss_share: float | None = None
    """Share of the time that a camera loses a worker; None: as calibrated, by joints in sight."""
    min_joints: int = 1
    """Fewer joints (of 15) in sight of a camera, and it does not see the worker."""
    outside_confidence: float = 0.1
    """Joints outside the image are guesses, at most this visible; as in `DetectorConfig`."""

    def __post_init__(self) -> None:
        check_fields(self, "not be negative", "error_scale", "max_error")
        chosen = [n for n in ("swap_share", "miss_share") if getattr(self, n) is not None]
        check_fields(self, "be in [0, 1]", "outside_confidence", *chosen)
        self.calibrated()

    def calibrated(self) -> Calibration:
        """The calibration, with what is different. Raises `ConfigError` for a bad file."""
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
    """What the detector's errors remember from image to image, in standard deviations."""

    errors: Records  # (B, C, W) `emulator_kernel.ERRORS`
    wander: Floats  # (B, W, J, 3) the same in every camera, a joint's own: ahead, aside, up
    dt_s: float  # time between images [s]


def make_state(
    batch: int, n_cameras: int, n_workers: int, dt_s: float, config: EmulatorConfig
) -> EmulatorState:
    """A state for `batch` environments with images `dt_s` apart; `reset` it before use."""
    if not dt_s > 0:
        raise ConfigError(f"The time between images must be positive, got {dt_s} s.")
    errors = np.zeros((batch, n_cameras, n_workers), kernels.ERRORS)
    return EmulatorState(errors, np.zeros((batch, n_workers, N_JOINTS, 3)), dt_s)


def reset(state: EmulatorState, ids: Ints, rngs: Rngs) -> None:
    """Begin environments `ids` anew with errors drawn from how they are in the long run."""
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
    """What the detector would report of the workers in one image of every camera, in its pixels;
    NaN, 0 and infinity of a worker who is not seen.

    Args:
        state: of the errors, advanced by one image in place.
        truth: (B, W, ...) the workers; their capsules hide joints of their own and of others.
        surroundings: (B, ...) the room, what is carried and the robot, which hide joints too.
        config: as given to `make_state`.
        expected: (B, W, ...) what the tracker predicts, which decides what is told of errors; None,
            and where there is no track near: what a search assumes, somebody who stands.
        dim: (B, C) how well the pictures show people; None: as in usual light.
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
    calibration = _settings(config, state.dt_s, written_ns)
    out = kernels.Report(np.empty((*shape, 2)), np.empty(shape), np.empty(shape))
    world, rig = _world(truth, surroundings), _rig(cameras)
    known = _known(expected, truth.joints_world.shape)
    shows = _shows(dim, (batch, n_cameras))
    state_of = state.errors, state.wander, normals
    kernels.emulate_batch(*state_of, world, known, rig, shows, calibration, out)
    return Keypoints(*out)


def _known(expected: PoseEstimate | None, shape: tuple[int, ...]) -> kernels.Expected:
    if expected is None:
        nowhere = np.zeros(shape)
        return kernels.Expected(nowhere, nowhere, np.zeros(shape[:2], np.bool_))
    joints, velocity = map(np.ascontiguousarray, (expected.mean_world, expected.velocity_world))
    return kernels.Expected(joints, velocity, np.ascontiguousarray(expected.tracked))


def _shows(dim: Quality | None, shape: tuple[int, int]) -> Floats:
    shows = np.zeros((*shape, 2))
    shows[..., kernels.DOUBT] = 1.0 if dim is None else dim.doubt
    shows[..., kernels.OVERLOOKED] = 0.0 if dim is None else dim.missed
    return shows


def lines_of_sight(
    truth: WorkerTruth, surroundings: Surroundings, cameras: tuple[PinholeCamera, ...]
) -> tuple[Ints, Floats]:
    """How each camera sees each joint, (B, C, W, J) `sightlines.SEEN` to `BEHIND`, and each worker,
    (B, C, W, `N_LOOK`) `SIDE` to `STEPPING`, as the emulator has it."""
    batch, n_workers, n_joints = truth.joints_world.shape[:3]
    sight = np.empty((batch, len(cameras), n_workers, n_joints), np.int64)
    look_of = np.empty((batch, len(cameras), n_workers, N_LOOK))
    sight_batch(_world(truth, surroundings), _rig(cameras), sight, look_of)
    return sight, look_of


def _world(truth: WorkerTruth, surroundings: Surroundings) -> World:
    workers = truth.joints_world, truth.velocity_world, truth.capsules_world, truth.capsule_radius_m
    robot = surroundings.capsules_world, surroundings.capsule_radius_m
    joints, velocity, capsules, radius = map(np.ascontiguousarray, workers)
    obstacles = surroundings.still, surroundings.moving
    return World(joints, velocity, capsules, radius, *obstacles, *robot)


def without_names(keypoints: Keypoints, rngs: Rngs) -> Keypoints:
    """The same poses, in every camera in an order of its own: nobody wears a name."""
    batch, n_cameras, n_workers = keypoints.confidence.shape[:3]
    order = np.tile(np.arange(n_workers), (batch, n_cameras, 1))
    for b in range(batch):
        order[b] = rngs[b].permuted(order[b], axis=-1)
    pick = (np.arange(batch)[:, None, None], np.arange(n_cameras)[:, None], order)
    parts = (keypoints.px[pick], keypoints.confidence[pick], keypoints.sigma_px[pick])
    return Keypoints(*parts, keypoints.time_s)


@functools.lru_cache(maxsize=16)
def _rig(cameras: tuple[PinholeCamera, ...]) -> Records:
    """(C,) `CAMERA`."""
    rig = np.zeros(len(cameras), CAMERA)
    for row, camera in zip(rig, cameras, strict=True):
        row["P"], row["eye"] = camera.P, camera.eye_world
        row["size_px"] = camera.width_px, camera.height_px
        row["focal_px"], row["centre_px"] = camera.K[[0, 1], [0, 1]], camera.K[:2, 2]
        if camera.lens is not None:
            row["has_lens"], row["lens"] = True, lens_row(camera.lens)
    return rig


@functools.lru_cache(maxsize=16)
def _settings(config: EmulatorConfig, dt_s: float, written_ns: int) -> tuple[Floats, Records]:
    """A calibration as the kernel takes it: (P, N) postures, (1,) `SETTINGS`; read again if its
    file has been written anew."""
    known = config.calibrated()
    confidence = np.clip(known.confidence, 1e-6, 1 - 1e-6)
    of_posture = {name: getattr(known, name) for name in POSTURED}
    of_posture["size"] = np.log(known.size)
    of_posture["confidence"] = np.log(confidence / (1 - confidence))
    rows = [table.reshape(len(table), -1) for table in of_posture.values()]
    settings = np.zeros(1, kernels.SETTINGS)
    for name in ("space_limb", "bias", "limb", "follows"):
        settings[name] = getattr(known, name)
    for name in ("error_scale", "max_error", "min_joints", "outside_confidence"):
        settings[name] = getattr(config, name)
    settings["shares"] = np.sqrt(known.shares)
    settings["at_rest"], settings["per_speed"] = dt_s / known.slow_s, dt_s / known.slow_m
    settings["common"], settings["own"] = np.sqrt(known.common), np.sqrt(1 - known.common)
    settings["keep"] = [np.exp(-dt_s / lasts_s) for lasts_s in (*known.swap_s, known.miss_s)]
    settings["stature_of_side"] = STATURE_OF_SIDE
    return np.concatenate(rows, 1), settings
