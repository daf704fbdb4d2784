"""The benchmark of policies: conditions and seeds.

A policy acts in a process of its own (`hrc_env.agents.separate`). Its seeds are public, or follow
from its digest and a salt that is drawn after the policy was submitted.
"""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace

from hrc_env.agents.separate import SeparateProcess
from hrc_env.agents.submission import Submission, read_submission
from hrc_env.evaluation.sums import ACHIEVED
from hrc_env.experiments.columns import per_minute, rate, share_of_tries
from hrc_env.experiments.report import Table
from hrc_env.experiments.setups import PerceptionSetup
from hrc_env.experiments.study import Row, Study
from hrc_env.safety.incidents import KINDS
from hrc_env.tasks import BUILT_IN
from hrc_env.tasks.task import find_task

VERSION = 1
"""Version of the conditions, seeds and counts. Numbers of different versions cannot be compared."""
SEED = 5_000_000
"""Public seed of the first episode, far from those of training and of other evaluations."""
SALTED_BYTES = 6
"""Size of the first seed that follows from a salt [bytes]."""
DEPENDS = ("env", "tracker", "emulator", "motion", "shield", "agents")
"""Subsystems on which the numbers depend (`behaviour.toml`)."""
SETUPS = {
    "truth": ("the truth", PerceptionSetup("truth")),
    "keypoints": ("four cameras", PerceptionSetup()),
    "late": ("four cameras, 200 ms late", PerceptionSetup(latency_s=0.2)),
    "one": ("one camera after 1 s", PerceptionSetup(n_cameras=1)),
}
"""Perception setups with their descriptions, by name. Delayed images carry time stamps."""
COLUMNS = (
    per_minute(ACHIEVED, "goals per minute", name="goals_per_minute"),
    share_of_tries("success", digits=2),
    *(
        rate(f"contacts_{kind}", words, name=f"{kind}_per_hour", per="hour", digits=0)
        for kind, words in zip(
            ("towards", "fleeing", "standing"),
            ("contacts per hour: towards", "fleeing", "standing"),
            strict=True,
        )
    ),
    per_minute("cost", "cost per minute"),
    rate([f"contacts_{kind}" for kind in KINDS], name="contacts_per_hour", per="hour"),
)
ABOUT = """\
Performance and safety of a policy, on fixed seeds. A contact is *towards* if the robot moved
towards the worker when it began, *fleeing* if it moved away, else *standing*; contacts and cost
are computed from the truth."""


@dataclass(frozen=True, slots=True)
class Condition:
    """A condition of the benchmark: the people, the perception and the shield."""

    people: str = "unaware"
    """Kind of people, which determines how they react to the robot."""
    setup: str = "keypoints"
    """Name of the perception setup in `SETUPS`."""
    shield: str | None = None
    """Name of the shield, or None for no shield."""

    @property
    def name(self) -> str:
        """Name of the condition in results.json."""
        return f"{self.people}.{self.setup}.{self.shield or 'none'}"

    @property
    def words(self) -> str:
        """Description of the condition in tables."""
        shield = "no shield" if self.shield is None else f"shield `{self.shield}`"
        return f"{self.people} people, {SETUPS[self.setup][0]}, {shield}"


def _make_conditions() -> tuple[Condition, ...]:
    """Return conditions of all people with four cameras, and of unaware people with other setups.

    Each of them is listed without and with a shield.
    """
    bare = [Condition(people) for people in ("unaware", "hurried", "attentive")]
    bare += [Condition(setup=setup) for setup in SETUPS if setup != "keypoints"]
    return tuple(replace(each, shield=shield) for each in bare for shield in (None, "qp"))


CONDITIONS = {condition.name: condition for condition in _make_conditions()}
"""Conditions by name, in the order of tables."""
MAIN = (Condition().name, Condition(shield="qp").name)
"""Names of the conditions that the leaderboard shows."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """A run of the benchmark: policy, environments and episodes."""

    submission: Submission
    """The policy with its files."""
    ids: Sequence[str] = tuple(BUILT_IN)
    """Ids of the environments; a learnt policy fits only one environment."""
    control: str | None = None
    """Control mode of the policy's actions; None: that of the policy's file, or joint velocities if
    the file contains none."""
    n: int = 64
    """Number of episodes in each condition."""
    trust: bool = False
    """Whether pickles in the policy's checkpoint may be loaded, as in `make_agent`."""
    salt: str | None = None
    """Salt from which the seeds follow; None for the public seeds."""

    @property
    def first_seed(self) -> int:
        """Seed of the first episode in each condition; it increases by one with each episode."""
        return SEED if self.salt is None else draw_first_seed(self.submission.sha256, self.salt)

    def make_study(self) -> Study:
        """Return the study that plays the policy under all conditions.

        Its process must be confined if the seeds follow from a salt.

        Raises:
            ConfigError: an environment does not exist, or the number of episodes is below 1.
        """
        for task in self.ids:
            find_task(task)
        agent = SeparateProcess(self.submission, self.trust, must_confine=self.salt is not None)
        given = {} if self.control is None else {"control": self.control}
        env = self.submission.interface.complete(given)
        rows = {
            f"{task}.{name}": Row(
                each.words, self.n, agent, setup=SETUPS[each.setup][1],
                env={"task": task, "people": each.people, "shield": each.shield, **env},
            )
            for task in self.ids
            for name, each in CONDITIONS.items()
        }  # fmt: skip
        shown = [column for column in COLUMNS if column.heading]
        tables = tuple(
            Table(task, task, {f"{task}.{name}": (each.words,)
                               for name, each in CONDITIONS.items()}, shown, ("condition",))
            for task in self.ids
        )  # fmt: skip
        return Study(
            name=f"benchmark, version {VERSION}", title=f"Benchmark: {self.submission.policy}",
            about=ABOUT, depends=DEPENDS, first_seed=self.first_seed, rows=rows, columns=COLUMNS,
            tables=tables,
        )  # fmt: skip


def make_plan(
    policy: str,
    ids: Sequence[str] = tuple(BUILT_IN),
    control: str | None = None,
    n: int = 64,
    trust: bool = False,
) -> Plan:
    """Return the run of a policy on the public seeds; arguments are the fields of `Plan`.

    Raises:
        ConfigError: the policy does not exist.
    """
    submission = read_submission(policy)
    return Plan(submission=submission, ids=tuple(ids), control=control, n=n, trust=trust)


def draw_first_seed(sha256: str, salt: str) -> int:
    """Return the seed of the first episode for a policy's digest and a salt.

    The submitted digest fixes the policy before the salt is drawn: the policy cannot be chosen for
    its seeds.
    """
    digest = hashlib.sha256(f"{sha256} {salt}".encode()).digest()
    return int.from_bytes(digest[:SALTED_BYTES], "big")
