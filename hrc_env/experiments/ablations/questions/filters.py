"""Algorithm 1, what each part of the default filter contributes, what bodies are worth."""

import math
from typing import Any

from hrc_env.experiments.ablations.ablation import Ablation, Setting
from hrc_env.experiments.ablations.questions.rigs import PAIRS
from hrc_env.experiments.rigs import ALL, SINGLE, Rig, left_of
from hrc_env.tracking.config import PaperConfig, ParticleConfig


def _paper(name: str, n: int, m: int, sigma_cm: float = 5) -> Setting:
    tracker = PaperConfig(n_iterations=n, n_particles=m, sigma_m=sigma_cm / 100)
    words = f"N = {n}, M = {m:,}, noise {sigma_cm:g} cm"
    return Setting(name, words, estimator="paper", tracker=tracker)


ALGORITHM_1 = Ablation(
    "algorithm1",
    "N and M of Algorithm 1",
    "The paper gives neither its number of particles M nor of passes N nor the noise of line 7. "
    "Four cameras in the corners of the laboratory; one joint has M particles.",
    (
        *(_paper(f"n1_m{m}", 1, m) for m in (30, 100, 300, 1000, 3000, 10_000)),
        *(_paper(f"n{n}_m1000", n, 1000) for n in (2, 5, 10)),
        *(_paper(f"sigma_{cm}cm", 1, 1000, cm) for cm in (1, 2, 10)),
        Setting("particle", "the default filter"),
    ),
    against=("particle",),
)

WITHOUT: dict[str, tuple[str, dict[str, Any]]] = {
    "all": ("the default filter", {}),
    "velocity forgotten": ("no motion model (velocity forgotten)", {"motion": "forgotten"}),
    "bones of any length": ("no bones (any length)", {"bones": "none"}),
    "no outliers": ("no outliers in the likelihood", {"outlier_weight": 1e-9}),
    "no swaps": ("no exchanged sides", {"swap_begins": 1e-30, "swap_ends": 1.0 - 1e-16}),
    "noise as told": ("no learnt noise (as the detector reports)", {"noise_bounds": (1.0, 1.0)}),
    "mode for mean": ("no step from the mode to the mean", {"mean_correction": 0.0}),
    "no widening": ("no wider report for one view", {"one_view_inflation": 1.0}),
    "no floor": ("no floor", {"floor_std_m": math.inf}),
    "stiff bones": ("stiff bones (no more give than a person's)", {"bone_give": 1.0}),
    "kalman": ("no mixture (kalman)", {"estimator": "kalman"}),
    "one hypothesis": ("no mixture (one hypothesis)", {"n_hypotheses": 1}),
    "no turned body": ("no turned body", {"mirrored_parts": ("limbs",)}),
    "no limbs": ("no limbs", {"mirrored_parts": ("body",)}),
    "no anatomy": ("no anatomy", {"anatomy_trust": 0.0}),
    "no walking direction": ("no walking direction", {"walking_odds": 0.0}),
    "evidence in full": ("evidence in full", {"evidence_trust": 1.0}),
    "4 hypotheses": ("4 hypotheses", {"n_hypotheses": 4}),
    "16 hypotheses": ("16 hypotheses", {"n_hypotheses": 16}),
    "paper": ("paper: Algorithm 1 as printed", {"estimator": "paper"}),
    "paper restarts": ("paper_restarts: with restarts", {"estimator": "paper_restarts"}),
    "ransac": ("ransac: no motion, no body", {"estimator": "ransac"}),
}
"""The default filter without one of its parts, and rivals: words, and what takes the part away,
fields of `Setting` or of the tracker's settings."""
OF_ONE_VIEW = (
    "no widening", "one hypothesis", "no turned body", "no limbs", "no anatomy",
    "no walking direction", "evidence in full", "4 hypotheses", "16 hypotheses",
)  # fmt: skip
"""Parts that do nothing while several cameras look."""
CAMERAS: dict[str, tuple[str, tuple[Rig, ...]]] = {
    "4cam": ("four cameras", (ALL,)),
    "2cam": ("two cameras", PAIRS),
    "1cam": ("one camera", SINGLE),
}


def _part(cameras: str, name: str) -> Setting:
    """The default filter without a part, or a rival."""
    (spoken, rigs), (words, changes) = CAMERAS[cameras], WITHOUT[name]
    of_setting = {key: value for key, value in changes.items() if key in Setting.__slots__}
    of_tracker = {key: value for key, value in changes.items() if key not in of_setting}
    return Setting(
        f"{cameras}_{name.replace(' ', '_')}",
        f"{spoken}: {words}",
        tracker=ParticleConfig(**of_tracker),
        turns=left_of("lab", rigs),
        **of_setting,
    )


FILTER = Ablation(
    "filter",
    "What each part of the default filter contributes",
    "The default filter without one of its parts, and rivals that have fewer, on the same "
    "detections: with all four cameras of the laboratory, and with one that is left after the "
    "warm-up.",
    (
        *(_part("4cam", name) for name in WITHOUT if name not in OF_ONE_VIEW),
        *(_part("1cam", name) for name in WITHOUT),
    ),
    against=("4cam_all", "1cam_all"),
)

KNOWING = {
    "learnt": ("bone lengths learnt (the default)", "particle", "learnt"),
    "known": ("bone lengths known", "particle", "known"),
    "none": ("bones of any length", "particle", "none"),
    "points": ("points without a body (ransac)", "ransac", "learnt"),
}
"""What is known of the body: words, estimator and bones."""
KINEMATICS = Ablation(
    "kinematics",
    "What it is worth to know the body",
    "The default filter with the worker's true bone lengths, with lengths that it learns, and "
    "with none expected (the motion model alone holds joints together); beside an estimator "
    "without a body. All four cameras of the laboratory, two or one of them after the warm-up.",
    tuple(
        Setting(
            f"{cameras}_{name}",
            f"{spoken}: {words}",
            estimator=estimator,
            bones=bones,
            turns=left_of("lab", rigs),
        )
        for cameras, (spoken, rigs) in CAMERAS.items()
        for name, (words, estimator, bones) in KNOWING.items()
    ),
    against=tuple(f"{cameras}_learnt" for cameras in CAMERAS),
)
