"""Whether the emulator predicts the pixels: the same clips, seen by both, tracked by the default.

The clips are none of the fit's: other seeds, other pairs of motion and body, and cameras that hang
elsewhere. What counts is the 3D error after tracking, by family of motions.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from assets.emulator.clips import FAMILIES, WARM_UP, Clip, family_of, unseen_clips
from assets.emulator.samples import exchanged_sides
from assets.emulator.shelf import kept
from assets.emulator.watch import BodyOf, Watched, watch
from hrc_env.config import HRCConfig
from hrc_env.core.results import Metric
from hrc_env.core.typing import Bools, Floats, Ints
from hrc_env.perception.sightlines import SEEN, SIDE
from hrc_env.worker.body import load_body

CHI2_95_3D = 7.815
"""95 % of a three-dimensional normal variable lies within this squared distance."""
GROUPS = {name: (name,) for name in FAMILIES}
GROUPS |= {"upright": tuple(name for name in FAMILIES if name != "fold"), "all": tuple(FAMILIES)}
"""Families of motions of which there are numbers, each alone and some together."""
HALF_SEEN = 8
"""Least number of joints of 15."""
DRAWS = 4
"""How often the emulator plays a clip."""
RESAMPLES = 200
"""Draws of clips for an interval."""
Say = Callable[[float, str], None]
"""Called with the growth of the finished share, and with the current work."""
InSpace = tuple[Floats, Bools]
"""(N,) errors of joints [m], and whether they are within the reported region."""


@dataclass(frozen=True, slots=True)
class StepResult:
    """What a level of perception made of clips."""

    median_m: float
    """Of the joints' errors while tracked [m]."""
    p95_m: float
    """Their 95th percentile [m]."""
    coverage: float
    """Share of them within the reported 95 % region."""
    lost: float
    """Share of frames in which nobody was tracked."""
    px_median: float
    """Median error in an image, a share of the window's side."""
    px_p95: float
    """Its 95th percentile."""
    lasting: float
    """Correlation of these errors (without gross ones) with those 0.48 s later."""
    missed: float
    """Share of looks at a body half of which is in sight that found nobody."""
    exchanged: float
    """Share of looks that exchanged left and right of the body or of the legs."""
    n: int
    """Joints."""


@dataclass(frozen=True, slots=True)
class Compared:
    """The same clips as both levels saw them."""

    clips: Sequence[Clip]
    """K of them."""
    pixels: Sequence[Watched]
    """(K,)."""
    emulated: Sequence[Sequence[Watched]]
    """(K, `DRAWS`)."""
    outcomes: dict[str, tuple[StepResult, StepResult]]
    """Of pixels and emulator, by the names of `GROUPS`."""


def error_ratios(
    rounds: int = 1,
    seed: int = 0,
    say: Say = lambda share, label: None,
    config: HRCConfig | None = None,
    store: Path | None = None,
    picture: Path | None = None,
) -> dict[str, Metric]:
    """`ratios_of` clips that no fit has seen.

    Args:
        rounds: how often each motion is rendered in each scene: 82 clips a round; 0: once, in
            one of them.
        seed: of the clips.
        say: hears of the progress: shares that sum to 1.
        config: settings; its `emulator` is judged.
        store: a folder in which what was rendered stays, and is taken from; None: nothing stays.
        picture: where a plot of both is drawn (PNG); None: nowhere.
    """
    seen = compared(unseen_clips(rounds, seed), say, config or HRCConfig(), store)
    if picture is not None:
        from assets.emulator.plot import plot_comparison  # which imports this module

        plot_comparison(picture, seen)
    return ratios_of(seen)


def ratios_of(seen: Compared) -> dict[str, Metric]:
    """Error of the emulator over that of the pixels, by family of motions.

    Returns:
        `emulator_error_ratio.<family>` for medians, `.<family>.p95`, and
        `emulator_coverage_difference.<family>`; their 95 % intervals draw clips anew. What they are
        made of, and what lasts: `emulator_<what>.<family>.<pixels|keypoints>`, which are median_m,
        p95_m, coverage95, lasting, exchanged; and `emulator_clips.<family>`.
    """
    pixels = [in_space([each]) for each in seen.pixels]
    emulated = [in_space(each) for each in seen.emulated]
    metrics: dict[str, Metric] = {}
    for family, outcomes in seen.outcomes.items():
        mine = of_family(seen.clips, family)
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
    """How far both levels are apart on K clips of a family."""

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
    """Numbers of clips (K,), with 95 % intervals that draw the clips anew; `n` observations."""
    draws = np.random.default_rng(0)
    again = [numbers(draws.integers(0, n_clips, n_clips)) for _ in range(RESAMPLES)]
    lows, highs = np.percentile(again, [2.5, 97.5], axis=0).tolist()
    values = numbers(np.arange(n_clips))
    return [Metric(*each, n) for each in zip(values, lows, highs, units, strict=True)]


def accuracy(each: Sequence[InSpace]) -> list[Metric]:
    """Median and 95th percentile [mm] of errors, and coverage, of clips."""

    def numbers(ks: Ints) -> list[float]:
        errors, inside = zip(*(each[k] for k in ks.tolist()), strict=True)
        middle, most = 1e3 * np.percentile(np.concatenate(errors), [50, 95])
        return [middle, most, float(np.concatenate(inside).mean())]

    n = sum(errors.size for errors, _ in each)
    return over_clips(numbers, len(each), ("mm", "mm", "share"), n)


def _of(ks: Ints, level: Sequence[InSpace]) -> InSpace:
    """Some clips of a level, together."""
    errors, inside = zip(*(level[k] for k in ks.tolist()), strict=True)
    return np.concatenate(errors), np.concatenate(inside)


def compared(
    clips: Sequence[Clip],
    say: Say,
    config: HRCConfig,
    store: Path | None,
    body_of: BodyOf = load_body,
) -> Compared:
    """What pixels and emulator make of clips; see `error_ratios`, `watch`."""
    pixels: list[Watched] = []
    for clip, watched in zip(clips, kept("pixels", clips, config, store, body_of), strict=True):
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
    """Outcomes of both levels for each of `GROUPS` that occurs."""
    result = {}
    for family in GROUPS:
        mine = of_family(clips, family)
        if mine:
            parts = [[each for k in mine for each in level[k]] for level in (pixels, emulated)]
            result[family] = (outcome(parts[0]), outcome(parts[1]))
    return result


def of_family(clips: Sequence[Clip], group: str) -> list[int]:
    """Which of the clips are of one of `GROUPS`."""
    return [k for k, clip in enumerate(clips) if family_of(clip.motion) in GROUPS[group]]


def outcome(watched: Sequence[Watched]) -> StepResult:
    """Numbers of some clips."""
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
    """Errors of the tracked joints [m], and whether the reported region held them; the truth is
    one of `Watched`'s."""
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
    """(T, C, J) errors of the detections, of the window's side."""
    away = np.linalg.norm(watched.px - watched.true_px, axis=-1)[WARM_UP:]
    return away / watched.look_of[WARM_UP:, :, :1]


def lasting(watched: Sequence[Watched], lag: int = 12, sharp: float = 0.06) -> float:
    """Correlation about zero of errors below `sharp` with those `lag` frames later."""
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
    """Share of looks while somebody was tracked that exchanged left and right."""
    exchanged, looks = 0, 0
    for each in watched:
        px, side = each.px[WARM_UP:], each.look_of[WARM_UP:, :, SIDE]
        mine = each.tracked[WARM_UP:, None] & np.isfinite(px[..., 0, 0])
        sides = np.any(exchanged_sides(px, each.true_px[WARM_UP:], side), axis=-1)
        exchanged += int(sides[mine].sum())
        looks += int(mine.sum())
    return exchanged / max(looks, 1)


def format_metrics(seen: dict[str, tuple[StepResult, StepResult]]) -> Iterator[tuple[str, ...]]:
    """Rows of text: family, then each number as "pixels / emulator"."""
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
