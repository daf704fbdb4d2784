"""How often a scene hides a walking worker's head from its cameras.

    python benchmarks/occlusion.py --scene site

Heads stand at random in the walkable area, 1.60 to 1.75 m high, half a body clear of what stands
there and of the robot. What hides: the scene's solid things and the robot at rest, as the emulator
has it; not the workers themselves. The paper's site hides a head from at least one of four cameras
in 30 % of frames, from two or more in 10 %.
"""

import numpy as np
import tyro

from hrc_env.core.records import Grounds
from hrc_env.core.typing import Bools, Floats
from hrc_env.geometry.sight import hidden
from hrc_env.scene.build import Scene, build

HEAD_M, BODY_M = (1.60, 1.75), 0.25
"""Heights of the heads' middles; half a person [m]."""


def main(scene: str = "site", n_heads: int = 20000, seed: int = 0) -> None:
    """Print the shares of random heads that are hidden from 1, 2, ... cameras.

    Args:
        scene: which scene.
        n_heads: how many places are tried.
        seed: of the places.
    """
    place = build(name=scene)
    heads = random_heads(place.grounds, n_heads, np.random.default_rng(seed))
    blind = hidden_from(place, heads)
    print(f"scene {scene}, seed {seed}: {len(heads)} heads that fit")
    for camera, share in zip(place.cameras, blind.mean(1), strict=True):
        print(f"hidden from {camera.name}: {100 * share:5.1f} %")
    for n in range(1, len(blind) + 1):
        print(f"hidden from {n} or more: {100 * (blind.sum(0) >= n).mean():5.1f} %")


def random_heads(grounds: Grounds, n: int, rng: np.random.Generator) -> Floats:
    """(at most n, 3) heads where a person has room [m]."""
    (x0, x1), (y0, y1) = grounds.walkable_x_m, grounds.walkable_y_m
    heads = rng.uniform([x0, y0, HEAD_M[0]], [x1, y1, HEAD_M[1]], (n, 3))
    free = np.hypot(*(heads[:, :2] - grounds.robot_xy_m).T) > grounds.robot_clearance_m
    for x, y, half_length, half_width, yaw in grounds.blocked:
        dx, dy = heads[:, 0] - x, heads[:, 1] - y
        along = np.abs(np.cos(yaw) * dx + np.sin(yaw) * dy) - half_length
        aside = np.abs(np.cos(yaw) * dy - np.sin(yaw) * dx) - half_width
        free &= np.maximum(along, aside) > BODY_M
    return heads[free]


def hidden_from(scene: Scene, heads: Floats) -> Bools:
    """(C, n) whether each camera does not see each head."""
    eyes = np.stack([camera.eye_world for camera in scene.cameras])
    return hidden(scene.surroundings(scene.home_q[None]), eyes, heads[None])[0]


if __name__ == "__main__":
    tyro.cli(main)
