"""Activities in families: what the body does, as far as eyes are concerned."""

from hrc_env.motion.generator import activity_names

FAMILIES: dict[str, tuple[str, ...]] = {
    "stand": ("stand", "look round", "turn", "point"),
    "walk": ("walk", "stumble", "step back", "lunge"),
    "carry": ("carry", "push", "hand over", "receive"),
    "work": ("reach", "hammer", "drill", "saw", "measure", "clip"),
    "raise": ("drill overhead", "climb"),
    "fold": ("lift", "pick up", "set down", "squat", "kneel"),
}
"""Motion families and the activities in them; every activity is in one. A judgement: `fold` are
those in which trunk or knees are bent far, where the network is weak."""

FAMILY_OF: dict[str, str] = {
    activity: family for family, activities in FAMILIES.items() for activity in activities
}
"""The family of each activity, by name."""
NAMES = tuple(FAMILIES)
"""The families' names."""


def in_turns() -> tuple[str, ...]:
    """Every activity that a worker does on their own account, the families in turns."""
    kinds = [[each for each in names if each != "clip"] for names in FAMILIES.values()]
    longest = max(map(len, kinds))
    return tuple(names[k] for k in range(longest) for names in kinds if k < len(names))


def family_index(activity: int) -> int:
    """The family of an activity: an index of `NAMES`."""
    return NAMES.index(FAMILY_OF[activity_names[activity]])
