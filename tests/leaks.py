"""What moves when the truth is another one and the sensors say what they said before.

The first run is recorded: the images, by camera and window, or the keypoints. The second has
another truth, which is all that its sensors are shown, but they answer from the record. Then
nothing may move but what is counted on the truth: neither windows, keypoints, what the tracker
keeps, belief, observation, reward, nor the actions of agent and shield, to the bit.
"""

import contextlib
import dataclasses
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from hrc_env import simulation
from hrc_env.agents.env_info import env_info
from hrc_env.agents.registry import make_agent
from hrc_env.core.batching import copy_arrays
from hrc_env.motion import generator, starts
from hrc_env.pipeline.emulated import EmulatedCameras
from hrc_env.pipeline.rendered import RenderedCameras
from hrc_env.simulation import Simulation
from hrc_env.worker.body import worker_capsules, worker_truth

ON_THE_TRUTH = ("cost", "episode_cost", "safety/", "tracking/", "worker_")
"""Infos that are counted on the truth, or tell it."""
Patch = Callable[[pytest.MonkeyPatch], None]


class Tape:
    """What one sensor has said, in the order in which it was asked."""

    def __init__(self) -> None:
        self.said: list[Any] = []
        self.shown: dict[Any, Any] = {}
        self.plays, self.turn, self.unlike = False, 0, False

    def attach(self, sensor: Any) -> None:
        """Record what a sensor says; once rewound, let it say that again."""
        if isinstance(sensor, EmulatedCameras):
            sensor.keypoints = self._again(sensor.keypoints)
        elif isinstance(sensor, RenderedCameras):
            sensor.show, sensor.images = self._again(sensor.show), Film(self, sensor.images)

    def rewind(self) -> None:
        self.plays, self.turn = True, 0

    def _again(self, ask: Callable[..., Any]) -> Callable[..., Any]:
        def answer(*given: Any) -> Any:
            new, self.turn = ask(*given), self.turn + 1  # also when it plays: it draws numbers
            if not self.plays:
                self.said.append(copy_arrays(new))
                return new
            self.unlike |= bool(apart(self.said[self.turn - 1], new))
            return copy_arrays(self.said[self.turn - 1])

        return answer


class Film:
    """An `ImageSource` that keeps the images of another one, and shows them again."""

    def __init__(self, tape: Tape, images: Any) -> None:
        self.tape, self.images = tape, images

    def crop(self, camera: int, window: Any) -> Any:
        tape, key, draw = self.tape, (self.tape.turn, camera, window), None
        if not tape.plays or (key in tape.shown and not tape.unlike):
            draw = np.array(self.images.crop(camera, window))
        if not tape.plays:
            tape.shown[key] = draw
        elif draw is not None:
            tape.unlike = not np.array_equal(tape.shown[key], draw)  # is it another one at all?
        return tape.shown.get(key, np.zeros((256, 256, 3), np.uint8)).copy()  # black: nobody's

    def show(self, *given: Any) -> None:
        self.images.show(*given)


def fields_of(record: Any) -> dict[str, Any]:
    return {each.name: getattr(record, each.name) for each in dataclasses.fields(record)}


def apart(one: Any, other: Any) -> list[str]:
    """Where two nested values are not the same to the bit; NaN is NaN."""
    if isinstance(one, np.random.Generator):
        one, other = one.bit_generator.state, other.bit_generator.state
    if dataclasses.is_dataclass(one):
        one, other = fields_of(one), fields_of(other)
    if hasattr(one, "_asdict"):
        one, other = one._asdict(), other._asdict()
    if isinstance(one, np.ndarray) and one.dtype.names:
        one, other = ({name: each[name] for name in one.dtype.names} for each in (one, other))
    if type(one) is not type(other):
        return [""]
    if isinstance(one, dict):
        both = one.keys() & other.keys()
        inside = [f"{k}/{at}" for k in both for at in apart(one[k], other[k])]
        return [*inside, *(f"{k}/" for k in one.keys() ^ other.keys())]
    if isinstance(one, list | tuple):
        if len(one) != len(other):
            return [""]
        return [at for pair in zip(one, other, strict=True) for at in apart(*pair)]
    if isinstance(one, np.ndarray) and one.dtype != object:
        return [] if one.shape == other.shape and one.tobytes() == other.tobytes() else [""]
    if isinstance(one, np.ndarray):
        return apart(one.tolist(), other.tolist())
    return [] if one == other or (one != one and other != other) else [""]


def simulations(env: Any) -> list[Simulation]:
    env = env.unwrapped
    return env.shards.parts if hasattr(env, "shards") else [env.simulation]


def moment(env: Any) -> dict[str, Any]:
    """What every part believes, and all that its pipeline keeps but the sensor's own."""
    found = {}
    for k, part in enumerate(simulations(env)):
        kept = part.pipeline.get_state()
        found[f"belief {k}"] = fields_of(part.belief)
        found[f"pipeline {k}"] = {name: kept[name] for name in kept if name != "sensor"}
        found[f"windows {k}"] = part.pipeline.last_detections(0)[1]
    return copy_arrays(found)


def played(
    make: Callable[[], Any], tapes: list[Tape], agent: str, n_steps: int
) -> Iterator[dict[str, Any]]:
    """Moment by moment, from the reset on."""
    with contextlib.closing(make()) as env:
        parts = simulations(env)
        tapes += [Tape() for _ in parts[len(tapes) :]]
        for tape, part in zip(tapes, parts, strict=True):
            tape.attach(part.pipeline.sensor)
        policy = make_agent(agent, env_info(parts[0]), seed=5)
        observation, info = env.reset(seed=3)
        yield {"observation": observation, "info": info, **moment(env)}
        for _ in range(n_steps):
            action = policy.act(observation)
            observation, *ends, info = env.step(action)
            now = {"action": action, "observation": observation, "reward and ends": ends}
            yield {**now, "info": info, **moment(env)}


def differences(
    make: Callable[[], Any], perturb: Patch, leak: Patch | None = None, *,
    agent: str = "scripted_slowed", n_steps: int = 30,
) -> dict[str, int]:  # fmt: skip
    """What moved, and in which step first (0: the reset), if the truth is perturbed.

    Args:
        make: makes the environment, single or vector.
        perturb: gives cost, metrics and sensors another truth.
        leak: what a leaking environment would do, in both runs.
    """
    tapes: list[Tape] = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(starts, "APART_M", -np.inf)  # the truth says where robots begin: no belief
        (leak or (lambda patch: None))(patch)
        first = list(played(make, tapes, agent, n_steps))
    for tape in tapes:
        tape.rewind()
    moved: dict[str, int] = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(starts, "APART_M", -np.inf)
        perturb(patch)
        (leak or (lambda patch: None))(patch)
        for step, now in enumerate(played(make, tapes, agent, n_steps)):
            for name in apart(first[step], now):
                moved.setdefault(name, step)
    assert all(tape.unlike for tape in tapes if tape.said), "the sensors saw the same truth"
    return moved


def leaks(moved: dict[str, int]) -> dict[str, int]:
    """Of `differences`: what must not move."""

    def told(name: str) -> bool:
        for above in ("info/", "final_info/", "_"):
            name = name.removeprefix(above)
        return name.startswith(ON_THE_TRUTH)

    return {name: step for name, step in moved.items() if not told(name)}


def another_worker(patch: pytest.MonkeyPatch) -> None:
    """Somebody else does something else somewhere else: only the robot's numbers are the same."""
    reset = generator.reset

    def begin(state: Any, ids: Any, rngs: list[np.random.Generator], *casts: Any) -> None:
        for b in ids.tolist():
            rngs[b] = np.random.default_rng([77, int(rngs[b].integers(2**31))])
        reset(state, ids, rngs, *casts)

    patch.setattr(simulation.generator, "reset", begin)


def displaced(change: Callable[[Any], Any], shown: bool = True, told: bool = True) -> Patch:
    """Points of every worker are elsewhere, for sensors, who are shown the truth, and for cost and
    metrics, who are told it."""

    def perturb(patch: pytest.MonkeyPatch) -> None:
        def truth(bodies: Any, motion: Any) -> Any:
            true = worker_truth(bodies, motion)
            joints, capsules = change(true.joints_world), change(true.capsules_world)
            return dataclasses.replace(true, joints_world=joints, capsules_world=capsules)

        def expose(self: Simulation, world: simulation.Truth) -> None:
            motion = world.motion
            true = (truth if shown else worker_truth)(self.bodies, motion)
            places = change(motion.position_world) if shown else motion.position_world
            seen = dataclasses.replace(motion, position_world=places)
            really(self, dataclasses.replace(world, motion=seen, workers=true))

        really = Simulation._expose
        patch.setattr(Simulation, "_expose", expose)
        if told:
            patch.setattr(simulation, "worker_truth", truth)
            patch.setattr(simulation, "worker_capsules", lambda *on: change(worker_capsules(*on)))

    return perturb


def shifted(points: Any) -> Any:
    return points + np.array([0.02, -0.01, 0.03])


PERTURBED: dict[str, Patch] = {
    "another worker": another_worker,
    "shifted": displaced(shifted),
    "blended": displaced(lambda points: 0.9 * points + 0.1 * np.array([2.0, 1.0, 1.0])),
}
