"""The report of the laboratory: the paper's figure 6 from our own data, and the errors."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from hrc_env.core.batching import one
from hrc_env.core.skeleton import BONES
from hrc_env.core.typing import Image, Points3
from hrc_env.experiments.lab import sides
from hrc_env.experiments.lab.declaration import (
    ASKED,
    ERRORS,
    ESTIMATORS,
    FAR,
    LESS,
    TITLE,
    errors_of,
)
from hrc_env.experiments.plots import new_figure, save
from hrc_env.experiments.recording import Recording, replay
from hrc_env.experiments.report import Metrics, Report, picture
from hrc_env.geometry.cameras import image_from_pinhole
from hrc_env.perception.lenses import LensRenderer
from hrc_env.render import overlay
from hrc_env.scene.render import CropRenderer

WARM_UP = 12
"""At first everybody has all cameras, and is not judged [frames]."""
SHOWN = (("standing", "(a) standing"), ("bending", "(b) bending"), ("lifting", "(c) lifting"))
CROP_PX = 512
TRUTH, SINGLE, MULTI = "#9aa3ad", "#e65100", "#1565c0"


def report(figures: Path, take: Callable[[str], Recording], metrics: Metrics) -> Report:
    """Draw the figure; return the tables beside it."""
    draw_poses(figures / "figure_6.png", take)
    caption = (
        "The paper's figure 6: what one camera was shown and found, the body from that camera "
        "alone, and from four; grey is the truth. The frame in which that camera missed most."
    )
    tables = (ERRORS, *(errors_of(name) for name in ESTIMATORS[1:]), LESS, FAR)
    shown = (each.markdown(metrics) for each in tables)
    return Report(TITLE, ASKED, (picture(figures / "figure_6.png", caption), *shown))


def draw_poses(path: Path, take: Callable[[str], Recording]) -> None:
    """A row a motion, filmed now: a crop with what was found in it, the body from one and four."""
    figure = new_figure(13, 14)
    for row, (motion, title) in enumerate(SHOWN):
        recording = take(motion)
        t, c = telling(recording)
        axis = figure.add_subplot(3, 3, 3 * row + 1)
        axis.imshow(_crop(recording, t, c))
        axis.set_title(f"{title}: camera {c + 1}", fontsize=13)
        axis.axis("off")
        for k, cameras in enumerate(((c,), (0, 1, 2, 3))):
            said = replay(recording, ESTIMATORS[0], cameras, WARM_UP, 0).mean_world[t, 0]
            _draw_body(figure, 3 * row + 2 + k, recording, said, (t, c))
    save(figure, path, dpi=100)


def telling(recording: Recording) -> tuple[int, int]:
    """A later frame, and the camera that misses most of the far side in it."""
    lost = (sides.missed_by_camera(recording) & sides.away_from_cameras(recording)).sum(-1)
    looked = [[window is not None for window in windows[0]] for windows in recording.windows]
    first, every = len(lost) // 3, 5
    lost = np.where(looked, lost, -1)[first::every]
    t, c = np.unravel_index(lost.argmax(), lost.shape)
    return first + every * int(t), int(c)


def _crop(recording: Recording, t: int, c: int) -> Image:
    """What camera c gave the network, larger, with what was found."""
    scene, window = recording.scene, recording.windows[t][0][c]
    renderer = CropRenderer(scene, CROP_PX)
    renderer.pose(scene.home_q, one(recording.motions, t))
    if window is None:
        raise AssertionError("a camera is chosen that has looked")
    image = np.array(LensRenderer(renderer, scene.cameras).crop(c, window))
    renderer.close()
    found = recording.keypoints
    px = image_from_pinhole(scene.cameras[c], found.px[t, c, 0])
    overlay.draw_landmarks(image, window, px, found.confidence[t, c, 0])
    return image


def _draw_body(
    figure: Figure, place: int, recording: Recording, said: Points3, frame: tuple[int, int]
) -> None:
    """An estimate beside the truth, seen from a little aside of where the camera is."""
    axis: Any = figure.add_subplot(3, 3, place, projection="3d")
    (t, c), alone = frame, place % 3 == 2
    truth = recording.joints_world[t]
    styles = ((truth, TRUTH, 5.0, "truth"), (said, SINGLE if alone else MULTI, 2.5, "estimate"))
    for joints, colour, width, words in styles:
        for k, bone in enumerate(BONES):
            name = None if k else words
            ends = joints[list(bone)].T
            axis.plot(*ends, color=colour, linewidth=width, label=name, axlim_clip=True)
    off_mm = 1000 * np.linalg.norm(said - truth, axis=-1).mean()
    which = f"camera {c + 1} alone" if alone else "four cameras"
    axis.set_title(f"{which}: {off_mm:.0f} mm", fontsize=13)
    middle = truth.mean(0)
    for name, value in zip("xyz", middle, strict=True):
        axis.set(**{f"{name}lim": (value - 0.9, value + 0.9)})
        getattr(axis, f"set_{name}label")(f"{name} [m]", labelpad=12 if name == "x" else 6)
        getattr(axis, f"{name}axis").set_major_locator(MultipleLocator(1.0 if name == "x" else 0.5))
    toward = recording.scene.cameras[c].eye_world - middle
    axis.view_init(elev=12, azim=float(np.degrees(np.arctan2(toward[1], toward[0]))) + 40)
    axis.set_box_aspect((1, 1, 1), zoom=0.88)
    axis.legend(loc="upper left", fontsize=9)
