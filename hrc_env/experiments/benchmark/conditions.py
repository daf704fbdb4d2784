"""The conditions: beside whom, with which eyes, under which shield; the same for everybody."""

from dataclasses import dataclass, replace
from typing import Any

from hrc_env.experiments.study.rigs import ALL, SINGLE, Rig, Turn, late, left_with
from hrc_env.scene.rigs import RIGS
from hrc_env.tasks.task import task_called

VERSION = 1
"""Of the conditions, seeds and counts: numbers of different versions do not compare."""
SEED = 5_000_000
"""Of the first episode, far from those of training and of other evaluations."""
LATE_S = 0.2
"""How late images are that say so [s]."""


@dataclass(frozen=True, slots=True)
class Eyes:
    """How the robot perceives."""

    words: str
    level: str = "keypoints"
    latency_s: float = 0.0
    """From taking an image to having it; the image says so."""
    left: tuple[Rig, ...] = (ALL,)
    """Cameras that are left after the first second; episodes take turns in them."""


EYES = {
    "truth": Eyes("the truth", level="truth"),
    "keypoints": Eyes("four cameras"),
    "late": Eyes("four cameras, 200 ms late", latency_s=LATE_S),
    "one": Eyes("one camera after 1 s", left=SINGLE),
}


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
        return f"{self.people} people, {EYES[self.eyes].words}, {shield}"

    def keywords(self, task: str) -> list[dict[str, Any]]:
        """Arguments of environments, in which episodes take turns."""
        eyes = EYES[self.eyes]
        kwargs = {"task": task, "perception": eyes.level, "people": self.people}
        if self.shield is not None:
            kwargs["shield"] = self.shield
        turns = _turns(eyes, task)
        return [{**kwargs, "cameras": list(t.cameras), "faults": list(t.faults)} for t in turns]


def _turns(eyes: Eyes, task: str) -> list[Turn]:
    rig = RIGS[task_called(task).scene]
    return [late(left_with(rig, left), eyes.latency_s, is_told=True) for left in eyes.left]


def _conditions() -> tuple[Condition, ...]:
    """Everybody with four cameras; unaware people with other eyes; each twice."""
    bare = [Condition(people) for people in ("unaware", "hurried", "attentive")]
    bare += [Condition(eyes=eyes) for eyes in EYES if eyes != "keypoints"]
    return tuple(replace(each, shield=shield) for each in bare for shield in (None, "qp"))


CONDITIONS = {each.name: each for each in _conditions()}
"""By name, in the order of tables."""
MAIN = (Condition().name, Condition(shield="qp").name)
"""What the leaderboard shows."""
