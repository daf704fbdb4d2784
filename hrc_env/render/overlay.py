"""Drawing of estimates, keypoints, crops, markers and text over pictures."""

from functools import lru_cache
from typing import Any, NamedTuple, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image as PillowImage
from PIL import ImageDraw, ImageFont

from hrc_env.core.records import Keypoints, PoseEstimate, Roi
from hrc_env.core.skeleton import BONES, JOINTS
from hrc_env.core.typing import Floats, Image, Points2
from hrc_env.geometry.cameras import (
    PinholeCamera,
    image_from_pinhole,
    pinhole_magnification,
    project,
)
from hrc_env.safety.shield import ACTIVE_RAD_S

Colour: TypeAlias = tuple[int, int, int]
"""Red, green and blue, from 0 to 255."""
Pixel: TypeAlias = tuple[int, int]
"""Column and row in a picture [px]."""
LEFT: Colour = (66, 165, 245)
RIGHT: Colour = (255, 138, 60)
MIDDLE: Colour = (235, 235, 235)
DETECTED: Colour = (255, 64, 96)
WINDOW: Colour = (250, 250, 120)
INK: Colour = (236, 239, 241)
PANEL: Colour = (24, 28, 34)
GOAL: Colour = (255, 214, 0)
GRID: Colour = (46, 53, 61)
ARM: Colour = (150, 158, 168)
BELIEF: Colour = (90, 230, 160)
COST: Colour = (255, 110, 120)
SHIELD: Colour = (255, 90, 60)
"""Colour of the frame and the label that indicate an active shield."""
FLOOR_M = 3
"""Half the side length of the grid on the floor [m]."""
SIDE_COLOURS = {("left", "left"): LEFT, ("right", "right"): RIGHT}
"""Colours of bones with both ends on the same side of the body; other bones are `MIDDLE`."""


class Projection(NamedTuple):
    """Points that are projected into a picture."""

    px: Points2
    """(N, 2) columns and rows [px]."""
    depth_m: Floats
    """(N,) distances along the optical axis [m]."""


def draw_estimate(
    image: Image, camera: PinholeCamera, estimate: PoseEstimate, thickness: int = 2
) -> None:
    """Draw the estimated skeletons of tracked workers, with 2-sigma ellipses of their joints.

    Args:
        image: (H, W, 3) picture of the camera, of any size with the aspect ratio of the camera's
            image; it is changed.
        camera: the camera.
        estimate: estimate of a single environment, as a batch of one.
        thickness: thickness of the lines [px].
    """
    scale = image.shape[1] / camera.width_px
    for worker in np.flatnonzero(estimate.tracked[0]):
        joints = estimate.mean_world[0, worker]
        points, depth_m = _project(image, camera, joints)
        if (depth_m < 0.1).any():
            continue
        _ellipses(image, camera, joints, estimate.cov_world[0, worker], scale)
        _draw_bones(image, points, thickness)
        _lines(image, np.stack([points[0], points[[1, 2]].mean(0)]), MIDDLE, thickness)


def draw_keypoints(image: Image, camera: PinholeCamera, keypoints: Keypoints, index: int) -> None:
    """Draw the joints detected by camera `index`; the opacity increases with the confidence."""
    scale = image.shape[1] / camera.width_px
    px = image_from_pinhole(camera, keypoints.px[0, index].reshape(-1, 2)) * scale
    known = np.isfinite(px).all(-1)
    confidence = keypoints.confidence[0, index].reshape(-1)
    _draw_joints(image, px[known], confidence[known], max(2, round(image.shape[1] / 200)))


def draw_window(image: Image, camera: PinholeCamera, window: Roi) -> None:
    """Draw the outline of a crop's window in a picture of the camera."""
    scale = image.shape[1] / camera.width_px
    box = (
        (window.centre_px[0] * scale, window.centre_px[1] * scale),
        (window.side_px * scale, window.side_px * scale),
        float(np.degrees(window.rotation_rad)),
    )
    corners = cv2.boxPoints(box)
    cv2.polylines(image, [np.round(corners * 16).astype(np.int32)], True, WINDOW, 1, cv2.LINE_AA, 4)


def draw_landmarks(image: Image, window: Roi, joints_px: Points2, confidence: Floats) -> None:
    """Draw detected joints and bones on a crop.

    Args:
        image: the crop, which is changed.
        window: the crop's window in the camera's image.
        joints_px: (J, 2) joints in the camera's image [px].
        confidence: (J,) confidences in [0, 1].
    """
    offset = (joints_px - np.array(window.centre_px)) * (image.shape[1] / window.side_px)
    c, s = np.cos(window.rotation_rad), np.sin(window.rotation_rad)
    points = offset @ np.array([[c, -s], [s, c]]) + image.shape[1] / 2
    if not np.isfinite(points).all():
        return
    _draw_bones(image, points, 1)
    _draw_joints(image, points, confidence, 3)


def draw_floor(image: Image, camera: PinholeCamera, middle: Floats) -> None:
    """Draw a grid with lines 1 m apart on the floor around a point (3,) [m]."""
    foot = np.array([middle[0], middle[1], 0.0])
    for k in range(-FLOOR_M, FLOOR_M + 1):
        line = np.array([(-FLOOR_M, k, 0), (FLOOR_M, k, 0)])
        draw_path(image, camera, foot + line, GRID, 1)
        draw_path(image, camera, foot + line[:, [1, 0, 2]], GRID, 1)


def draw_path(
    image: Image, camera: PinholeCamera, points: Floats, colour: Colour, thickness: int
) -> None:
    """Draw a polyline through points (N, 3) [m], if all are in front of the camera.

    Args:
        image: a picture of the camera, which is changed.
        camera: the camera.
        points: (N, 3) points of the polyline [m].
        colour: colour of the line.
        thickness: thickness of the line [px].
    """
    px, depth_m = _project(image, camera, points)
    if (depth_m >= 0.1).all():
        _lines(image, px, colour, thickness)


def draw_markers(image: Image, camera: PinholeCamera, markers_world: Floats) -> None:
    """Draw a ring around each point (M, 3) [m], even if objects occlude the point."""
    px, depth_m = _project(image, camera, markers_world)
    focal_px = camera.K[0, 0] * image.shape[1] / camera.width_px
    for middle, away_m in zip(_fixed(px), depth_m.tolist(), strict=True):
        if away_m >= 0.1:
            radius = max(4, round(0.05 * focal_px / away_m))
            cv2.circle(image, middle, radius * 16, GOAL, 2, cv2.LINE_AA, 4)
            cv2.circle(image, middle, 2 * 16, GOAL, -1, cv2.LINE_AA, 4)


def draw_shield(image: Image, change_rad_s: float) -> None:
    """Draw a frame and a label if the shield is active, by its change of the command [rad/s]."""
    if change_rad_s > ACTIVE_RAD_S:
        height, width = image.shape[:2]
        thickness = max(2, width // 240)
        cv2.rectangle(image, (0, 0), (width - 1, height - 1), SHIELD, thickness)
        size = max(12, width // 60)
        text = f"shield: {change_rad_s:.1f} rad/s"
        corner = width - text_width(text, size) - 2 * size, height - 3 * size
        write(image, text, corner, size, SHIELD)


def label(image: Image, text: str, corner: Pixel, size: int = 16, colour: Colour = INK) -> None:
    """Draw text on a dark background.

    Args:
        image: the picture, which is changed.
        text: the text.
        corner: upper left corner of the background.
        size: size of the font [px].
        colour: colour of the text.
    """
    x, y = corner[0], corner[1]
    pad, (_, _, right, bottom) = max(3, size // 4), _font(size).getbbox(text)
    plate = image[y : y + round(bottom) + 2 * pad, x : x + round(right) + 2 * pad]
    plate[:] = (0.35 * plate + 0.65 * np.array(PANEL)).astype(np.uint8)
    write(image, text, (x + pad, y + pad), size, colour)


def write(image: Image, text: str, corner: Pixel, size: int = 16, colour: Colour = INK) -> None:
    """Draw text in a picture.

    Args:
        image: the picture, which is changed.
        text: the text.
        corner: upper left corner of the text.
        size: size of the font [px].
        colour: colour of the text.
    """
    x, y = corner[0], corner[1]
    ink = _ink(text, size)
    patch = image[y : y + ink.shape[0], x : x + ink.shape[1]]
    ink = ink[: patch.shape[0], : patch.shape[1]]
    patch[:] = patch + ink * (np.array(colour, np.float32) - patch)


def text_width(text: str, size: int = 16) -> int:
    """Return the width of a text [px]."""
    return round(_font(size).getbbox(text)[2])


def panel(width: int, height: int) -> Image:
    """Return a uniformly dark picture."""
    return np.full((height, width, 3), PANEL, np.uint8)


def tile(pictures: list[Image], columns: int, gap: int = 4) -> Image:
    """Return a mosaic of pictures of equal size, in rows with dark gaps between them."""
    height, width = pictures[0].shape[:2]
    rows = -(-len(pictures) // columns)
    sheet = panel(columns * (width + gap) - gap, rows * (height + gap) - gap)
    for k, picture in enumerate(pictures):
        y, x = (k // columns) * (height + gap), (k % columns) * (width + gap)
        sheet[y : y + height, x : x + width] = picture
    return sheet


def shrink(image: NDArray[Any], width: int, height: int) -> Image:
    """Reduce the size of an image; each new pixel is the mean of the original ones."""
    return np.asarray(cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA), np.uint8)


def middle_rows(image: Image, height: int) -> Image:
    """Return the middle `height` rows of an image."""
    top = (image.shape[0] - height) // 2
    return image[top : top + height]


def _project(image: Image, camera: PinholeCamera, points: Floats) -> Projection:
    """Project points (N, 3) [m] into a picture of a camera."""
    px, depth_m = project(camera.P[None], points[None])
    scale = image.shape[1] / camera.width_px
    return Projection(image_from_pinhole(camera, px[0, 0]) * scale, depth_m[0, 0])


def _ellipses(
    image: Image, camera: PinholeCamera, joints: Floats, covariances: Floats, scale: float
) -> None:
    """Draw the 2-sigma ellipses of joints, by linearized projections of their covariances.

    Args:
        image: a picture of the camera, which is changed.
        camera: the camera.
        joints: (J, 3) positions of the joints [m].
        covariances: (J, 3, 3) covariances of the joints [m^2].
        scale: ratio of the picture's size to that of the camera's image.
    """
    R_cam_from_world = camera.T_world_from_cam[:3, :3].T
    x, y, z = ((joints - camera.eye_world) @ R_cam_from_world.T).T
    one, none = np.ones_like(z), np.zeros_like(z)
    local = np.stack([np.stack([one, none, -x / z], -1), np.stack([none, one, -y / z], -1)], 1)
    J = (camera.K[0, 0] * scale / z)[:, None, None] * local @ R_cam_from_world
    values, vectors = np.linalg.eigh(J @ covariances @ J.transpose(0, 2, 1))
    pinhole_px = camera.K[:2, 2] + camera.K[0, 0] * np.stack([x, y], -1) / z[:, None]
    magnification = np.reshape(pinhole_magnification(camera, pinhole_px), (-1, 1))
    axes = 2 * np.sqrt(np.maximum(values, 0.25)) / magnification
    angles = np.degrees(np.arctan2(vectors[:, 1, 1], vectors[:, 0, 1]))
    centres = image_from_pinhole(camera, pinhole_px) * scale
    covered = image.copy()
    for j in np.flatnonzero((axes.max(-1) <= 4 * image.shape[1]) & np.isfinite(centres).all(-1)):
        centre = int(centres[j, 0]), int(centres[j, 1])
        radii = max(1, round(axes[j, 1])), max(1, round(axes[j, 0]))
        cv2.ellipse(covered, centre, radii, angles[j], 0, 360, BELIEF, -1, cv2.LINE_AA)
    image[:] = cv2.addWeighted(covered, 0.35, image, 0.65, 0)


def _draw_bones(image: Image, points: Points2, thickness: int) -> None:
    """Draw the bones between joints (J, 2) [px]."""
    pixels = _fixed(points)
    for first, second in BONES[:-2]:
        sides = JOINTS[first].split("_")[0], JOINTS[second].split("_")[0]
        colour = SIDE_COLOURS.get(sides, MIDDLE)
        cv2.line(image, pixels[first], pixels[second], colour, thickness, cv2.LINE_AA, 4)


def _draw_joints(image: Image, points: Points2, confidence: Floats, radius: int) -> None:
    """Draw joints (N, 2) [px], with an opacity that increases with the confidence (N,)."""
    for pixel, share_sure in zip(_fixed(points), confidence.tolist(), strict=True):
        share = 0.35 + 0.65 * share_sure
        colour = [round(p + share * (q - p)) for p, q in zip(PANEL, DETECTED, strict=True)]
        cv2.circle(image, pixel, radius * 16, colour, -1, cv2.LINE_AA, 4)


def _lines(image: Image, points: Points2, colour: Colour, thickness: int) -> None:
    """Draw a polyline through points (N, 2) [px]."""
    pixels = np.array(_fixed(points), np.int32)
    cv2.polylines(image, [pixels], False, colour, thickness, cv2.LINE_AA, 4)


def _fixed(points: Points2) -> list[Pixel]:
    """Convert points (N, 2) to OpenCV's units: 1/16 px from the centre of the first pixel."""
    limited = np.clip(points - 0.5, -30000, 30000)
    return [(x, y) for x, y in np.round(limited * 16).astype(int).tolist()]


@lru_cache(maxsize=256)
def _ink(text: str, size: int) -> NDArray[np.float32]:
    """Return the opacity (H, W, 1) of a text, from 0 to 1."""
    font = _font(size)
    _, _, right, bottom = font.getbbox(text)
    drawn = PillowImage.new("L", (round(right) + 2, round(bottom) + 2))
    ImageDraw.Draw(drawn).text((0, 0), text, fill=255, font=font)
    return np.asarray(drawn, np.float32)[..., None] / np.float32(255)


@lru_cache(maxsize=16)
def _font(size: int) -> ImageFont.FreeTypeFont:
    """Return the font DejaVu Sans, which is part of matplotlib."""
    from matplotlib import get_data_path

    return ImageFont.truetype(f"{get_data_path()}/fonts/ttf/DejaVuSans.ttf", size)
