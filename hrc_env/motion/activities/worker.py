"""What start functions get of a worker: one bundle, so that all of them are called alike."""

from typing import NamedTuple

from hrc_env.core.typing import Floats

N_START = 16
"""Uniform numbers that a start function may use."""

Place = tuple[float, float, float, float]
"""x, y [m], yaw [rad], height of the work [m]."""


class Worker(NamedTuple):
    """The rows of one worker, their body's constants and room to work in."""

    traits: Floats
    """(N_TRAITS,) see `plans`."""
    plan: Floats
    """(N_PLAN,) written by start functions."""
    prints: Floats
    """(MAX_STEPS, 5) footprints of the steps to come."""
    stance: Floats
    """(2, 5) footprints that the activity begins on, as `prints`."""
    bones: Floats
    """(22, 3) `Anatomy.offset`."""
    frame: Floats
    """(22, 3, 3) `Anatomy.frame`."""
    size: Floats
    """(N_SIZES,) `Anatomy.size`."""
    q: Floats
    """(N_CONTROLS,) scratch; its feet stand where they stand at time 0."""
    p: Floats
    """(N_POINTS, 3) scratch."""
    r: Floats
    """(N_FRAMES, 3, 3) scratch."""
