"""Figures 3 and 4 of the paper, from our own data, and the table as a picture."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from hrc_env.core.batching import one
from hrc_env.core.records import WorkerMotion
from hrc_env.core.results import Metric
from hrc_env.core.typing import Floats
from hrc_env.experiments.site.metrics import Parts
from hrc_env.experiments.site.rows import MULTI
from hrc_env.geometry.cameras import pinhole, project
from hrc_env.scene.build import Scene
from hrc_env.scene.render import PictureRenderer

PAPER_RMSE_M = {
    "camera_1": 6.771, "camera_2": 3.763, "camera_3": 5.630, "camera_4": 12.814, MULTI: 0.133,
}  # fmt: skip
"""What the paper reports; its unit is not printed, metres are meant."""
COLUMNS = (*(f"camera_{k + 1}" for k in range(4)), MULTI)
COLOURS = ("#1565c0", "#e65100", "#2e7d32", "#6a1b9a", "#455a64", "#ad1457")
ABOVE_PX = (1100, 1100)
VIEW_PX = (960, 540)
LIMIT_M = 10.0


def draw_figures(
    folder: Path,
    scene: Scene,
    parts: Parts,
    metrics: Mapping[str, Metric],
    motions: WorkerMotion,
) -> None:
    """Write figure_3.png, figure_4_<estimator>.png and rmse.png; `motions` of the first walk."""
    folder.mkdir(parents=True, exist_ok=True)
    film = next(iter(parts.films.values()))
    path_world = np.asarray(film["truth"], float)
    draw_place(folder / "figure_3.png", scene, motions, path_world)
    for estimator in parts.estimators:
        draw_paths(folder / f"figure_4_{estimator}.png", scene, parts, estimator)
    draw_table(folder / "rmse.png", (*parts.estimators, *parts.also), metrics)


def draw_place(path: Path, scene: Scene, motions: WorkerMotion, path_world: Floats) -> None:
    """The site from above with cameras and the first walk, and what each camera sees of it."""
    above = pinhole("above", np.array([0, 0, 36.0]), np.zeros(3), 37.0, *ABOVE_PX)
    worker = one(motions, len(motions.position_world) - 1)
    views = [(above, ABOVE_PX)] + [(camera, VIEW_PX) for camera in scene.cameras]
    images = []
    for camera, size in views:
        renderer = PictureRenderer(scene, *size)
        images.append(np.array(renderer.picture(scene.home_q, worker, camera), np.uint8))
        renderer.close()
    figure = Figure(figsize=(15, 7.2), layout="constrained")
    grid = figure.add_gridspec(2, 4, width_ratios=(1, 1, 1, 1))
    left = figure.add_subplot(grid[:, :2])
    left.imshow(images[0])
    px = project(above.P[None], path_world[None])[0][0, 0]
    left.plot(px[:, 0], px[:, 1], color="#ffd600", linewidth=2.5, label="the head's way")
    places = np.stack([camera.eye_world for camera in scene.cameras])
    eyes = project(above.P[None], places[None])[0][0, 0]
    left.plot(*eyes.T, "s", color="#ff1744", markersize=11, label="cameras, 5 m high")
    for k, (x, y) in enumerate(eyes):
        left.annotate(
            f"{k + 1}", (x, y), color="white", fontsize=9, ha="center", va="center", weight="bold"
        )
    left.legend(loc="upper center", bbox_to_anchor=(0.5, 0.0), ncols=2, fontsize=11)
    left.set(xlim=(0, ABOVE_PX[0]), ylim=(ABOVE_PX[1], 0))
    left.set_title("(a) the site from above, with the first walk", fontsize=13)
    for k in range(4):
        axis = figure.add_subplot(grid[k // 2, 2 + k % 2])
        axis.imshow(images[1 + k])
        axis.set_title(f"(b) camera {k + 1}", fontsize=12)
        axis.axis("off")
    left.axis("off")
    _save(figure, path)


def draw_paths(path: Path, scene: Scene, parts: Parts, estimator: str) -> None:
    """The first walk's head from above, truth against estimate: a panel a camera, one for all."""
    film = next(iter(parts.films.values()))
    truth = np.asarray(film["truth"], float)
    figure = Figure(figsize=(16, 4.2), layout="constrained")
    for axis, column in zip(figure.subplots(1, 5, sharey=True), COLUMNS, strict=True):
        _draw_ground(axis, scene)
        head = np.asarray(film["rows"][f"{estimator}.{column}"]["head"], float)
        axis.plot(truth[:, 0], truth[:, 1], color="#111", linewidth=2.2, label="truth")
        axis.plot(head[:, 0], head[:, 1], color="#e53935", linewidth=1.3, label=estimator)
        used = range(4) if column == MULTI else [COLUMNS.index(column)]
        for k in used:
            x, y, _ = scene.cameras[k].eye_world
            axis.plot(x, y, "s", color="#1565c0", markersize=9, clip_on=False)
        axis.set(xlim=(-LIMIT_M, LIMIT_M), ylim=(-LIMIT_M, LIMIT_M), aspect="equal", xlabel="x [m]")
        axis.set_title(spoken(column), fontsize=13)
    figure.axes[0].set_ylabel("y [m]", fontsize=12)
    figure.axes[0].legend(loc="upper left", fontsize=10)
    _save(figure, path)


def draw_table(path: Path, estimators: tuple[str, ...], metrics: Mapping[str, Metric]) -> None:
    """RMSE with intervals, beside the paper's."""
    figure = Figure(figsize=(10, 5), layout="constrained")
    axis = figure.subplots()
    places = np.arange(len(COLUMNS))
    values = [PAPER_RMSE_M[column] for column in COLUMNS]
    axis.plot(places - 0.3, values, "*", color="#111", markersize=13, label="the paper reports")
    for k, estimator in enumerate(estimators):
        found = [metrics[f"rmse_m.{estimator}.{column}"] for column in COLUMNS]
        values = np.array([each.value for each in found])
        ends = np.array([[each.low for each in found], [each.high for each in found]])
        axis.errorbar(
            places - 0.15 + 0.13 * k, values, np.abs(ends - values), fmt="o", capsize=4,
            color=COLOURS[k % len(COLOURS)], label=estimator,
        )  # fmt: skip
    axis.set_yscale("log")
    axis.set_xticks(
        places, [column.replace("_", " ").replace(MULTI, "all four") for column in COLUMNS]
    )
    axis.set_ylabel("RMSE of the head [m], log scale", fontsize=12)
    axis.grid(axis="y", which="both", alpha=0.25)
    axis.legend(fontsize=11)
    _save(figure, path)


def spoken(column: str) -> str:
    """`camera_1` and `multi` in words."""
    return "all four" if column == MULTI else column.replace("_", " ")


def _draw_ground(axis: Axes, scene: Scene) -> None:
    """What stands on the floor."""
    for x, y, half_length, half_width, yaw in scene.grounds.blocked:
        corners = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * [half_length, half_width]
        c, s = np.cos(yaw), np.sin(yaw)
        axis.add_patch(
            Polygon(corners @ np.array([[c, s], [-s, c]]) + [x, y], color="#cfd4dc", zorder=0)
        )


def _save(figure: Figure, path: Path) -> None:
    FigureCanvasAgg(figure)
    figure.savefig(path, dpi=110)
