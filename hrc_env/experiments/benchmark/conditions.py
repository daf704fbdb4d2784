"""The conditions: beside whom, with which eyes, under which shield; the same for everybody."""

from dataclasses import dataclass, replace
from typing import Any

from hrc_env.experiments.setups import PerceptionSetup
from hrc_env.scene.rigs import RIGS
from hrc_env.tasks.task import find_task

VERSION = 1
"""Of the conditions, seeds and counts: numbers of different versions do not compare."""
SEED = 5_000_000
"""Of the first episode, far from those of training and of other evaluations."""
EYES = {
    "truth": ("the truth", PerceptionSetup("truth")),
    "keypoints": ("four cameras", PerceptionSetup()),
    "late": ("four cameras, 200 ms late", PerceptionSetup(latency_s=0.2)),
    "one": ("one camera after 1 s", PerceptionSetup(n_cameras=1)),
}
"""How robots perceive, and that in words; late images say so."""


@dataclass(frozen=True, slots=True)
class Condition:
    """One row of a policy's table."""

    people: str = "unaware"
    eyes: str = "keypoints"
    shield: str | None = None

    @property
    def name(self) -> str:
        """As in results.json."""
        return f"{self.people}.{self.eyes}.{self.shield or 'none'}"

    @property
    def words(self) -> str:
        """As in tables."""
        shield = "no shield" if self.shield is None else f"shield `{self.shield}`"
        return f"{self.people} people, {EYES[self.eyes][0]}, {shield}"

    def keywords(self, task: str) -> list[dict[str, Any]]:
        """Arguments of environments, in which episodes take turns."""
        (_, setup), rig = EYES[self.eyes], RIGS[find_task(task).scene]
        kwargs = {"task": task, "perception": setup.level, "people": self.people}
        if self.shield is not None:
            kwargs["shield"] = self.shield
        turns = setup.turns_of(rig)
        return [{**kwargs, "cameras": list(t.cameras), "faults": list(t.faults)} for t in turns]


def _conditions() -> tuple[Condition, ...]:
    """Everybody with four cameras; unaware people with other eyes; each twice."""
    bare = [Condition(people) for people in ("unaware", "hurried", "attentive")]
    bare += [Condition(eyes=eyes) for eyes in EYES if eyes != "keypoints"]
    return tuple(replace(each, shield=shield) for each in bare for shield in (None, "qp"))


CONDITIONS = {each.name: each for each in _conditions()}
"""By name, in the order of tables."""
MAIN = (Condition().name, Condition(shield="qp").name)
"""What the leaderboard shows."""
