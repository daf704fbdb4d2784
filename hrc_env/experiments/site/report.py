"""The report of the site study: tables, and the paper's figures 3 and 4 with the study's data."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from hrc_env.config import HRCConfig
from hrc_env.core.batching import one
from hrc_env.core.typing import Floats
from hrc_env.experiments.plots import label_axes, make_figure, save
from hrc_env.experiments.report import Metrics, Report, Table, format_picture
from hrc_env.experiments.rigs import CAMERA_LABELS, MULTI
from hrc_env.experiments.site.declaration import QUESTION, TITLE
from hrc_env.experiments.site.walk import walk
from hrc_env.geometry.cameras import pinhole, project
from hrc_env.scene.build import Scene, build
from hrc_env.scene.render import PictureRenderer

ABOVE_PX, VIEW_PX = (1100, 1100), (960, 540)
"""Sizes of the picture from above and of the cameras' pictures, (width, height) [px]."""
LIMIT_M = 10.0
"""Half the side of the site [m]."""


def make_site() -> Scene:
    """Return the paper's site with its four cameras."""
    return build(HRCConfig().scene, "site", 1)


def make_report(
    figures: Path,
    estimators: tuple[str, ...],
    films: Mapping[int, Mapping[str, Any]],
    tables: Sequence[Table],
    metrics: Metrics,
) -> Report:
    """Draw the figures and return the report.

    Args:
        figures: folder of the figures.
        estimators: estimators whose paths are drawn.
        films: films by seed.
        tables: tables of the report, beginning with that of errors.
        metrics: metrics by name.
    """
    seed, film = next(iter(films.items()))
    scene, truth = make_site(), np.asarray(film["truth"], float)
    draw_place(figures / "figure_3.png", scene, seed, truth)
    paths = []
    for name in estimators:
        rows = {c: film["rows"][f"alone.{name}.{c}"] for c in CAMERA_LABELS}
        heads = {c: np.where(np.c_[row["tracked"]], row["head"], np.nan) for c, row in rows.items()}
        path = figures / f"figure_4_{name}.png"
        draw_paths(path, scene, name, truth, heads)
        paths.append(
            format_picture(path, f"The paper's figure 4: the first walk from above, `{name}`.")
        )
    first, *others = (table.to_markdown(metrics) for table in tables)
    place = format_picture(
        figures / "figure_3.png", "The paper's figure 3: our site, and the views of its cameras."
    )
    return Report(TITLE, QUESTION, (place, first, *paths, *others))


def draw_place(path: Path, scene: Scene, seed: int, path_world: Floats) -> None:
    """Draw the site from above with its cameras and the first walk, and the view from each camera.

    Args:
        path: picture file to write.
        scene: the site.
        seed: seed of the walk.
        path_world: path of the head (T, 3) [m].
    """
    above = pinhole("above", np.array([0, 0, 36.0]), np.zeros(3), 37.0, *ABOVE_PX)
    worker = one(walk(scene, seed, 60, HRCConfig().ctrl_dt), 59)
    figure = make_figure(15, 7.0)
    grid = figure.add_gridspec(2, 3, width_ratios=(1.4, 1.0, 1.0))
    axes = [figure.add_subplot(grid[:, 0])]
    axes += [figure.add_subplot(grid[k // 2, 1 + k % 2]) for k in range(4)]
    titles = ("(a) the site from above, with the first walk", *(f"(b) camera {k}" for k in "1234"))
    sizes = (ABOVE_PX, *[VIEW_PX] * 4)
    for axis, camera, size, title in zip(axes, (above, *scene.cameras), sizes, titles, strict=True):
        renderer = PictureRenderer(scene, *size)
        axis.imshow(np.array(renderer.picture(scene.home_q, worker, camera), np.uint8))
        renderer.close()
        axis.set_title(title, fontsize=13)
        axis.axis("off")
    px = project(above.P[None], path_world[None])[0][0, 0]
    axes[0].plot(*px.T, color="#ffd600", linewidth=2.5, label="path of the head")
    places = np.stack([camera.eye_world for camera in scene.cameras])
    px = project(above.P[None], places[None])[0][0, 0]
    axes[0].plot(*px.T, "s", color="#ff1744", markersize=11, label="cameras, at 5 m")
    for k, place in enumerate(px):
        axes[0].annotate(f"{k + 1}", place, color="white", ha="center", va="center")
    axes[0].legend(loc="upper center", bbox_to_anchor=(0.5, 0.0), ncols=2, fontsize=11)
    axes[0].set(xlim=(0, ABOVE_PX[0]), ylim=(ABOVE_PX[1], 0))
    save(figure, path)


def draw_paths(
    path: Path, scene: Scene, estimator: str, truth: Floats, heads: Mapping[str, Floats]
) -> None:
    """Draw the head's path in the first walk from above, for each camera alone and for all.

    Args:
        path: picture file to write.
        scene: the site.
        estimator: name of the estimator.
        truth: true path (T, 3) [m].
        heads: estimated paths (T, 3) [m], by the cameras used.
    """
    figure = make_figure(16, 3.7)
    eyes = np.stack([camera.eye_world for camera in scene.cameras])
    panels = zip(figure.subplots(1, 5, sharey=True), heads.items(), range(5), strict=True)
    for axis, (column, head), k in panels:
        _draw_ground(axis, scene)
        axis.plot(*truth[:, :2].T, color="#111", linewidth=2.2, label="truth")
        axis.plot(*head[:, :2].T, color="#e53935", linewidth=1.3, label=estimator)
        used = eyes if column == MULTI else eyes[[k]]
        axis.plot(*used[:, :2].T, "s", color="#1565c0", markersize=9, clip_on=False)
        axis.set(xlim=(-LIMIT_M, LIMIT_M), ylim=(-LIMIT_M, LIMIT_M), aspect="equal")
        label_axes(axis, "x [m]", "" if k else "y [m]", CAMERA_LABELS[column])
    figure.axes[0].legend(loc="upper left", fontsize=10)
    save(figure, path)


def _draw_ground(axis: Axes, scene: Scene) -> None:
    """Draw the obstacles on the floor."""
    for x, y, half_x, half_y, yaw in scene.grounds.blocked:
        corner, turn_deg = (x - half_x, y - half_y), float(np.degrees(yaw))
        axis.add_patch(Rectangle(corner, 2 * half_x, 2 * half_y, angle=turn_deg,
                                 rotation_point="center", color="#cfd4dc", zorder=0))  # fmt: skip
