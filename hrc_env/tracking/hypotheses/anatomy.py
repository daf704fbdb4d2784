"""What bodies look like from the side: the nose, the toes and the knees are in front.

A body that is tracked mirrored in depth has them behind. That is told between hypotheses as a
potential of the pose that is believed now, not anew with every frame: it does not add up.
"""

from hrc_env.core.kernels import kernel
from hrc_env.tracking.models.acquisition import heading

_FEATURES = (
    (0, 1, 2, 0.12, 0.10),  # the nose before the middle of the shoulders
    (13, 11, 11, 0.12, 0.10), (14, 12, 12, 0.12, 0.10),  # toes before the ankles
    (9, 7, 11, 0.06, 0.12), (10, 8, 12, 0.06, 0.12),  # knees before the middle of the leg
    (3, 1, 5, -0.05, 0.12), (4, 2, 6, -0.05, 0.12),  # elbows behind the middle of the arm
)  # fmt: skip
"""A joint, two others, how far it is before their middle [m], and its deviation [m]: judgements
from common proportions, wide enough for turned heads and feet."""
_MOST = 4.5
"""No feature counts for more than three deviations."""


@kernel
def anatomy(body):
    """Log-potential of a pose (J, 6): 0 at best; 0 if the heading is unknown."""
    cos, sin, known = heading(body)
    total = 0.0
    if known:
        for joint, one, other, ahead, std in _FEATURES:
            x = body[joint, 0] - 0.5 * (body[one, 0] + body[other, 0])
            y = body[joint, 1] - 0.5 * (body[one, 1] + body[other, 1])
            total -= min(0.5 * ((cos * x + sin * y - ahead) / std) ** 2, _MOST)
    return total
