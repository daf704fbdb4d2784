"""Motions of the laboratory study: the paper's motions, composed of activities of this package."""

import math

import numpy as np

from hrc_env.core.batching import rows
from hrc_env.core.records import WorkerMotion
from hrc_env.experiments.recording import concatenate
from hrc_env.experiments.site.walk import walk
from hrc_env.motion.repertoire import REPERTOIRE, Act, make_worker, perform
from hrc_env.scene.build import Scene
from hrc_env.worker.body import load_body

WALKING = "walking"
"""Name of the motion that follows a path."""
_BOX, _BOARD = REPERTOIRE["box from the floor to a table"], REPERTOIRE["board in both hands"]
ACTS: dict[str, tuple[Act, ...]] = {
    "standing": (*REPERTOIRE["stand"], *REPERTOIRE["look round"]),
    "bending": (_BOX[0], _BOARD[2], _BOX[0]),
    "lifting": (_BOARD[0], _BOX[2]),
    "moving_board": _BOARD,
    "moving_wood": REPERTOIRE["board on the shoulder"],
}
"""Activities of each motion.

In "bending", the worker bends down to the floor, rises, and bends down again. In "lifting", the
worker lifts a board with both hands, instead of the paper's whiteboard. In "moving_board" and
"moving_wood", the worker carries a board for about 3 m, in both hands or on the shoulder.
"""
MOTIONS = ("standing", WALKING, "bending", "lifting", "moving_board", "moving_wood")
"""Names of the motions."""
START_Y_M, START_X_M = 1.5, (0.9, 1.6)
"""Start of motions that lead past the robot [m]: distance to its side, and range along its axis."""


def play(scene: Scene, motion: str, seed: int, n_frames: int, dt_s: float) -> WorkerMotion:
    """Return a motion (T, 1, S, ...) of at most `n_frames` frames at intervals of `dt_s`.

    Position and heading are sampled with the seed.
    """
    if motion == WALKING:
        return walk(scene, seed, n_frames, dt_s)
    rng = np.random.default_rng([seed, MOTIONS.index(motion)])
    x, side = rng.uniform(*START_X_M), rng.choice([-1.0, 1.0])
    if motion.startswith("moving"):
        start, yaw = (x, side * START_Y_M), -side * math.pi / 2
    else:
        start, yaw = (x, rng.uniform(-0.8, 0.8)), rng.uniform(-math.pi, math.pi)
    performer = make_worker(load_body(scene.bodies[0]), start, yaw, right=bool(rng.random() < 0.9))
    films = perform(ACTS[motion], performer, rng, dt_s)
    motions = concatenate([film.motion for film in films])
    return rows(motions, np.arange(min(n_frames, len(motions.position_world))))
