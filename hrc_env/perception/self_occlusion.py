"""Which joints a worker's body hides from a camera.

A joint lies inside the body, and so do the ends of the capsules that meet there; a test of
the bare line of sight would hide every joint. What counts is how much of one capsule the
line passes through: a joint is hidden where that is much more than the way from the
capsule's axis to its surface.
"""

from hrc_env.core.kernels import kernel
from hrc_env.geometry.shapes import HALF_SIZE, against_axis, rounded, through_tube

BLOCKING_CHORD = 1.4
"""A line that runs through a capsule for more than this many of its radii is blocked: it
then passes the axis within 0.7 radii."""

OWN_CAPSULE_M = 0.06
"""So much longer may the way out of a capsule be that the joint itself lies in [m]."""


@kernel
def body_blocks(table, row, px, py, pz, dx, dy, dz, length):
    """Whether a body's capsule, a row of shapes, hides what is at `length` [m] on a line.

    p is the eye less the capsule's centre, d the line's unit direction.
    """
    radius, half = table[row, HALF_SIZE], table[row, HALF_SIZE + 1]
    rise, height, ahead, excess = against_axis(table, row, px, py, pz, dx, dy, dz)
    enter, leave = through_tube(rise, height, ahead, excess)
    if min(leave, length) - max(enter, 0.0) <= BLOCKING_CHORD * radius:
        return False  # and the way through the capsule is no longer
    enter, leave = rounded(enter, leave, half, rise, height, ahead, excess)
    within = enter < length and leave >= length
    chord = min(leave, length) - max(enter, 0.0)
    return chord > BLOCKING_CHORD * radius + (OWN_CAPSULE_M if within else 0.0)
