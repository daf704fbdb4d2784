"""Bake a worker: anny phenotype -> assets/workers/<name>.npz. See README.md beside this file.

    python assets/workers/bake.py [worker_1 ...]

Everything that a run needs of a body is in that one file; torch and anny are needed here only.
"""

import argparse
from dataclasses import replace
from pathlib import Path

import anatomy
import capsules
import numpy as np
import paint_clothes
import paint_skin
import surfaces
from recipes import RECIPES, Recipe

FOLDER = Path(__file__).parent
UNIT_M = 1 / 16000
"""Vertices are stored as int16 multiples of this (0.06 mm)."""


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
"""The 15 joints in the order of hrc_env.core.skeleton.JOINTS: (joint, segment, COCO landmark)."""

N_VERTICES = {"head": 800, "hand": 190, "cloth": 1000}


def bake(name: str, recipe: Recipe, raw: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """All arrays of a worker's file."""
    person = anatomy.person(raw)
    cloth = surfaces.clothes(person)
    lift = np.array([0.0, 0.0, -cloth.vertices[:, 2].min()])
    person = anatomy.lifted(person, lift)
    cloth = surfaces.decimated(replace(cloth, vertices=cloth.vertices + lift), N_VERTICES["cloth"])
    if recipe.collar:
        cloth = surfaces.joined(cloth, surfaces.collar(person))
    head = surfaces.head_surface(person)
    hat = surfaces.hard_hat(person, head) if recipe.hat else None
    head = surfaces.decimated(head, N_VERTICES["head"])
    hands = [
        surfaces.decimated(surfaces.hand_surface(person, side), N_VERTICES["hand"])
        for side in ("left", "right")
    ]
    eyes = [surfaces.eye_surface(person, group) for group in anatomy.EYE_GROUPS]
    origins = dict(zip(anatomy.SEGMENTS, person.origins, strict=True))
    hair = paint_skin.hair_pieces(person, recipe)
    worn = [surface.vertices for surface, _ in hair] + ([] if hat is None else [hat[0]])
    crown = np.vstack([head.vertices, *worn])
    fitted = capsules.body_capsules(
        cloth.vertices, cloth.parts(), crown, hands[0].vertices, origins
    )
    return {
        "unit_m": np.array(UNIT_M),
        "stature_m": np.array(person.stature_m),
        "rest_position": person.origins.astype(np.float32),
        **_joints(person, origins),
        **_capsules(fitted, origins),
        **paint_skin.skin_arrays(person, head, hands, eyes, hair, recipe, UNIT_M),
        **paint_clothes.cloth_arrays(person, cloth, recipe, UNIT_M),
        **({} if hat is None else _hat(hat, origins["head"], recipe)),
    }


def _hat(
    hat: tuple[np.ndarray, np.ndarray], head: np.ndarray, recipe: Recipe
) -> dict[str, np.ndarray]:
    return {
        "hat_vertices": np.round((hat[0] - head) / UNIT_M).astype(np.int16),
        "hat_faces": hat[1].astype(np.uint16),
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
    parser.add_argument("names", nargs="*", help=f"{', '.join(RECIPES)}; none bakes all")
    parser.add_argument("--raw", type=Path, help="keep anny's arrays here, to bake again faster")
    parser.add_argument("--to", type=Path, default=FOLDER, help="folder to write into")
    arguments = parser.parse_args()
    for name in arguments.names or RECIPES:
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
