"""Frames of videos, which show the scene, four cameras, the belief and the separation."""

from collections.abc import Mapping
from typing import TypeAlias

import cv2
import numpy as np

from hrc_env.core.declared import Records1, dtype_of
from hrc_env.core.typing import Floats, Image
from hrc_env.pipeline.levels import CAMERA_LEVELS
from hrc_env.render import overlay
from hrc_env.render.views import Glance, Views

WIDTH = 1600
"""Width of a frame [px]."""
HEIGHT = 900
"""Height of a frame [px]."""
ROOM = (792, 716)
"""Width and height of the picture of the scene in a frame [px]."""
TILE = (400, 225)
"""Width and height of a camera's picture in a frame [px]."""
RIGHT_X = WIDTH - 2 * TILE[0] - 4
"""Left edge of the pictures in the right part of a frame [px]."""
TITLE_Y = 2 * TILE[1] + 22
"""Upper edge of the title in the right part of a frame [px]."""
CROP = 196
"""Side of a crop of a camera's image in a frame [px]."""
BELIEF = (400, 214)
"""Width and height of a picture of the belief in a frame [px]."""
LEGEND_HEIGHT = 28
"""Height of the legend of colours [px]."""
STRIP_HEIGHT = 180
"""Height of the strip with the curves at the bottom of a frame [px]."""
STRIP_S = 10.0
"""Length of the time axis of the strip [s]."""
FAR_M = 1.5
"""Maximum of the distance axis of the strip [m]."""
LEFT, RIGHT, TOP, BOTTOM = 290, WIDTH - 20, 14, STRIP_HEIGHT - 14
"""Left, right, upper and lower edges of the curves' area in the strip [px]."""
NEAR = (150, 30, 40)
"""Colour of steps with a cost above 0 and below 2."""
TOUCHING = (255, 40, 60)
"""Colour of steps with a cost of 2 or more."""


class Moment:
    """Values of one step that are plotted in the strip."""

    true_m: float
    """True separation [m]."""
    estimated_m: float
    """Separation estimated from the robot's belief [m]."""
    error_m: float
    """Error of the tracked joints [m]; NaN without a track."""
    cost: float
    """Cost of the step."""


MOMENT = dtype_of(Moment)
Diary: TypeAlias = Records1[Moment]
"""Moments of an episode (T,), one for each step."""


def compose(
    views: Views, diary: Diary, counts: Mapping[str, float], seen: Glance | None = None
) -> Image:
    """Return a frame (900, 1600, 3) with scene, cameras, crops or belief, and strip.

    Args:
        views: views of the simulation, which may have advanced since `seen`.
        diary: (T,) moments of the episode up to the frame.
        counts: numbers of successful and failed attempts up to the frame.
        seen: copy of the state that the frame shows; None for the present state.
    """
    seen = seen or views.glance()
    level, config = views.simulation.perception, views.simulation.config
    frame = _panel(HEIGHT, WIDTH)
    if level == "pixels":
        title = "input of the pose network: crops around the predicted worker"
        pictures = views.crops(CROP, seen)[:4]
    else:
        title = f"estimate (perception: {level}), from above and from the side"
        pictures = views.beliefs(*BELIEF, seen)
    overlay.write(frame, title, (RIGHT_X + 4, TITLE_Y), 16)
    room = views.room(*ROOM, seen)
    overlay.label(room, "scene", (10, 10), 18)
    foot = room[-LEGEND_HEIGHT:]
    cv2.addWeighted(foot, 0.25, legend(level), 0.75, 0, dst=foot)
    _paste(frame, room, (0, 0))
    for k, view in enumerate(views.cameras(*TILE, seen)[:4]):
        _paste(frame, view, (RIGHT_X + k % 2 * (TILE[0] + 4), k // 2 * (TILE[1] + 4)))
    for k, picture in enumerate(pictures):
        _paste(frame, picture, (RIGHT_X + k * (picture.shape[1] + 4), TITLE_Y + 30))
    _paste(frame, strip(diary, counts, config.ctrl_dt, config.cost.proximity_m), (0, 720))
    return frame


def legend(level: str) -> Image:
    """Return a legend (28, 792, 3) of the colours that are used at a perception level."""
    image = _panel(LEGEND_HEIGHT, ROOM[0])
    marks = [
        ("worker's left", overlay.LEFT, "line"),
        ("right", overlay.RIGHT, "line"),
        ("estimate, 2 sigma", overlay.BELIEF, "dot"),
        ("goal", overlay.GOAL, "ring"),
        ("detected joint", overlay.DETECTED, "dot"),
        ("crop", overlay.WINDOW, "box"),
    ]
    n_shown = 6 if level == "pixels" else 5 if level in CAMERA_LEVELS else 4
    x, y = 12, LEGEND_HEIGHT // 2
    for text, colour, shape in marks[:n_shown]:
        if shape == "line":
            cv2.line(image, (x, y), (x + 18, y), colour, 3, cv2.LINE_AA)
        elif shape == "box":
            cv2.rectangle(image, (x + 2, y - 6), (x + 14, y + 6), colour, 1)
        else:
            cv2.circle(image, (x + 9, y), 6, colour, -1 if shape == "dot" else 2, cv2.LINE_AA)
        overlay.write(image, text, (x + 26, y - 9), 14)
        x += 26 + overlay.text_width(text, 14) + 20
    return image


def strip(diary: Diary, counts: Mapping[str, float], dt_s: float, limit_m: float) -> Image:
    """Return the strip, a plot of the true and estimated separation and the cost of recent steps.

    Args:
        diary: (T,) moments of the episode.
        counts: numbers of successful and failed attempts.
        dt_s: duration of a step [s].
        limit_m: separation below which a step has a cost [m].
    """
    image = _axes(limit_m)
    n_shown = round(STRIP_S / dt_s)
    shown = diary[-n_shown:]
    x = np.round(LEFT + (RIGHT - LEFT) * np.arange(len(shown)) / n_shown).astype(int)
    for left, cost in zip(x.tolist(), shown["cost"].tolist(), strict=True):
        if cost > 0:
            colour = NEAR if cost < 2 else TOUCHING
            cv2.rectangle(image, (left, TOP), (left + 6, BOTTOM), colour, -1)
    for name, colour in (("true_m", overlay.INK), ("estimated_m", overlay.BELIEF)):
        points = np.stack([x, _y_of(shown[name])], -1).astype(np.int32)
        cv2.polylines(image, [points], False, colour, 2, cv2.LINE_AA)
    for row, (name, count) in enumerate(counts.items()):
        overlay.write(image, f"{name}: {count:.0f}", (14, 100 + 20 * row), 15, overlay.GOAL)
    overlay.write(image, f"cost: {diary['cost'].sum():.0f}", (14, 142), 15, overlay.COST)
    overlay.write(image, f"{len(diary) * dt_s:.1f} s", (140, 142), 15)
    return image


def _axes(limit_m: float) -> Image:
    """Return the background and the axes of the strip, without curves."""
    image = _panel(STRIP_HEIGHT, WIDTH)
    for metres in (0.0, 0.5, 1.0, 1.5):
        y = int(_y_of(np.array(metres)))
        cv2.line(image, (LEFT, y), (RIGHT, y), (60, 66, 74), 1)
        overlay.write(image, f"{metres:.1f} m", (LEFT - 52, y - 9), 14)
    y = int(_y_of(np.array(limit_m)))
    cv2.line(image, (LEFT, y), (RIGHT, y), (190, 70, 80), 1)
    overlay.write(image, "separation", (14, 10), 18)
    overlay.write(image, "true", (14, 36), 15)
    overlay.write(image, "estimated", (14, 56), 15, overlay.BELIEF)
    overlay.write(image, "bar: step with cost", (14, 76), 15, overlay.COST)
    return image


def _y_of(metres: Floats) -> Floats:
    """Return the pixel rows of distances [m] in the strip [px]."""
    return np.round(BOTTOM - (BOTTOM - TOP) * np.clip(metres, 0, FAR_M) / FAR_M)


def _panel(height: int, width: int) -> Image:
    """Return a uniformly dark picture."""
    return np.full((height, width, 3), overlay.PANEL, np.uint8)


def _paste(frame: Image, picture: Image, corner: overlay.Pixel) -> None:
    """Copy a picture into a frame, with its upper left corner at the pixel `corner`."""
    x, y = corner[0], corner[1]
    frame[y : y + picture.shape[0], x : x + picture.shape[1]] = picture
