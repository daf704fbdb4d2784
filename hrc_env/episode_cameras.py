"""Cameras of each environment in its current episode: sampled rigs, faults and appearances.

Usually all environments share one perception pipeline; an environment with different cameras has a
separate pipeline (`pipeline.episodic`).
"""

from collections.abc import Mapping
from functools import lru_cache
from types import MappingProxyType
from typing import Any

import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.infos import DELAY, FAULT, LIGHT, MOVED, N_CAMERAS, TURNED, Info
from hrc_env.core.streams import aside
from hrc_env.core.typing import Floats, Ints
from hrc_env.geometry.camera_config import CameraConfig, axes_of
from hrc_env.geometry.cameras import PinholeCamera
from hrc_env.perception.faults.fault import IMAGE, KINDS, FaultConfig
from hrc_env.pipeline.episodic import CameraSetup, EpisodicPipeline, EpisodicState
from hrc_env.pipeline.levels import CAMERA_LEVELS, EMULATED, PipelineOfEpisode, make_pipeline
from hrc_env.pipeline.observed_images import Images, ObservedImages
from hrc_env.pipeline.sensor_input import Generators
from hrc_env.reset_options import Fixed, faults_of
from hrc_env.scene.build import Scene, with_rig
from hrc_env.scene.domain_randomization import AS_BUILT, AppearanceConfig, Look, draw_look
from hrc_env.scene.rig import make_cameras
from hrc_env.scene.rig_distribution import STREAM as RIG_STREAM
from hrc_env.scene.rig_distribution import draw_rig
from hrc_env.settings import Settings

ALL_DRAWN = Fixed()
"""Fixed parts of an episode in which all parts are sampled."""
NOTHING_GIVEN: Mapping[int, Fixed] = MappingProxyType({})
"""Empty mapping of fixed parts, for episodes in which all parts are sampled."""
NEUTRAL = {"darkness": 1.0}
"""Amount without effect, by kind of fault; it is 0 for all other kinds."""


class EpisodeCameras:
    """The cameras and perception pipelines of a batch of environments.

    Args:
        batch: number of environments.
        settings: settings that the environments share.
        scene: scene with the common rig.
    """

    def __init__(self, batch: int, settings: Settings, scene: Scene) -> None:
        self.scene, self.config, self._settings = scene, settings.config, settings
        self.names = tuple(camera.name for camera in scene.cameras)
        images, level = settings.images, settings.asked.perception
        has_cameras = level in CAMERA_LEVELS
        self.pipeline = make_pipeline(
            level, settings.estimator, scene, batch, self.config, shows_images=images is not None
        )
        if images is not None and settings.rigs is not None and not has_cameras:
            raise ConfigError(
                "cameras=RigDistribution(...) requires a perception level with cameras; with "
                f"perception={level!r} no rig is drawn per episode, although images would show it: "
                f"use {' or '.join(map(repr, CAMERA_LEVELS))}, or pass a single rig."
            )
        bends = settings.rigs is not None and settings.rigs.bends
        self.images = None if images is None else ObservedImages(scene, images, bends)
        """Renderer of the images in observations; None without images."""
        self._looks: dict[int, tuple[np.random.Generator, Look]] = {}
        self._rigs = settings.rigs if has_cameras else None
        if settings.rigs is not None:
            settings.rigs.counts(len(scene.cameras))
        if self._rigs is not None:  # to raise errors of the distribution early
            draw_rig(self._rigs, scene, np.random.default_rng(0))
        known = [k for k, each in KINDS.items() if each.group != IMAGE or k in EMULATED]
        self._kinds = tuple(known if level == "keypoints" else KINDS)
        names = (N_CAMERAS, MOVED, TURNED, DELAY, LIGHT, *(f"{FAULT}{k}" for k in self._kinds))
        self._drawn = {name: np.zeros(batch) for name in names} if has_cameras else {}

    def assign(self, ids: Ints, given: Mapping[int, Fixed], sensor_rngs: Generators) -> None:
        """Assign the cameras of new episodes to environments `ids`.

        Args:
            ids: (n,) indices of the environments.
            given: fixed parts of the episodes by environment.
            sensor_rngs: random generators of the sensors, one for each environment of the batch.
        """
        differ = self._rigs is not None or any(each.changes_cameras for each in given.values())
        if not differ and not isinstance(self.pipeline, EpisodicPipeline):
            return
        pipeline = self._make_episodic()
        for b in ids.tolist():
            setup = self._setup_of_episode(given.get(b, ALL_DRAWN), sensor_rngs[b])
            pipeline.assign(b, setup)

    def reset(self, ids: Ints, sensor_rngs: Generators, tracker_rngs: Generators) -> None:
        """Reset the perception of environments `ids`, and record their sampled values."""
        self.pipeline.reset(ids, sensor_rngs, tracker_rngs)
        self._record(ids)

    def info(self, ids: Ints) -> Info:
        """Return the sampled values of the episodes of environments `ids`; none without cameras."""
        return {name: values[ids] for name, values in self._drawn.items()}

    def rig_of(self, b: int) -> tuple[CameraConfig, ...]:
        """Return the rig of environment `b` in its current episode."""
        own = self._own(b)
        return self.scene.rig if own is None else own.rig

    def cameras_of(self, b: int) -> tuple[PinholeCamera, ...]:
        """Return the pinhole cameras of environment `b` in its current episode."""
        rig = self.rig_of(b)
        return self.scene.cameras if rig == self.scene.rig else make_cameras(rig)

    @property
    def are_drawn(self) -> bool:
        """Whether a new rig is sampled for every episode."""
        return self._rigs is not None

    def projections(self) -> Floats:
        """Return the projection matrices (B, C, 3, 4) of the cameras of each environment.

        They map world coordinates [m] to pixels. The matrix of a camera that is not in the rig of
        the current episode is NaN.
        """
        batch = len(self._drawn[N_CAMERAS])
        P = np.full((batch, len(self.names), 3, 4), np.nan)
        for b in range(batch):
            for camera in self.cameras_of(b):
                P[b, self.names.index(camera.name)] = camera.P
        return P

    def faults_of(self, b: int) -> tuple[FaultConfig, ...]:
        """Return the camera faults of environment `b`, with the amounts sampled for its episode."""
        schedule = self.pipeline.schedule_of(b)
        return () if schedule is None else schedule.faults

    def draw_images(self, sensor_rngs: Generators) -> Images:
        """Render the images in the observation at the time of the sensors' last exposure."""
        if self.images is None:
            return {}
        moment = self.pipeline.sensor.now
        ids = moment.ids.tolist()
        rigs = [self.cameras_of(b) for b in ids]
        return self.images.draw(moment, [self.look_of(b, sensor_rngs[b]) for b in ids], rigs)

    def look_of(self, b: int, sensor_rng: np.random.Generator) -> Look | None:
        """Return the appearance sampled for environment `b`; None for the scene as built."""
        look, appearance = self.pipeline.look_of(b), self._appearance_of(b)
        if look is not None or appearance == AS_BUILT:
            return look
        if b not in self._looks or self._looks[b][0] is not sensor_rng:  # a new episode has begun
            self._looks[b] = sensor_rng, draw_look(appearance, self.scene.n_workers, sensor_rng)
        return self._looks[b][1]

    def get_state(self) -> Any:
        """Return a copy of the pipelines' state."""
        return self.pipeline.get_state()

    def get_rows(self, ids: Ints, batch: int) -> Any:
        """Return a copy of the pipelines' state for environments `ids`."""
        return self.pipeline.get_rows(ids, batch)

    def set_state(self, state: Any) -> None:
        """Restore a state, including the separate pipelines of environments."""
        if isinstance(state, EpisodicState):
            self._make_episodic()
        self.pipeline.set_state(state)
        if self._drawn:
            self._record(np.arange(len(self._drawn[N_CAMERAS])))

    def close(self) -> None:
        """Release threads and graphics contexts."""
        self.pipeline.close()
        if self.images is not None:
            self.images.close()

    def _own(self, b: int) -> CameraSetup | None:
        """Return the camera setup of environment `b`; None if it uses the common cameras."""
        return self.pipeline.setup_of(b) if isinstance(self.pipeline, EpisodicPipeline) else None

    def _appearance_of(self, b: int) -> AppearanceConfig:
        """Return the appearance settings of environment `b` in its current episode."""
        own = self._own(b)
        return self.config.appearance if own is None else own.appearance

    def _make_episodic(self) -> EpisodicPipeline:
        """Return a pipeline in which every environment can have different cameras."""
        if not isinstance(self.pipeline, EpisodicPipeline):
            level, estimator = self._settings.asked.perception, self._settings.estimator
            made = level, estimator, self.scene, self.config
            make = PipelineOfEpisode(*made, self.images is not None)
            self.pipeline = EpisodicPipeline(self.pipeline, self.names, make)
        return self.pipeline

    def _setup_of_episode(
        self, fixed: Fixed, sensor_rng: np.random.Generator
    ) -> CameraSetup | None:
        """Return the camera setup of an environment's next episode; None for the common cameras."""
        rigs = self._rigs if fixed.rig is None else fixed.rigs
        if not fixed.changes_cameras and rigs is None:
            return None
        rig, config = self.scene.rig if fixed.rig is None else fixed.rig, self.config
        if rigs is not None:
            rig = draw_rig(rigs, with_rig(self.scene, rig), aside(sensor_rng, RIG_STREAM))
        faults = config.faults if fixed.faults is None else fixed.faults
        return CameraSetup(
            rig,
            faults_of(faults, self.names, rig),
            config.appearance if fixed.appearance is None else fixed.appearance,
        )

    def _record(self, ids: Ints) -> None:
        """Record the values sampled for the episodes of environments `ids`."""
        if not self._drawn:
            return
        for b in ids.tolist():
            schedule = self.pipeline.schedule_of(b)
            delay_s = 0.0 if schedule is None else schedule.max_delay_s
            drawn = {DELAY: delay_s, LIGHT: self.pipeline.light_of(b)}
            drawn |= _difference(self.rig_of(b), self.scene.rig)
            drawn |= _amounts(self.faults_of(b), self._kinds)
            for name, value in drawn.items():
                self._drawn[name][b] = value


@lru_cache(maxsize=256)
def _difference(
    rig: tuple[CameraConfig, ...], usual: tuple[CameraConfig, ...]
) -> Mapping[str, float]:
    """Return the number of cameras of a rig, and their largest shift and rotation from `usual`."""
    if rig == usual:
        return {N_CAMERAS: len(rig), MOVED: 0.0, TURNED: 0.0}
    named, moved_m, turned_rad = {camera.name: camera for camera in usual}, 0.0, 0.0
    for camera in rig:
        nominal = named[camera.name]
        shift = np.subtract(camera.eye_world, nominal.eye_world)
        moved_m = max(moved_m, float(np.linalg.norm(shift)))
        R = axes_of(nominal).T @ axes_of(camera)
        turned_rad = max(turned_rad, float(np.arccos(np.clip((np.trace(R) - 1) / 2, -1, 1))))
    return {N_CAMERAS: len(rig), MOVED: moved_m, TURNED: turned_rad}


@lru_cache(maxsize=256)
def _amounts(faults: tuple[FaultConfig, ...], kinds: tuple[str, ...]) -> Mapping[str, float]:
    """Return the amount of each kind of fault.

    For several faults of one kind, it is the amount with the largest effect.
    """
    most = {kind: NEUTRAL.get(kind, 0.0) for kind in kinds}
    for fault in faults:
        none = NEUTRAL.get(fault.kind, 0.0)
        amount = 1.0 if KINDS[fault.kind].bounds == (0.0, 0.0) else fault.max_amount
        if abs(amount - none) > abs(most[fault.kind] - none):
            most[fault.kind] = amount
    return {f"{FAULT}{kind}": amount for kind, amount in most.items()}
