"""The settings of the shield that the price study compares for each kind of perception.

They were chosen by their meaning, those for one camera also by 32 episodes on seeds 21,000,000 to
21,000,031, in which limits near the unknown had hardly any effect, and doubts had a large one.
"""

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import TypedDict, Unpack

from hrc_env.experiments.price.setups import Family
from hrc_env.safety.config import ShieldConfig

UNSHIELDED = "no_shield"
"""Name of the setting without a shield, which every kind of perception has."""


@dataclass(frozen=True, slots=True)
class Setting:
    """A shield, or none, with its description."""

    name: str
    """Name of the setting in results.json."""
    words: str
    """Description of the setting in tables."""
    shield: ShieldConfig | None
    """Settings of the shield; None without a shield."""


class _Changes(TypedDict, total=False):
    """Settings of `ShieldConfig` that differ from the defaults."""

    margin: str
    n_sigmas: float
    min_uncertainty_m: float
    single_view_sigmas: float
    unknown_speed_limit_m_s: float
    worker_speed_margin_m_s: float
    worker_time_s: float
    prediction_growth_m_s: float
    latency_s: float


def _make(
    name: str,
    words: str,
    margin_m: float = 0.0,
    base: _Changes | None = None,
    **changes: Unpack[_Changes],
) -> Setting:
    """Return a setting with its own changes in addition to those that it shares with others.

    Args:
        name: name of the setting.
        words: description of the setting.
        margin_m: distance by which all protective distances change [m].
        base: changes that it shares with others.
        changes: its own changes.
    """
    given: _Changes = {**(base or {}), **changes}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # negative margins are compared on purpose
        shield = ShieldConfig("qp", margin_m=margin_m, hand_margin_m=margin_m, **given)
    return Setting(name, words, shield)


def _make_margin(margin_m: float, base: _Changes | None = None) -> Setting:
    """Return a setting with another margin."""
    side = "wider" if margin_m > 0 else "closer"
    cm = f"{100 * abs(margin_m):g}"
    return _make(f"{side}_{cm}cm", f"margin {100 * margin_m:+g} cm", margin_m, base)


def _list_exact() -> list[Setting]:
    """Return the settings for true bodies, where only margin and anticipation can be chosen."""
    exact = _Changes(margin="constant", min_uncertainty_m=0.0)
    return [
        _make("default", "no margin", base=exact),
        *(_make_margin(m, exact) for m in (-0.02, -0.05, -0.08, 0.02, 0.05)),
        _make("short", "anticipation 0.2 s", worker_time_s=0.2, base=exact),
        _make("shorter", "anticipation 0.1 s", worker_time_s=0.1, base=exact),
        _make("short_closer_2cm", "anticipation 0.2 s, margin -2 cm", -0.02, worker_time_s=0.2,
              base=exact),
        _make("short_wider_2cm", "anticipation 0.2 s, margin +2 cm", 0.02, worker_time_s=0.2,
              base=exact),
        _make("long", "anticipation 0.4 s", worker_time_s=0.4, base=exact),
    ]  # fmt: skip


def _list_joints() -> list[Setting]:
    """Return the settings for true joints, where the body around them is uncertain."""
    return [
        _make("default", "default"),
        *(_make_margin(m) for m in (-0.03, -0.06, -0.09, 0.03)),
        _make("constant", "constant margin", margin="constant"),
        _make("constant_no_floor", "constant margin, Z_d from 0", margin="constant",
              min_uncertainty_m=0.0),
        _make("constant_closer_3cm", "constant margin -3 cm, Z_d from 0", -0.03,
              margin="constant", min_uncertainty_m=0.0),
        _make("constant_closer_6cm", "constant margin -6 cm, Z_d from 0", -0.06,
              margin="constant", min_uncertainty_m=0.0),
        _make("short", "anticipation 0.2 s", worker_time_s=0.2),
        _make("short_closer_3cm", "anticipation 0.2 s, margin -3 cm", -0.03, worker_time_s=0.2),
    ]  # fmt: skip


def _list_cameras() -> list[Setting]:
    """Return the settings for two or four cameras."""
    sure = _Changes(margin="constant", n_sigmas=1.0, single_view_sigmas=0.0)
    return [
        _make("default", "default"),
        *(_make_margin(m) for m in (-0.04, -0.08, -0.12, 0.04, 0.08)),
        _make("constant", "constant margin, 2 sigmas", margin="constant"),
        _make("constant_wider_4cm", "constant margin +4 cm, 2 sigmas", 0.04, margin="constant"),
        _make("sure", "constant margin, 1 sigma, no doubt", base=sure),
        _make("sure_fast", "1 sigma, no doubt, 1 m/s near the unknown",
              unknown_speed_limit_m_s=1.0, base=sure),
        _make("fast", "1 m/s near the unknown, margin -4 cm", -0.04, unknown_speed_limit_m_s=1.0),
    ]  # fmt: skip


def _list_one_camera() -> list[Setting]:
    """Return the settings for one camera, where the unknown and doubts slow the robot."""
    sure = _Changes(margin="constant", single_view_sigmas=0.0)
    return [
        _make("default", "default"),
        _make_margin(0.08),
        _make("fast", "1 m/s near the unknown", unknown_speed_limit_m_s=1.0),
        _make("constant", "constant margin, 2 sigmas", margin="constant"),
        _make("half_sure", "constant margin, 2 sigmas, half the doubt", margin="constant",
              single_view_sigmas=2.5),
        _make("sure", "constant margin, 2 sigmas, no doubt", base=sure),
        _make("sure_slow", "2 sigmas, no doubt, stops near the unknown",
              unknown_speed_limit_m_s=0.0, base=sure),
        _make("sure_fast", "2 sigmas, no doubt, 1 m/s near the unknown",
              unknown_speed_limit_m_s=1.0, base=sure),
        _make("sure_wider_5cm", "constant margin +5 cm, 2 sigmas, no doubt", 0.05, base=sure),
        _make("sure_wider_10cm", "constant margin +10 cm, 2 sigmas, no doubt", 0.1, base=sure),
        _make("surer_fast", "constant margin, 1 sigma, no doubt, 1 m/s", n_sigmas=1.0,
              unknown_speed_limit_m_s=1.0, base=sure),
    ]  # fmt: skip


def _list_late() -> list[Setting]:
    """Return the settings for delayed images with time stamps, where predictions are uncertain."""
    return [
        _make("default", "default"),
        *(_make_margin(m) for m in (-0.05, -0.1, 0.05, 0.1)),
        _make("constant", "constant margin, 2 sigmas", margin="constant"),
        _make("constant_wider_5cm", "constant margin +5 cm, 2 sigmas", 0.05, margin="constant"),
        _make("sure", "constant margin, 1 sigma, predictions 0.35 m/s", margin="constant",
              n_sigmas=1.0, prediction_growth_m_s=0.35),
        _make("sure_closer_5cm", "1 sigma, predictions 0.35 m/s, margin -5 cm", -0.05,
              margin="constant", n_sigmas=1.0, prediction_growth_m_s=0.35),
        _make("short", "anticipation 0.2 s", worker_time_s=0.2),
        _make("long", "anticipation 0.4 s", worker_time_s=0.4),
    ]  # fmt: skip


def _list_late_untold() -> list[Setting]:
    """Return the settings for delayed images without time stamps, which the shield may expect."""
    return [
        _make("default", "default"),
        _make("expected", "expects the delay", latency_s=0.12),
        *(_make_margin(m) for m in (-0.05, 0.05, 0.1)),
        _make("expected_closer_5cm", "expects the delay, margin -5 cm", -0.05, latency_s=0.12),
        _make("expected_wider_5cm", "expects the delay, margin +5 cm", 0.05, latency_s=0.12),
        _make("expected_wider_10cm", "expects the delay, margin +10 cm", 0.1, latency_s=0.12),
        _make("twice", "expects twice the delay", latency_s=0.24),
        _make("expected_quicker", "expects the delay, workers 0.3 m/s faster", latency_s=0.12,
              worker_speed_margin_m_s=0.3),
        _make("constant_expected", "constant margin, expects the delay", margin="constant",
              latency_s=0.12),
    ]  # fmt: skip


_LISTS = {
    "exact": _list_exact, "joints": _list_joints, "cameras": _list_cameras,
    "one camera": _list_one_camera, "late": _list_late, "late untold": _list_late_untold,
}  # fmt: skip


@cache
def list_settings(family: Family) -> Mapping[str, Setting]:
    """Return the twelve settings for a kind of perception by name, first that without a shield."""
    settings = (Setting(UNSHIELDED, "no shield", None), *_LISTS[family]())
    return {each.name: each for each in settings}
