"""What a worker looks like: textured surfaces that follow the segments, and a hard hat."""

import functools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hrc_env.core.typing import Floats, Ints, Points3
from hrc_env.worker.body import N_SEGMENTS, baked_path, fixed


@dataclass(frozen=True, slots=True)
class SkinMesh:
    """A textured surface that follows the segments (linear blend skinning)."""

    name: str
    vertices: Points3
    """(V, 3) at rest [m]."""
    faces: Ints
    """(F, 3) counter-clockwise seen from outside."""
    uv: Floats
    """(V, 2) texture coordinates in [0, 1], v = 0 at the texture's first row."""
    weights: Floats
    """(V, S) share of each segment; at most four a vertex, rows sum to 1."""
    texture: NDArray[np.uint8]
    """(H, W, 3) RGB."""


@dataclass(frozen=True, slots=True)
class HatMesh:
    """A hard hat; it moves with the head."""

    vertices: Points3
    """(V, 3) in the head's frame [m]."""
    faces: Ints
    """(F, 3)."""
    rgb: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class WorkerMesh:
    """What a worker looks like; the room `scene` draws it."""

    skins: tuple[SkinMesh, ...]
    hat: HatMesh | None
    """None for who wears none."""


@functools.cache
def load_mesh(name: str = "worker_1") -> WorkerMesh:
    """Read a baked worker's surfaces and textures; `ConfigError` where none was baked."""
    with np.load(baked_path(name)) as baked:
        return WorkerMesh(tuple(_skin(baked, skin) for skin in ("skin", "cloth")), _hat(baked))


def _skin(baked: np.lib.npyio.NpzFile, name: str) -> SkinMesh:
    segment, share = baked[f"{name}_weight_segment"], baked[f"{name}_weight"].astype(float)
    weights = np.zeros((len(segment), N_SEGMENTS))
    np.add.at(weights, (np.arange(len(segment))[:, None], segment), share)
    return SkinMesh(
        name=name,
        vertices=fixed(baked[f"{name}_vertices"] * float(baked["unit_m"]), np.float64),
        faces=fixed(baked[f"{name}_faces"], np.int64),
        uv=fixed(baked[f"{name}_uv"] / 65535.0, np.float64),
        weights=fixed(weights / weights.sum(1, keepdims=True), np.float64),
        texture=_texture(baked, name),
    )


def _hat(baked: np.lib.npyio.NpzFile) -> HatMesh | None:
    if "hat_vertices" not in baked:
        return None
    red, green, blue = (float(value) / 255 for value in baked["hat_rgb"])
    return HatMesh(
        vertices=fixed(baked["hat_vertices"] * float(baked["unit_m"]), np.float64),
        faces=fixed(baked["hat_faces"], np.int64),
        rgb=(red, green, blue),
    )


def _texture(baked: np.lib.npyio.NpzFile, name: str) -> NDArray[np.uint8]:
    """Palette colours, darkened by the coarse shade map (creases, folds)."""
    colours = baked[f"{name}_palette"][baked[f"{name}_paint"]].astype(np.float32)
    shade = _enlarged(baked[f"{name}_shade"].astype(np.float32) / 200.0, colours.shape[:2])
    return fixed(np.clip(colours * shade[..., None], 0.0, 255.0), np.uint8)


def _enlarged(image: NDArray[np.float32], shape: tuple[int, ...]) -> NDArray[np.float32]:
    """(h, w) to a larger (H, W), bilinear, pixel centres at half-integers."""
    for axis in (0, 1):
        size, old = shape[axis], image.shape[axis]
        at = np.clip((np.arange(size) + 0.5) * old / size - 0.5, 0, old - 1)
        low = np.minimum(at.astype(int), old - 2)
        part = (at - low).astype(np.float32).reshape((-1, 1) if axis == 0 else (1, -1))
        image = image.take(low, axis) * (1 - part) + image.take(low + 1, axis) * part
    return image
