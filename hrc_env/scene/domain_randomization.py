"""How scene and workers look, drawn anew for every episode: light, colours, hats, litter.

Looks change images and nothing else: where things are, what hides what, how workers move, goals
and faults are those of the same seed without. They are drawn from a stream of their own.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import mujoco
import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.mapping import answer_unknown_fields
from hrc_env.core.streams import aside
from hrc_env.core.typing import Floats
from hrc_env.geometry.rotations import about_axis
from hrc_env.scene.worker_visuals import HIDDEN, WorkerVisuals
from hrc_env.world import Grounds

LEAST_FALL = 0.4
"""Light comes from above: it falls by at least this share of its way."""
PLAIN_RGB = (0.78, 0.76, 0.72)
"""A surface that has lost its picture, before it is tinted."""
LITTER_M = (0.06, 0.35)
"""Half sizes of what lies on the floor [m]."""
LITTER_THICK_M = 0.002
CLOTH = "cloth"
"""How the names of the skins that are clothes end."""
STREAM = 0x10075
"""Tells the stream for looks from those that a generator's `spawn` gives: these count from 0."""


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class AppearanceConfig:
    """Between what looks are drawn; as it stands, everything looks as it was built."""

    light: tuple[float, float] = (1.0, 1.0)
    """Least and greatest factor on the strength of all light."""
    light_turn_deg: float = 0.0
    """Lamps and sun come from directions turned by at most so much about the vertical [deg]."""
    light_tilt_deg: float = 0.0
    """And tilted by at most so much [deg]."""
    warmth: float = 0.0
    """Light is redder and less blue by at most this share, or the other way round."""
    plain: float = 0.0
    """Share of the surfaces of the scene that lose their pictures (wood, concrete, plaster)."""
    tint: float = 0.0
    """Each channel of each surface of the scene is darker by at most this share."""
    clothing: float = 0.0
    """The same of each worker's clothes."""
    skin: float = 0.0
    """Workers' skins are darker by at most this share."""
    hat: float = 1.0
    """How probable it is that a worker who has a hat wears it."""
    litter: int = 0
    """At most so many flat things of any colour lie on the floor, too thin to hide anything."""

    def __post_init__(self) -> None:
        low, high = self.light
        if not 0.05 <= low <= high <= 3.0:
            raise ConfigError(
                "light must be two factors from 0.05 to 3, the lesser one first, got "
                f"{self.light}; (0.5, 1.3) is from half the light to a third more."
            )
        bounds = {"light_turn_deg": 180.0, "light_tilt_deg": 60.0, "litter": MOST_LITTER}
        shares = dict.fromkeys(("warmth", "plain", "tint", "clothing", "skin", "hat"), 1)
        for name, most in (bounds | shares).items():
            if not 0 <= getattr(self, name) <= most:
                raise ConfigError(f"{name} must be from 0 to {most:g}, got {getattr(self, name)}.")


MOST_LITTER = 60
AS_BUILT = AppearanceConfig()
VARIED = AppearanceConfig(
    light=(0.5, 1.3), light_turn_deg=180.0, light_tilt_deg=25.0, warmth=0.2, plain=0.3, tint=0.5,
    clothing=0.6, skin=0.5, hat=0.6, litter=25,
)  # fmt: skip
"""What one may meet; a judgement."""
APPEARANCES: dict[str, AppearanceConfig] = {
    "as_built": AS_BUILT,
    "varied": VARIED,
    "lights": AppearanceConfig(
        light=(0.4, 1.4), light_turn_deg=180.0, light_tilt_deg=40.0, warmth=0.3
    ),
    "surfaces": AppearanceConfig(plain=0.5, tint=0.7, litter=40),
    "people": AppearanceConfig(clothing=0.8, skin=0.6, hat=0.5),
}
"""By name: everything as it was built, everything varied, and one thing at a time."""


class Look(NamedTuple):
    """One episode's looks: numbers from which a scene of any size is dressed."""

    light: float
    """Factor on all light."""
    turn_rad: float
    """Turn of its directions about the vertical."""
    tilt_rad: float
    """Their tilt, about the horizontal direction `tilt_about_rad`."""
    tilt_about_rad: float
    light_rgb: Floats
    """(3,) its colour."""
    clothing_rgb: Floats
    """(W, 3) factors on the colours of clothes."""
    skin_rgb: Floats
    """(W, 3) the same of skins."""
    has_hat: Floats
    """(W,) 1 or 0."""
    plain: float
    """Share of surfaces without pictures."""
    tint: float
    """By how much surfaces' channels are darker at most."""
    n_litter: int
    seed: int
    """For the surfaces and for what lies on the floor."""


def draw_look(config: AppearanceConfig, n_workers: int, rng: np.random.Generator) -> Look:
    """An episode's looks, for as many workers as there is room for; `rng` is the environment's
    sensor generator and stays as it is."""
    own = aside(rng, STREAM)
    low, high = config.light
    warmth = config.warmth * own.uniform(-1, 1)
    return Look(
        light=float(np.exp(own.uniform(np.log(low), np.log(high)))),
        turn_rad=float(np.radians(config.light_turn_deg * own.uniform(-1, 1))),
        tilt_rad=float(np.radians(config.light_tilt_deg * own.uniform(0, 1))),
        tilt_about_rad=float(own.uniform(0, 2 * np.pi)),
        light_rgb=1.0 + warmth * np.array([1.0, 0.0, -1.0]),
        clothing_rgb=1.0 - config.clothing * own.uniform(0, 1, (n_workers, 3)),
        skin_rgb=np.repeat(1.0 - config.skin * own.uniform(0, 1, (n_workers, 1)), 3, 1),
        has_hat=(own.uniform(0, 1, n_workers) < config.hat).astype(float),
        plain=config.plain,
        tint=config.tint,
        n_litter=int(own.integers(config.litter + 1)),
        seed=int(own.integers(2**31)),
    )


def randomize(
    model: mujoco.MjModel, built: mujoco.MjModel, visuals: WorkerVisuals, look: Look
) -> None:
    """Put a look on a drawing model of the caller's own, of which `built` is the original."""
    _randomize_light(model, built, look)
    _randomize_surfaces(model, built, look)
    for k, worker in enumerate(visuals.skins[:, 0]):
        is_cloth = built.skin(k).name.endswith(CLOTH)
        factor = look.clothing_rgb[worker] if is_cloth else look.skin_rgb[worker]
        model.skin_rgba[k, :3] = built.skin_rgba[k, :3] * factor


def restore(model: mujoco.MjModel, built: mujoco.MjModel) -> None:
    """Take every look off a drawing model of the caller's own."""
    for name in (
        "light_dir",
        "light_diffuse",
        "light_specular",
        "mat_rgba",
        "mat_texid",
        "skin_rgba",
    ):
        getattr(model, name)[:] = getattr(built, name)
    for name in ("ambient", "diffuse"):
        getattr(model.vis.headlight, name)[:] = getattr(built.vis.headlight, name)


def take_off_hats(model: mujoco.MjModel, visuals: WorkerVisuals, look: Look) -> None:
    """Put the hats away of those who wear none in this episode; after `show_bodies`."""
    bare = visuals.hats[look.has_hat[visuals.hats[:, 0]] == 0.0, 2]
    model.geom_group[bare] = HIDDEN


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


def _randomize_light(model: mujoco.MjModel, built: mujoco.MjModel, look: Look) -> None:
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
    model.vis.headlight.ambient[:] = built.vis.headlight.ambient * factor
    model.vis.headlight.diffuse[:] = built.vis.headlight.diffuse * factor


def _randomize_surfaces(model: mujoco.MjModel, built: mujoco.MjModel, look: Look) -> None:
    """Tints of the materials of what stands still, and some of them without pictures."""
    draws = np.random.default_rng([look.seed, 1])
    still = np.unique(built.geom_matid[(built.geom_bodyid == 0) & (built.geom_matid >= 0)])
    tint = 1.0 - look.tint * draws.uniform(0, 1, (len(still), 3))
    has_picture = (built.mat_texid[still] >= 0).any(1)
    plain = has_picture & (draws.uniform(0, 1, len(still)) < look.plain)
    colour = np.where(plain[:, None], PLAIN_RGB, built.mat_rgba[still, :3])
    model.mat_rgba[still, :3] = colour * tint
    model.mat_texid[:] = built.mat_texid
    model.mat_texid[still[plain]] = -1
