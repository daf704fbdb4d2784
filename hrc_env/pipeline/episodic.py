"""Pipelines for single environments with cameras that differ from episode to episode.

A pipeline has one rig, one list of faults and one appearance. An environment is assigned a separate
pipeline if its episode differs in any of these. Because no result depends on the batch size, that
pipeline gives exactly the results of a single environment with the same rig, bit for bit.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Generic, NamedTuple, Protocol, TypeVar

import numpy as np

from hrc_env.core import batching
from hrc_env.core.batching import map_arrays, one, rows, write_rows
from hrc_env.core.errors import require
from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.typing import Bools, Floats, Image, Ints
from hrc_env.core.vacancy import Coverage, Vacancy
from hrc_env.geometry.camera_config import CameraConfig
from hrc_env.perception.faults.fault import FaultConfig
from hrc_env.perception.faults.schedule import Schedule
from hrc_env.pipeline.sensor_input import Generators, Sensor, SensorInput
from hrc_env.pipeline.tracking import Detections, PerceptionPipeline
from hrc_env.scene.domain_randomization import AppearanceConfig, Look

RecordT = TypeVar("RecordT")


@dataclass(frozen=True, slots=True)
class CameraSetup:
    """The cameras of one episode."""

    rig: tuple[CameraConfig, ...]
    """Configurations of the cameras, which are available to the estimator."""
    faults: tuple[FaultConfig, ...]
    """Faults of the cameras in the episode."""
    appearance: AppearanceConfig
    """Appearance of the scene in the episode."""


class MakePipeline(Protocol):
    """A factory of pipelines for single environments with different cameras."""

    def __call__(self, setup: CameraSetup, like: PerceptionPipeline) -> PerceptionPipeline:
        """Return a pipeline with the cameras of `setup` and the renderer and networks of `like`."""
        ...


class OwnState(NamedTuple):
    """The state of an environment with a separate pipeline."""

    setup: CameraSetup
    """Cameras of the environment's episode."""
    state: Any
    """State of the environment's pipeline."""


@dataclass(frozen=True, slots=True)
class EpisodicState:
    """The state of an `EpisodicPipeline`."""

    shared: Any
    """State of the pipeline that most environments share."""
    own: dict[int, OwnState]
    """States of the environments with a separate pipeline, by the environment's index."""

    @staticmethod
    def gather(parts: Sequence[Any], bounds: Sequence[int], ids: Ints) -> "EpisodicState":
        """Return the state of environments `ids` (`batching.gather`).

        A part may also be the state of a pipeline that all its environments share.
        """
        found = [each if isinstance(each, EpisodicState) else EpisodicState(each, {})
                 for each in parts]  # fmt: skip
        return EpisodicState(
            batching.gather([each.shared for each in found], bounds, ids),
            batching.gather_entries([each.own for each in found], bounds, ids),
        )


@dataclass(frozen=True, slots=True)
class _Own:
    """The separate pipeline of an environment."""

    setup: CameraSetup
    """Cameras of the environment's episode."""
    pipeline: PerceptionPipeline
    """The environment's pipeline, with a batch of one."""

    def get_state(self) -> OwnState:
        """Return the cameras and a copy of the pipeline's state."""
        return OwnState(self.setup, self.pipeline.get_state())


@dataclass(frozen=True, slots=True)
class _Part:
    """The subset of the requested environments that share a pipeline."""

    pipeline: PerceptionPipeline
    """Pipeline that the environments share."""
    rows: Ints
    """(n,) rows of the environments in the requested batch."""
    ids: Ints
    """(n,) indices of the environments in the pipeline."""
    columns: Ints
    """(C,) indices of the pipeline's cameras in `EpisodicPipeline.names`."""


class _PartRecord(NamedTuple, Generic[RecordT]):
    """A record of the environments in `part`."""

    part: _Part
    """The environments and their pipeline."""
    record: RecordT
    """(n, ...) record of the environments in `part`."""


class _Place(NamedTuple):
    """The pipeline of an environment, and the environment's index in it."""

    pipeline: PerceptionPipeline
    """Pipeline of the environment."""
    row: int
    """Index of the environment in the pipeline."""


class EpisodicPipeline(PerceptionPipeline):
    """A pipeline with separate sub-pipelines for environments with different cameras.

    Args:
        shared: the pipeline that most environments share.
        names: names of all cameras; every rig has a subset of them.
        make: factory of the separate pipelines.
    """

    def __init__(
        self, shared: PerceptionPipeline, names: tuple[str, ...], make: MakePipeline
    ) -> None:
        self.shared, self.names, self._make = shared, names, make
        self.sensor = EpisodicSensor(shared.sensor.NEEDS_TRUTH, self._parts)
        self._own: dict[int, _Own] = {}

    def assign(self, b: int, setup: CameraSetup | None) -> None:
        """Set the cameras of environment `b` for its next episode; None selects the shared ones."""
        had = self._own.get(b)
        if had is not None and had.setup == setup:
            return
        if had is not None:
            had.pipeline.close()
            del self._own[b]
        if setup is not None:
            self._own[b] = _Own(setup, self._make(setup, self.shared))

    def setup_of(self, b: int) -> CameraSetup | None:
        """Return the cameras of environment `b`, or None if it uses the shared ones."""
        return self._own[b].setup if b in self._own else None

    def reset(self, ids: Ints, sensor_rngs: Generators, tracker_rngs: Generators) -> None:
        """Reset environments `ids`, for new episodes."""
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
        """Return the belief about workers in environments `ids`, updated by the measurements."""

        def perceive(part: _Part) -> PoseEstimate:
            streams = ([rngs[row] for row in part.rows] for rngs in (sensor_rngs, tracker_rngs))
            return part.pipeline.perceive(part.ids, *streams)

        return self._gather(ids, perceive)

    def forecast(self, now: PoseEstimate, ids: Ints, horizon_s: float) -> PoseEstimate:
        """Forecast the belief for a future time; see `PerceptionPipeline.forecast`."""
        return self._gather(
            ids,
            lambda part: part.pipeline.forecast(rows(now, part.rows), part.ids, horizon_s),
        )

    def last_detections(self, b: int) -> Detections:
        """Return the last keypoints of environment `b`, and the windows of their detection."""
        pipeline, b = self._place(b)
        return pipeline.last_detections(b)

    @property
    def measurements(self) -> Keypoints:
        """Last keypoints (B, C, W, J) that the estimators received.

        The cameras are in the order of `names`. The keypoints and times of cameras that are not in
        an episode's rig are missing.
        """
        shared = self.shared.measurements
        whole = replace(map_arrays(shared, np.copy), time_s=self._times_s(self.shared, shared))
        for b, own in self._own.items():
            seen, columns = own.pipeline.measurements, self._columns(own)
            seen = replace(seen, time_s=self._times_s(own.pipeline, seen))
            whole.px[b], whole.confidence[b], whole.sigma_px[b] = np.nan, 0.0, np.inf
            require(whole.time_s, "Times of frames")[b] = np.nan
            write_rows(one(whole, b), columns, one(seen, 0))
        return whole

    def crops(self, b: int) -> list[Image | None]:
        """Return the last crop (C,) of environment `b`'s first worker in each camera."""
        pipeline, b = self._place(b)
        return pipeline.crops(b)

    def look_of(self, b: int) -> Look | None:
        """Return the appearance of environment `b`'s episode, or None for the default one."""
        pipeline, b = self._place(b)
        return pipeline.look_of(b)

    def schedule_of(self, b: int) -> Schedule | None:
        """Return the schedule of environment `b`'s cameras in its episode."""
        pipeline, b = self._place(b)
        return pipeline.schedule_of(b)

    def light_of(self, b: int) -> float:
        """Return the relative light intensity in environment `b`'s episode."""
        pipeline, b = self._place(b)
        return pipeline.light_of(b)

    def suspected_cameras(self, ids: Ints) -> Bools:
        """Return a mask (B, C) of possibly miscalibrated cameras, in the order of `names`.

        The mask is False for cameras that are not in an episode's rig.
        """
        found = np.zeros((len(ids), len(self.names)), np.bool_)
        for part in self._parts(ids):
            found[np.ix_(part.rows, part.columns)] = part.pipeline.suspected_cameras(part.ids)
        return found

    def vacancy(self, ids: Ints) -> Vacancy | None:
        """Return the state of the floor of environments `ids`, or None if there are no cameras.

        If the environments have different rigs, every patch of floor forms a separate group.
        """
        parts = self._parts(ids)
        found = [_PartRecord(part, part.pipeline.vacancy(part.ids)) for part in parts]
        known = [_PartRecord(part, each) for part, each in found if each is not None]
        if len(known) < 2:
            return known[0].record if known else None
        floor = known[0].record.coverage
        n_pieces = len(floor.group)
        coverage = Coverage(
            floor.floor_world, floor.piece_m, np.arange(n_pieces), np.zeros((n_pieces, 0), bool)
        )
        n = len(ids)
        levels = [_PartRecord(part, each.level[..., each.coverage.group]) for part, each in known]
        return replace(
            known[0].record,
            coverage=coverage,
            level=_join(n, levels),
            age_s=_join(n, [_PartRecord(part, each.age_s) for part, each in known]),
            others=_join(n, [_PartRecord(part, each.others) for part, each in known]),
        )

    def close(self) -> None:
        """Release threads and graphics contexts."""
        for own in self._own.values():
            own.pipeline.close()
        self.shared.close()

    def get_state(self) -> EpisodicState:
        """Return a copy of the state, including the cameras of separate pipelines."""
        own = {b: each.get_state() for b, each in self._own.items()}
        return EpisodicState(self.shared.get_state(), own)

    def get_rows(self, ids: Ints, batch: int) -> EpisodicState:
        """Return a copy of the state of environments `ids`."""
        own = {
            row: self._own[b].get_state() for row, b in enumerate(ids.tolist()) if b in self._own
        }
        return EpisodicState(self.shared.get_rows(ids, batch), own)

    def set_state(self, state: Any) -> None:
        """Restore a state, which may also be that of a pipeline shared by all environments."""
        if not isinstance(state, EpisodicState):
            state = EpisodicState(state, {})
        self.shared.set_state(state.shared)
        for b in {*self._own} - {*state.own}:
            self.assign(b, None)
        for b, own in state.own.items():
            self.assign(b, own.setup)
            self._own[b].pipeline.set_state(own.state)

    def __getstate__(self) -> dict[str, Any]:
        own = {b: each.get_state() for b, each in self._own.items()}
        return {"shared": self.shared, "names": self.names, "make": self._make, "own": own}

    def __setstate__(self, saved: dict[str, Any]) -> None:
        self.__init__(saved["shared"], saved["names"], saved["make"])
        for b, (setup, state) in saved["own"].items():
            self.assign(b, setup)
            self._own[b].pipeline.set_state(state)

    def _place(self, b: int) -> _Place:
        """Return the pipeline of environment `b`, and the environment's index in it."""
        return _Place(self._own[b].pipeline, 0) if b in self._own else _Place(self.shared, b)

    def _parts(self, ids: Ints) -> list[_Part]:
        """Group environments `ids` by their pipeline, beginning with the shared one."""
        mine = np.array([b in self._own for b in ids.tolist()], bool)
        shared = np.flatnonzero(~mine)
        everything = np.arange(len(self.names))
        parts = [_Part(self.shared, shared, ids[shared], everything)] if len(shared) else []
        for row in np.flatnonzero(mine).tolist():
            own = self._own[int(ids[row])]
            parts.append(_Part(own.pipeline, np.array([row]), np.array([0]), self._columns(own)))
        return parts

    def _columns(self, own: _Own) -> Ints:
        """Return the indices of a rig's cameras in `names` (C,)."""
        return np.array([self.names.index(camera.name) for camera in own.setup.rig])

    @staticmethod
    def _times_s(pipeline: PerceptionPipeline, seen: Keypoints) -> Floats:
        """Return the times (B, C) of frames [s]; frames without timestamps are current."""
        if seen.time_s is not None:
            return seen.time_s.copy()
        return np.repeat(pipeline.now_s[:, None], seen.px.shape[1], axis=1)

    def _gather(self, ids: Ints, find: Callable[[_Part], PoseEstimate]) -> PoseEstimate:
        """Apply a function to each part, and join the results in one estimate (B, W, ...)."""
        return _join(len(ids), [_PartRecord(part, find(part)) for part in self._parts(ids)])


class EpisodicSensor(Sensor):
    """The sensors of an `EpisodicPipeline`, each of which observes its pipeline's environments.

    Args:
        needs_truth: whether the sensors require a `TrueSensorInput`.
        parts: function that groups the environments by their pipeline.
    """

    def __init__(self, needs_truth: bool, parts: Callable[[Ints], list[_Part]]) -> None:
        self.NEEDS_TRUTH, self._parts = needs_truth, parts

    def expose(self, now: SensorInput) -> None:
        """Pass the present scene to the sensors, which keep it until the next exposure."""
        self.now = now
        for part in self._parts(now.ids):
            part.pipeline.sensor.expose(replace(rows(now, part.rows), ids=part.ids))


def _join(n: int, parts: list[_PartRecord[RecordT]]) -> RecordT:
    """Join the records of the parts of n environments to one record."""
    first = parts[0].record
    if len(parts) == 1 and len(parts[0].part.rows) == n:
        return first
    whole = map_arrays(first, lambda array: np.empty((n, *array.shape[1:]), array.dtype))
    for each in parts:
        write_rows(whole, each.part.rows, each.record)
    return whole
