"""Visual domain randomization of light, colours, hats and litter for every episode.

The randomization uses a separate random stream and changes only images: for the same seed,
positions, occlusion, the workers' motion, goals and faults are the same as without it.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

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
"""Minimum downward component of the light's direction, a unit vector."""
PLAIN_RGB = (0.78, 0.76, 0.72)
"""Colour of a surface without its texture, before it is tinted."""
LITTER_M = (0.06, 0.35)
"""Range of the half side lengths of litter [m]."""
LITTER_THICK_M = 0.002
"""Half thickness of litter [m]."""
CLOTH = "cloth"
"""Suffix of the names of skins that represent clothes."""
STREAM = 0x10075
"""Key of the random stream for appearances, distinct from those of `Generator.spawn`, which count
from 0."""


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class AppearanceConfig:
    """Ranges of the visual domain randomization. The defaults randomize nothing."""

    RENAMED: ClassVar[Mapping[str, str]] = {"plain": "untextured"}
    """Current names of renamed fields, by former name."""

    light: tuple[float, float] = (1.0, 1.0)
    """Minimum and maximum of the factor on the brightness of all light."""
    light_turn_deg: float = 0.0
    """Largest rotation of the directions of lamps and sun about the vertical [deg]."""
    light_tilt_deg: float = 0.0
    """Largest tilt of the directions of lamps and sun [deg]."""
    warmth: float = 0.0
    """Largest fraction by which the red channel of the light is increased and the blue channel
    decreased, or vice versa."""
    untextured: float = 0.0
    """Fraction of the scene's textured surfaces that lose their texture (wood, concrete,
    plaster)."""
    tint: float = 0.0
    """Largest fraction by which each colour channel of each surface in the scene is darkened."""
    clothing: float = 0.0
    """Largest fraction by which each colour channel of each worker's clothes is darkened."""
    skin: float = 0.0
    """Largest fraction by which the workers' skins are darkened."""
    hat: float = 1.0
    """Probability that a worker with a hat wears it."""
    litter: int = 0
    """Maximum number of flat objects of any colour on the floor, which are too thin to occlude
    anything."""

    def __post_init__(self) -> None:
        low, high = self.light
        if not 0.05 <= low <= high <= 3.0:
            raise ConfigError(
                f"light must be two factors from 0.05 to 3 in ascending order, got {self.light}; "
                "for example, (0.5, 1.3) is from 50 % to 130 % of the default intensity."
            )
        bounds = {"light_turn_deg": 180.0, "light_tilt_deg": 60.0, "litter": MOST_LITTER}
        shares = dict.fromkeys(("warmth", "untextured", "tint", "clothing", "skin", "hat"), 1)
        for name, most in (bounds | shares).items():
            if not 0 <= getattr(self, name) <= most:
                raise ConfigError(f"{name} must be from 0 to {most:g}, got {getattr(self, name)}.")


MOST_LITTER = 60
"""Upper limit of `AppearanceConfig.litter`."""
AS_BUILT = AppearanceConfig()
"""Appearance without randomization."""
VARIED = AppearanceConfig(
    light=(0.5, 1.3),
    light_turn_deg=180.0,
    light_tilt_deg=25.0,
    warmth=0.2,
    untextured=0.3,
    tint=0.5,
    clothing=0.6,
    skin=0.5,
    hat=0.6,
    litter=25,
)
"""Randomization of all properties, within ranges that are estimated to be plausible."""
APPEARANCES: dict[str, AppearanceConfig] = {
    "as_built": AS_BUILT,
    "varied": VARIED,
    "lights": AppearanceConfig(
        light=(0.4, 1.4), light_turn_deg=180.0, light_tilt_deg=40.0, warmth=0.3
    ),
    "surfaces": AppearanceConfig(untextured=0.5, tint=0.7, litter=40),
    "people": AppearanceConfig(clothing=0.8, skin=0.6, hat=0.5),
}
"""Named appearances: without randomization, with all of it, and with one kind at a time."""


class Look(NamedTuple):
    """Appearance that was sampled for an episode."""

    light: float
    """Factor on the brightness of all light."""
    turn_rad: float
    """Rotation of the light's directions about the vertical [rad]."""
    tilt_rad: float
    """Tilt of the light's directions about the horizontal axis at `tilt_about_rad` [rad]."""
    tilt_about_rad: float
    """Angle of the tilt's axis from world +x [rad]."""
    light_rgb: Floats
    """(3,) RGB factors on the colour of the light."""
    clothing_rgb: Floats
    """(W, 3) RGB factors on the colours of clothes."""
    skin_rgb: Floats
    """(W, 3) RGB factors on the colours of skins."""
    has_hat: Floats
    """(W,) 1 for a worker that wears a hat, and 0 for others."""
    untextured: float
    """Fraction of textured surfaces that lose their texture."""
    tint: float
    """Largest fraction by which the colour channels of surfaces are darkened."""
    n_litter: int
    """Number of flat objects on the floor."""
    seed: int
    """Seed of the surfaces' colours and of the objects on the floor."""


def draw_look(config: AppearanceConfig, n_workers: int, rng: np.random.Generator) -> Look:
    """Sample the appearance of an episode.

    Args:
        config: ranges of the randomization.
        n_workers: number of workers in the scene.
        rng: random generator of the environment's sensors; its state is not changed.
    """
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
        untextured=config.untextured,
        tint=config.tint,
        n_litter=int(own.integers(config.litter + 1)),
        seed=int(own.integers(2**31)),
    )


def randomize(
    model: mujoco.MjModel, built: mujoco.MjModel, visuals: WorkerVisuals, look: Look
) -> None:
    """Apply a sampled appearance to a drawing model.

    Args:
        model: drawing model of the caller, which is changed.
        built: the original model.
        visuals: indices of the workers' skins.
        look: the appearance.
    """
    _randomize_light(model, built, look)
    _randomize_surfaces(model, built, look)
    for k, worker in enumerate(visuals.skins[:, 0]):
        is_cloth = built.skin(k).name.endswith(CLOTH)
        factor = look.clothing_rgb[worker] if is_cloth else look.skin_rgb[worker]
        model.skin_rgba[k, :3] = built.skin_rgba[k, :3] * factor


def restore(model: mujoco.MjModel, built: mujoco.MjModel) -> None:
    """Restore the original model's appearance in a drawing model of the caller."""
    fields = "light_dir", "light_diffuse", "light_specular", "mat_rgba", "mat_texid", "skin_rgba"
    for name in fields:
        getattr(model, name)[:] = getattr(built, name)
    for name in ("ambient", "diffuse"):
        getattr(model.vis.headlight, name)[:] = getattr(built.vis.headlight, name)


def hide_hats(model: mujoco.MjModel, visuals: WorkerVisuals, look: Look) -> None:
    """Hide hats according to `Look.has_hat`; call this function after `show_bodies`."""
    bare = visuals.hats[look.has_hat[visuals.hats[:, 0]] == 0.0, 2]
    model.geom_group[bare] = HIDDEN


def add_litter(scene: mujoco.MjvScene, grounds: Grounds, look: Look) -> None:
    """Add litter on the floor to MuJoCo's list of rendered geoms."""
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
    """Set brightness, colour and direction of all light."""
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
    """Tint the materials of fixed geoms, and remove the textures of some of them."""
    draws = np.random.default_rng([look.seed, 1])
    still = np.unique(built.geom_matid[(built.geom_bodyid == 0) & (built.geom_matid >= 0)])
    tint = 1.0 - look.tint * draws.uniform(0, 1, (len(still), 3))
    has_picture = (built.mat_texid[still] >= 0).any(1)
    plain = has_picture & (draws.uniform(0, 1, len(still)) < look.untextured)
    colour = np.where(plain[:, None], PLAIN_RGB, built.mat_rgba[still, :3])
    model.mat_rgba[still, :3] = colour * tint
    model.mat_texid[:] = built.mat_texid
    model.mat_texid[still[plain]] = -1
