"""Film strips: moments of a clip beside each other, with the worker who plays it."""

import numpy as np

from hrc_env.core.records import WorkerMotion
from hrc_env.core.typing import Image
from hrc_env.geometry.cameras import pinhole
from hrc_env.mocap.poses import segments_in
from hrc_env.motion import controls as c
from hrc_env.motion.anatomy import anatomy
from hrc_env.motion.clip import Clip, fitted_to
from hrc_env.render import overlay
from hrc_env.scene.build import SceneConfig, build
from hrc_env.scene.render import PictureRenderer
from hrc_env.worker.body import load_body

TILE = (300, 400)
N_MOMENTS, COLUMNS = 12, 6
STAGE_M = (0.9, 0.3)
"""Where the worker's middle is put in every picture [m]: a strip shows poses, not ways."""
EYE_M, TARGET_Z_M, HFOV_DEG = (1.4, -1.7, 1.35), 0.95, 44.0
"""The camera's place from there, the height that it looks at [m], its field of view."""


def film_strip(clip: Clip, worker: str) -> Image:
    """Moments of a clip at equal intervals, each with its time.

    Raises:
        RenderingError: this machine has no OpenGL.
    """
    scene = build(SceneConfig(), "lab", 1, worker)
    renderer, bones = PictureRenderer(scene, *TILE), anatomy(load_body(worker))
    eye = np.array([STAGE_M[0] + EYE_M[0], STAGE_M[1] + EYE_M[1], EYE_M[2]])
    target = np.array([*STAGE_M, TARGET_Z_M])
    camera = pinhole("strip", eye, target, HFOV_DEG, *TILE)
    rows = np.linspace(0, len(clip.controls) - 1, N_MOMENTS).astype(int)
    q = fitted_to(clip, bones.size)[rows]
    shift = np.array(STAGE_M) - q[:, [c.ROOT_X, c.ROOT_Y]]
    for at in (c.ROOT_X, c.ANKLE, c.ANKLE + 6):
        q[:, at : at + 2] += shift
    position, turn = segments_in(q, bones)
    still = np.zeros((1, *position.shape[1:]))
    tiles = []
    try:
        for k, row in enumerate(rows):
            motion = WorkerMotion(position[k : k + 1], turn[k : k + 1], still, still)
            tile = np.array(renderer.picture(scene.home_q, motion, camera), np.uint8)
            overlay.label(tile, f"{row / clip.fps:.1f} s", (6, 6), 14)
            tiles.append(tile)
    finally:
        renderer.close()
    return overlay.tile(tiles, COLUMNS)
