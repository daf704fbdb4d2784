"""Calibrated bounds on the error of an estimated body along the line to a robot.

The error of a capsule is the amount by which the true gap between it and a robot's capsule is
smaller than the estimated gap. Its distribution has heavier tails than a Gaussian, so that
multiples of the estimated standard deviation are no bounds. Instead, quantiles of measured errors
are used, as in split conformal prediction (Vovk, Gammerman and Shafer 2005, DOI 10.1007/b106715),
separately for each part of the body, the time since its last detection, and its *expected error*:
the standard deviation along the line, times factors for the number of views and their misfit
(`tracking.agreement`). This makes the bounds small where errors are small (Lei et al. 2018, DOI
10.1080/01621459.2017.1307116).

The quantiles are in `error_bounds.json`, which `python -m assets.error_bounds.calibrate` computes.
They hold for what was calibrated (`PoseEstimate.calibrated`): a capsule of another estimator's
body, or whose part, age or expected error was not calibrated, has no bound. Then the constants of
`ShieldConfig` apply.
"""

import json
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.kernels import kernel
from hrc_env.core.records import PoseEstimate
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Bools, Floats, Ints
from hrc_env.core.versions import read_versions
from hrc_env.geometry.enclosure import CAPSULES, find_shares, load_enclosure

COMMAND = "python -m assets.error_bounds.calibrate"
"""Command that computes the bounds of the package."""
DEPENDS = ("tracker", "emulator", "motion")
"""Subsystems that determine the errors."""
MAX_VIEWS = (1, 2)
"""Upper bounds on the number of views of all classes of views but the last."""
MAX_MISFIT = (4.0, 9.0, 18.0)
"""Upper bounds on the misfit of all classes of misfit but the last."""
MIN_SHARE = 0.05
"""Minimum influence of a joint on an end of a capsule with which the joint's views, misfit and age
count for the capsule."""
NOT_CALIBRATED = -1
"""Class of a capsule without calibrated bounds."""


class ErrorBounds(NamedTuple):
    """Bounds on the error of each capsule of an estimated body."""

    max_age_s: Floats
    """Upper bound on the age of each class of ages (A,) [s]."""
    view_factor: Floats
    """Factor on the standard deviation by class of views (S, V)."""
    misfit_factor: Floats
    """Factor on the standard deviation by class of misfit (S, M)."""
    expected_m: Floats
    """Upper bounds on the expected error of its classes (S, A, U), ascending [m]; -inf if a capsule
    is not calibrated."""
    bound_m: Floats
    """Quantiles of the error (S, A, U), which do not decrease [m]."""


class Support(NamedTuple):
    """Properties of capsules that determine their bounds, besides the standard deviation."""

    factor: Floats
    """Expected error divided by the standard deviation (B, W, S)."""
    age_class: Ints
    """Index into `ErrorBounds.max_age_s` (B, W, S), or `NOT_CALIBRATED`."""


@cache
def load_error_bounds() -> ErrorBounds:
    """Return the bounds of the package.

    Raises:
        ConfigError: the file is missing or invalid, or was made with another version of a subsystem
            on which errors depend.
    """
    return read_error_bounds(Path(__file__).with_suffix(".json"))


def read_error_bounds(path: Path) -> ErrorBounds:
    """Read bounds that `describe_error_bounds` describes; see `load_error_bounds`."""
    renew = f"Calibrate again, in a clone, by `{COMMAND}`, or use margin='constant'."
    if not path.is_file():
        raise ConfigError(f"The calibrated error bounds {path.name} are missing. {renew}")
    try:
        content: dict[str, Any] = json.loads(path.read_text())
        made = {name: content["versions"][name] for name in DEPENDS}
        bounds = ErrorBounds(*(np.array(content[name], float) for name in ErrorBounds._fields))
    except (ValueError, KeyError, TypeError) as error:
        raise ConfigError(
            f"{path.name} must be calibrated error bounds, got {error!r}. {renew}"
        ) from error
    now = read_versions()
    stale = [
        f"{name} {made[name]} (now {now[name]})" for name in DEPENDS if made[name] != now[name]
    ]
    if stale:
        raise ConfigError(
            f"The error bounds {path.name} were calibrated with {', '.join(stale)}, whose errors "
            f"differ. {renew}"
        )
    _check_bounds(path.name, bounds)
    for values in bounds:
        values.setflags(write=False)
    return bounds


def describe_error_bounds(bounds: ErrorBounds) -> dict[str, Any]:
    """Return bounds as values for a JSON file, with the versions of the subsystems."""
    versions = read_versions()
    values = {name: values.tolist() for name, values in zip(bounds._fields, bounds, strict=True)}
    return {"versions": {name: versions[name] for name in DEPENDS}, **values}


@cache
def make_no_bounds() -> ErrorBounds:
    """Return bounds in which nothing is calibrated."""
    n = len(CAPSULES)
    return ErrorBounds(
        max_age_s=np.full(1, -np.inf),
        view_factor=np.ones((n, len(MAX_VIEWS) + 1)),
        misfit_factor=np.ones((n, len(MAX_MISFIT) + 1)),
        expected_m=np.full((n, 1, 1), -np.inf),
        bound_m=np.zeros((n, 1, 1)),
    )


def find_support(estimate: PoseEstimate, bounds: ErrorBounds) -> Support:
    """Return the factors and classes (B, W, S) of the capsules of estimated bodies."""
    shape = (*estimate.tracked.shape, len(CAPSULES))
    support = Support(np.ones(shape), np.full(shape, NOT_CALIBRATED))
    if np.isfinite(bounds.max_age_s[-1]):
        counts = find_joints_that_count()
        _find_support(estimate.n_views, estimate.misfit, estimate.age_s, counts, bounds, support)
        support.age_class[~estimate.calibrated] = NOT_CALIBRATED
    return support


@kernel
def _find_support(
    n_views: Ints,
    misfit: Floats,
    age_s: Floats,
    counts: Bools,
    bounds: ErrorBounds,
    support: Support,
) -> None:
    """Fill in `support`; the worst joint of each capsule counts.

    Args:
        n_views: (B, W, J) number of views of each joint.
        misfit: (B, W, J) misfit of each joint; NaN if it was not measured.
        age_s: (B, W, J) time since each joint was detected [s].
        counts: (S, J) mask of the joints that count for each capsule.
        bounds: calibrated bounds.
        support: receives the factors and classes (B, W, S).
    """
    for b, w, s in np.ndindex(support.factor.shape):
        fewest, worst, oldest_s, is_known = MAX_VIEWS[-1] + 1, 0.0, 0.0, True
        for j in range(counts.shape[1]):
            if counts[s, j]:
                fewest = min(fewest, n_views[b, w, j])
                worst, oldest_s = max(worst, misfit[b, w, j]), max(oldest_s, age_s[b, w, j])
                is_known &= misfit[b, w, j] >= 0.0
        view, off, age = 0, 0, 0
        while view < len(MAX_VIEWS) and fewest > MAX_VIEWS[view]:
            view += 1
        while off < len(MAX_MISFIT) and worst > MAX_MISFIT[off]:
            off += 1
        while age < len(bounds.max_age_s) and oldest_s > bounds.max_age_s[age]:
            age += 1
        support.factor[b, w, s] = bounds.view_factor[s, view] * bounds.misfit_factor[s, off]
        if is_known and age < len(bounds.max_age_s):
            support.age_class[b, w, s] = age


@cache
def find_joints_that_count() -> Bools:
    """Return a mask (S, J) of the joints with views, misfit and age that count for each capsule."""
    influence = np.zeros((len(CAPSULES), 2, N_JOINTS))
    joints, shares = load_enclosure().joints, find_shares()
    for s, end, k in np.ndindex(shares.shape):
        influence[s, end, joints[s, end, k]] += shares[s, end, k]
    counts: Bools = np.asarray((influence > MIN_SHARE).any(1))
    return counts


@kernel
def find_error_bound(
    bounds: ErrorBounds, s: int, age_class: int, expected_m: float, otherwise_m: float
) -> float:
    """Return the bound on the error of capsule `s` [m].

    Args:
        bounds: calibrated bounds.
        s: index of the capsule.
        age_class: class of its age, or `NOT_CALIBRATED`.
        expected_m: expected error [m].
        otherwise_m: bound if the error is not calibrated [m].
    """
    if age_class < 0:
        return otherwise_m
    for k in range(bounds.expected_m.shape[2]):
        if expected_m <= bounds.expected_m[s, age_class, k]:
            return bounds.bound_m[s, age_class, k]
    return otherwise_m


def _check_bounds(name: str, bounds: ErrorBounds) -> None:
    """Raise `ConfigError` unless the shapes and the order of the bounds are valid."""
    n, n_ages = len(CAPSULES), len(bounds.max_age_s)
    shapes = {
        "max_age_s": (n_ages,),
        "view_factor": (n, len(MAX_VIEWS) + 1),
        "misfit_factor": (n, len(MAX_MISFIT) + 1),
        "expected_m": (n, n_ages, bounds.expected_m.shape[-1]),
        "bound_m": (n, n_ages, bounds.expected_m.shape[-1]),
    }
    for field, shape in shapes.items():
        got = getattr(bounds, field).shape
        if got != shape:
            raise ConfigError(f"{name}: {field} must have the shape {shape}, got {got}.")
    ascending = ("max_age_s", "expected_m", "bound_m")
    for field in ascending:
        values = getattr(bounds, field)
        if np.isnan(values).any() or (values[..., 1:] < values[..., :-1]).any():
            raise ConfigError(f"{name}: {field} must not decrease along its last axis.")
