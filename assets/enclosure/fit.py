"""Fit hrc_env/geometry/enclosure.json: python -m assets.enclosure.fit

The axes of the capsules are fitted by least squares, with left and right sides pooled. A radius is
such that at most `PROTRUSION_M` of the true surfaces protrudes from it for 95 % of the poses of the
worst body. Then each body is left out in turn: the table has the distance by which it protrudes
from a fit to the others, in the 95 % quantile.
"""

import json
import sys
from collections.abc import Mapping, Sequence
from itertools import product
from pathlib import Path

import numpy as np
import tyro
from rich.console import Console
from rich.progress import track
from rich.table import Table

from assets.enclosure.poses import EVERY, N_EPISODES, N_STEPS, TASKS, Poses, play
from hrc_env.core.skeleton import JOINT, MIRROR
from hrc_env.core.typing import Floats, Points3
from hrc_env.geometry.enclosure import N_TERMS, Enclosure, enclose, name_part
from hrc_env.worker.body import load_body, worker_names

OUT = Path(__file__).parents[2] / "hrc_env" / "geometry" / "enclosure.json"
TERMS: Mapping[str, Sequence[str]] = {
    "neck": ("nose", "left_shoulder", "right_shoulder", "left_hip", "right_hip"),
    "chest": ("left_shoulder", "right_shoulder", "left_hip", "right_hip"),
    "torso": ("left_shoulder", "right_shoulder", "left_hip", "right_hip"),
    "abdomen": ("left_shoulder", "right_shoulder", "left_hip", "right_hip"),
    "pelvis": ("left_shoulder", "right_shoulder", "left_hip", "right_hip"),
    "left_shoulder": ("left_shoulder", "right_shoulder", "left_hip", "left_elbow"),
    "left_upper_arm": ("left_shoulder", "right_shoulder", "left_elbow"),
    "left_forearm": ("left_shoulder", "left_elbow", "left_wrist"),
    "left_hand": ("left_shoulder", "left_elbow", "left_wrist"),
    "left_thigh": ("left_hip", "right_hip", "left_knee"),
    "left_shank": ("left_knee", "left_ankle", "left_foot"),
    "left_foot": ("left_knee", "left_ankle", "left_foot"),
}
"""Joints on which the ends of each capsule depend; the right side is the mirror image of the left.
The head is fitted in the frame of the trunk."""
HEAD_TERMS = ("nose", "left_shoulder", "right_shoulder")
"""Joints whose covariance and age are those of the head."""
PROTRUSION_M: Mapping[str, float] = {
    "head": 0.022, "neck": 0.01, "chest": 0.02, "torso": 0.01, "abdomen": 0.01, "pelvis": 0.01,
    "shoulder": 0.02, "upper_arm": 0.025, "forearm": 0.015, "hand": 0.014, "thigh": 0.015,
    "shank": 0.015, "foot": 0.01,
}  # fmt: skip
"""Distance by which a capsule of the worst body of a fit may protrude in 5 % of the poses [m]."""
OF_FIXED_SIZE = ("head", "neck", "foot", "hand")
"""Parts whose radii do not depend on a person's width: hats, shoes and hands are similar."""
WIDEST = 1.25
"""Greatest width of an estimate as a multiple of that of the widest body."""
DIRECTIONS = 60
"""Number of directions in which points of a capsule's surface are examined."""


def fit_enclosure(bodies: Sequence[Poses], capsules: Sequence[str]) -> Enclosure:
    """Return the enclosure of several bodies, with `protrusion_m` of the fit itself."""
    n = len(capsules)
    joints, weights = np.zeros((n, 2, N_TERMS), np.int64), np.zeros((n, 2, N_TERMS))
    for s, name in enumerate(capsules):
        if name == "head":
            joints[s, :, : len(HEAD_TERMS)] = [JOINT[term] for term in HEAD_TERMS]
            weights[s, :, : len(HEAD_TERMS)] = 1 / len(HEAD_TERMS)
            continue
        left = name.replace("right_", "left_")
        terms = np.array([JOINT[term] for term in TERMS[left]])
        of_side = MIRROR[terms] if name.startswith("right_") else terms
        joints[s, :, : len(terms)] = of_side
        for end in range(2):
            points, ends = [], []
            for body in bodies:
                points.append(body.joints_world[:, terms])
                ends.append(body.capsules_world[:, capsules.index(left), end])
                if left in TERMS and left.startswith("left_"):
                    right = capsules.index(left.replace("left_", "right_"))
                    points.append(body.joints_world[:, MIRROR[terms]])
                    ends.append(body.capsules_world[:, right, end])
            weights[s, end, : len(terms)] = _fit_weights(
                np.concatenate(points), np.concatenate(ends)
            )
    widths = [np.median(measure_width(body.joints_world)) for body in bodies]
    limits = np.array([min(widths), WIDEST * max(widths)])
    draft = Enclosure(
        joints, weights, _fit_head(bodies, capsules.index("head")), np.zeros(n), np.zeros(n),
        limits, np.zeros(n),
    )  # fmt: skip
    radius_m, per_width = np.zeros(n), np.zeros(n)
    for part in {name_part(name) for name in capsules}:
        sides = [s for s, name in enumerate(capsules) if name_part(name) == part]
        least, least_per_width = 0.0, 0.0
        for body, s in product(bodies, sides):
            needed_m, width_m = (
                _find_needed_radius(draft, body, s),
                measure_width(body.joints_world),
            )
            least = max(least, np.quantile(needed_m, 0.95))
            least_per_width = max(least_per_width, np.quantile(needed_m / width_m, 0.95))
        is_fixed = part in OF_FIXED_SIZE
        radius_m[sides] = (least if is_fixed else 0.0) - PROTRUSION_M[part]
        per_width[sides] = 0.0 if is_fixed else least_per_width
    return draft._replace(radius_m=radius_m, radius_per_width=per_width)


def measure_width(joints_world: Points3) -> Floats:
    """Return the distance between the shoulders plus that between the hips (N,) [m]."""
    shoulders = joints_world[:, JOINT["left_shoulder"]] - joints_world[:, JOINT["right_shoulder"]]
    hips = joints_world[:, JOINT["left_hip"]] - joints_world[:, JOINT["right_hip"]]
    width_m: Floats = np.linalg.norm(shoulders, axis=1) + np.linalg.norm(hips, axis=1)
    return width_m


def measure_protrusion(enclosure: Enclosure, body: Poses, every: int = 12) -> Floats:
    """Return the 95 % quantile of the distance by which each capsule protrudes (S,) [m]."""
    directions = np.random.default_rng(0).normal(size=(DIRECTIONS, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    ends = body.capsules_world[::every]
    found = enclose(body.joints_world[::every], enclosure)
    axes, radii_m = found.ends_world, found.radius_m
    farthest_m = np.full(ends.shape[:2], -np.inf)
    for along in (0.0, 0.5, 1.0):
        middle = ends[:, :, 0] + along * (ends[:, :, 1] - ends[:, :, 0])
        for direction in directions:
            points = middle + body.radius_m[:, None] * direction
            outside_m = [
                _measure_distance(points, axes[:, None, s, 0], axes[:, None, s, 1])
                - radii_m[:, s, None]
                for s in range(axes.shape[1])
            ]
            farthest_m = np.maximum(farthest_m, np.min(outside_m, axis=0))
    return np.quantile(farthest_m, 0.95, axis=0)


def _fit_weights(points: Points3, ends: Points3) -> Floats:
    """Return the weights (K,) with sum 1 that give `ends` (N, 3) from `points` (N, K, 3)."""
    axes = (points[:, 1:] - points[:, :1]).swapaxes(1, 2).reshape(-1, points.shape[1] - 1)
    found = np.linalg.lstsq(axes, (ends - points[:, 0]).reshape(-1), rcond=None)[0]
    return np.append(1 - found.sum(), found)


def _fit_head(bodies: Sequence[Poses], s: int) -> Floats:
    """Return the map (2, 3, 4) from the nose to both ends of the head in the trunk's frame."""
    noses, ends = [], []
    for body in bodies:
        neck, frames = _find_trunks(body.joints_world)
        nose = body.joints_world[:, JOINT["nose"]] - neck
        noses.append(np.einsum("nij,nj->ni", frames, nose))
        ends.append(np.einsum("nij,nej->nei", frames, body.capsules_world[:, s] - neck[:, None]))
    nose, end = np.concatenate(noses), np.concatenate(ends)
    extended = np.column_stack([nose, np.ones(len(nose))])
    maps = [np.linalg.lstsq(extended, end[:, e], rcond=None)[0].T for e in range(2)]
    return np.array(maps, float)


def _find_trunks(joints_world: Points3) -> tuple[Points3, Floats]:
    """Return the middle of the shoulders (N, 3) and the frames (N, 3, 3) of trunks."""
    shoulders = joints_world[:, [JOINT["left_shoulder"], JOINT["right_shoulder"]]]
    hips = joints_world[:, [JOINT["left_hip"], JOINT["right_hip"]]]
    up = shoulders.mean(1) - hips.mean(1)
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    left = shoulders[:, 0] - shoulders[:, 1]
    left -= (left * up).sum(1, keepdims=True) * up
    left /= np.linalg.norm(left, axis=1, keepdims=True)
    return shoulders.mean(1), np.stack([np.cross(left, up), left, up], 1)


def _find_needed_radius(enclosure: Enclosure, body: Poses, s: int) -> Floats:
    """Return the radius (N,) with which capsule `s` alone would enclose the true one [m]."""
    axis = enclose(body.joints_world, enclosure).ends_world[:, s]
    away = [
        _measure_distance(body.capsules_world[:, s, end], axis[:, 0], axis[:, 1])
        for end in range(2)
    ]
    return np.max(away, axis=0) + body.radius_m[s]


def _measure_distance(points: Points3, start: Points3, end: Points3) -> Floats:
    """Return the distances of points from segments; all arrays are (..., 3) [m]."""
    along = end - start
    share = ((points - start) * along).sum(-1) / np.maximum((along**2).sum(-1), 1e-12)
    nearest = start + np.clip(share, 0, 1)[..., None] * along
    return np.linalg.norm(points - nearest, axis=-1)


def main(seed: int = 9_600_000, out: Path = OUT) -> None:
    """Fit the enclosure to all bodies, and measure it with each body left out in turn.

    Args:
        seed: seed of the first episode of the first body; body k begins at seed + 1000 k.
        out: file to write.
    """
    console, names = Console(), worker_names()
    capsules = load_body(names[0]).capsule_names
    bodies = [
        play(name, seed + 1000 * k)
        for k, name in enumerate(track(names, "Playing", console=console))
    ]
    fitted = fit_enclosure(bodies, capsules)
    protrusions = []
    for k, body in enumerate(track(bodies, "Leaving out each body", console=console)):
        others = fit_enclosure([*bodies[:k], *bodies[k + 1 :]], capsules)
        protrusions.append(measure_protrusion(others, body))
    left_out = np.array(protrusions)
    fitted = fitted._replace(protrusion_m=np.maximum(left_out.max(0), 0.0))
    write(fitted, left_out, capsules, names, seed, out)
    console.print(make_table(left_out, capsules, names))


def make_table(left_out_m: Floats, capsules: Sequence[str], names: Sequence[str]) -> Table:
    """Return the table of protrusions [cm] with each body left out."""
    table = Table(
        "protrusion, 95 % [cm]", *(name.removeprefix("worker_") for name in names), "worst"
    )
    for s, capsule in enumerate(capsules):
        values = [*left_out_m[:, s], left_out_m[:, s].max()]
        table.add_row(capsule, *(f"{100 * value:.1f}" for value in values))
    return table


def write(
    fitted: Enclosure,
    left_out_m: Floats,
    capsules: Sequence[str],
    names: Sequence[str],
    seed: int,
    out: Path,
) -> None:
    """Write the fit with its origin."""
    digits = {"head": 5, "weights": 5, "joints": 0}
    content = {
        "format": "hrc_env enclosure",
        "version": 1,
        "made": {
            "command": " ".join(["python -m assets.enclosure.fit", *sys.argv[1:]]),
            "seed": seed, "bodies": list(names), "tasks": list(TASKS),
            "poses_per_body": len(TASKS) * N_EPISODES * N_STEPS // EVERY,
        },
        "capsules": list(capsules),
        **{
            name: np.round(values, digits.get(name, 4)).tolist()
            for name, values in fitted._asdict().items()
        },
        "left_out_protrusion_m": {
            name: np.round(row, 4).tolist() for name, row in zip(names, left_out_m, strict=True)
        },
    }  # fmt: skip
    lines = [f"{json.dumps(key)}: {json.dumps(value)}" for key, value in content.items()]
    out.write_text("{\n" + ",\n".join(lines) + "\n}\n")


if __name__ == "__main__":
    tyro.cli(main)
