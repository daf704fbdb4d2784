"""Pictures of baked workers in the lab's light, to look at.

    python assets/workers/portraits.py [worker_1 ...] --to DIR

One sheet a worker: front, side and three quarters, standing and reaching, then the face.
"""

import argparse
from pathlib import Path

import cv2
import numpy as np
from poses import posed

from hrc_env.worker.body import SEGMENT, load_body, worker_names
from hrc_env.geometry.cameras import PinholeCamera, pinhole
from hrc_env.render.overlay import label, tile
from hrc_env.core.records import WorkerMotion
from hrc_env.scene.build import SceneConfig, build
from hrc_env.scene.render import PictureRenderer

PLACE, YAW = (0.7, 0.6), -np.pi / 2
"""Where the worker stands [m] and looks [rad]."""
VIEWS_RAD = {"front": 0.0, "side": np.pi / 2, "three quarters": np.pi / 4, "behind": 0.8 * np.pi}
WIDTH_PX, HEIGHT_PX = 560, 840


def camera(
    target: np.ndarray, turn_rad: float, distance_m: float, hfov_deg: float
) -> PinholeCamera:
    """A camera that looks at a target from `turn_rad` beside where the worker looks."""
    turn = YAW + turn_rad
    away = distance_m * np.array([np.cos(turn), np.sin(turn), 0.1])
    return pinhole("portrait", target + away, target, hfov_deg, WIDTH_PX, HEIGHT_PX)


def sheet(name: str) -> np.ndarray:
    """All views of one worker."""
    scene = build(SceneConfig(clutter=False), n_workers=1, bodies=name)
    renderer = PictureRenderer(scene, WIDTH_PX, HEIGHT_PX)
    body, found = load_body(name), []
    for pose in ("stand", "reach"):
        motion = posed(body, pose, PLACE, YAW, np.zeros(12))
        alone = WorkerMotion(*(getattr(motion, field)[None] for field in _FIELDS))
        middle = np.array([*PLACE, 0.5 * body.stature_m + 0.03])
        shots = [(view, camera(middle, turn, 1.9, 46.0)) for view, turn in VIEWS_RAD.items()]
        head = motion.position_world[SEGMENT["head"]] + [0.0, 0.0, 0.06]
        turns = {"stand": (0.0, 0.7), "reach": (np.pi / 2, 0.8 * np.pi)}[pose]
        shots += [("head", camera(head, turn, 0.8, 30.0)) for turn in turns]
        for view, eye in shots:
            picture = np.array(renderer.picture(scene.home_q, alone, eye))
            label(picture, f"{name} {pose}, {view}", (6, 6), 15)
            found.append(picture)
    renderer.close()
    return tile(found, 6)


_FIELDS = ("position_world", "quaternion_wxyz", "velocity_world", "angular_velocity_world")


def main() -> None:
    """Draw the named workers, or all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help=f"{', '.join(worker_names())}; none draws all")
    parser.add_argument("--to", type=Path, required=True, help="folder to write into")
    arguments = parser.parse_args()
    arguments.to.mkdir(parents=True, exist_ok=True)
    for name in arguments.names or worker_names():
        picture = cv2.cvtColor(sheet(name), cv2.COLOR_RGB2BGR)
        cv2.imwrite(str(arguments.to / f"{name}.png"), picture)


if __name__ == "__main__":
    main()
