"""Marks that are drawn over the scene: markers of the task, capsules of robot and people."""

from dataclasses import dataclass

import numpy as np

from hrc_env.core.batching import one
from hrc_env.core.typing import Capsules, Floats, Image, Points3
from hrc_env.geometry.cameras import PinholeCamera
from hrc_env.geometry.enclosure import enclose
from hrc_env.motion import generator
from hrc_env.render import overlay
from hrc_env.scene.canvas import Marks
from hrc_env.simulation import Simulation
from hrc_env.worker.body import worker_truth

OVERLAYS = ("capsules",)
"""Names of the overlays that are available for pictures of the scene."""
MARKER_M = 0.05
"""Radius of a marker [m]."""
MARKER_PX = 4
"""Minimum radius of a marker in a picture [px]."""
MARKER_SHOWN = 0.8
"""Opacity of visible markers."""
MARKER_HIDDEN = 0.3
"""Opacity of occluded markers."""
CAPSULES_SHOWN = 0.5
"""Opacity of visible capsules."""
CAPSULES_HIDDEN = 0.12
"""Opacity of occluded capsules."""
COLOURS = {
    "robot": overlay.LEFT,
    "people, estimated": overlay.BELIEF,
    "people, true": overlay.RIGHT,
}
"""Colours of the groups of capsules, by the group's name."""
LEGEND_FROM_PX = 320
"""Minimum width of pictures with a legend [px]."""


@dataclass(frozen=True, slots=True, eq=False)
class Solids:
    """Capsules of one group that are used for the computation of distances."""

    group: str
    """Name of the group, a key of `COLOURS`."""
    ends_world: Capsules
    """(N, 2, 3) end points of the capsules' axes [m]."""
    radius_m: Floats
    """(N,) radii of the capsules [m]."""


def find_solids(simulation: Simulation, b: int) -> tuple[Solids, ...]:
    """Return the capsules of robot and people in environment `b`, by group.

    Shields, rewards and the observed separation are computed from the capsules of the robot with
    its load and of the estimated people; workers without a track have no estimated capsules. Costs,
    contacts and `info["safety/..."]` are computed from the capsules of the robot and of the true
    people.
    """
    robot, estimate = simulation.belief.robot, one(simulation.estimate, b)
    believed = enclose(estimate.mean_world[estimate.tracked])
    motion = one(generator.current(simulation.motion, np.array([b])), 0)
    truth, present = worker_truth(simulation.bodies, motion), simulation.present[b]
    return (
        Solids("robot", robot.capsules_world[b], robot.capsule_radius_m),
        Solids(
            "people, estimated",
            believed.ends_world.reshape(-1, 2, 3),
            believed.radius_m.reshape(-1),
        ),
        Solids(
            "people, true",
            truth.capsules_world[present].reshape(-1, 2, 3),
            truth.capsule_radius_m[present].reshape(-1),
        ),
    )


def mark_solids(solids: tuple[Solids, ...]) -> Marks:
    """Return capsules as marks of a picture, in the colours of their groups."""
    colours = [
        np.tile(np.array(COLOURS[each.group]) / 255, (len(each.radius_m), 1)) for each in solids
    ]
    return Marks(
        np.concatenate([each.ends_world for each in solids]),
        np.concatenate([each.radius_m for each in solids]),
        np.concatenate(colours),
    )


def mark_points(points_world: Points3, camera: PinholeCamera) -> Marks:
    """Return sphere markers centred on the points (M, 3) [m], for a camera's picture."""
    depth_m = (points_world - camera.eye_world) @ camera.T_world_from_cam[:3, 2]
    radius_m = np.maximum(MARKER_M, MARKER_PX * depth_m / camera.K[0, 0])
    rgb = np.tile(np.array(overlay.GOAL) / 255, (len(points_world), 1))
    return Marks(np.repeat(points_world[:, None], 2, axis=1), radius_m, rgb)


def draw_legend(image: Image, solids: tuple[Solids, ...]) -> None:
    """Draw a legend of the groups of capsules and their colours in a picture."""
    height, width = image.shape[:2]
    if width < LEGEND_FROM_PX:
        return
    size, names = max(12, width // 60), [each.group for each in solids if len(each.radius_m)]
    for row, group in enumerate(names):
        corner = size // 2, height - (len(names) - row) * round(1.7 * size) - size // 2
        overlay.label(image, group, corner, size, COLOURS[group])
