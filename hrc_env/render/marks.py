"""Marks in pictures beside the scene: places that the task marks, and shapes of which distances are
taken."""

from dataclasses import dataclass

import numpy as np

from hrc_env.core.batching import one
from hrc_env.core.skeleton import SEGMENT_RADIUS_M
from hrc_env.core.typing import Capsules, Floats, Image, Points3
from hrc_env.geometry.cameras import PinholeCamera
from hrc_env.geometry.distances import segments
from hrc_env.motion import generator
from hrc_env.render import overlay
from hrc_env.scene.canvas import Marks
from hrc_env.simulation import Simulation
from hrc_env.worker.body import worker_truth

OVERLAYS = ("capsules",)
"""Overlays of a picture of the scene."""
MARKER_M, MARKER_PX = 0.05, 4
"""Radius of a marker [m], and in a picture at least [px]."""
MARKER_SHOWN, MARKER_HIDDEN = 0.8, 0.3
CAPSULES_SHOWN, CAPSULES_HIDDEN = 0.5, 0.12
"""Opacity before other things, and behind them."""
COLOURS = {
    "robot": overlay.LEFT,
    "people, as believed": overlay.BELIEF,
    "people, as they are": overlay.RIGHT,
}
"""Of capsules, by whose they are."""
LEGEND_FROM_PX = 320
"""Pictures that are narrower have no legend."""


@dataclass(frozen=True, slots=True, eq=False)
class Solids:
    """Capsules of one group, as distances take them."""

    whose: str
    """A key of `COLOURS`."""
    ends_world: Capsules
    """(N, 2, 3) [m]."""
    radius_m: Floats
    """(N,)."""


def solids_of(simulation: Simulation, b: int) -> tuple[Solids, ...]:
    """Return the capsules of environment `b`.

    Those of the robot, with what it holds, and of people as they are believed are what shields,
    rewards and the observed separation take. Costs, contacts and `info["safety/..."]` take the
    robot and people as they are. Nobody stands for who is not tracked.
    """
    robot, seen = simulation.belief.robot, one(simulation.estimate, b)
    believed = segments(seen.mean_world[seen.tracked])
    motion = one(generator.current(simulation.motion, np.array([b])), 0)
    truth, there = worker_truth(simulation.bodies, motion), simulation.present[b]
    return (
        Solids("robot", robot.capsules_world[b], robot.capsule_radius_m),
        Solids(
            "people, as believed",
            believed.reshape(-1, 2, 3),
            np.tile(SEGMENT_RADIUS_M, len(believed)),
        ),
        Solids(
            "people, as they are",
            truth.capsules_world[there].reshape(-1, 2, 3),
            truth.capsule_radius_m[there].reshape(-1),
        ),
    )


def marks_of(solids: tuple[Solids, ...]) -> Marks:
    """Return capsules as a picture shows them."""
    colours = [np.tile(np.array(COLOURS[s.whose]) / 255, (len(s.radius_m), 1)) for s in solids]
    return Marks(
        np.concatenate([each.ends_world for each in solids]),
        np.concatenate([each.radius_m for each in solids]),
        np.concatenate(colours),
    )


def markers_of(points_world: Points3, camera: PinholeCamera) -> Marks:
    """Return a sphere round each point (M, 3), in a picture of a camera."""
    depth_m = (points_world - camera.eye_world) @ camera.T_world_from_cam[:3, 2]
    radius_m = np.maximum(MARKER_M, MARKER_PX * depth_m / camera.K[0, 0])
    rgb = np.tile(np.array(overlay.GOAL) / 255, (len(points_world), 1))
    return Marks(np.repeat(points_world[:, None], 2, axis=1), radius_m, rgb)


def draw_legend(image: Image, solids: tuple[Solids, ...]) -> None:
    """Write whose capsules have which colour, in place."""
    height, width = image.shape[:2]
    if width < LEGEND_FROM_PX:
        return
    size, names = max(12, width // 60), [each.whose for each in solids if len(each.radius_m)]
    for row, whose in enumerate(names):
        at = size // 2, height - (len(names) - row) * round(1.7 * size) - size // 2
        overlay.label(image, whose, at, size, COLOURS[whose])
