"""Validation of the emulator against the pixels: the same clips, both levels, the default tracker.

The clips are none of the fit's: other seeds, other pairs of motion and body, and displaced cameras.
The criterion is the 3D error after tracking, by family of motions.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from assets.emulator.clips import FAMILIES, WARM_UP, Clip, find_family, list_unseen_clips
from assets.emulator.samples import find_exchanges
from assets.emulator.shelf import watch_cached
from assets.emulator.watch import BodyOf, Watched, watch
from hrc_env.config import HRCConfig
from hrc_env.core.results import Metric
from hrc_env.core.typing import Bools, Floats, Ints
from hrc_env.evaluation.intervals import MIN_SEEDS
from hrc_env.perception.sightlines import SEEN, SIDE
from hrc_env.worker.body import load_body

CHI2_95_3D = 7.815
"""95th percentile of the squared length of three standard normal variables."""
GROUPS = {name: (name,) for name in FAMILIES}
GROUPS |= {"upright": tuple(name for name in FAMILIES if name != "fold"), "all": tuple(FAMILIES)}
"""Families of motions of which there are metrics, each alone and some together."""
HALF_SEEN = 8
"""Least number of joints of 15 in sight of which the body counts as half seen."""
DRAWS = 4
"""Number of times that the emulator plays a clip."""
RESAMPLES = 200
"""Number of resamples of clips for an interval."""
Say = Callable[[float, str], None]
"""Callback with the increase of the completed share, and with the current work."""
InSpace = tuple[Floats, Bools]
"""Errors of joints, (N,) [m], and whether they are within the reported region."""


@dataclass(frozen=True, slots=True)
class StepResult:
    """Accuracy of a level of perception on clips."""

    median_m: float
    """Median of the joints' errors while tracked [m]."""
    p95_m: float
    """95th percentile of these errors [m]."""
    coverage: float
    """Share of joints within the reported 95 % region."""
    lost: float
    """Share of frames without a tracked worker."""
    px_median: float
    """Median error in an image, as a share of the window's side."""
    px_p95: float
    """95th percentile of the error in an image, as a share of the window's side."""
    lasting: float
    """Correlation of these errors (without outliers) with those 0.48 s later."""
    missed: float
    """Share of images with at least half of the body in sight and no detection."""
    exchanged: float
    """Share of images with left and right of the body or of the legs exchanged."""
    n: int
    """Number of joints."""


@dataclass(frozen=True, slots=True)
class Compared:
    """The same clips at both levels."""

    clips: Sequence[Clip]
    """The K clips."""
    pixels: Sequence[Watched]
    """Clips in rendered images, (K,)."""
    emulated: Sequence[Sequence[Watched]]
    """Clips with the emulator, (K, `DRAWS`)."""
    outcomes: dict[str, tuple[StepResult, StepResult]]
    """Results of pixels and emulator, by the names of `GROUPS`."""


def error_ratios(
    rounds: int = 1,
    seed: int = 0,
    say: Say = lambda share, label: None,
    config: HRCConfig | None = None,
    store: Path | None = None,
    picture: Path | None = None,
) -> dict[str, Metric]:
    """Return `ratios_of` clips that no fit has used.

    Args:
        rounds: number of times that each motion is rendered in each scene: 82 clips a round; 0:
            once, in one of them.
        seed: seed of the clips.
        say: callback of the progress; its shares sum to 1.
        config: settings; their `emulator` is validated.
        store: folder of rendered clips, which are read from it and saved there; None: none are
            saved.
        picture: file of a plot of both levels (PNG); None: no plot.
    """
    seen = compared(list_unseen_clips(rounds, seed), say, config or HRCConfig(), store)
    if picture is not None:
        from assets.emulator.plot import plot_comparison  # which imports this module

        plot_comparison(picture, seen)
    return ratios_of(seen)


def ratios_of(seen: Compared) -> dict[str, Metric]:
    """Return the error of the emulator over that of the pixels, by family of motions.

    Returns:
        `emulator_error_ratio.<family>` for medians, `.<family>.p95`, and
            `emulator_coverage_difference.<family>`; their 95 % intervals resample the clips. Their
            terms and the durations are `emulator_<metric>.<family>.<pixels|keypoints>` with the
            metrics median_m, p95_m, coverage95, lasting and exchanged; the numbers of clips are
            `emulator_clips.<family>`.
    """
    pixels = [in_space([each]) for each in seen.pixels]
    emulated = [in_space(each) for each in seen.emulated]
    metrics: dict[str, Metric] = {}
    for family, outcomes in seen.outcomes.items():
        mine = select_family(seen.clips, family)
        metrics[f"emulator_clips.{family}"] = _exactly(len(mine), "", len(mine))
        for level, found in zip(("pixels", "keypoints"), outcomes, strict=True):
            for what, value, unit in (
                ("median_m", found.median_m, "m"), ("p95_m", found.p95_m, "m"),
                ("coverage95", found.coverage, "share"), ("lasting", found.lasting, ""),
                ("exchanged", found.exchanged, "share"),
            ):  # fmt: skip
                metrics[f"emulator_{what}.{family}.{level}"] = _exactly(value, unit, found.n)
        metrics |= apart(family, [pixels[k] for k in mine], [emulated[k] for k in mine])
    return metrics


def _exactly(value: float, unit: str, n: int) -> Metric:
    return Metric(value, value, value, unit, n)


def apart(family: str, pixels: Sequence[InSpace], emulated: Sequence[InSpace]) -> dict[str, Metric]:
    """Return the differences of both levels on K clips of a family."""

    def off(ks: Ints) -> list[float]:
        (a, a_inside), (b, b_inside) = (_of(ks, level) for level in (pixels, emulated))
        ratios = np.percentile(b, [50, 95]) / np.percentile(a, [50, 95])
        return [*ratios.tolist(), float(b_inside.mean() - a_inside.mean())]

    ratio, n_joints = f"emulator_error_ratio.{family}", sum(error.size for error, _ in pixels)
    names = (ratio, f"{ratio}.p95", f"emulator_coverage_difference.{family}")
    return dict(zip(names, over_clips(off, len(pixels), ("", "", ""), n_joints), strict=True))


def over_clips(
    numbers: Callable[[Ints], list[float]], n_clips: int, units: Sequence[str], n: int
) -> list[Metric]:
    """Return metrics of clips (K,) with 95 % intervals that resample the clips, from 8 clips on;
    `n` is that of observations."""
    draws, values = np.random.default_rng(0), numbers(np.arange(n_clips))
    again = [numbers(draws.integers(0, n_clips, n_clips)) for _ in range(RESAMPLES)]
    ends = np.percentile(again, [2.5, 97.5], axis=0)
    lows, highs = (ends if n_clips >= MIN_SEEDS else np.full_like(ends, np.nan)).tolist()
    return [Metric(*each, n) for each in zip(values, lows, highs, units, strict=True)]


def accuracy(each: Sequence[InSpace]) -> list[Metric]:
    """Return median and 95th percentile [mm] of the errors, and the coverage, of clips."""

    def numbers(ks: Ints) -> list[float]:
        errors, inside = zip(*(each[k] for k in ks.tolist()), strict=True)
        middle, most = 1e3 * np.percentile(np.concatenate(errors), [50, 95])
        return [middle, most, float(np.concatenate(inside).mean())]

    n = sum(errors.size for errors, _ in each)
    return over_clips(numbers, len(each), ("mm", "mm", "share"), n)


def _of(ks: Ints, level: Sequence[InSpace]) -> InSpace:
    """Concatenate some clips of a level."""
    errors, inside = zip(*(level[k] for k in ks.tolist()), strict=True)
    return np.concatenate(errors), np.concatenate(inside)


def compared(
    clips: Sequence[Clip],
    say: Say,
    config: HRCConfig,
    store: Path | None,
    body_of: BodyOf = load_body,
) -> Compared:
    """Compare pixels and emulator on clips; see `error_ratios` and `watch`."""
    pixels: list[Watched] = []
    for clip, watched in zip(
        clips, watch_cached("pixels", clips, config, store, body_of), strict=True
    ):
        pixels.append(watched)
        say(0.9 / len(clips), f"pixels: {clip.motion}")
    emulated: list[list[Watched]] = [[] for _ in clips]
    for draw in range(DRAWS):
        others = [replace(clip, draw=draw) for clip in clips]
        for k, watched in enumerate(watch("keypoints", others, config, body_of)):
            emulated[k].append(watched)
            say(0.1 / DRAWS / len(clips), f"emulator: {clips[k].motion}")
    outcomes = by_family(clips, [[each] for each in pixels], emulated)
    return Compared(clips, pixels, emulated, outcomes)


def by_family(
    clips: Sequence[Clip], pixels: Sequence[list[Watched]], emulated: Sequence[list[Watched]]
) -> dict[str, tuple[StepResult, StepResult]]:
    """Return results of both levels for each of `GROUPS` that occurs."""
    result = {}
    for family in GROUPS:
        mine = select_family(clips, family)
        if mine:
            parts = [[each for k in mine for each in level[k]] for level in (pixels, emulated)]
            result[family] = (outcome(parts[0]), outcome(parts[1]))
    return result


def select_family(clips: Sequence[Clip], group: str) -> list[int]:
    """Return the indices of the clips of one of `GROUPS`."""
    return [k for k, clip in enumerate(clips) if find_family(clip.motion) in GROUPS[group]]


def outcome(watched: Sequence[Watched]) -> StepResult:
    """Compute the accuracy on some clips."""
    error, inside = in_space(watched)
    px = np.concatenate([errors_in_image(each).ravel() for each in watched])
    px = px[np.isfinite(px)]
    looked = np.concatenate(
        [(each.sight[WARM_UP:] == SEEN).sum(-1).ravel() >= HALF_SEEN for each in watched]
    )
    missed = np.concatenate([np.isnan(each.px[WARM_UP:, :, 0, 0]).ravel() for each in watched])
    return StepResult(
        float(np.median(error)), float(np.percentile(error, 95)), float(inside.mean()),
        float(1 - np.concatenate([each.tracked[WARM_UP:] for each in watched]).mean()),
        float(np.median(px)), float(np.percentile(px, 95)), lasting(watched),
        float(missed[looked].mean()), exchanging(watched), error.size,
    )  # fmt: skip


def in_space(watched: Sequence[Watched], truth: str = "joints_world") -> InSpace:
    """Return errors of the tracked joints [m], and whether they are within the reported region.

    The truth is one of the fields of `Watched`.
    """
    errors, inside = [], []
    for each in watched:
        tracked = np.flatnonzero(each.tracked[WARM_UP:]) + WARM_UP
        offset = (each.mean_world - getattr(each, truth))[tracked]
        squared = np.einsum(
            "tji,tjik,tjk->tj", offset, np.linalg.inv(each.cov_world[tracked]), offset
        )
        errors.append(np.linalg.norm(offset, axis=-1).ravel())
        inside.append((squared < CHI2_95_3D).ravel())
    return np.concatenate(errors), np.concatenate(inside)


def errors_in_image(watched: Watched) -> Floats:
    """Return errors of the detections, (T, C, J), as a share of the window's side."""
    away = np.linalg.norm(watched.px - watched.true_px, axis=-1)[WARM_UP:]
    return away / watched.look_of[WARM_UP:, :, :1]


def lasting(watched: Sequence[Watched], lag: int = 12, sharp: float = 0.06) -> float:
    """Return the correlation about zero of errors below `sharp` with those `lag` frames later."""
    product, square = 0.0, 1e-12
    for each in watched:
        error = (each.px - each.true_px)[WARM_UP:] / each.look_of[WARM_UP:, :, None, :1]
        error = np.where(np.linalg.norm(error, axis=-1, keepdims=True) < sharp, error, np.nan)
        a, b = error[lag:], error[:-lag]
        both = np.isfinite(a) & np.isfinite(b)
        product += float((a[both] * b[both]).sum())
        square += 0.5 * float((a[both] ** 2 + b[both] ** 2).sum())
    return product / square


def exchanging(watched: Sequence[Watched]) -> float:
    """Return the share of images with left and right exchanged, while the worker was tracked."""
    exchanged, looks = 0, 0
    for each in watched:
        px, side = each.px[WARM_UP:], each.look_of[WARM_UP:, :, SIDE]
        mine = each.tracked[WARM_UP:, None] & np.isfinite(px[..., 0, 0])
        sides = np.any(find_exchanges(px, each.true_px[WARM_UP:], side), axis=-1)
        exchanged += int(sides[mine].sum())
        looks += int(mine.sum())
    return exchanged / max(looks, 1)


def format_metrics(seen: dict[str, tuple[StepResult, StepResult]]) -> Iterator[tuple[str, ...]]:
    """Yield rows of text: the family, then each number as "pixels / emulator"."""
    for family, (a, b) in seen.items():
        yield (
            family,
            f"{1e3 * a.median_m:.1f} / {1e3 * b.median_m:.1f}", f"{b.median_m / a.median_m:.2f}",
            f"{1e3 * a.p95_m:.0f} / {1e3 * b.p95_m:.0f}", f"{b.p95_m / a.p95_m:.2f}",
            f"{a.coverage:.3f} / {b.coverage:.3f}", f"{a.lost:.3f} / {b.lost:.3f}",
            f"{100 * a.px_median:.2f} / {100 * b.px_median:.2f}",
            f"{100 * a.px_p95:.1f} / {100 * b.px_p95:.1f}",
            f"{a.lasting:.2f} / {b.lasting:.2f}", f"{a.missed:.3f} / {b.missed:.3f}",
            f"{a.exchanged:.3f} / {b.exchanged:.3f}",
        )  # fmt: skip


COLUMNS = (
    "family", "median [mm]", "ratio", "p95 [mm]", "ratio", "coverage", "lost",
    "2D median [%]", "2D p95 [%]", "after 0.48 s", "missed", "exchanged",
)  # fmt: skip
