"""Move a baked worker's joints to where BlazePose sees them, once.

    python assets/workers/calibrate_joints.py [worker_1 ...] [--dry-run]

The worker is drawn in known poses, BlazePose looks through the four cameras of the lab, its
landmarks are triangulated and expressed in the segment that carries the joint. The median
over all frames, made mirror-symmetric, becomes the joint's offset. The table measures
honestly: with offsets from half of the frames, on the other half.
"""

import argparse
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from poses import POSES, posed

from hrc_env.worker.body import SEGMENTS, Body, assets_dir, load_body, worker_names, worker_truth
from hrc_env.geometry.cameras import project, projections
from assets.rotations import matrix_from_quaternion
from hrc_env.geometry.triangulation import triangulate
from hrc_env.perception.blazepose import decode_landmarks, landmark_input, to_image
from hrc_env.perception.detector import STATURE_OF_SIDE
from hrc_env.perception.network import Landmarker, load_landmarker
from hrc_env.perception.noise import sigma_px
from hrc_env.perception.windows import window_from_joints
from hrc_env.core.records import Roi, WorkerMotion
from hrc_env.scene.build import SceneConfig, build
from hrc_env.scene.render import CropRenderer
from hrc_env.scene.rig import LAB_CAMERAS, make_cameras
from hrc_env.core.skeleton import BLAZEPOSE_INDEX, JOINTS, MIRROR, N_JOINTS

PLACES = (((0.3, 0.0), 0.4), ((1.1, 0.6), 2.1), ((0.5, -0.7), -1.8), ((1.5, -0.2), 3.6))
"""Where the worker stands (x, y) [m] and looks (yaw) [rad]."""
JITTER_DEG = 4.0
MIN_CONFIDENCE = 0.5


def anatomical_offset(name: str) -> np.ndarray:
    """(J, 3) the joints before calibration."""
    with np.load(_path(name)) as baked:
        return baked["joint_anatomical_offset"].astype(float)


def observe(name: str) -> tuple[list[WorkerMotion], np.ndarray, np.ndarray]:
    """Motions of all frames, with detected pixels (B, C, 1, J, 2) and their deviations.

    Windows are laid round the anatomical joints, so that calibrating twice changes nothing.
    """
    scene = build(SceneConfig(clutter=False), n_workers=1, bodies=name)
    body = replace(load_body(name), joint_offset=anatomical_offset(name))
    P = projections(scene.cameras)
    renderer, look = CropRenderer(scene), load_landmarker()
    rng = np.random.default_rng(0)
    motions, px, sigma = [], [], []
    for number, pose in enumerate(POSES):
        for turn, (xy, yaw) in enumerate(PLACES):
            jitter = rng.normal(0, JITTER_DEG, 12)
            motion = posed(body, pose, xy, yaw + 0.7 * number + 0.3 * turn, jitter)
            renderer.pose(scene.home_q, _one_worker(motion))
            joints_px, depth_m = project(P, worker_truth(body, motion).joints_world[None])
            found = []
            for c, camera in enumerate(scene.cameras):
                window = window_from_joints(joints_px[0, c], depth_m[0, c], camera)
                found.append(_detect(renderer, look, c, window))
            motions.append(motion)
            px.append([each[0] for each in found])
            sigma.append([each[1] for each in found])
    renderer.close()
    return motions, np.array(px)[:, :, None], np.array(sigma)[:, :, None]


def _one_worker(motion: WorkerMotion) -> WorkerMotion:
    """A motion (S, ...) as that of all workers of an environment (1, S, ...)."""
    return WorkerMotion(
        motion.position_world[None],
        motion.quaternion_wxyz[None],
        motion.velocity_world[None],
        motion.angular_velocity_world[None],
    )


def _detect(
    renderer: CropRenderer, look: Landmarker, camera: int, window: Roi | None
) -> tuple[np.ndarray, np.ndarray]:
    """Landmarks of one view in image pixels (J, 2) and their deviations (J,)."""
    if window is None:
        return np.full((N_JOINTS, 2), np.nan), np.full(N_JOINTS, np.inf)
    points, flag, heat = look(landmark_input(renderer.crop(camera, window)))
    joints = decode_landmarks(points, heat)[BLAZEPOSE_INDEX]
    sigma = sigma_px(joints[:, 2], STATURE_OF_SIDE * window.side_px)
    sigma[(joints[:, 2] < MIN_CONFIDENCE) | (flag < 0.5)] = np.inf
    return to_image(joints[:, :2], window), sigma


def in_segments(
    body: Body, motions: list[WorkerMotion], points: np.ndarray, segment: np.ndarray
) -> np.ndarray:
    """(B, J, 3) world points in the frames of the segments (J,) that carry them."""
    local = np.full(points.shape, np.nan)
    for b, motion in enumerate(motions):
        turn = matrix_from_quaternion(motion.quaternion_wxyz[segment])
        local[b] = np.einsum("jik,ji->jk", turn, points[b] - motion.position_world[segment])
    return local


def symmetric_median(local: np.ndarray) -> np.ndarray:
    """(J, 3) median offsets of (B, J, 3), each pooled with its mirrored partner's."""
    pooled = np.concatenate([local, local[:, MIRROR] * [1.0, -1.0, 1.0]])
    return np.nanmedian(pooled, axis=0)


@dataclass(frozen=True)
class Calibration:
    """Offsets and how well they hold, per joint [m]."""

    offset: np.ndarray
    """(J, 3) in the carrying segment's frame, from all frames."""
    moved: np.ndarray
    """(J,) how far the calibration moved the joint from the anatomical landmark."""
    before: np.ndarray
    """(J,) median distance of detections to the anatomical landmark, held-out frames."""
    after: np.ndarray
    """(J,) the same to offsets fitted on the other frames."""
    bias: np.ndarray
    """(J,) distance between the offsets that the two halves of the frames give."""
    n_frames: np.ndarray
    """(J,) frames in which the joint could be triangulated."""


def calibrate(name: str) -> Calibration:
    """Look at a worker in all poses and places."""
    body = load_body(name)
    motions, px, sigma = observe(name)
    points = triangulate(projections(make_cameras(LAB_CAMERAS)), px, sigma, 5.0).points_world[:, 0]
    local = in_segments(body, motions, points, body.joint_segment)
    anatomical = anatomical_offset(name)
    held_out = np.arange(len(motions)) % 2 == 1
    offset, fitted = symmetric_median(local), symmetric_median(local[~held_out])
    return Calibration(
        offset=offset,
        moved=np.linalg.norm(offset - anatomical, axis=-1),
        before=np.nanmedian(np.linalg.norm(local - anatomical, axis=-1)[held_out], axis=0),
        after=np.nanmedian(np.linalg.norm(local - fitted, axis=-1)[held_out], axis=0),
        bias=np.linalg.norm(symmetric_median(local[held_out]) - fitted, axis=-1),
        n_frames=np.isfinite(local[..., 0]).sum(0),
    )


def table(result: Calibration, body: Body) -> str:
    """The README's table in mm, left and right together."""
    rows = ["| joint | carried by | moved | before | after | bias | frames |", "|---" * 7 + "|"]
    for j, name in enumerate(JOINTS):
        if name.startswith("right_"):
            continue
        pair = sorted({j, int(MIRROR[j])})
        columns = (result.moved, result.before, result.after, result.bias)
        mm = " | ".join(f"{1000 * column[pair].mean():.0f}" for column in columns)
        segment = SEGMENTS[body.joint_segment[j]].removeprefix("left_").replace("_", " ")
        joint = name.removeprefix("left_")
        rows.append(f"| {joint} | {segment} | {mm} | {result.n_frames[pair].sum()} |")
    return "\n".join(rows)


def _path(name: str) -> Path:
    return assets_dir() / "workers" / f"{name}.npz"


def main() -> None:
    """Calibrate workers and write the offsets into their files."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help=f"{', '.join(worker_names())}; none takes all")
    parser.add_argument("--dry-run", action="store_true", help="only print the table")
    arguments = parser.parse_args()
    for name in arguments.names or worker_names():
        result = calibrate(name)
        print(f"\n{name}\n{table(result, load_body(name))}", flush=True)
        if not arguments.dry_run:
            with np.load(_path(name)) as baked:
                arrays = dict(baked)
            arrays["joint_offset"] = result.offset.astype(np.float32)
            np.savez_compressed(_path(name), **arrays)


if __name__ == "__main__":
    main()
