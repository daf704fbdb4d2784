"""What the worker does in the laboratory: the paper's list, with our activities."""

import math

import numpy as np

from hrc_env.core.batching import rows
from hrc_env.core.records import WorkerMotion
from hrc_env.experiments.recording import concatenated
from hrc_env.experiments.site.walk import walk
from hrc_env.motion.repertoire import REPERTOIRE, Act, make_worker, perform
from hrc_env.scene.build import Scene
from hrc_env.worker.body import load_body

WALKING = "walking"
_BOX, _BOARD = REPERTOIRE["box from the floor to a table"], REPERTOIRE["board in both hands"]
ACTS: dict[str, tuple[Act, ...]] = {
    "standing": (*REPERTOIRE["stand"], *REPERTOIRE["look round"]),
    "bending": (_BOX[0], _BOARD[2], _BOX[0]),
    "lifting": (_BOARD[0], _BOX[2]),
    "moving_board": _BOARD,
    "moving_wood": REPERTOIRE["board on the shoulder"],
}
"""Bending: down to the floor, up, and down again. Lifting: a board, in place of the paper's
whiteboard, in both hands. The moves take one some 3 m, the second on the shoulder."""
MOTIONS = ("standing", WALKING, "bending", "lifting", "moving_board", "moving_wood")
START_Y_M, START_X_M = 1.5, (0.9, 1.6)
"""Those who go somewhere start so far aside of the robot's axis, and come past it [m]."""


def play(scene: Scene, motion: str, seed: int, n_frames: int, dt_s: float) -> WorkerMotion:
    """(T, 1, S, ...) a motion, at most n_frames, `dt_s` apart; where and which way is drawn."""
    if motion == WALKING:
        return walk(scene, seed, n_frames, dt_s)
    rng = np.random.default_rng([seed, MOTIONS.index(motion)])
    x, side = rng.uniform(*START_X_M), rng.choice([-1.0, 1.0])
    if motion.startswith("moving"):
        start, yaw = (x, side * START_Y_M), -side * math.pi / 2
    else:
        start, yaw = (x, rng.uniform(-0.8, 0.8)), rng.uniform(-math.pi, math.pi)
    me = make_worker(load_body(scene.bodies[0]), start, yaw, right=bool(rng.random() < 0.9))
    films = perform(ACTS[motion], me, rng, dt_s)
    whole = concatenated([film.motion for film in films])
    return rows(whole, np.arange(min(n_frames, len(whole.position_world))))
