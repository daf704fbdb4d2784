"""Paint the clothes: hi-vis vest, shirt, trousers, belt and boots, of our own cut."""

from typing import TypeAlias

import numpy as np
from anatomy import Person
from atlas import (
    Painting,
    above,
    band,
    cavity,
    folds,
    raster,
    smooth_seam,
    split,
    stored_shade,
    stored_surface,
)
from colours import Colours, shaded
from recipes import Recipe
from surfaces import Surface, normals

CLOTH_SIZE = 768
Layer: TypeAlias = tuple[tuple[int, int, int] | np.ndarray, np.ndarray]
"""A colour, and how much of each texel it covers."""


def cloth_arrays(
    person: Person, cloth: Surface, recipe: Recipe, unit_m: float
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
    painting = Painting((CLOTH_SIZE, CLOTH_SIZE), recipe.colours.trousers)
    for colour, cover in outfit.layers(recipe.over, recipe.colours):
        painting.lay(colour, cover)
    palette, index = painting.palette(40)
    drawn_cut, drawn_uv = smooth_seam(cloth, (facing[:, 0] < 0).astype(int), uv_of)
    return {
        **stored_surface("cloth", drawn_cut, drawn_uv, unit_m),
        "cloth_palette": palette,
        "cloth_paint": index,
        "cloth_shade": stored_shade(outfit.shade(recipe), 4),
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

    def layers(self, over: str, colours: Colours) -> list[Layer]:
        """(colour, cover) from the trousers up."""
        upper = above(self.z, self.hem - 0.02, 0.003)
        collar = above(self.z, self.shoulder[2] + 0.052, 0.003)
        pieces = {"vest": self._vest, "bib": self._bib, "nothing": self._shirt_front}
        return [
            *self._trousers(colours),
            (colours.shirt, upper),
            (shaded(colours.shirt, 0.72), upper * self._cuff()),
            (shaded(colours.shirt, 1.12), collar * upper),
            *pieces[over](colours, upper, collar),
        ]

    def _vest(self, colours: Colours, upper: np.ndarray, collar: np.ndarray) -> list[Layer]:
        """A hi-vis vest with reflective stripes, and the belt that peeps out under it."""
        sleeve = self._beyond(self.shoulder[1] - 0.008) * upper
        vee = self.front * above(self.z - self.chest - 0.05, 1.9 * self.y, 0.006)
        vest = above(self.z, self.hem, 0.003) * (1 - sleeve) * (1 - collar) * (1 - vee)
        inner = vest * above(self.z, self.hem + 0.012, 0.003)
        inner = inner * (1 - self._beyond(self.shoulder[1] - 0.022))
        return [
            (shaded(colours.trim, 0.9), vest),
            (colours.vest, inner),
            *self._reflective(colours, vest),
            (shaded(colours.vest, 0.55), self.front * inner * band(self.y, 0, 0.0035, 0.002)),
            *self._pockets(colours, vest),
            *self._belt(colours),
        ]

    def _bib(self, colours: Colours, upper: np.ndarray, collar: np.ndarray) -> list[Layer]:
        """Overalls: a bib with a pocket in front, a panel behind, braces over the shoulders."""
        waist, top = self.hem + 0.07, self.chest + 0.02
        width = np.interp(self.z, [waist, waist + 0.05, top], [0.30, 0.155, 0.118])
        panel = above(width, self.y, 0.003) * above(np.where(self.front > 0, top, top - 0.05),
                                                    self.z, 0.003)  # fmt: skip
        lean = np.where(self.front > 0, 0.0, 0.10) * (self.shoulder[2] + 0.03 - self.z)
        brace = band(self.y, 0.092 - lean, 0.019, 0.002) * above(self.z, self.chest - 0.06, 0.002)
        body = np.maximum(panel, brace) * (1 - collar) * upper * (self.arm < 0.4)
        seam = panel * (1 - above(width - 0.008, self.y, 0.002) * above(top - 0.010, self.z, 0.002))
        pocket = (
            self.front * band(self.y, 0, 0.062, 0.002) * band(self.z, top - 0.075, 0.045, 0.002)
        )
        edge = pocket * (1 - band(self.y, 0, 0.058, 0.002) * band(self.z, top - 0.08, 0.042, 0.002))
        button = self.front * above(0.011, np.hypot(self.y - 0.092, self.z - top + 0.022), 0.002)
        return [
            (colours.bib, body),
            (shaded(colours.bib, 0.72), seam * self.front * upper * (self.arm < 0.4)),
            (shaded(colours.bib, 0.72), edge),
            (np.array((206, 186, 120.0)), button),
        ]

    def _shirt_front(self, colours: Colours, upper: np.ndarray, collar: np.ndarray) -> list[Layer]:
        """A buttoned work shirt tucked into belted trousers."""
        placket = self.front * upper * band(self.y, 0, 0.017, 0.002) * (1 - collar)
        button = self.front * above(0.0055, np.hypot(self.y, self._since_button()), 0.002)
        pocket = self.front * band(self.y, 0.088, 0.048, 0.002)
        pocket = pocket * band(self.z, self.chest + 0.005, 0.050, 0.002) * (self.arm < 0.3)
        flap = pocket * above(self.z, self.chest + 0.030, 0.002)
        dark = shaded(colours.shirt, 0.78)
        return [
            (shaded(colours.shirt, 0.86), placket),
            (np.array((226, 222, 212.0)), button * placket),
            (shaded(colours.shirt, 0.90), pocket),
            (dark, flap * (1 - above(self.z, self.chest + 0.034, 0.002))),
            *self._belt(colours),
        ]

    def _since_button(self) -> np.ndarray:
        """Height over the nearest of a row of buttons [m]."""
        up = self.z - self.hem - 0.05
        return up - 0.085 * np.round(up / 0.085)

    def _beyond(self, armhole: float) -> np.ndarray:
        """Past the armhole: a straight edge over the shoulder, the arm itself below the armpit."""
        armpit = self.shoulder[2] - 0.135
        lower = np.clip((armpit + 0.09 - self.z) / 0.09, 0, 1)
        over = above(self.y, armhole + 0.055 * lower**2, 0.003)
        return np.where(self.z > armpit, over, above(self.arm, 0.5, 0.1))

    def _trousers(self, colours: Colours) -> list[Layer]:
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
            (shaded(colours.boots, 1.4), laces * above(shaft - 0.03, self.z, 0.004)),
            (colours.sole, above(welt, self.z, 0.003)),
        ]

    def _cuff(self) -> np.ndarray:
        axis = self.wrist - self.elbow
        length = np.hypot(axis[1], axis[2])
        along = ((self.y - self.elbow[1]) * axis[1] + (self.z - self.elbow[2]) * axis[2]) / length
        return above(along, length - 0.040, 0.003) * above(self.arm, 0.5, 0.1)

    def _reflective(self, colours: Colours, vest: np.ndarray) -> list[Layer]:
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

    def _pockets(self, colours: Colours, vest: np.ndarray) -> list[Layer]:
        """A badge on the left of the chest, pockets with flaps below."""
        badge = self.front * band(self.left, 0.062, 0.022, 0.002)
        badge = badge * band(self.z, self.chest - 0.062, 0.014, 0.002)
        pocket = self.front * band(self.y, 0.092, 0.048, 0.002) * vest
        edge = pocket * band(self.z, self.hem + 0.062, 0.0025, 0.002)
        return [
            (np.array((245, 245, 240.0)), badge),
            (shaded(colours.vest, 0.6), edge),
        ]

    def _belt(self, colours: Colours) -> list[Layer]:
        """A belt with a buckle."""
        belt = band(self.z, self.hem - 0.018, 0.018, 0.003) * above(0.22, self.y, 0.01)
        buckle = (
            self.front
            * band(self.y, 0, 0.024, 0.002)
            * band(self.z, self.hem - 0.018, 0.014, 0.002)
        )
        return [
            (np.array(colours.belt, float), belt),
            (np.array((176, 172, 160.0)), buckle),
        ]

    def shade(self, recipe: Recipe) -> np.ndarray:
        """Return the shade of creases, folds, and the shadow of the upper clothes on the
        trousers."""
        dark = 1 - np.clip(self.fine / 0.016, -0.06, 0.10) - np.clip(self.broad / 0.08, -0.07, 0.07)
        fine, broad = folds(dark.shape, 1, (5.0, 9.0)), folds(dark.shape, 2, (18.0,))
        dark *= 1 + recipe.creases * 0.035 * fine + recipe.creases * 0.03 * broad
        if recipe.over != "bib":
            dark *= 1 - 0.22 * band(self.z, self.hem - 0.045, 0.012, 0.03)
        knee = np.exp(-(((self.z - self.knee[2]) / 0.05) ** 2)) * (1 - self.front)
        dark *= 1 - 0.12 * knee * (0.5 + 0.5 * np.sin(self.z / 0.006))
        return np.clip(dark, 0.5, 1.2)
