"""Bake a worker: anny phenotype -> assets/workers/<name>.npz. See README.md beside this file.

    python assets/workers/bake.py worker_1

Everything that a run needs of a body is in that one file; torch and anny are needed here only.
"""

import argparse
from dataclasses import dataclass, replace
from pathlib import Path

import anatomy
import capsules
import numpy as np
import paint_clothes
import paint_skin
import surfaces
from colours import Colours

FOLDER = Path(__file__).parent
UNIT_M = 1 / 16000
"""Vertices are stored as int16 multiples of this (0.06 mm)."""


@dataclass(frozen=True)
class Recipe:
    """A phenotype (anny's parameters in [0, 1]) with a stature, and the colours of its clothes."""

    stature_m: float
    phenotype: dict[str, float]
    colours: Colours


def _recipe(stature_m: float, *phenotype: float, **colours: tuple[int, int, int]) -> Recipe:
    names = ("gender", "age", "muscle", "weight", "proportions")
    return Recipe(
        stature_m, dict(zip(names, phenotype, strict=True)), replace(Colours(), **colours)
    )


RECIPES = {
    "worker_1": _recipe(1.78, 0.0, 0.67, 0.60, 0.50, 0.60),
    "worker_2": _recipe(1.66, 1.0, 0.65, 0.50, 0.50, 0.70, hat=(235, 235, 232)),
    "worker_3": _recipe(1.80, 0.0, 0.75, 0.50, 0.85, 0.40, vest=(255, 122, 30)),
    "worker_4": _recipe(1.88, 0.0, 0.62, 0.50, 0.30, 0.70, skin=(124, 82, 60)),
    "worker_5": _recipe(1.57, 1.0, 0.70, 0.50, 0.65, 0.50, skin=(176, 128, 98)),
}
"""Named bodies; gender 0 is male, age 0.67 an adult. Only worker_1 is shipped so far."""

JOINTS = (
    ("nose", "head", "nose"),
    *(
        (f"{side}_{joint}", f"{side}_{segment}" if segment != "pelvis" else segment,
         f"{side}_{landmark}")
        for joint, segment, landmark in (
            ("shoulder", "clavicle", "shoulder"), ("elbow", "upper_arm", "elbow"),
            ("wrist", "forearm", "wrist"), ("hip", "pelvis", "hip"), ("knee", "thigh", "knee"),
            ("ankle", "shank", "ankle"), ("foot", "toes", "big_toe"),
        )
        for side in ("left", "right")
    ),
)  # fmt: skip
"""The 15 joints in the order of hrc_env.skeleton.JOINTS: (joint, segment, COCO landmark)."""

N_VERTICES = {"head": 800, "hand": 190, "cloth": 1000}


def bake(name: str, recipe: Recipe, raw: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """All arrays of a worker's file."""
    person = anatomy.person(raw)
    cloth = surfaces.clothes(person)
    lift = np.array([0.0, 0.0, -cloth.vertices[:, 2].min()])
    person = anatomy.lifted(person, lift)
    cloth = surfaces.decimated(replace(cloth, vertices=cloth.vertices + lift), N_VERTICES["cloth"])
    head = surfaces.head_surface(person)
    hat, hat_faces = surfaces.hard_hat(person, head)
    head = surfaces.decimated(head, N_VERTICES["head"])
    hands = [
        surfaces.decimated(surfaces.hand_surface(person, side), N_VERTICES["hand"])
        for side in ("left", "right")
    ]
    eyes = [surfaces.eye_surface(person, group) for group in anatomy.EYE_GROUPS]
    origins = dict(zip(anatomy.SEGMENTS, person.origins, strict=True))
    fitted = capsules.body_capsules(
        cloth.vertices, cloth.parts(), np.vstack([head.vertices, hat]), hands[0].vertices, origins
    )
    return {
        "unit_m": np.array(UNIT_M),
        "stature_m": np.array(person.stature_m),
        "rest_position": person.origins.astype(np.float32),
        **_joints(person, origins),
        **_capsules(fitted, origins),
        **paint_skin.skin_arrays(person, head, hands, eyes, recipe.colours, UNIT_M),
        **paint_clothes.cloth_arrays(person, cloth, recipe.colours, UNIT_M),
        "hat_vertices": np.round((hat - origins["head"]) / UNIT_M).astype(np.int16),
        "hat_faces": hat_faces.astype(np.uint16),
        "hat_rgb": np.array(recipe.colours.hat, np.uint8),
    }


def _joints(person: anatomy.Person, origins: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Anatomical joints; `calibrate_joints.py` moves them to where BlazePose sees them."""
    offsets = [person.landmarks[landmark] - origins[segment] for _, segment, landmark in JOINTS]
    return {
        "joint_segment": np.array([anatomy.SEGMENTS.index(s) for _, s, _ in JOINTS], np.uint8),
        "joint_anatomical_offset": np.array(offsets, np.float32),
        "joint_offset": np.array(offsets, np.float32),
    }


def _capsules(
    fitted: list[capsules.Capsule], origins: dict[str, np.ndarray]
) -> dict[str, np.ndarray]:
    return {
        "capsule_names": np.array([capsule.name for capsule in fitted]),
        "capsule_segment": np.array(
            [anatomy.SEGMENTS.index(capsule.segment) for capsule in fitted], np.uint8
        ),
        "capsule_ends": np.array(
            [capsule.ends - origins[capsule.segment] for capsule in fitted], np.float32
        ),
        "capsule_radius_m": np.array([capsule.radius_m for capsule in fitted], np.float32),
    }


def main() -> None:
    """Bake the named workers (all recipes' names are valid)."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="+", choices=sorted(RECIPES))
    parser.add_argument("--raw", type=Path, help="keep anny's arrays here, to bake again faster")
    parser.add_argument("--to", type=Path, default=FOLDER, help="folder to write into")
    arguments = parser.parse_args()
    for name in arguments.names:
        recipe = RECIPES[name]
        kept = arguments.raw / f"{name}.npz" if arguments.raw else None
        if kept and kept.exists():
            raw = dict(np.load(kept))
        else:
            raw = anatomy.raw_arrays(recipe.phenotype, recipe.stature_m)
            if kept:
                np.savez(kept, **raw)
        arrays = bake(name, recipe, raw)
        path = arguments.to / f"{name}.npz"
        np.savez_compressed(path, **arrays)
        counts = {skin: len(arrays[f"{skin}_vertices"]) for skin in ("skin", "cloth")}
        print(f"{path.name}: {path.stat().st_size / 1000:.1f} kB, vertices {counts}")


if __name__ == "__main__":
    main()
