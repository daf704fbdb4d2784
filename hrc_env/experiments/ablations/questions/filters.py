"""Ablations of Algorithm 1, of the parts of the default filter, and of its body model."""

import math
from typing import Any, NamedTuple

from hrc_env.experiments.ablations.ablation import Ablation, Setting
from hrc_env.experiments.ablations.questions.rigs import PAIRS
from hrc_env.experiments.rigs import ALL, SINGLE, Rig, make_turns
from hrc_env.tracking.config import PaperConfig, ParticleConfig


def _make_paper(name: str, n: int, m: int, sigma_cm: float = 5) -> Setting:
    tracker = PaperConfig(n_iterations=n, n_particles=m, sigma_m=sigma_cm / 100)
    words = f"N = {n}, M = {m:,}, noise {sigma_cm:g} cm"
    return Setting(name, words, estimator="paper", tracker=tracker)


ALGORITHM_1 = Ablation(
    "algorithm1",
    "N and M of Algorithm 1",
    "The paper gives neither its number of particles M nor of passes N nor the noise of line 7. "
    "Four cameras are in the corners of the laboratory; each joint has M particles.",
    (
        *(_make_paper(f"n1_m{m}", 1, m) for m in (30, 100, 300, 1000, 3000, 10_000)),
        *(_make_paper(f"n{n}_m1000", n, 1000) for n in (2, 5, 10)),
        *(_make_paper(f"sigma_{cm}cm", 1, 1000, cm) for cm in (1, 2, 10)),
        Setting("particle", "the default filter"),
    ),
    against=("particle",),
)


class Variant(NamedTuple):
    """A variant of the default filter, or another estimator."""

    words: str
    """Description of the variant in tables."""
    changes: dict[str, Any]
    """Values that differ from the default, by field of `Setting` or of `TrackerConfig`."""


WITHOUT = {
    "all": Variant("the default filter", {}),
    "velocity forgotten": Variant("no motion model (velocity forgotten)", {"motion": "forgotten"}),
    "bones of any length": Variant("no bones (any length)", {"bones": "none"}),
    "no outliers": Variant("no outliers in the likelihood", {"outlier_weight": 1e-9}),
    "no swaps": Variant(
        "no exchanged sides", {"swap_start_probability": 1e-30, "swap_end_probability": 1.0 - 1e-16}
    ),
    "reported noise": Variant(
        "no learnt noise (only the detector's)", {"noise_bounds": (1.0, 1.0)}
    ),
    "mode for mean": Variant("no step from the mode to the mean", {"mean_correction": 0.0}),
    "no widening": Variant("no wider covariance for one view", {"one_view_inflation": 1.0}),
    "no floor": Variant("no floor", {"floor_std_m": math.inf}),
    "stiff bones": Variant(
        "stiff bones (no more variation than in people)", {"bone_variation_scale": 1.0}
    ),
    "kalman": Variant("no mixture (kalman)", {"estimator": "kalman"}),
    "one hypothesis": Variant("no mixture (one hypothesis)", {"n_hypotheses": 1}),
    "no turned body": Variant("no turned body", {"mirrored_parts": ("limbs",)}),
    "no limbs": Variant("no limbs", {"mirrored_parts": ("body",)}),
    "no anatomy": Variant("no anatomy", {"anatomy_exponent": 0.0}),
    "no walking direction": Variant("no walking direction", {"walking_log_odds_per_s": 0.0}),
    "evidence in full": Variant("evidence in full", {"evidence_exponent": 1.0}),
    "4 hypotheses": Variant("4 hypotheses", {"n_hypotheses": 4}),
    "16 hypotheses": Variant("16 hypotheses", {"n_hypotheses": 16}),
    "paper": Variant("paper: Algorithm 1 as printed", {"estimator": "paper"}),
    "paper restarts": Variant("paper_restarts: with restarts", {"estimator": "paper_restarts"}),
    "ransac": Variant("ransac: no motion, no body", {"estimator": "ransac"}),
}
"""The default filter without one of its parts, and other estimators, by name."""
OF_ONE_VIEW = (
    "no widening", "one hypothesis", "no turned body", "no limbs", "no anatomy",
    "no walking direction", "evidence in full", "4 hypotheses", "16 hypotheses",
)  # fmt: skip
"""Names of the variants that differ from the default filter only if a single camera works."""


class CameraChoice(NamedTuple):
    """A number of working cameras, with the rigs that successive episodes use in turn."""

    words: str
    """Description of the choice of cameras in tables."""
    rigs: tuple[Rig, ...]
    """Rigs of the cameras that work after the warm-up."""


CAMERAS = {
    "4cam": CameraChoice("four cameras", (ALL,)),
    "2cam": CameraChoice("two cameras", PAIRS),
    "1cam": CameraChoice("one camera", SINGLE),
}
"""Choices of cameras by name."""


def _make_variant(cameras: str, name: str) -> Setting:
    """Return the setting of a filter variant with a choice of cameras."""
    choice, variant = CAMERAS[cameras], WITHOUT[name]
    of_setting = {k: value for k, value in variant.changes.items() if k in Setting.__slots__}
    of_tracker = {k: value for k, value in variant.changes.items() if k not in of_setting}
    return Setting(
        f"{cameras}_{name.replace(' ', '_')}",
        f"{choice.words}: {variant.words}",
        tracker=ParticleConfig(**of_tracker),
        turns=make_turns("lab", choice.rigs),
        **of_setting,
    )


FILTER = Ablation(
    "filter",
    "Contribution of each part of the default filter",
    "The default filter without one of its parts, and other estimators that have fewer, on the "
    "same detections: with all four cameras of the laboratory, and with one that remains after the "
    "warm-up.",
    (
        *(_make_variant("4cam", name) for name in WITHOUT if name not in OF_ONE_VIEW),
        *(_make_variant("1cam", name) for name in WITHOUT),
    ),
    against=("4cam_all", "1cam_all"),
)


class BodyKnowledge(NamedTuple):
    """An estimator with a treatment of bone lengths."""

    words: str
    """Description of the estimator in tables."""
    estimator: str
    bones: str
    """Treatment of bone lengths, one of `handicaps.BONES`."""


KNOWING = {
    "learnt": BodyKnowledge("bone lengths learnt (the default)", "particle", "learnt"),
    "known": BodyKnowledge("bone lengths known", "particle", "known"),
    "none": BodyKnowledge("bones of any length", "particle", "none"),
    "points": BodyKnowledge("points without a body (ransac)", "ransac", "learnt"),
}
"""Estimators with their treatments of bone lengths, by name."""
KINEMATICS = Ablation(
    "kinematics",
    "Effect of a model of the body",
    "The default filter with the worker's true bone lengths, with lengths that it learns, and with "
    "no expectation of lengths (the motion model alone holds joints together); and an estimator "
    "without a body. All four cameras of the laboratory, two or one of them after the warm-up.",
    tuple(
        Setting(
            f"{cameras}_{name}",
            f"{choice.words}: {knowledge.words}",
            estimator=knowledge.estimator,
            bones=knowledge.bones,
            turns=make_turns("lab", choice.rigs),
        )
        for cameras, choice in CAMERAS.items()
        for name, knowledge in KNOWING.items()
    ),
    against=tuple(f"{cameras}_learnt" for cameras in CAMERAS),
)
