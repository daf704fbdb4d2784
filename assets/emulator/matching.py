"""The last touch of a calibration: play the same clips with the emulator, and close what is open.

The fit takes one table after the other, and what is drawn from all of them together is not quite
what was measured: sizes, whole bodies that are seen badly, and the error in space are compared
with those of the pixels, and corrected by what they are off.
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
from assets.emulator.samples import Samples, postures_of, samples_of
from assets.emulator.watch import Watched, watch
from assets.emulator.writing import write_calibration
from hrc_env.config import HRCConfig
from hrc_env.core.typing import Floats
from hrc_env.perception.calibration import LONGEST_TAIL, Calibration
from hrc_env.perception.emulator import EmulatorConfig

IN_THE_IMAGE, IN_SPACE = 3, 7
"""Rounds: first errors in the image are matched, then those in space; in one more their scale."""
STEP = (0.75, 1.3)
"""No number changes by more than such a factor in a round."""
DRAWS = 3
"""How often the emulator plays every clip in a round."""
DAMPED = 0.7
"""Power of the factors in space: what the emulator draws by chance is not to be fitted."""
THROUGH_THE_TRACKER = 1.5
"""Power of the factors of tails, chosen by trial: with `DAMPED` they were short at the end."""
OFTEN = 2000
"""Least number of joints of a posture for an estimate of it: some three clips."""
USUAL = 2.366
"""Median of the square of three normal variables: so much a longer tail adds to the median."""
TAKEN_BACK = 0.5
"""How much of what a longer tail adds to the median is taken off at once, before it is measured."""
TOLD_LAGS = (2, 5, 12)
"""Those of `LAGS` by which the duration of errors is estimated [frames]."""
LONG_LAGS = (25, 35)
"""Those by which the lasting share of errors is estimated [frames]."""
Say = Callable[[float, str], None]
"""Called with the growth of the finished share, and with the current work."""


def matched(
    draft: Calibration, clips: list[Clip], pixels: list[Watched], path: Path, say: Say
) -> Calibration:
    """A draft, corrected so that the emulator does to these clips what the pixels did.

    Args:
        draft: what the fit gave.
        clips: K of them.
        pixels: (K) what was seen of them.
        path: a file that may be written while this runs.
        say: hears of the progress: shares that sum to 1.
    """
    wanted, n_rounds = samples_of(pixels), IN_THE_IMAGE + IN_SPACE + 1
    for k in range(n_rounds):
        write_calibration(path, draft, {})
        part = 1 / n_rounds / DRAWS / len(clips)
        emulated = _emulated(clips, path, lambda part=part: say(part, "emulator"))
        if k < IN_THE_IMAGE:
            draft = _as_in_the_image(draft, wanted, samples_of(emulated))
        elif k < IN_THE_IMAGE + IN_SPACE:
            draft = _as_in_space(draft, pixels, emulated)
        else:
            draft = _scaled(draft, pixels, emulated)
    path.unlink()
    return replace(draft, novel=novel_of(draft, pixels))


def _emulated(clips: list[Clip], path: Path, tick: Callable[[], None]) -> list[Watched]:
    """Every clip `DRAWS` times."""
    config = replace(HRCConfig(), emulator=EmulatorConfig(calibration=str(path)))
    seen = []
    for draw in range(DRAWS):
        for watched in watch("keypoints", [replace(clip, draw=draw) for clip in clips], config):
            seen.append(watched)
            tick()
    return seen


def _as_in_the_image(draft: Calibration, wanted: Samples, drawn: Samples) -> Calibration:
    """Sizes by cell and how they spread, how badly whole bodies are seen, and how long errors last,
    moved by what they are off."""
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
        slow_m=draft.slow_m * longer, shares=_moved(draft.shares, float(stays.mean())),
    )  # fmt: skip


def _moved(shares: Floats, more: float) -> Floats:
    """Shares (K, 3) of what stays and what lasts for a while, of which so much more stays."""
    more_each = np.clip(more, -shares[:, 0], shares[:, 1])
    return shares + np.stack([more_each, -more_each, np.zeros(N_K)], -1)


def _correlation(samples: Samples, lags: tuple[int, ...]) -> Floats:
    """(P, n) correlation of errors with those so many frames later, by posture, .01 to .99."""
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
    """(P, S, K) each: median length of the errors, and the logarithm of what their 95th percentile
    is over it; 1 where there are hardly any."""
    length = np.linalg.norm(cells.mirrored, axis=-1)
    middle, wide = np.ones((N_P, N_S, N_K)), np.ones((N_P, N_S, N_K))
    for cell in np.ndindex(*middle.shape):
        mine = cells.pick(*cell)
        if mine.sum() >= 30:
            half, most = np.percentile(length[mine], [50, 95])
            middle[cell], wide[cell] = half, np.log(most / half)
    return middle, wide


def _trust(cells: Cells) -> Floats:
    """(P, S, K) how far a cell has enough samples to speak for itself."""
    count = np.zeros((N_P, N_S, N_K))
    for cell in np.ndindex(*count.shape):
        count[cell] = cells.pick(*cell).sum()
    return np.where(count >= 30, count / (count + FEW), 0.0)


def _limited(factor: Floats | float, trust: Floats | float = 1.0) -> Floats:
    return np.clip(factor, *STEP) ** trust


def _as_in_space(draft: Calibration, pixels: list[Watched], emulated: list[Watched]) -> Calibration:
    """All errors scaled by what the tracker's median error is off, posture by posture; tails of
    what cameras share by what is then left of its 95th percentile's."""
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


def _scaled(draft: Calibration, pixels: list[Watched], emulated: list[Watched]) -> Calibration:
    """All errors scaled by what the growing tails have left of the medians' difference."""
    size, wander = draft.size.copy(), draft.wander_m.copy()
    for posture, middle, _ in _off(pixels, emulated):
        size[posture] *= middle
        wander[posture] *= middle
    return replace(draft, size=size, wander_m=wander)


def _off(pixels: list[Watched], emulated: list[Watched]) -> Iterator[tuple[int, float, float]]:
    """For each posture of which there is enough: it, and factors by which median and 95th
    percentile of the tracker's errors would have to grow."""
    for posture in range(N_P):
        wanted, drawn = _errors_in(pixels, posture), _errors_in(emulated, posture)
        if min(wanted.size, drawn.size) >= OFTEN:
            middle, most = np.percentile(wanted, [50, 95]) / np.percentile(drawn, [50, 95])
            yield posture, float(middle), float(most)


def _errors_in(watched: list[Watched], posture: int) -> Floats:
    """(N,) errors of the tracked joints while the body was of a posture [m]."""
    errors = [np.zeros(0)]
    for each in watched:
        mine = each.tracked & (class_of(postures_of(each)) == posture)
        mine[:WARM_UP] = False
        errors.append(np.linalg.norm((each.mean_world - each.joints_world)[mine], axis=-1).ravel())
    return np.concatenate(errors)
