"""Accuracy of the pose network on images that are dark or have low contrast.

    python -m benchmarks.perception.dim

The same moments are rendered in normal light and with each degradation in `PICTURES`, and the
worker is detected in all cameras without a previous track. The standard deviations in
`hrc_env.perception.exposure` were fitted to this table.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import tyro

from benchmarks.perception.crops import Instant, instants
from benchmarks.perception.views import list_activities
from hrc_env.core.batching import one
from hrc_env.core.records import Roi
from hrc_env.core.typing import Floats, Image
from hrc_env.geometry.cameras import image_from_pinhole, project, projections
from hrc_env.perception.detector import Detection, PoseDetector
from hrc_env.perception.faults.corruptions import CropView, corrupt
from hrc_env.perception.faults.fault import FaultConfig
from hrc_env.perception.lenses import LensRenderer
from hrc_env.perception.searching import Views
from hrc_env.perception.windows import window_from_joints
from hrc_env.scene.build import Scene, SceneConfig, build
from hrc_env.scene.domain_randomization import AppearanceConfig, draw_look
from hrc_env.scene.render import CropRenderer
from hrc_env.worker.body import load_body, worker_truth

GROSS = 8.0
"""Maximum error in standard deviations; clipping reduces the influence of gross errors."""


class Picture(NamedTuple):
    """A degradation of images by lower light or contrast."""

    light: float = 1.0
    """Factor on the light, as in `AppearanceConfig`."""
    darkness: float = 1.0
    """Amount of the camera fault `darkness`."""
    contrast: float = 1.0
    """Factor on the difference of pixels from middle grey."""


PICTURES: dict[str, Picture] = {
    "usual": Picture(),
    **{f"light {light:g}": Picture(light=light) for light in (0.3, 0.15, 0.1, 0.07)},
    **{f"contrast {share:g}": Picture(contrast=share) for share in (0.5, 0.35, 0.2, 0.1)},
    **{f"darkness {share:g}": Picture(darkness=share) for share in (0.1, 0.05, 0.02, 0.01)},
}


@dataclass(frozen=True, slots=True)
class Arguments:
    """Settings of the measurement on degraded images."""

    moments: int = 40
    """Number of moments for each body in each scene."""
    bodies: tuple[str, ...] = ("worker_1", "worker_3")
    scenes: tuple[str, ...] = ("lab", "site")
    seed: int = 1


class _Seen(NamedTuple):
    """Errors of the detection in one crop."""

    error_px: Floats  # (J,), NaN without a detection
    sigma_px: Floats  # (J,), as reported by the detector


class _Spoilt:
    """An image source that degrades the images of another one."""

    def __init__(self, scene: Scene) -> None:
        self.scene, self.renderer = scene, CropRenderer(scene)
        self.source = LensRenderer(self.renderer, scene.cameras)
        self.picture, self.count = Picture(), 0

    def crop(self, camera_index: int, window: Roi) -> Image:
        """Return a crop of a camera's degraded image."""
        image, kind = self.source.crop(camera_index, window), self.picture
        self.count += 1
        if kind.contrast < 1.0:
            image = np.round(128.0 + kind.contrast * (image - 128.0)).astype(np.uint8)
        if kind.darkness < 1.0:
            shown = CropView(image, self.scene.cameras[camera_index], window, (0, 0, 0, self.count))
            image = corrupt(shown, FaultConfig("darkness", ("all",), kind.darkness))
        return image

    def show(self, now: Instant, picture: Picture, seed: Sequence[int]) -> None:
        """Set the moment and the degradation of the following crops."""
        light = AppearanceConfig(light=(picture.light, picture.light))
        self.picture = picture
        self.renderer.randomize(draw_look(light, 1, np.random.default_rng(seed)))
        self.renderer.pose(now.q, one(now.motion, 0))


def look(name: str, body: str, asked: Arguments) -> dict[str, list[_Seen]]:
    """Return the detections at the same moments and in the same cameras, by name in `PICTURES`."""
    scene = build(SceneConfig(), name, 1, body)
    spoilt, detector = _Spoilt(scene), PoseDetector(scene.cameras)
    seen: dict[str, list[_Seen]] = {kind: [] for kind in PICTURES}
    rng = np.random.default_rng(asked.seed)
    for k, now in enumerate(instants(scene, asked.moments, rng, list_activities())):
        joints = worker_truth(load_body(body), now.motion).joints_world[0]
        px, depth_m = (values[0] for values in project(projections(scene.cameras), joints))
        views = zip(px, depth_m, scene.cameras, strict=True)
        windows: Views = [window_from_joints(*view) for view in views]
        true_px = np.stack(
            [image_from_pinhole(c, p) for c, p in zip(scene.cameras, px, strict=True)]
        )
        for kind, picture in PICTURES.items() if any(windows) else ():
            spoilt.show(now, picture, [asked.seed, k])
            detector.forget(0)
            found = detector.detect(spoilt, windows)
            seen[kind] += _compare(found, windows, true_px)
    detector.close()
    spoilt.renderer.close()
    return seen


def _compare(found: Detection, windows: Views, true_px: Floats) -> list[_Seen]:
    off = np.linalg.norm(found.px - true_px, axis=-1)
    return [_Seen(off[c], found.sigma_px[c]) for c, w in enumerate(windows) if w is not None]


class Row(NamedTuple):
    """Comparison of detections in degraded images and in normal light."""

    n_known: int
    """Number of crops with a detection in normal light."""
    n_both: int
    """Number of these crops with a detection also in the degraded image."""
    error: float
    """Ratio of the median error in the degraded crops to that in normal light."""
    spread: float
    """Ratio of the root mean square of the normalized error in the degraded crops to that in normal
    light.
    """


def make_row(usual: Sequence[_Seen], dim: Sequence[_Seen]) -> Row:
    """Compare the detections in degraded images with those in normal light."""
    known = [pair for pair in zip(usual, dim, strict=True) if np.isfinite(pair[0].error_px).all()]
    both = [pair for pair in known if np.isfinite(pair[1].error_px).all()]

    def median(which: int) -> float:
        return float(np.median([pair[which].error_px for pair in both]))

    def spread(which: int) -> float:
        share = np.array([pair[which].error_px / pair[which].sigma_px for pair in both])
        return float(np.sqrt(np.mean(np.minimum(share, GROSS) ** 2)))

    return Row(len(known), len(both), median(1) / median(0), spread(1) / spread(0))


def main(asked: Arguments, say: Callable[[str], None] = print) -> None:
    """Measure all degradations, and print a table for each scene."""
    for name in asked.scenes:
        parts = [look(name, body, asked) for body in asked.bodies]
        seen = {kind: [view for part in parts for view in part[kind]] for kind in PICTURES}
        say(f"\n| {name} | found | of | error | error / deviation |\n|---|---:|---:|---:|---:|")
        for kind in PICTURES:
            row = make_row(seen["usual"], seen[kind])
            say(f"| {kind} | {row.n_both} | {row.n_known} | {row.error:.2f} | {row.spread:.2f} |")


if __name__ == "__main__":
    main(tyro.cli(Arguments))
