"""Draw the pictures in ../data: the lab's worker at different work, seen by different cameras.

    python tests/perception/reference/draw_pictures.py

then `make_reference.py` for the official landmarks. Stored pictures need not be drawn anew
when the scene changes its looks; they test the network's decoding, not the scene.
"""

from pathlib import Path

import cv2
import numpy as np

from hrc_env.core.batching import one
from hrc_env.core.records import Roi, WorkerMotion
from hrc_env.geometry.cameras import project, projections
from hrc_env.motion import generator
from hrc_env.motion.config import MotionConfig
from hrc_env.perception.windows import window_from_joints
from hrc_env.scene.build import build
from hrc_env.scene.render import CropRenderer
from hrc_env.worker.body import load_body, worker_truth

DATA = Path(__file__).parents[1] / "data"
SIDE_PX = 256
STEP_S = 0.5
SEED = 4
PICTURES = {"walk": (7.5, 1), "stand": (10.0, 3), "robot_in_front": (10.0, 2), "reach": (30.0, 1)}
"""Name: time [s] in the worker's day, and camera."""


def main() -> None:
    """Let a worker work and draw each picture when its time has come; one more of a lift."""
    scene = build(n_workers=1)
    renderer = CropRenderer(scene, SIDE_PX)
    state = generator.make_state(1, 1, load_body(), MotionConfig())
    rngs = [np.random.default_rng(SEED)]
    generator.reset(state, np.array([0]), rngs)
    wanted = dict(PICTURES)
    time_s, lifting = 0.0, 0
    while wanted or lifting != 4:
        _, motion = generator.advance(state, rngs, STEP_S, 1)
        time_s += STEP_S
        for name in [name for name, (at_s, _) in wanted.items() if at_s == time_s]:
            draw(name, renderer, motion, wanted.pop(name)[1])
        activity = generator.activity_names[int(generator.activity(state)[0, 0])]
        lifting = lifting + 1 if activity == "lift" else 0
    draw("lift", renderer, motion, camera=3)
    renderer.close()


def draw(name: str, renderer: CropRenderer, motion: WorkerMotion, camera: int) -> None:
    """Store what a camera sees round the worker, not quite in the middle."""
    rig = renderer.scene.cameras
    now = one(motion, 0)
    joints = worker_truth(load_body(), now).joints_world
    px, depth_m = project(projections(rig), joints)
    window = window_from_joints(px[0, camera], depth_m[0, camera], rig[camera])
    if window is None:
        raise SystemExit(f"Camera {camera} does not see the worker of {name!r}: choose another.")
    x, y = window.centre_px
    renderer.pose(renderer.scene.home_q, now)
    picture = renderer.crop(camera, Roi((x + 15, y - 10), 1.15 * window.side_px, 0.0))
    cv2.imwrite(str(DATA / f"{name}.png"), picture[..., ::-1], [cv2.IMWRITE_PNG_COMPRESSION, 9])


if __name__ == "__main__":
    main()
