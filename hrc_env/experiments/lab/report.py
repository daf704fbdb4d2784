"""The report of the laboratory study: errors, and the paper's figure 6 with the study's data."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from hrc_env.core.batching import one
from hrc_env.core.skeleton import BONES
from hrc_env.core.typing import Image, Points3
from hrc_env.experiments.lab import sides
from hrc_env.experiments.lab.declaration import (
    ERRORS,
    ESTIMATORS,
    FAR,
    LESS,
    QUESTION,
    TITLE,
    make_errors_table,
)
from hrc_env.experiments.plots import make_figure, save
from hrc_env.experiments.recording import Recording, replay
from hrc_env.experiments.report import Metrics, Report, format_picture
from hrc_env.geometry.cameras import image_from_pinhole
from hrc_env.perception.lenses import LensRenderer
from hrc_env.render import overlay
from hrc_env.scene.render import CropRenderer

WARM_UP = 12
"""Number of frames at the start of a film in which all cameras are used. They are not evaluated."""
SHOWN = (("standing", "(a) standing"), ("bending", "(b) bending"), ("lifting", "(c) lifting"))
CROP_PX = 512
TRUTH, SINGLE, MULTI = "#9aa3ad", "#e65100", "#1565c0"


def make_report(figures: Path, take: Callable[[str], Recording], metrics: Metrics) -> Report:
    """Draw the figure and return the report.

    Args:
        figures: folder of the figure.
        take: function that records the film of a motion.
        metrics: metrics by name.
    """
    draw_poses(figures / "figure_6.png", take)
    caption = (
        "The paper's figure 6: the crop of one camera with its detections, the body estimated from "
        "that camera alone, and from four; grey is the truth. The frame in which it missed most."
    )
    tables = (ERRORS, *(make_errors_table(name) for name in ESTIMATORS[1:]), LESS, FAR)
    shown = (table.to_markdown(metrics) for table in tables)
    return Report(TITLE, QUESTION, (format_picture(figures / "figure_6.png", caption), *shown))


def draw_poses(path: Path, take: Callable[[str], Recording]) -> None:
    """Draw one row of pictures per motion.

    Each row shows a crop with its detections, and the bodies estimated from one camera and from
    four.

    Args:
        path: picture file to write.
        take: function that records the film of a motion.
    """
    figure = make_figure(13, 14)
    for row, (motion, title) in enumerate(SHOWN):
        recording = take(motion)
        frame = find_shown_frame(recording)
        axis = figure.add_subplot(3, 3, 3 * row + 1)
        axis.imshow(_render_crop(recording, frame))
        axis.set_title(f"{title}: camera {frame.camera + 1}", fontsize=13)
        axis.axis("off")
        for k, cameras in enumerate(((frame.camera,), (0, 1, 2, 3))):
            beliefs = replay(recording, ESTIMATORS[0], cameras, WARM_UP, 0)
            estimate = beliefs.mean_world[frame.t, 0]
            _draw_body(figure, 3 * row + 2 + k, recording, estimate, frame)
    save(figure, path, dpi=100)


class CameraFrame(NamedTuple):
    """One frame of one camera."""

    t: int
    """Index of the frame in the recording."""
    camera: int
    """Index of the camera in the rig."""


def find_shown_frame(recording: Recording) -> CameraFrame:
    """Return the frame and the camera with the most missed joints on the averted side.

    The first third of the recording is excluded.
    """
    missed = sides.find_missed_joints(recording) & sides.find_averted_joints(recording)
    searched = [[window is not None for window in windows[0]] for windows in recording.windows]
    n_missed = missed.sum(-1)
    first, every = len(n_missed) // 3, 5
    n_missed = np.where(searched, n_missed, -1)[first::every]
    t, c = np.unravel_index(n_missed.argmax(), n_missed.shape)
    return CameraFrame(first + every * int(t), int(c))


def _render_crop(recording: Recording, frame: CameraFrame) -> Image:
    """Return the crop that the network received from a camera, enlarged and with its detections."""
    t, c = frame
    scene, window = recording.scene, recording.windows[t][0][c]
    renderer = CropRenderer(scene, CROP_PX)
    renderer.pose(scene.home_q, one(recording.motions, t))
    if window is None:
        raise AssertionError("the camera of the frame has no crop")
    image = np.array(LensRenderer(renderer, scene.cameras).crop(c, window))
    renderer.close()
    keypoints = recording.keypoints
    px = image_from_pinhole(scene.cameras[c], keypoints.px[t, c, 0])
    overlay.draw_landmarks(image, window, px, keypoints.confidence[t, c, 0])
    return image


def _draw_body(
    figure: Figure, place: int, recording: Recording, estimate: Points3, frame: CameraFrame
) -> None:
    """Draw an estimate and the truth, seen from a viewpoint beside the camera."""
    axis: Any = figure.add_subplot(3, 3, place, projection="3d")
    (t, c), alone = frame, place % 3 == 2
    truth = recording.joints_world[t]
    styles = ((truth, TRUTH, 5.0, "truth"), (estimate, SINGLE if alone else MULTI, 2.5, "estimate"))
    for joints, colour, width, words in styles:
        for k, bone in enumerate(BONES):
            name = None if k else words
            ends = joints[list(bone)].T
            axis.plot(*ends, color=colour, linewidth=width, label=name, axlim_clip=True)
    off_mm = 1000 * np.linalg.norm(estimate - truth, axis=-1).mean()
    cameras = f"camera {c + 1} alone" if alone else "four cameras"
    axis.set_title(f"{cameras}: {off_mm:.0f} mm", fontsize=13)
    middle = truth.mean(0)
    for name, value in zip("xyz", middle, strict=True):
        axis.set(**{f"{name}lim": (value - 0.9, value + 0.9)})
        getattr(axis, f"set_{name}label")(f"{name} [m]", labelpad=12 if name == "x" else 6)
        getattr(axis, f"{name}axis").set_major_locator(MultipleLocator(1.0 if name == "x" else 0.5))
    toward = recording.scene.cameras[c].eye_world - middle
    axis.view_init(elev=12, azim=float(np.degrees(np.arctan2(toward[1], toward[0]))) + 40)
    axis.set_box_aspect((1, 1, 1), zoom=0.88)
    axis.legend(loc="upper left", fontsize=9)
