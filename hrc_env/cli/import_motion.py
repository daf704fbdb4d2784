"""Import a recording of a person as a clip that workers play."""

import math
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import tyro
from rich.console import Console
from rich.table import Table

from hrc_env.cli.checks import check_writable_file
from hrc_env.core.errors import ConfigError
from hrc_env.core.progress import progress_bar
from hrc_env.core.skeleton import JOINTS

if TYPE_CHECKING:  # --help imports no simulator
    from hrc_env.core.typing import Image
    from hrc_env.mocap.record import Capture
    from hrc_env.mocap.retarget import RetargetError
    from hrc_env.motion.clip import Clip

USUAL_FPS = 60.0
"""Frame rate to which faster recordings are resampled [1/s]; a walking step has about 30 frames."""
TILE = (300, 400)
N_MOMENTS, COLUMNS = 12, 6
STAGE_M = (0.9, 0.3)
"""Horizontal position x, y at which the worker is shown in every picture of the film strip [m]."""
EYE_M = (1.4, -1.7, 1.35)
"""Position of the camera: x and y relative to the worker, z above the floor [m]."""
TARGET_Z_M = 0.95
"""Height of the point at which the camera is aimed [m]."""
HFOV_DEG = 44.0
"""Horizontal field of view of the camera [deg]."""


@dataclass(frozen=True)
class ImportMotion:
    """Convert a motion-capture recording (BVH, ASF/AMC or npz) into a clip that workers play.

    Units, the upward axis, a T-pose in the first frame, short gaps and swapped axes are detected,
    corrected and reported; a recording that cannot be repaired is rejected with the reason. A
    worker's body is fitted to the joints, standing feet are fixed to the floor, and the error of
    each joint is printed. docs/motion_capture.md lists the joint names that are recognized.
    """

    file: tyro.conf.Positional[Path]
    """Recording: .bvh, .amc (with its .asf in the same folder), or .npz with joints (T, 15, 3) and
    fps."""
    out: Path
    """File (.npz) to which the clip is written; an interrupted run leaves no partial file."""
    fps: float | None = None
    """Frame rate of the clip [1/s] (default: that of the recording, at most 60)."""
    source_fps: float | None = None
    """True frame rate of the recording [1/s], for files without a frame rate (AMC) or with a wrong
    one."""
    skeleton: Path | None = None
    """Skeleton file (.asf) of an .amc recording, if it is not in the same folder."""
    joint: tyro.conf.UseAppendAction[tuple[str, ...]] = ()
    """Assignment of a joint to its name in the file if that name is not recognized, such as
    left_shoulder=lShldr; or a TOML file with such lines. The option may be repeated."""
    up: str | None = None
    """Upward axis of the file, if it is not recognized: --up=+x, -x, +y, -y, +z or -z."""
    allow_off_floor: bool = False
    """Accept recordings with feet that are not on one level floor: on stairs or terrain, in the air
    for long, or above the floor because the right .asf file is missing. The clip is played as if
    the floor were level."""
    worker: str = "worker_1"
    """Name of the body model to which the recording is fitted. Workers with other bodies can also
    play the clip, scaled to the lengths of their legs and arms."""
    picture: Path | None = None
    """PNG file to which a film strip of the clip is also drawn (needs OpenGL)."""

    def run(self) -> int:
        """Read and fit the recording, print the errors and write the clip; return the status."""
        check_writable_file(self.out, ".npz")
        if self.out.resolve() == self.file.resolve():
            raise ConfigError(
                "--out is the path of the recording itself; choose another path for the clip."
            )
        if self.picture is not None:
            check_writable_file(self.picture, ".png", "--picture")
        from hrc_env.mocap.retarget import retarget
        from hrc_env.motion import fit
        from hrc_env.motion.clip import save_clip
        from hrc_env.scene.build import all_grounds
        from hrc_env.worker.body import ANY, load_body

        body, console = load_body(self.worker), Console()
        capture = self._read(self.fps)
        if self.fps is None and capture.fps > USUAL_FPS:
            capture = self._read(USUAL_FPS)
        print_capture(console, capture)
        name = f"fitting {self.worker}"
        with progress_bar(console, name) as say:
            clip, error = retarget(capture, body, lambda share: say(share, name))
        print_error(console, capture, clip, error)
        played = fit.measure_played_s(clip, all_grounds(), ANY)
        save_clip(clip, self.out)
        ready = f"play it with motions=[{str(self.out)!r}]. " if any(played.values()) else ""
        console.print(f"In [bold]{self.out}[/]: {ready}{fit.describe_fit(clip, played)}")
        if self.picture is not None:
            import imageio.v2 as imageio

            self.picture.parent.mkdir(parents=True, exist_ok=True)
            imageio.imwrite(self.picture, _draw_film_strip(clip, self.worker))
            console.print(f"In [bold]{self.picture}[/]: a film strip")
        return 0

    def _read(self, fps: float | None) -> "Capture":
        from hrc_env.mocap.names import read_joint_names
        from hrc_env.mocap.read import read_recording

        return read_recording(
            self.file, fps, self.source_fps, self.skeleton, self.allow_off_floor,
            read_joint_names(self.joint), self.up,
        )  # fmt: skip


def print_capture(console: Console, capture: "Capture") -> None:
    """Print the length and frame rate of a recording, and the repairs that were made."""
    n_frames = len(capture.joints_world)
    text = f"[bold]{capture.source}[/]: {n_frames} frames at {capture.fps:g} Hz, "
    console.print(text + f"{(n_frames - 1) / capture.fps:.1f} s", highlight=False)
    for sentence in capture.notes:
        console.print(f"[yellow]Repaired:[/] {sentence}", highlight=False)


def print_error(console: Console, capture: "Capture", clip: "Clip", error: "RetargetError") -> None:
    """Print each joint's name in the file and its distance between the fit and the recording."""
    table = Table("joint", "in the file", "mean [cm]", "p95 [cm]", title="worker beside person")
    joints = zip(JOINTS, capture.node_names, 100 * error.mean_m, 100 * error.p95_m, strict=True)
    for joint, name, mean_cm, p95_cm in joints:
        table.add_row(joint, name, f"{mean_cm:.1f}", f"{p95_cm:.1f}")
    table.add_section()
    overall = 100 * error.mean_m.mean(), 100 * error.p95_m.mean()
    table.add_row("all", "", *(f"{value:.1f}" for value in overall))
    left, right = 100 * clip.contacts.mean(0)
    slide = f"standing feet slide by {100 * error.slip_m_s:.1f} cm/s (p95)."
    console.print(
        table,
        f"Errors after a single alignment of the whole clip (scale {error.scale:.2f}).",
        f"The left foot stands {left:.0f} % of the time, the right one {right:.0f} %; "
        + ("no foot stands flat and still." if math.isnan(error.slip_m_s) else slide),
        sep="\n", highlight=False,
    )  # fmt: skip


def _draw_film_strip(clip: "Clip", worker: str) -> "Image":
    """Return an image of a clip's poses at equal time intervals, each labelled with its time."""
    import numpy as np  # here: --help imports no simulator

    from hrc_env.core.records import WorkerMotion
    from hrc_env.geometry.cameras import pinhole
    from hrc_env.mocap.poses import pose_segments
    from hrc_env.motion import controls as c
    from hrc_env.motion.anatomy import measure_body
    from hrc_env.motion.clip import scale_clip
    from hrc_env.render import overlay
    from hrc_env.scene.build import SceneConfig, build
    from hrc_env.scene.render import PictureRenderer
    from hrc_env.worker.body import load_body

    scene = build(SceneConfig(), "lab", 1, worker)
    bones = measure_body(load_body(worker))
    eye = np.array([STAGE_M[0] + EYE_M[0], STAGE_M[1] + EYE_M[1], EYE_M[2]])
    target = np.array([*STAGE_M, TARGET_Z_M])
    camera = pinhole("strip", eye, target, HFOV_DEG, *TILE)
    rows = np.linspace(0, len(clip.controls) - 1, N_MOMENTS).astype(int)
    q = scale_clip(clip, bones.lengths)[rows]
    shift = np.array(STAGE_M) - q[:, [c.ROOT_X, c.ROOT_Y]]
    for at in (c.ROOT_X, c.ANKLE, c.ANKLE + 6):
        q[:, at : at + 2] += shift
    position, turn, _ = pose_segments(q, bones)
    still = np.zeros((1, *position.shape[1:]))
    tiles = []
    with closing(PictureRenderer(scene, *TILE)) as renderer:
        for k, row in enumerate(rows):
            motion = WorkerMotion(position[k : k + 1], turn[k : k + 1], still, still)
            tile = np.array(renderer.picture(scene.home_q, motion, camera), np.uint8)
            overlay.label(tile, f"{row / clip.fps:.1f} s", (6, 6), 14)
            tiles.append(tile)
    return overlay.tile(tiles, COLUMNS)
