"""Faults of cameras: their kinds, amounts and times.

The random numbers of faults have a separate seed in each episode, so that faults do not change any
other random numbers.
"""

import numbers
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, NamedTuple

import numpy as np

from hrc_env.core.errors import ConfigError, check_integer, make_unknown_name_error
from hrc_env.core.mapping import answer_unknown_fields

FOREVER_S = 1e9
"""End time of a permanent fault [s]."""
TIMING, PLACE, IMAGE = "timing", "place", "image"
"""Groups of faults, which affect the timing of images, the pose and intrinsics of a camera, or the
appearance of images."""


class Kind(NamedTuple):
    """Description of a kind of fault."""

    group: str
    """Group of the fault: `TIMING`, `PLACE` or `IMAGE`."""
    unit: str
    """Unit of the fault's amount."""
    usual: float
    """Default amount in units of `unit`, with a clearly visible but realistic effect."""
    bounds: tuple[float, float]
    """Minimum and maximum amount, in units of `unit`."""
    description: str
    """Phrase that describes the fault."""


KINDS: dict[str, Kind] = {
    "lost": Kind(TIMING, "-", 0.0, (0.0, 0.0), "no images"),
    "frozen": Kind(TIMING, "-", 0.0, (0.0, 0.0), "the last image is repeated as if it were new"),
    "late": Kind(TIMING, "s", 0.2, (0.0, 1.0), "images arrive late, with correct time stamps"),
    "dropped": Kind(
        TIMING, "share", 0.3, (0.0, 1.0), "a random share of images, of this size, is missing"
    ),
    "out_of_step": Kind(
        TIMING,
        "control steps",
        2.0,
        (0.0, 25.0),
        "images are older by this time, but have current time stamps",
    ),
    "wrong_rotation": Kind(
        PLACE, "rad", 0.02, (0.0, 0.5), "the camera is rotated relative to its calibrated pose"
    ),
    "wrong_translation": Kind(
        PLACE, "m", 0.05, (0.0, 1.0), "the camera is displaced relative to its calibrated pose"
    ),
    "wrong_focal": Kind(
        PLACE, "share", 0.03, (-0.5, 0.5), "the focal length is longer than calibrated"
    ),
    "knocked": Kind(PLACE, "rad", 0.1, (0.0, 1.0), "the camera is rotated by an impact"),
    "motion_blur": Kind(IMAGE, "s", 0.04, (0.0, 0.1), "motion blur of this exposure time"),
    "defocus": Kind(IMAGE, "px", 8.0, (0.0, 60.0), "points are blurred to discs of this radius"),
    "noise": Kind(
        IMAGE,
        "grey levels",
        20.0,
        (0.0, 100.0),
        "noise of this standard deviation is added to each pixel",
    ),
    "dirt": Kind(
        IMAGE, "share", 0.15, (0.0, 0.9), "spots of dirt on the lens cover this share of the image"
    ),
    "white_balance": Kind(IMAGE, "share", 0.4, (-0.9, 0.9), "the image has more red and less blue"),
    "exposure": Kind(
        IMAGE, "stops", 2.0, (-6.0, 6.0), "the image is brighter by this number of stops"
    ),
    "darkness": Kind(
        IMAGE,
        "share",
        0.05,
        (0.001, 1.0),
        "only this share of the light remains, and noise is added",
    ),
    "glare": Kind(IMAGE, "share", 0.8, (0.0, 1.0), "a light source shines into the lens"),
}
"""All kinds of faults, by name."""
ALL = "all"
"""Value of `FaultConfig.cameras` that selects all cameras."""


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class FaultConfig:
    """A fault of some cameras during a part of every episode."""

    RENAMED: ClassVar[Mapping[str, str]] = {
        "from_s": "start_s",
        "until_s": "end_s",
    }
    """Current names of renamed fields, by their old names."""

    kind: str
    """Kind of the fault, a key of `KINDS`."""
    cameras: tuple[int | str, ...]
    """Cameras with the fault, by name or by index (from 0) in the rig; ("all",) means every
    camera."""
    amount: float | tuple[float, float] | None = None
    """Amount of the fault in the kind's unit. If it is a pair (minimum, maximum), the amount in
    each episode is sampled uniformly from this range. None selects the default of the kind."""
    start_s: float = 0.0
    """Time since the reset at which the fault begins [s]."""
    end_s: float = FOREVER_S
    """Time since the reset at which the fault ends [s]."""

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise make_unknown_name_error("fault", self.kind, KINDS)
        named = isinstance(self.cameras, tuple) and all(map(_is_choice, self.cameras))
        if not named or not self.cameras:
            raise ConfigError(
                f"Fault {self.kind!r} must name its cameras, such as ('camera_1',), (0,) or "
                f"('all',), got {self.cameras!r}."
            )
        low, high = KINDS[self.kind].bounds
        ends = self.amount if isinstance(self.amount, tuple | list) else (self.max_amount,)
        if not all(map(_is_number, ends)) or not all(low <= end <= high for end in ends):
            raise ConfigError(
                f"Fault {self.kind!r}: amount must be from {low:g} to {high:g} "
                f"{KINDS[self.kind].unit}, got {self.amount!r}."
            )
        if isinstance(self.amount, tuple | list) and not (
            len(ends) == 2 and isinstance(self.amount, tuple) and ends[0] <= ends[1]
        ):
            raise ConfigError(
                f"Fault {self.kind!r}: a range of amounts must be (least, most), from which the "
                f"amount is drawn in every episode, got {self.amount!r}."
            )
        if not 0 <= self.start_s < self.end_s:
            raise ConfigError(
                f"Fault {self.kind!r} must begin at 0 s or later and end after its beginning, got "
                f"{self.start_s} to {self.end_s} s."
            )

    @property
    def group(self) -> str:
        """Group of the fault's kind."""
        return KINDS[self.kind].group

    @property
    def max_amount(self) -> float:
        """Amount in the unit of the kind, or its maximum if it is a range."""
        if isinstance(self.amount, tuple):
            return self.amount[1]
        return KINDS[self.kind].usual if self.amount is None else self.amount

    @property
    def is_range(self) -> bool:
        """Whether the amount is a range from which each episode's amount is sampled."""
        return isinstance(self.amount, tuple)

    def draw(self, rng: np.random.Generator) -> "FaultConfig":
        """Return the fault of an episode, with an amount sampled from the range."""
        if not isinstance(self.amount, tuple):
            return self
        return replace(self, amount=float(rng.uniform(*self.amount)))

    def is_active(self, time_s: float) -> bool:
        """Return whether the fault is active at a time since the reset, to within 0.5 ms."""
        return self.start_s - 5e-4 <= time_s < self.end_s - 5e-4


def check_cameras(faults: Sequence[FaultConfig], names: Sequence[str]) -> None:
    """Raise `ConfigError` if a fault refers to a camera that is not in the rig."""
    for fault in faults:
        for camera in fault.cameras:
            if not isinstance(camera, str):
                label = f"Camera index of fault {fault.kind!r} (of {', '.join(names)})"
                check_integer(label, camera, 0, len(names) - 1)
            elif camera not in (*names, ALL):
                raise make_unknown_name_error(
                    f"camera of fault {fault.kind!r}:", camera, (*names, ALL)
                )


def _is_number(value: object) -> bool:
    """Return whether a value is a number but not a Boolean."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def _is_choice(camera: object) -> bool:
    """Return whether a value is a name or an index of a camera."""
    return isinstance(camera, str | numbers.Integral) and not isinstance(camera, bool)
