"""Cameras that differ from episode to episode: environments with a pipeline of their own.

A pipeline knows one rig, one list of faults and one appearance. An environment whose episode has
others gets a pipeline for itself; as no result depends on the size of a batch, it sees what a
single environment with that rig sees, bit for bit.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Protocol, TypeVar

import numpy as np

from hrc_env.core.batching import mapped, one, rows, write_rows
from hrc_env.core.errors import needed
from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.typing import Bools, Floats, Image, Ints
from hrc_env.core.vacancy import Coverage, Vacancy
from hrc_env.geometry.camera_config import CameraConfig
from hrc_env.perception.faults.fault import FaultConfig
from hrc_env.perception.faults.schedule import Schedule
from hrc_env.pipeline.sensor_input import Generators, Sensor, SensorInput, Windows
from hrc_env.pipeline.tracking import PerceptionPipeline
from hrc_env.scene.domain_randomization import AppearanceConfig, Look

RecordT = TypeVar("RecordT")


@dataclass(frozen=True, slots=True)
class CameraSetup:
    """The cameras of one episode."""

    rig: tuple[CameraConfig, ...]
    """As they hang, and as the estimator knows them."""
    faults: tuple[FaultConfig, ...]
    """Their faults."""
    appearance: AppearanceConfig
    """How the scene looks to them."""


class MakePipeline(Protocol):
    """Makes a pipeline of one environment with other cameras, which borrows renderer and
    networks."""

    def __call__(self, setup: CameraSetup, like: PerceptionPipeline) -> PerceptionPipeline: ...


@dataclass(frozen=True, slots=True)
class EpisodicState:
    """The state of an `EpisodicPipeline`."""

    shared: Any
    own: dict[int, tuple[CameraSetup, Any]]
    """By environment: its cameras, and the state of its pipeline."""


@dataclass(frozen=True, slots=True)
class _Own:
    setup: CameraSetup
    pipeline: PerceptionPipeline


@dataclass(frozen=True, slots=True)
class _Part:
    """Environments of a call that one pipeline works on."""

    pipeline: PerceptionPipeline
    rows: Ints
    """Their rows among those of the call."""
    ids: Ints
    """Their numbers in that pipeline."""
    columns: Ints
    """The rig's cameras among those of the environment."""


class EpisodicPipeline(PerceptionPipeline):
    """The pipeline that most environments share, and one for each whose cameras are others."""

    def __init__(
        self, shared: PerceptionPipeline, names: tuple[str, ...], make: MakePipeline
    ) -> None:
        """`names` are the cameras' that infos know: of any rig these or some of them."""
        self.shared, self.names, self._make = shared, names, make
        self.sensor = EpisodicSensor(shared.sensor.NEEDS_TRUTH, self._parts)
        self._own: dict[int, _Own] = {}

    def assign(self, b: int, setup: CameraSetup | None) -> None:
        """Let the next episode of environment `b` have these cameras; None: the shared ones."""
        had = self._own.get(b)
        if had is not None and had.setup == setup:
            return
        if had is not None:
            had.pipeline.close()
            del self._own[b]
        if setup is not None:
            self._own[b] = _Own(setup, self._make(setup, self.shared))

    def setup_of(self, b: int) -> CameraSetup | None:
        """Return the cameras of environment `b`; None: the shared ones."""
        return self._own[b].setup if b in self._own else None

    def reset(self, ids: Ints, sensor_rngs: Generators, tracker_rngs: Generators) -> None:
        """Forget environments `ids`."""
        shared = [b for b in ids.tolist() if b not in self._own]
        if shared:
            self.shared.reset(np.array(shared), sensor_rngs, tracker_rngs)
        for b in ids.tolist():
            if b in self._own:
                streams = [sensor_rngs[b]], [tracker_rngs[b]]
                self._own[b].pipeline.reset(np.array([0]), *streams)

    def perceive(
        self, ids: Ints, sensor_rngs: Generators, tracker_rngs: Generators
    ) -> PoseEstimate:
        """What is believed of environments `ids` after what the sensor measures of them."""

        def believed(part: _Part) -> PoseEstimate:
            streams = ([rngs[row] for row in part.rows] for rngs in (sensor_rngs, tracker_rngs))
            return part.pipeline.perceive(part.ids, *streams)

        return self._gathered(ids, believed)

    def forecast(self, now: PoseEstimate, ids: Ints, horizon_s: float) -> PoseEstimate:
        """What is expected in `horizon_s` of rows `ids`, of which `now` is believed."""
        return self._gathered(
            ids,
            lambda part: part.pipeline.forecast(rows(now, part.rows), part.ids, horizon_s),
        )

    def last_detections(self, b: int) -> tuple[Keypoints | None, Windows]:
        """Return the last keypoints of environment `b`, and their windows."""
        pipeline, b = self._of(b)
        return pipeline.last_detections(b)

    @property
    def given(self) -> Keypoints:
        """The keypoints (B, C, W, J) that estimators were given last, by `names`: a camera that
        does not hang in an episode finds nothing at no time."""
        shared = self.shared.given
        whole = replace(mapped(shared, np.copy), time_s=self._times_s(self.shared, shared))
        for b, own in self._own.items():
            seen, columns = own.pipeline.given, self._columns(own)
            seen = replace(seen, time_s=self._times_s(own.pipeline, seen))
            whole.px[b], whole.confidence[b], whole.sigma_px[b] = np.nan, 0.0, np.inf
            needed(whole.time_s, "Times of frames")[b] = np.nan
            write_rows(one(whole, b), columns, one(seen, 0))
        return whole

    def crops(self, b: int) -> list[Image | None]:
        """Return the crops of `b`'s first worker that the network was given, one a camera."""
        pipeline, b = self._of(b)
        return pipeline.crops(b)

    def look_of(self, b: int) -> Look | None:
        """How environment `b` looks in its episode; None: as it was built."""
        pipeline, b = self._of(b)
        return pipeline.look_of(b)

    def schedule_of(self, b: int) -> Schedule | None:
        """Return the schedule of environment `b`'s cameras in its episode."""
        pipeline, b = self._of(b)
        return pipeline.schedule_of(b)

    def light_of(self, b: int) -> float:
        """Return the strength of the light in environment `b`'s episode."""
        pipeline, b = self._of(b)
        return pipeline.light_of(b)

    def suspected(self, ids: Ints) -> Bools:
        """(B, C) which cameras are thought to be miscalibrated, by `names`; those that do not hang
        in an episode are not."""
        found = np.zeros((len(ids), len(self.names)), np.bool_)
        for part in self._parts(ids):
            found[np.ix_(part.rows, part.columns)] = part.pipeline.suspected(part.ids)
        return found

    def vacancy(self, ids: Ints) -> Vacancy | None:
        """Return the state of the floor of environments `ids`: of each piece by itself where these
        have several rigs."""
        parts = self._parts(ids)
        found = [(part, part.pipeline.vacancy(part.ids)) for part in parts]
        known = [(part, each) for part, each in found if each is not None]
        if len(known) < 2:
            return known[0][1] if known else None
        floor = known[0][1].coverage
        n_pieces = len(floor.group)
        coverage = Coverage(
            floor.floor_world, floor.piece_m, np.arange(n_pieces), np.zeros((n_pieces, 0), bool)
        )
        states = [
            (part, replace(each, level=each.level[..., each.coverage.group], coverage=coverage))
            for part, each in known
        ]
        return replace(
            states[0][1],
            level=_joined(len(ids), [(part, each.level) for part, each in states]),
            age_s=_joined(len(ids), [(part, each.age_s) for part, each in states]),
            others=_joined(len(ids), [(part, each.others) for part, each in states]),
        )

    def close(self) -> None:
        """Release threads and graphics contexts."""
        for own in self._own.values():
            own.pipeline.close()
        self.shared.close()

    def get_state(self) -> EpisodicState:
        """A copy of everything that changes, the environments' own cameras among it."""
        own = {b: (each.setup, each.pipeline.get_state()) for b, each in self._own.items()}
        return EpisodicState(self.shared.get_state(), own)

    def set_state(self, state: Any) -> None:
        """Continue from a state, also of a pipeline that all environments shared."""
        if not isinstance(state, EpisodicState):
            state = EpisodicState(state, {})
        self.shared.set_state(state.shared)
        for b in {*self._own} - {*state.own}:
            self.assign(b, None)
        for b, (setup, of_own) in state.own.items():
            self.assign(b, setup)
            self._own[b].pipeline.set_state(of_own)

    def __getstate__(self) -> dict[str, Any]:
        own = {b: (each.setup, each.pipeline.get_state()) for b, each in self._own.items()}
        return {"shared": self.shared, "names": self.names, "make": self._make, "own": own}

    def __setstate__(self, saved: dict[str, Any]) -> None:
        self.__init__(saved["shared"], saved["names"], saved["make"])
        for b, (setup, state) in saved["own"].items():
            self.assign(b, setup)
            self._own[b].pipeline.set_state(state)

    def _of(self, b: int) -> tuple[PerceptionPipeline, int]:
        """The pipeline of environment `b`, and its number there."""
        return (self._own[b].pipeline, 0) if b in self._own else (self.shared, b)

    def _parts(self, ids: Ints) -> list[_Part]:
        """Environments `ids` by pipeline: the shared one first."""
        mine = np.array([b in self._own for b in ids.tolist()], bool)
        shared = np.flatnonzero(~mine)
        everything = np.arange(len(self.names))
        parts = [_Part(self.shared, shared, ids[shared], everything)] if len(shared) else []
        for row in np.flatnonzero(mine).tolist():
            own = self._own[int(ids[row])]
            parts.append(_Part(own.pipeline, np.array([row]), np.array([0]), self._columns(own)))
        return parts

    def _columns(self, own: _Own) -> Ints:
        """The rig's cameras among `names`."""
        return np.array([self.names.index(camera.name) for camera in own.setup.rig])

    @staticmethod
    def _times_s(pipeline: PerceptionPipeline, seen: Keypoints) -> Floats:
        """(B, C) when frames were taken [s]; where a pipeline tells no times, all were now."""
        if seen.time_s is not None:
            return seen.time_s.copy()
        return np.repeat(pipeline.now_s[:, None], seen.px.shape[1], axis=1)

    def _gathered(self, ids: Ints, find: Callable[[_Part], PoseEstimate]) -> PoseEstimate:
        return _joined(len(ids), [(part, find(part)) for part in self._parts(ids)])


class EpisodicSensor(Sensor):
    """The sensors of an `EpisodicPipeline`: each is shown the environments that it is of."""

    def __init__(self, needs_truth: bool, parts: Callable[[Ints], list[_Part]]) -> None:
        self.NEEDS_TRUTH, self._parts = needs_truth, parts

    def expose(self, now: SensorInput) -> None:
        """The shutters open before `now`."""
        self.now = now
        for part in self._parts(now.ids):
            part.pipeline.sensor.expose(replace(rows(now, part.rows), ids=part.ids))


def _joined(n: int, parts: list[tuple[_Part, RecordT]]) -> RecordT:
    """Records of parts of n environments as one."""
    (first, record), *_ = parts
    if len(parts) == 1 and len(first.rows) == n:
        return record
    whole = mapped(record, lambda array: np.empty((n, *array.shape[1:]), array.dtype))
    for part, each in parts:
        write_rows(whole, part.rows, each)
    return whole
