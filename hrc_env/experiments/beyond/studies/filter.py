"""What each part of the default filter contributes: without one after the other."""

import math
from typing import Any

from hrc_env.experiments.beyond.metrics import Found
from hrc_env.experiments.beyond.study import Panel, Rows, Study
from hrc_env.experiments.beyond.trial.setting import ALL, SINGLE, Rig, Setting, left_of
from hrc_env.experiments.beyond.variants import VARIANTS, estimator_of
from hrc_env.tracking.config import ParticleConfig

WHOLE = "all"
"""The variant that is the default filter."""
WITHOUT: dict[str, dict[str, Any]] = {
    "velocity forgotten": {},
    "bones of any length": {},
    "no outliers": {"outlier_weight": 1e-9},
    "no swaps": {"swap_begins": 1e-30, "swap_ends": 1.0 - 1e-16},
    "noise as told": {"noise_bounds": (1.0, 1.0)},
    "mode for mean": {"mean_correction": 0.0},
    "no widening": {"one_view_inflation": 1.0},
    "no floor": {"floor_std_m": math.inf},
    "stiff bones": {"bone_give": 1.0},
}
"""Parts beside the hypotheses, by the settings that take them away."""
HANDICAPS = {
    "velocity forgotten": ("learnt", "forgotten"),
    "bones of any length": ("none", "model"),
}
"""Those that no setting of the filter takes away: what becomes of bones and motion."""
WORDS = {
    WHOLE: "the default filter",
    "velocity forgotten": "no motion model (velocity forgotten)",
    "bones of any length": "no bones (any length)",
    "no outliers": "no outliers in the likelihood",
    "no swaps": "no exchanged sides",
    "noise as told": "no learnt noise (as the detector tells)",
    "mode for mean": "no step from the mode to the mean",
    "no widening": "no wider report for one view",
    "stiff bones": "stiff bones (that give no more than people's)",
    "kalman": "no mixture (kalman)",
    "one hypothesis": "no mixture (one hypothesis)",
}
RIVALS = {
    "paper": "paper: Algorithm 1",
    "ransac": "ransac: no motion, no body",
}
HANGING_ON_ONE_VIEW = ("no widening", *(name for name in VARIANTS if name not in (WHOLE, "kalman")))
"""Parts that do nothing while several cameras look."""
CAMERAS: dict[str, tuple[str, tuple[Rig, ...]]] = {
    "4cam": ("four cameras", (ALL,)),
    "1cam": ("one camera", SINGLE),
}


def _setting(cameras: str, name: str, estimator: str, change: dict[str, Any]) -> Setting:
    spoken, rigs = CAMERAS[cameras]
    bones, motion = HANDICAPS.get(name, ("learnt", "model"))
    words = {**WORDS, **RIVALS}.get(name, name)
    return Setting(
        f"{cameras}_{name.replace(' ', '_')}",
        f"{spoken}: {words}",
        estimator=estimator,
        tracker=ParticleConfig(**change),
        bones=bones,
        motion=motion,
        turns=left_of("lab", rigs),
        is_timed=True,
    )


def _settings(cameras: str) -> tuple[Setting, ...]:
    variants = {WHOLE: VARIANTS[WHOLE], **WITHOUT, **VARIANTS}
    if cameras == "4cam":
        variants = {k: v for k, v in variants.items() if k not in HANGING_ON_ONE_VIEW}
    ours = (_setting(cameras, name, estimator_of(name), v) for name, v in variants.items())
    return (*ours, *(_setting(cameras, name, name, {}) for name in RIVALS))


SETTINGS = {cameras: _settings(cameras) for cameras in CAMERAS}


def _panels(found: Found) -> tuple[Panel, ...]:
    del found
    return tuple(
        Rows(spoken.capitalize(), tuple(setting.name for setting in SETTINGS[cameras]))
        for cameras, (spoken, _) in CAMERAS.items()
    )


def _says(found: Found) -> str:
    return " ".join(_with(found, cameras) for cameras in CAMERAS)


def _with(found: Found, cameras: str) -> str:
    """What is missed most with so many cameras, and what is less honest than the whole."""
    whole = f"{cameras}_{WHOLE}"
    rms = {
        setting: found.of("rmse_m", setting.name).value
        for setting in SETTINGS[cameras]
        if setting.estimator in ("particle", "kalman")
    }
    here, inside = found.of("rmse_m", whole).value, found.of("coverage95", whole).value
    by_cost = sorted(rms, key=lambda setting: rms[setting], reverse=True)
    missed = ", ".join(
        f"{_part(each)} {1000 * rms[each]:,.0f} mm"
        for each in by_cost[:4]
        if rms[each] > MATTERS * here
    )
    better = ", ".join(
        f"{_part(each)} {1000 * rms[each]:,.0f} mm" for each in rms if MATTERS * rms[each] < here
    )
    return (
        f"With {CAMERAS[cameras][0]} the default filter has an RMSE of {1000 * here:,.0f} mm and "
        f"a coverage of {100 * inside:.0f} %; "
        + (f"worst are {missed}" if missed else "no part is missed by more than 5 %")
        + (f"; better without: {better}." if better else ".")
    )


def _part(setting: Setting) -> str:
    return setting.words.split(": ")[1]


MATTERS = 1.05
"""An RMSE that is larger by this factor is spoken of."""

FILTER = Study(
    "filter",
    "What each part of the default filter contributes",
    "The default filter without one of its parts, and rivals that have fewer, on the same "
    "detections: with all four cameras of the laboratory, and with one that is left after the "
    "warm-up. Times are those of the settings with their cameras.",
    tuple(setting for cameras in CAMERAS for setting in SETTINGS[cameras]),
    _panels,
    _says,
)
