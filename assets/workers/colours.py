"""The colours of a worker."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Colours:
    """RGB colours of skin, hair and clothes."""

    skin: tuple[int, int, int] = (214, 166, 138)
    hair: tuple[int, int, int] = (62, 44, 32)
    iris: tuple[int, int, int] = (88, 62, 40)
    vest: tuple[int, int, int] = (204, 238, 40)
    trim: tuple[int, int, int] = (250, 130, 30)
    stripe: tuple[int, int, int] = (196, 201, 204)
    bib: tuple[int, int, int] = (44, 66, 112)
    shirt: tuple[int, int, int] = (70, 92, 132)
    trousers: tuple[int, int, int] = (52, 56, 70)
    belt: tuple[int, int, int] = (44, 34, 28)
    boots: tuple[int, int, int] = (128, 88, 54)
    sole: tuple[int, int, int] = (34, 32, 31)
    hat: tuple[int, int, int] = (250, 200, 36)


def shaded(colour: tuple[int, int, int], factor: float) -> np.ndarray:
    """A colour made darker or lighter."""
    return np.array(colour) * factor
