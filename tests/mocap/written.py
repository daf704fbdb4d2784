"""The project's own motion in other people's formats, with as many of their traps as wished.

python tests/mocap/written.py FOLDER   writes a walk in all of them
"""

import sys
from pathlib import Path

import numpy as np

from assets.recordings.written import (
    BODY,
    ORDERS,
    Y_UP,
    cmu_name,
    compute_angles,
    write_acclaim,
    write_bvh,
)
from assets.rotations import matrix_from_quaternion
from hrc_env.core.records import WorkerMotion
from hrc_env.mocap.poses import make_marks
from hrc_env.worker.body import worker_truth

__all__ = ["BODY", "ORDERS", "Y_UP", "cmu_name", "compute_angles", "write_acclaim", "write_bvh"]


def filmed(motion, worker=0):
    """Segments of one environment's worker over time: origins (T, 22, 3), turns (T, 22, 3, 3)."""
    turns = matrix_from_quaternion(motion.quaternion_wxyz[0, :, worker])
    return motion.position_world[0, :, worker], turns


def centres(position):
    """(T, 14, 3) where bones turn, all joints but the nose, foot tips left out as NaN."""
    marks = make_marks(BODY, landmarks=False)
    out = position[:, marks.segment].copy()
    out[:, [0, 13, 14]] = np.nan
    return out


def true_joints(motion, body=BODY):
    """(T, 15, 3) joints as BlazePose means them."""
    still = np.zeros_like(motion.position_world)
    record = WorkerMotion(motion.position_world, motion.quaternion_wxyz, still, still)
    return worker_truth(body, record).joints_world[0, :, 0]


def main(folder, fps=50.0):
    """Write a walk of the project's own worker into a folder, in every format that is read."""
    sys.path.append(str(Path(__file__).parents[1]))
    from recorded import walk_straight

    folder.mkdir(parents=True, exist_ok=True)
    motion = walk_straight(1.2, length_m=5.0, dt_s=1 / fps).motion
    position, rotation = filmed(motion)
    write_bvh(folder / "walk.bvh", position, rotation, fps)
    write_bvh(
        folder / "traps.bvh", position, rotation, fps, unit_m=0.01, axes=Y_UP, orders=ORDERS,
        rest_first=True, name=lambda segment: cmu_name(segment, "mixamorig:"),
    )  # fmt: skip
    write_acclaim(folder, position, rotation)
    np.savez(folder / "joints.npz", joints=true_joints(motion), fps=fps)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
