"""Correction of a calibration: play the same clips with the emulator and remove the differences.

The fit estimates one table after the other, and errors drawn from all of them together do not
reproduce the measured ones exactly. Sizes, factors of whole bodies and the error in space are
compared with those of the pixels and corrected by their differences.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from assets.emulator.clips import WARM_UP, Clip
from assets.emulator.fit.body import body_spread
from assets.emulator.fit.cells import (
    FEW,
    N_K,
    N_P,
    N_S,
    SHARP,
    Cells,
    class_of,
)
from assets.emulator.fit.lasting import LAGS, add_lagged
from assets.emulator.fit.novelty import novel_of
from assets.emulator.samples import Samples, make_samples, read_postures
from assets.emulator.watch import Watched, watch
from assets.emulator.writing import write_calibration
from hrc_env.config import HRCConfig
from hrc_env.core.typing import Floats
from hrc_env.perception.calibration import LONGEST_TAIL, Calibration
from hrc_env.perception.emulator import EmulatorConfig

IN_THE_IMAGE, IN_SPACE = 3, 7
"""Numbers of rounds: the errors in the image are matched first, then those in space; one more round
corrects their scale."""
STEP = (0.75, 1.3)
"""Greatest decrease and increase of a number in a round, as factors."""
DRAWS = 3
"""Number of times that the emulator plays every clip in a round."""
DAMPED = 0.7
"""Power of the factors in space, so that random errors of the emulator are not fitted."""
THROUGH_THE_TRACKER = 1.5
"""Power of the factors of tails, chosen by trial: with `DAMPED` they were too short at the end."""
OFTEN = 2000
"""Least number of joints of a posture for an estimate: some three clips."""
USUAL = 2.366
"""Median of the square of three normal variables, by which a longer tail increases the median."""
TAKEN_BACK = 0.5
"""Share of a longer tail's effect on the median that is compensated at once, before it is
measured."""
TOLD_LAGS = (2, 5, 12)
"""Lags of `LAGS` by which the duration of errors is estimated [frames]."""
LONG_LAGS = (25, 35)
"""Lags of `LAGS` by which the lasting share of errors is estimated [frames]."""
Say = Callable[[float, str], None]
"""Callback with the increase of the completed share, and with the current work."""


def matched(
    draft: Calibration, clips: list[Clip], pixels: list[Watched], path: Path, say: Say
) -> Calibration:
    """Correct a draft so that the emulator reproduces the errors of the pixels on these clips.

    Args:
        draft: result of the fit.
        clips: K clips.
        pixels: (K) their detections in rendered images.
        path: temporary file of the drafts.
        say: callback of the progress; its shares sum to 1.
    """
    wanted, n_rounds = make_samples(pixels), IN_THE_IMAGE + IN_SPACE + 1
    for k in range(n_rounds):
        write_calibration(path, draft, {})
        part = 1 / n_rounds / DRAWS / len(clips)
        emulated = _emulate(clips, path, lambda part=part: say(part, "emulator"))
        if k < IN_THE_IMAGE:
            draft = _correct_image(draft, wanted, make_samples(emulated))
        elif k < IN_THE_IMAGE + IN_SPACE:
            draft = _correct_space(draft, pixels, emulated)
        else:
            draft = _scale(draft, pixels, emulated)
    path.unlink()
    return replace(draft, novel=novel_of(draft, pixels))


def _emulate(clips: list[Clip], path: Path, tick: Callable[[], None]) -> list[Watched]:
    """Play every clip `DRAWS` times with the emulator."""
    config = replace(HRCConfig(), emulator=EmulatorConfig(calibration=str(path)))
    seen = []
    for draw in range(DRAWS):
        for watched in watch("keypoints", [replace(clip, draw=draw) for clip in clips], config):
            seen.append(watched)
            tick()
    return seen


def _correct_image(draft: Calibration, wanted: Samples, drawn: Samples) -> Calibration:
    """Correct the errors in the image.

    These are sizes by cell and their spread, factors of whole bodies, and the duration of errors.
    """
    cells, others = Cells(wanted), Cells(drawn)
    body = draft.body * _limited(body_spread(cells) / body_spread(others))[:, None]
    (middle, wide), (middle_drawn, wide_drawn) = _lengths(cells), _lengths(others)
    size = draft.size * _limited(middle / middle_drawn, _trust(cells))
    spread = draft.spread * _limited(wide / wide_drawn, _trust(cells))
    fading, fading_drawn = (np.log(_correlation(each, TOLD_LAGS)) for each in (wanted, drawn))
    longer = _limited(float(np.mean(fading_drawn / fading)))
    stays = _correlation(wanted, LONG_LAGS) - _correlation(drawn, LONG_LAGS)
    return replace(
        draft, size=size, spread=spread, body=body, slow_s=draft.slow_s * longer,
        slow_m=draft.slow_m * longer, shares=_shift(draft.shares, float(stays.mean())),
    )  # fmt: skip


def _shift(shares: Floats, more: float) -> Floats:
    """Increase the constant share of shares (K, 3) of constant and lasting errors."""
    more_each = np.clip(more, -shares[:, 0], shares[:, 1])
    return shares + np.stack([more_each, -more_each, np.zeros(N_K)], -1)


def _correlation(samples: Samples, lags: tuple[int, ...]) -> Floats:
    """Return the correlation of errors at these lags by posture, (P, n), between .01 and .99."""
    class_ = class_of(samples.posture)[..., None, None, None]
    small = np.linalg.norm(samples.error, axis=-1, keepdims=True) < SHARP
    found = []
    for posture in range(N_P):
        mine = np.where(small & (class_ == posture), samples.error, np.nan)
        sums = [np.zeros(len(LAGS)), np.full(len(LAGS), 1e-12)]
        add_lagged(sums, mine)
        found.append((sums[0] / sums[1])[[LAGS.index(lag) for lag in lags]])
    return np.clip(found, 0.01, 0.99)


def _lengths(cells: Cells) -> tuple[Floats, Floats]:
    """Return the median length of the errors and the logarithm of the 95th percentile over it, each
    (P, S, K).

    The values are 1 where there are hardly any errors.
    """
    length = np.linalg.norm(cells.mirrored, axis=-1)
    middle, wide = np.ones((N_P, N_S, N_K)), np.ones((N_P, N_S, N_K))
    for cell in np.ndindex(*middle.shape):
        mine = cells.pick(*cell)
        if mine.sum() >= 30:
            half, most = np.percentile(length[mine], [50, 95])
            middle[cell], wide[cell] = half, np.log(most / half)
    return middle, wide


def _trust(cells: Cells) -> Floats:
    """Return the weight of each cell by its number of samples, (P, S, K)."""
    count = np.zeros((N_P, N_S, N_K))
    for cell in np.ndindex(*count.shape):
        count[cell] = cells.pick(*cell).sum()
    return np.where(count >= 30, count / (count + FEW), 0.0)


def _limited(factor: Floats | float, trust: Floats | float = 1.0) -> Floats:
    return np.clip(factor, *STEP) ** trust


def _correct_space(
    draft: Calibration, pixels: list[Watched], emulated: list[Watched]
) -> Calibration:
    """Correct the errors in space.

    All errors are scaled by the ratio of the tracker's median errors, posture by posture; the tails
    of the error that cameras share by the ratio that remains of its 95th percentile.
    """
    size, wander, tail = draft.size.copy(), draft.wander_m.copy(), draft.tail.copy()
    for posture, middle, most in _off(pixels, emulated):
        factor = _limited(middle**DAMPED)
        longer = float(_limited((most / middle) ** THROUGH_THE_TRACKER))
        grown = np.clip(((1 + 3 * tail[posture]) * longer - 1) / 3, 0.0, LONGEST_TAIL)
        added = (3 + USUAL * grown) / (3 + USUAL * tail[posture])
        size[posture] *= factor
        wander[posture] *= factor / added**TAKEN_BACK
        tail[posture] = grown
    return replace(draft, size=size, wander_m=wander, tail=tail)


def _scale(draft: Calibration, pixels: list[Watched], emulated: list[Watched]) -> Calibration:
    """Scale all errors by the ratio of the medians that remains after the growth of the tails."""
    size, wander = draft.size.copy(), draft.wander_m.copy()
    for posture, middle, _ in _off(pixels, emulated):
        size[posture] *= middle
        wander[posture] *= middle
    return replace(draft, size=size, wander_m=wander)


def _off(pixels: list[Watched], emulated: list[Watched]) -> Iterator[tuple[int, float, float]]:
    """Yield each posture of enough samples with the factors of the tracker's median and 95th
    percentile."""
    for posture in range(N_P):
        wanted, drawn = _errors_in(pixels, posture), _errors_in(emulated, posture)
        if min(wanted.size, drawn.size) >= OFTEN:
            middle, most = np.percentile(wanted, [50, 95]) / np.percentile(drawn, [50, 95])
            yield posture, float(middle), float(most)


def _errors_in(watched: list[Watched], posture: int) -> Floats:
    """Return errors of the tracked joints while the body was of a posture, (N,) [m]."""
    errors = [np.zeros(0)]
    for each in watched:
        mine = each.tracked & (class_of(read_postures(each)) == posture)
        mine[:WARM_UP] = False
        errors.append(np.linalg.norm((each.mean_world - each.joints_world)[mine], axis=-1).ravel())
    return np.concatenate(errors)
