"""The default filter without one part after the other: what its hypotheses buy."""

from typing import Any

VARIANTS: dict[str, dict[str, Any]] = {
    "kalman": {},
    "one hypothesis": {"n_hypotheses": 1},
    "all": {},
    "no turned body": {"mirrored_parts": ("limbs",)},
    "no limbs": {"mirrored_parts": ("body",)},
    "no anatomy": {"anatomy_trust": 0.0},
    "no walking direction": {"walking_odds": 0.0},
    "evidence in full": {"evidence_trust": 1.0},
    "4 hypotheses": {"n_hypotheses": 4},
    "16 hypotheses": {"n_hypotheses": 16},
}
"""Changes of the tracker's settings; `kalman` is that estimator."""


def estimator_of(variant: str) -> str:
    """Whose settings are changed."""
    return "kalman" if variant == "kalman" else "particle"
