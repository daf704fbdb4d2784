"""How often a scene hides a walking worker's head from its cameras: python -m benchmarks.occlusion

Heads stand at random in the walkable area, 1.60 to 1.75 m high, half a body clear of what stands
there and of the robot. What hides: the scene's solid things and the robot at rest, as the emulator
has it; not the workers themselves.
"""

from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import tyro

from benchmarks.common import keys, publish, share
from hrc_env.core.records import Grounds
from hrc_env.core.results import Metric
from hrc_env.core.typing import Bools, Floats
from hrc_env.experiments.study.report import Column, Report, table_of
from hrc_env.geometry.sight import hidden
from hrc_env.scene.build import SCENES, Scene, build

HEAD_M, BODY_M = (1.60, 1.75), 0.25
"""Heights of the heads' middles; half a person [m]."""


@dataclass(frozen=True)
class Arguments:
    """Count heads that cameras do not see."""

    out: Path = Path("out/occlusion")
    """Folder for results.json and a report."""
    quick: bool = False
    """500 heads."""
    n_heads: int = 20000
    """How many places are tried in each scene."""
    seed: int = 0
    """Of the places."""


def main(arguments: Arguments) -> None:
    """Count, write, show."""
    metrics: dict[str, Metric] = {}
    n_heads = 500 if arguments.quick else arguments.n_heads
    for scene in SCENES:
        place = build(name=scene)
        heads = random_heads(place.grounds, n_heads, np.random.default_rng(arguments.seed))
        blind = hidden_from(place, heads)
        for camera, unseen in zip(place.cameras, blind, strict=True):
            metrics[f"hidden.{scene}.{camera.name}"] = share(unseen.tolist())
        for n in range(1, len(blind) + 1):
            metrics[f"hidden.{scene}.{n}"] = share((blind.sum(0) >= n).tolist())
    rows = {name: name.replace(".", ", ") for name in keys(metrics, "hidden.")}
    parts = [table_of("hidden from", rows, [Column("hidden.{}", "heads [%]", 1, 100)], metrics)]
    report = Report("Hidden heads", (__doc__ or "").strip(), parts, "95 % intervals over heads")
    publish(arguments.out, report, asdict(arguments), [arguments.seed], metrics)


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
    main(tyro.cli(Arguments, description=__doc__))
