"""The worst crops, with what was detected and where the worker truly was, for people to look at."""

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

from hrc_env.core.records import Roi
from hrc_env.core.skeleton import BONES
from hrc_env.core.typing import Image, Points2
from hrc_env.perception.blazepose import image_from_crop
from hrc_env.render.overlay import draw_landmarks, label, tile

N_CROPS, COLUMNS = 20, 5
MOST_MISSED = 8
"""So many of them at most show somebody who was not found at all."""
SCALE = 1.25
"""Crops are shown so much larger than the network sees them."""
TRUTH = (90, 230, 160)


def marked(crop: Image, window: Roi, found_px: Points2, true_px: Points2, text: str) -> Image:
    """A crop with the true body in thin green and the detected one over it.

    Args:
        crop: (n, n, 3).
        window: which part of the image it is.
        found_px: (J, 2) pixels of the image; NaN where nothing was found.
        true_px: (J, 2) likewise.
        text: what is written in its corner.
    """
    side = round(SCALE * len(crop))
    image = np.asarray(cv2.resize(crop, (side, side), interpolation=cv2.INTER_CUBIC), np.uint8)
    matrix = image_from_crop(window, side)
    points = (true_px - matrix[:, 2]) @ np.linalg.inv(matrix[:, :2]).T
    neck = points[[1, 2]].mean(0)
    ends = np.array([*((points[i], points[j]) for i, j in BONES[:-2]), (points[0], neck)])
    for a, b in np.round(16 * np.clip(ends, -999, 999)).astype(int).tolist():
        cv2.line(image, a, b, TRUTH, 1, cv2.LINE_AA, 4)
    draw_landmarks(image, window, found_px, np.ones(len(found_px)))
    label(image, text, (2, 2), 13)
    return image


def worst_of(errors: Sequence[float]) -> list[int]:
    """Indices of the crops for a sheet, worst first, those without a detection (NaN) last."""
    error = np.asarray(errors, float)
    missed = np.flatnonzero(np.isnan(error))
    order = [k for k in np.argsort(-error, kind="stable").tolist() if not np.isnan(error[k])]
    n_missed = min(len(missed), max(MOST_MISSED, N_CROPS - len(order)))
    return [*order[: N_CROPS - n_missed], *missed[:n_missed].tolist()]


def write_sheet(path: Path, crops: Sequence[Path]) -> None:
    """Lay crops out on one picture; nothing is written if there are none."""
    images = [np.asarray(cv2.imread(str(crop)), np.uint8) for crop in crops]
    if images:
        blank = np.zeros_like(images[0])
        images += [blank] * (-len(images) % COLUMNS)
        cv2.imwrite(str(path), tile(images, COLUMNS))


def keep(path: Path, image: Image) -> None:
    """Write one RGB crop."""
    path.parent.mkdir(parents=True, exist_ok=True)
    cv2.imwrite(str(path), cv2.cvtColor(image, cv2.COLOR_RGB2BGR))
