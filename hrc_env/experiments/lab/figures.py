"""Figure 6 of the paper from our own data, and the errors as pictures."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from hrc_env.config import HRCConfig
from hrc_env.core.batching import one
from hrc_env.core.results import Metric
from hrc_env.core.skeleton import BONES
from hrc_env.core.typing import Floats, Image, Points3
from hrc_env.experiments.lab.metrics import COLUMNS
from hrc_env.experiments.lab.motions import MOTIONS, play
from hrc_env.experiments.lab.sides import missed_by_camera, turned_away
from hrc_env.experiments.study.recording import Beliefs, Recording, replay
from hrc_env.geometry.cameras import image_from_pinhole
from hrc_env.perception.lensed import Lensed
from hrc_env.render import overlay
from hrc_env.scene.render import CropRenderer
from hrc_env.worker.body import load_body

SHOWN = (("standing", "(a) standing"), ("bending", "(b) bending"), ("lifting", "(c) lifting"))
CROP_PX = 512
TRUTH, SINGLE, MULTI = "#9aa3ad", "#e65100", "#1565c0"
SPOKEN = {column: column.replace("_", " ").replace("multi", "all four") for column in COLUMNS}
SPOKEN_MOTIONS = {
    **{motion: motion for motion in MOTIONS},
    "moving_board": "moving a board\nin both hands",
    "moving_wood": "moving wood\non the shoulder",
}
Take = Callable[[str, int, Callable[[float], None]], Recording]


def draw_figures(
    folder: Path, take: Take, warm_up: int, seeds: Sequence[int], metrics: Mapping[str, Metric]
) -> None:
    """Write figure_6.png, errors.png and far_side.png."""
    folder.mkdir(parents=True, exist_ok=True)
    draw_errors(folder / "errors.png", metrics)
    draw_far_side(folder / "far_side.png", metrics)
    draw_poses(folder / "figure_6.png", take, warm_up, seeds[0])


def draw_poses(path: Path, take: Take, warm_up: int, seed: int) -> None:
    """A row a motion: a camera's crop with what it found, then the body from one and from four."""
    figure = Figure(figsize=(13, 14), layout="constrained")
    for row, (motion, title) in enumerate(SHOWN):
        recording = take(motion, seed, lambda share: None)
        t, c = telling(recording)
        config = HRCConfig()
        axis = figure.add_subplot(3, 3, 3 * row + 1)
        axis.imshow(_crop(recording, motion, seed, t, c))
        axis.set_title(f"{title}: camera {c + 1}", fontsize=13)
        axis.axis("off")
        for k, (cameras, colour) in enumerate((((c,), SINGLE), ((0, 1, 2, 3), MULTI))):
            said = replay(recording, "particle", cameras, warm_up, config, seed)
            _draw_body(figure, 3 * row + 2 + k, recording, said, t, c, colour)
    _save(figure, path)


def telling(recording: Recording) -> tuple[int, int]:
    """A frame of the later half, and the camera that misses most of the far side in it."""
    stature_m = load_body(recording.scene.bodies[0]).stature_m
    frames = range(len(recording.joints_world) // 3, len(recording.joints_world), 5)

    def lost(t: int, c: int) -> int:
        camera, joints = recording.scene.cameras[c], recording.joints_world[t]
        missed = missed_by_camera(recording.keypoints[t], c, camera, joints, stature_m)
        looked = recording.windows[t][0][c] is not None
        return int((missed & turned_away(joints, camera.eye_world)).sum()) if looked else -1

    pairs = [(t, c) for t in frames for c in range(len(recording.scene.cameras))]
    return max(pairs, key=lambda pair: lost(*pair))


def draw_errors(path: Path, metrics: Mapping[str, Metric]) -> None:
    """Median and 95th percentile of the joints' errors, motion by motion."""
    figure = Figure(figsize=(11, 5.2), layout="constrained")
    for axis, word, title in zip(
        figure.subplots(1, 2, sharey=True), ("median", "p95"), ("median", "95th percentile"),
        strict=True,
    ):  # fmt: skip
        for k, column in enumerate(COLUMNS):
            found = [metrics[f"error_m.particle.{column}.{motion}.{word}"] for motion in MOTIONS]
            values = 1000 * np.array([each.value for each in found])
            ends = 1000 * np.array([[each.low for each in found], [each.high for each in found]])
            colour = MULTI if column == "multi" else f"C{k}"
            axis.errorbar(
                np.arange(len(MOTIONS)) + 0.12 * (k - 2), values, np.abs(ends - values),
                fmt="s" if column == "multi" else "o", capsize=3, color=colour,
                label=SPOKEN[column],
            )  # fmt: skip
        axis.set_yscale("log")
        axis.set_title(f"{title}, all joints, particle", fontsize=13)
        _name_motions(axis)
        axis.grid(axis="y", which="both", alpha=0.25)
    figure.axes[0].set_ylabel("error [mm], log scale", fontsize=12)
    figure.axes[0].legend(fontsize=10)
    _save(figure, path)


def _name_motions(axis: Any) -> None:
    """Write the motions under an axis."""
    names = [SPOKEN_MOTIONS[motion] for motion in MOTIONS]
    axis.set_xticks(np.arange(len(MOTIONS)), names, rotation=25, ha="right")


def draw_far_side(path: Path, metrics: Mapping[str, Metric]) -> None:
    """Joints of the far side: missed by each camera, and how many of these four bring back."""
    figure = Figure(figsize=(11, 4.6), layout="constrained")
    axes = figure.subplots(1, 2, sharey=True)
    for axis, key, title in zip(
        axes, ("missed_far", "recovered_far"),
        ("missed by one camera", "of these, known with four"), strict=True,
    ):  # fmt: skip
        for k, column in enumerate(COLUMNS[:4]):
            found = [metrics[f"{key}.{column}.{motion}"].value for motion in MOTIONS]
            axis.bar(np.arange(len(MOTIONS)) + 0.2 * (k - 1.5), found, 0.2, label=SPOKEN[column])
        axis.set_title(f"Far-side joints {title}", fontsize=13)
        _name_motions(axis)
        axis.set_ylim(0, 1)
    axes[0].set_ylabel("share", fontsize=12)
    axes[0].legend(fontsize=10)
    _save(figure, path)


def _crop(recording: Recording, motion: str, seed: int, t: int, c: int) -> Image:
    """What camera c gave the network, larger, with what was found."""
    scene, window = recording.scene, recording.windows[t][0][c]
    n_frames = len(recording.joints_world)
    moment = one(play(scene, motion, seed, n_frames, recording.dt_s), t)
    renderer = CropRenderer(scene, CROP_PX)
    renderer.draw(scene.home_q, moment)
    if window is None:
        raise AssertionError("a camera is chosen that has looked")
    image = np.array(Lensed(renderer, scene.cameras).crop(c, window))
    renderer.close()
    found = recording.keypoints[t]
    px = image_from_pinhole(scene.cameras[c], found.px[0, c, 0])
    overlay.draw_landmarks(image, window, px, found.confidence[0, c, 0])
    return image


def _draw_body(
    figure: Figure, place: int, recording: Recording, said: Beliefs, t: int, c: int, colour: str
) -> None:
    """The estimate beside the truth, seen from where camera c is, a little aside."""
    axis: Any = figure.add_subplot(3, 3, place, projection="3d")
    truth = recording.joints_world[t]
    _bones(axis, truth, TRUTH, 5.0, "truth")
    _bones(axis, said.mean_world[t], colour, 2.5, "estimate")
    middle = truth.mean(0)
    off_mm = 1000 * np.linalg.norm(said.mean_world[t] - truth, axis=-1).mean()
    which = "four cameras" if colour == MULTI else f"camera {c + 1} alone"
    axis.set_title(f"{which}: {off_mm:.0f} mm", fontsize=13)
    for name, value in zip("xyz", middle, strict=True):
        getattr(axis, f"set_{name}lim")(value - 0.9, value + 0.9)
        getattr(axis, f"set_{name}label")(f"{name} [m]")
        getattr(axis, f"{name}axis").set_major_locator(MultipleLocator(0.5))
    toward = recording.scene.cameras[c].eye_world - middle
    axis.view_init(elev=12, azim=float(np.degrees(np.arctan2(toward[1], toward[0]))) + 40)
    axis.set_box_aspect((1, 1, 1), zoom=0.88)
    axis.legend(loc="upper left", fontsize=9)


def _bones(axis: Any, joints: Points3 | Floats, colour: str, width: float, label: str) -> None:
    for k, (first, second) in enumerate(BONES):
        ends = joints[[first, second]]
        axis.plot(
            *ends.T, color=colour, linewidth=width, label=label if k == 0 else None, axlim_clip=True
        )


def _save(figure: Figure, path: Path) -> None:
    FigureCanvasAgg(figure)
    figure.savefig(path, dpi=100)
