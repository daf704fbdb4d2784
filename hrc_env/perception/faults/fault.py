"""Faults of cameras by name: what each does, how much, and when. Draws for them come from the
episode's number for faults: all else is that of the same seed without faults."""

import numbers
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from hrc_env.core.errors import ConfigError, unknown, whole
from hrc_env.core.mapping import answer_unknown_fields

FOREVER_S = 1e9
TIMING, PLACE, IMAGE = "timing", "place", "image"


class Kind(NamedTuple):
    """One kind of fault."""

    group: str  # when images come, where the camera really is, how an image looks
    unit: str  # of the amount
    usual: float  # the amount if none is given: clearly visible, not absurd; a judgement
    bounds: tuple[float, float]  # least and greatest amount
    says: str


KINDS: dict[str, Kind] = {
    "lost": Kind(TIMING, "-", 0.0, (0.0, 0.0), "no images"),
    "frozen": Kind(TIMING, "-", 0.0, (0.0, 0.0), "the last image again and again, as if new"),
    "late": Kind(TIMING, "s", 0.2, (0.0, 1.0), "images come later, with their true times"),
    "dropped": Kind(TIMING, "share", 0.3, (0.0, 1.0), "so many images are missing, at random"),
    "out_of_step": Kind(
        TIMING, "control steps", 2.0, (0.0, 25.0), "images are so old and claim to be new"
    ),
    "wrong_rotation": Kind(PLACE, "rad", 0.02, (0.0, 0.5), "it looks so far beside what is told"),
    "wrong_translation": Kind(PLACE, "m", 0.05, (0.0, 1.0), "it hangs so far from where is told"),
    "wrong_focal": Kind(PLACE, "share", 0.03, (-0.5, 0.5), "its focal length is so much longer"),
    "knocked": Kind(PLACE, "rad", 0.1, (0.0, 1.0), "it has been turned by so much"),
    "motion_blur": Kind(IMAGE, "s", 0.04, (0.0, 0.1), "the shutter is open for so long"),
    "defocus": Kind(IMAGE, "px", 8.0, (0.0, 60.0), "points are discs of this radius"),
    "noise": Kind(IMAGE, "grey levels", 20.0, (0.0, 100.0), "standard deviation of each pixel"),
    "dirt": Kind(IMAGE, "share", 0.15, (0.0, 0.9), "spots on the lens hide so much of the image"),
    "white_balance": Kind(IMAGE, "share", 0.4, (-0.9, 0.9), "more red and less blue by so much"),
    "exposure": Kind(IMAGE, "stops", 2.0, (-6.0, 6.0), "brighter by so many stops"),
    "darkness": Kind(IMAGE, "share", 0.05, (0.001, 1.0), "so much light is left, and noise"),
    "glare": Kind(IMAGE, "share", 0.8, (0.0, 1.0), "a light shines into the lens"),
}
"""All faults; amounts are refused outside their bounds."""
ALL = "all"
"""In the place of a camera's name: every camera."""


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class FaultConfig:
    """One fault of some cameras during a part of every episode."""

    kind: str
    """A key of `KINDS`."""
    cameras: tuple[int | str, ...]
    """Those that have it, by name or index (from 0) among those in use; ("all",) is every one."""
    amount: float | tuple[float, float] | None = None
    """How much, in the kind's unit; (least, most): drawn evenly, anew for every episode; None is
    the kind's usual amount."""
    from_s: float = 0.0
    """When in the episode it begins [s]; 0 is the reset."""
    until_s: float = FOREVER_S
    """When it ends [s]."""

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise unknown("fault", self.kind, KINDS)
        named = isinstance(self.cameras, tuple) and all(map(_is_choice, self.cameras))
        if not named or not self.cameras:
            raise ConfigError(
                f"Fault {self.kind!r} must name its cameras, as ('camera_1',), (0,) or ('all',), "
                f"got {self.cameras!r}."
            )
        low, high = KINDS[self.kind].bounds
        ends = self.amount if isinstance(self.amount, tuple | list) else (self.how_much,)
        if not all(map(_is_number, ends)) or not all(low <= end <= high for end in ends):
            raise ConfigError(
                f"Fault {self.kind!r}: amount must be from {low:g} to {high:g} "
                f"{KINDS[self.kind].unit}, got {self.amount!r}."
            )
        if isinstance(self.amount, tuple | list) and not (
            len(ends) == 2 and isinstance(self.amount, tuple) and ends[0] <= ends[1]
        ):
            raise ConfigError(
                f"Fault {self.kind!r}: a range of amounts must be (least, most), from which every "
                f"episode's amount is drawn, got {self.amount!r}."
            )
        if not 0 <= self.from_s < self.until_s:
            raise ConfigError(
                f"Fault {self.kind!r} must begin at 0 s or later and end after that, "
                f"got from {self.from_s} to {self.until_s} s."
            )

    @property
    def group(self) -> str:
        """The group of its kind."""
        return KINDS[self.kind].group

    @property
    def how_much(self) -> float:
        """The amount, in the kind's unit; of a range the greatest."""
        if isinstance(self.amount, tuple):
            return self.amount[1]
        return KINDS[self.kind].usual if self.amount is None else self.amount

    @property
    def is_range(self) -> bool:
        """Whether every episode has an amount of its own."""
        return isinstance(self.amount, tuple)

    def drawn(self, rng: np.random.Generator) -> "FaultConfig":
        """Return the fault of one episode: with an amount drawn from the range, if it is one."""
        if not isinstance(self.amount, tuple):
            return self
        return replace(self, amount=float(rng.uniform(*self.amount)))

    def active(self, time_s: float) -> bool:
        """Return whether an image of this time of the episode has it; 0.5 ms are nothing."""
        return self.from_s - 5e-4 <= time_s < self.until_s - 5e-4


def check_cameras(faults: Sequence[FaultConfig], names: Sequence[str]) -> None:
    """Raise `ConfigError` for a fault of a camera that is not one of those in use, by name."""
    for fault in faults:
        for camera in fault.cameras:
            if not isinstance(camera, str):
                what = f"Camera index of fault {fault.kind!r} (of {', '.join(names)})"
                whole(what, camera, 0, len(names) - 1)
            elif camera not in (*names, ALL):
                raise unknown(f"camera of fault {fault.kind!r}:", camera, (*names, ALL))


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _is_choice(camera: object) -> bool:
    return isinstance(camera, str | numbers.Integral) and not isinstance(camera, bool)
