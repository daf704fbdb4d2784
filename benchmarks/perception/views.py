"""Grouping of crops into table rows, by scene, body, activity, distance, view angle and so on."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from hrc_env.motion.generator import activity_names

FAMILIES: dict[str, tuple[str, ...]] = {
    "stand": ("stand", "look round", "turn", "point"),
    "walk": ("walk", "run", "stumble", "step back", "lunge"),
    "carry": ("carry", "push", "hand over", "receive"),
    "work": ("reach", "take", "hammer", "drill", "screw", "saw", "measure", "clip"),
    "raise": ("drill overhead", "climb"),
    "fold": ("lift", "pick up", "set down", "squat", "kneel", "fall"),
}
"""Families of motions with their activities; each activity belongs to exactly one family.

The assignment was made by hand. In the family `fold`, trunk or knees are strongly flexed; the
accuracy of the network is lower for such poses.
"""
FAMILY_OF: dict[str, str] = {
    activity: family for family, activities in FAMILIES.items() for activity in activities
}
DISTANCES_M = (0, 3, 4, 6, 9, 13)
"""Lower bounds of the rows by distance [m]; the last row has no upper bound."""
ANGLES_DEG = (0, 45, 90, 135)
"""Lower bounds of the rows by view angle [deg]; each row covers 45 degrees."""


@dataclass(frozen=True, slots=True)
class View:
    """A crop with the whole worker in view, and the error of the detection in it."""

    variant: str
    """Variant of the scene: `PLAIN`, or "<kind> <row>" of the table."""
    scene: str
    body: str
    activity: str
    distance_m: float
    angle_deg: float
    error: float | None
    """Mean error of the joints in the image, as a fraction of the stature; None without a
    detection.
    """


ROWS: Mapping[str, Callable[[View], str]] = {
    "scene": lambda view: view.scene,
    "body": lambda view: view.body,
    "pose": lambda view: FAMILY_OF[view.activity],
    "distance": lambda view: _band(view.distance_m, DISTANCES_M, "m"),
    "angle": lambda view: _band(view.angle_deg, (*ANGLES_DEG, 180), "deg"),
    "lens": lambda view: view.variant.removeprefix("lens "),
    "appearance": lambda view: view.variant.removeprefix("appearance "),
}
"""Functions that return the table row of a crop, by kind of rows."""
COMPARED = ("lens", "appearance")
"""Kinds of rows that compare variants "<kind> <row>" at the same moments; the other kinds use
`PLAIN` crops.
"""
PLAIN = "plain"
"""Name of the variant with unchanged scenes."""


def group_rows(views: list[View], kind: str) -> dict[str, list[View]]:
    """Group crops by the rows of a kind, in the order of the table."""
    name = ROWS[kind]
    compared = kind in COMPARED
    chosen = [v for v in views if v.variant.startswith(f"{kind} " if compared else PLAIN)]
    found = sorted({name(view) for view in chosen}, key=_order)
    return {row: [view for view in chosen if name(view) == row] for row in found}


def list_activities() -> tuple[str, ...]:
    """Return all activities except "clip", in an order that alternates families."""
    kinds = [[each for each in names if each != "clip"] for names in FAMILIES.values()]
    longest = max(map(len, kinds))
    return tuple(names[k] for k in range(longest) for names in kinds if k < len(names))


def family_index(activity: int) -> int:
    """Return the index in `FAMILIES` of the family of an activity."""
    return list(FAMILIES).index(FAMILY_OF[activity_names[activity]])


def _band(value: float, bounds: tuple[float, ...], unit: str) -> str:
    k = max(i for i, bound in enumerate(bounds) if value >= bound or i == 0)
    if unit == "deg":
        k = min(k, len(bounds) - 2)
    last = k + 1 == len(bounds)
    return f"{bounds[k]:g}_{'up' if last else f'{bounds[k + 1]:g}'}_{unit}"


def _order(row: str) -> tuple[float, str]:
    """Return the sort key of a row, which orders bands by number and names alphabetically."""
    number = row.split("_", 1)[0]
    return (float(number) if number.replace(".", "").isdigit() else -1.0, row)
