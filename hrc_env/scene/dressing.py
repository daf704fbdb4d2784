"""An episode's looks put on a drawing model: its lights, surfaces, clothes, hats and litter."""

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from hrc_env.core.records import Grounds
from hrc_env.core.typing import Floats, Ints
from hrc_env.geometry.rotations import about_axis
from hrc_env.scene.domain_randomization import Look
from hrc_env.scene.wardrobe import PUT_AWAY, Wardrobe

LEAST_FALL = 0.4
"""Light comes from above: it falls by at least this share of its way."""
PLAIN_RGB = (0.78, 0.76, 0.72)
"""A surface that has lost its picture, before it is tinted."""
LITTER_M = (0.06, 0.35)
"""Half sizes of what lies on the floor [m]."""
LITTER_THICK_M = 0.002
CLOTH = "cloth"
"""How the names of the skins that are clothes end."""


@dataclass(frozen=True, slots=True)
class AsBuilt:
    """What of a drawing model a look changes, as it was built."""

    light_dir: Floats
    light_diffuse: Floats
    light_specular: Floats
    headlight: tuple[Floats, Floats]
    """Ambient and diffuse."""
    material_rgba: Floats
    material_texture: Ints
    skin_rgba: Floats
    surfaces: Ints
    """Materials of what stands still."""
    clothes: Ints
    """(nskin,) 1 for clothes, 0 for a body's own skin."""


def as_built(model: mujoco.MjModel) -> AsBuilt:
    """What a look changes of a model that nobody has dressed yet."""
    still = model.geom_matid[(model.geom_bodyid == 0) & (model.geom_matid >= 0)]
    names = [model.skin(k).name for k in range(model.nskin)]
    headlight = model.vis.headlight
    return AsBuilt(
        light_dir=model.light_dir.copy(),
        light_diffuse=model.light_diffuse.copy(),
        light_specular=model.light_specular.copy(),
        headlight=(np.array(headlight.ambient), np.array(headlight.diffuse)),
        material_rgba=model.mat_rgba.copy(),
        material_texture=model.mat_texid.copy(),
        skin_rgba=model.skin_rgba.copy(),
        surfaces=np.unique(still),
        clothes=np.array([name.endswith(CLOTH) for name in names], np.int64),
    )


def dress(model: mujoco.MjModel, built: AsBuilt, wardrobe: Wardrobe, look: Look) -> None:
    """Put a look on a drawing model of the caller's own."""
    _light(model, built, look)
    _surfaces(model, built, look)
    whose = wardrobe.skins[:, 0]
    factors = np.where(built.clothes[:, None] > 0, look.clothing_rgb[whose], look.skin_rgb[whose])
    model.skin_rgba[:, :3] = built.skin_rgba[:, :3] * factors


def take_off_hats(model: mujoco.MjModel, wardrobe: Wardrobe, look: Look) -> None:
    """Put the hats away of those who wear none in this episode; after `wardrobe.wear`."""
    bare = wardrobe.hats[look.has_hat[wardrobe.hats[:, 0]] == 0.0, 2]
    model.geom_group[bare] = PUT_AWAY


def strew(scene: Any, grounds: Grounds, look: Look) -> None:
    """Add what lies on the floor to a list of what is drawn (an MjvScene)."""
    draws = np.random.default_rng(look.seed)
    low, high = np.array([grounds.walkable_x_m, grounds.walkable_y_m]).T
    for k in range(min(look.n_litter, scene.maxgeom - scene.ngeom)):
        x, y = draws.uniform(low, high)
        half = draws.uniform(*LITTER_M, 2)
        mujoco.mjv_initGeom(
            scene.geoms[scene.ngeom],
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=np.array([*half, LITTER_THICK_M]),
            pos=np.array([x, y, (1.0 + 0.1 * k) * LITTER_THICK_M]),
            mat=about_axis("z", draws.uniform(0, np.pi)).ravel(),
            rgba=np.array([*draws.uniform(0.05, 0.95, 3), 1.0], np.float32),
        )
        scene.ngeom += 1


def _light(model: mujoco.MjModel, built: AsBuilt, look: Look) -> None:
    """Strength, colour and direction of all light."""
    factor = look.light * look.light_rgb
    axis = np.array([np.cos(look.tilt_about_rad), np.sin(look.tilt_about_rad), 0.0])
    towards = built.light_dir @ about_axis("z", look.turn_rad).T
    c, s = np.cos(look.tilt_rad), np.sin(look.tilt_rad)
    along = (towards @ axis)[:, None] * axis
    towards = along + c * (towards - along) + s * np.cross(axis, towards)
    towards[:, 2] = np.minimum(towards[:, 2], -LEAST_FALL)
    model.light_dir[:] = towards / np.linalg.norm(towards, axis=-1, keepdims=True)
    model.light_diffuse[:] = built.light_diffuse * factor
    model.light_specular[:] = built.light_specular * factor
    model.vis.headlight.ambient[:] = built.headlight[0] * factor
    model.vis.headlight.diffuse[:] = built.headlight[1] * factor


def _surfaces(model: mujoco.MjModel, built: AsBuilt, look: Look) -> None:
    """Tints, and surfaces without pictures."""
    draws = np.random.default_rng([look.seed, 1])
    n = len(built.surfaces)
    tint = 1.0 - look.tint * draws.uniform(0, 1, (n, 3))
    has_picture = (built.material_texture[built.surfaces] >= 0).any(1)
    plain = has_picture & (draws.uniform(0, 1, n) < look.plain)
    colour = np.where(plain[:, None], PLAIN_RGB, built.material_rgba[built.surfaces, :3])
    model.mat_rgba[built.surfaces, :3] = colour * tint
    model.mat_texid[:] = built.material_texture
    model.mat_texid[built.surfaces[plain]] = -1
