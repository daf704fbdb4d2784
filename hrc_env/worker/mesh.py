"""Appearance of a worker: textured surfaces that follow the segments, and a hard hat."""

import functools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hrc_env.core.typing import Floats, Ints, Points3
from hrc_env.worker.body import N_SEGMENTS, find_baked, freeze


@dataclass(frozen=True, slots=True)
class SkinMesh:
    """A textured surface that follows the segments (linear blend skinning)."""

    name: str
    """Name of the surface."""
    vertices: Points3
    """Vertices (V, 3) at rest [m]."""
    faces: Ints
    """Triangles (F, 3), counter-clockwise seen from outside."""
    uv: Floats
    """Texture coordinates (V, 2) in [0, 1], with v = 0 at the first row of the texture."""
    weights: Floats
    """Skinning weights (V, S) of the segments, at most four per vertex; rows sum to 1."""
    texture: NDArray[np.uint8]
    """RGB texture (H, W, 3)."""


@dataclass(frozen=True, slots=True)
class HatMesh:
    """A hard hat, which moves with the head."""

    vertices: Points3
    """Vertices (V, 3) in the head's frame [m]."""
    faces: Ints
    """Triangles (F, 3)."""
    rgb: tuple[float, float, float]
    """RGB colour, with components in [0, 1]."""


@dataclass(frozen=True, slots=True)
class WorkerMesh:
    """Surfaces of a worker for rendering."""

    skins: tuple[SkinMesh, ...]
    """Textured surfaces."""
    hat: HatMesh | None
    """Hard hat; None for a worker without hat."""


@functools.cache
def load_mesh(name: str = "worker_1") -> WorkerMesh:
    """Read the surfaces of a worker model; raise `ConfigError` if the name is unknown."""
    with np.load(find_baked(name)) as baked:
        return WorkerMesh(
            tuple(_read_skin(baked, skin) for skin in ("skin", "cloth")), _read_hat(baked)
        )


def _read_skin(baked: np.lib.npyio.NpzFile, name: str) -> SkinMesh:
    """Return a textured surface from the file of a worker model."""
    segment, share = baked[f"{name}_weight_segment"], baked[f"{name}_weight"].astype(float)
    weights = np.zeros((len(segment), N_SEGMENTS))
    np.add.at(weights, (np.arange(len(segment))[:, None], segment), share)
    return SkinMesh(
        name=name,
        vertices=freeze(baked[f"{name}_vertices"] * float(baked["unit_m"]), np.float64),
        faces=freeze(baked[f"{name}_faces"], np.int64),
        uv=freeze(baked[f"{name}_uv"] / 65535.0, np.float64),
        weights=freeze(weights / weights.sum(1, keepdims=True), np.float64),
        texture=_read_texture(baked, name),
    )


def _read_hat(baked: np.lib.npyio.NpzFile) -> HatMesh | None:
    """Return the hard hat from the file of a worker model, or None if there is none."""
    if "hat_vertices" not in baked:
        return None
    red, green, blue = (float(value) / 255 for value in baked["hat_rgb"])
    return HatMesh(
        vertices=freeze(baked["hat_vertices"] * float(baked["unit_m"]), np.float64),
        faces=freeze(baked["hat_faces"], np.int64),
        rgb=(red, green, blue),
    )


def _read_texture(baked: np.lib.npyio.NpzFile, name: str) -> NDArray[np.uint8]:
    """Return a texture, with palette colours darkened by a coarse shading map of creases."""
    colours = baked[f"{name}_palette"][baked[f"{name}_paint"]].astype(np.float32)
    shade = _enlarge(baked[f"{name}_shade"].astype(np.float32) / 200.0, colours.shape[:2])
    return freeze(np.clip(colours * shade[..., None], 0.0, 255.0), np.uint8)


def _enlarge(image: NDArray[np.float32], shape: tuple[int, ...]) -> NDArray[np.float32]:
    """Enlarge an image (h, w) to (H, W) bilinearly, with pixel centres at half-integers."""
    for axis in (0, 1):
        size, old = shape[axis], image.shape[axis]
        at = np.clip((np.arange(size) + 0.5) * old / size - 0.5, 0, old - 1)
        low = np.minimum(at.astype(int), old - 2)
        part = (at - low).astype(np.float32).reshape((-1, 1) if axis == 0 else (1, -1))
        image = image.take(low, axis) * (1 - part) + image.take(low + 1, axis) * part
    return image
