"""Make the pictures of README and docs: python -m docs.make_pictures

demo.webp     the film of `python -m hrc_env demo`
loop.jpg      its still
room.jpg      the lab from beside and from outside
site.jpg      the construction site
site_work.jpg  people at work on it
workers.jpg   three workers of different bodies on it
faults.jpg    what faults do to an image
appearance.jpg  both scenes as they were built, and in five looks
cameras.jpg   the laboratory through a pinhole and through the paper's GoPro
ID.webp       an episode of the scripted agent in each environment, beside one worker or more
clip.jpg      a film strip of a walk that was written to a BVH file and imported

Those with measurements in them come from the studies of `benchmarks/results.py`.
"""

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import gymnasium
import imageio.v2 as imageio
import numpy as np
from PIL import Image

from benchmarks.gallery.still import views
from hrc_env.agents.env_info import env_info
from hrc_env.agents.experts import make_expert
from hrc_env.core.batching import copy_arrays
from hrc_env.core.records import Roi
from hrc_env.env import HRCEnv
from hrc_env.geometry.cameras import pinhole, project, projections
from hrc_env.perception.faults.camera_film import CameraFilm, ScenePose, Shot
from hrc_env.perception.faults.fault import IMAGE, KINDS, FaultConfig
from hrc_env.perception.faults.schedule import Schedule
from hrc_env.perception.lenses import LensRenderer
from hrc_env.perception.windows import window_from_joints
from hrc_env.render.overlay import label, middle_rows, shrink, tile
from hrc_env.scene.domain_randomization import VARIED, draw_look
from hrc_env.scene.render import CropRenderer, PictureRenderer
from hrc_env.tasks import BUILT_IN
from hrc_env.worker.body import worker_names

PICTURES = Path(__file__).parent / "pictures"
JPEG_QUALITY = 88
FILM_PX, SEED_FILM, MOST_STEPS = {"width": 640, "height": 480}, 1, 800
DEMO_PX, DEMO_STEP = (960, 540), 2
"""Of the demo's film: size, and which frames are kept."""
STEPS_A_FRAME, FRAME_MS = 5, 100
"""Of the films of episodes: size, seed and length; how many steps lie between frames, and how long
each is shown."""
SEED_WALK, STEPS_WALK = 3, 91
"""An episode and a step of it at which the worker walks."""


def save_film(frames: Sequence[np.ndarray], name: str, frame_ms: int) -> None:
    """A WebP in docs/pictures, each frame of which is shown for that long [ms]."""
    first, *others = (Image.fromarray(np.asarray(frame, np.uint8)) for frame in frames)
    first.save(
        PICTURES / name, save_all=True, append_images=others,
        duration=frame_ms, loop=0, quality=55, method=6,
    )  # fmt: skip


def save(image: np.ndarray, name: str) -> None:
    """A JPEG in docs/pictures."""
    path = str(PICTURES / name)
    cv2.imwrite(path, image[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])


def demo() -> None:
    """The demo's film, smaller, and one frame of it."""
    subprocess.run([sys.executable, "-m", "hrc_env", "demo"], check=True)
    save(imageio.imread("out/demo.png"), "loop.jpg")
    film: Any = imageio.get_reader("out/demo.mp4")
    frames = [shrink(frame, *DEMO_PX) for k, frame in enumerate(film) if k % DEMO_STEP == 0]
    save_film(frames, "demo.webp", round(1000 * DEMO_STEP / film.get_meta_data()["fps"]))


def room() -> None:
    """The place."""
    env = HRCEnv(perception="truth")
    env.reset(seed=3)
    for _ in range(60):
        env.step(np.zeros(6))
    renderer = PictureRenderer(env.simulation.scene, 960, 640)
    views = [renderer.picture(*env.views.pose(), view) for view in ("room", "outside")]
    save(np.hstack(views), "room.jpg")
    renderer.close()
    env.close()


def cameras() -> None:
    """The laboratory through a pinhole and through the paper's GoPro, in one place."""
    env = HRCEnv(perception="truth", cameras="lab_gopro")
    env.reset(seed=3)
    for _ in range(60):
        env.step(np.zeros(6))
    gopro = env.simulation.scene.cameras[2]
    wide = pinhole("wide", gopro.eye_world, np.array([0.2, 0.0, 1.0]), 118.2, 1920, 1080)
    renderer = CropRenderer(env.simulation.scene, 1920)
    renderer.pose(*env.views.pose())
    whole = Roi((960.0, 540.0), 1920.0, 0.0)
    images = [LensRenderer(renderer, (gopro,)).view(each, whole) for each in (wide, gopro)]
    shown = [shrink(middle_rows(image, 1080), 800, 450) for image in images]
    for image, text in zip(shown, ("pinhole, 118.2 degrees", "GoPro HERO8 wide"), strict=True):
        label(image, text, (8, 8))
    save(np.hstack(shown), "cameras.jpg")
    renderer.close()
    env.close()


def faults() -> None:
    """One crop of one camera with every fault that images can have."""
    kinds = [kind for kind, each in KINDS.items() if each.group == IMAGE]
    crops = []
    for kind in (None, *kinds):
        given = [] if kind is None else [FaultConfig(kind, ("camera_1",))]
        env = HRCEnv(perception="truth")
        env.reset(seed=SEED_WALK)
        for _ in range(STEPS_WALK - 1):
            env.step(np.zeros(6))
        scene, before = env.simulation.scene, copy_arrays(env.views.pose())
        env.step(np.zeros(6))
        renderer = CropRenderer(scene)
        schedule = Schedule(scene.rig, tuple(given), env.config.ctrl_dt)
        film = CameraFilm(LensRenderer(renderer, scene.cameras), schedule)
        now = copy_arrays(env.views.pose())
        shot = Shot(0, ScenePose(*now), ScenePose(*before), scene.cameras)
        film.show([shot] * 4, seed=4)
        joints = env.simulation.estimate.mean_world[:, 0]
        px, depth_m = project(projections(scene.cameras[:1]), joints)
        window = window_from_joints(px[0, 0], depth_m[0, 0], scene.cameras[0])
        if window is not None:
            crops.append(film.crop(0, window).copy())
            label(crops[-1], (kind or "no fault").replace("_", " "), (6, 6), 13)
        renderer.close()
        env.close()
    save(tile(crops, len(crops) // 3), "faults.jpg")


def appearance() -> None:
    """The lab and the site as they were built, and in five `varied` looks."""
    for_each = []
    for scene, view in (("lab", "room"), ("site", "camera_1")):
        env = HRCEnv(perception="truth", scene=scene)
        env.reset(seed=SEED_WALK)
        for _ in range(STEPS_WALK):
            env.step(np.zeros(6))
        renderer = PictureRenderer(env.simulation.scene, 400, 300)
        for k in range(6):
            if k > 0:
                renderer.randomize(draw_look(VARIED, 1, np.random.default_rng(k)))
            picture = renderer.picture(*env.views.pose(), view).astype(np.uint8).copy()
            label(picture, f"look {k}" if k else "as built", (6, 6), 13)
            for_each.append(picture)
        renderer.close()
        env.close()
    save(tile(for_each, 3), "appearance.jpg")


def episodes(ids: Sequence[str] = tuple(BUILT_IN)) -> None:
    """A short film of every environment, at twice the speed."""
    for task_id in ids:
        env = gymnasium.make(task_id, perception="truth", render_mode="rgb_array", **FILM_PX)
        inner = env.unwrapped
        assert isinstance(inner, HRCEnv)
        observation, _ = env.reset(seed=SEED_FILM)
        agent, frames, over, n = make_expert(env_info(inner.simulation)), [], False, 0
        while not over and n < MOST_STEPS:
            if n % STEPS_A_FRAME == 0:
                frames.append(np.asarray(env.render()))
            observation, _, terminated, truncated, _ = env.step(agent.act(observation))
            over, n = terminated or truncated, n + 1
        env.close()
        save_film(frames, f"{task_id}.webp", FRAME_MS)


def clip() -> None:
    """A recording, imported."""
    out = Path("out/clips")
    subprocess.run([sys.executable, "tests/mocap/written.py", str(out)], check=True)
    words = ["import-motion", str(out / "traps.bvh"), "--out", str(out / "traps.npz")]
    strip = out / "traps.png"
    subprocess.run([sys.executable, "-m", "hrc_env", *words, "--picture", str(strip)], check=True)
    save(imageio.imread(strip), "clip.jpg")


def site() -> None:
    """The construction site."""
    env = HRCEnv(perception="truth", scene="site", n_workers=3, config={"worker": "any"})
    env.reset(seed=5)
    for _ in range(140):
        env.step(np.zeros(6))
    renderer = PictureRenderer(env.simulation.scene, 1280, 720)
    save(np.asarray(renderer.picture(*env.views.pose(), "overview")), "site.jpg")
    renderer.close()
    env.close()


def site_work() -> None:
    """A view of the gallery."""
    picture = next(iter(views("site", worker_names()[1]).values()))
    save(shrink(picture, 1280, 720), "site_work.jpg")


def workers() -> None:
    """Three workers of different bodies, near the robot on the site."""
    env = HRCEnv(perception="truth", scene="site", n_workers=3, config={"worker": "any"})
    env.reset(seed=11)
    for _ in range(160):
        env.step(np.zeros(6))
    eye, target, size = np.array([-2.2, -3.4, 1.7]), np.array([0.5, -0.4, 0.95]), (1120, 640)
    renderer = PictureRenderer(env.simulation.scene, *size)
    camera = pinhole("near", eye, target, 60.0, *size)
    save(np.asarray(renderer.picture(*env.views.pose(), camera)), "workers.jpg")
    renderer.close()
    env.close()


if __name__ == "__main__":
    PICTURES.mkdir(exist_ok=True)
    demo()
    room()
    site()
    site_work()
    workers()
    cameras()
    faults()
    appearance()
    clip()
    episodes()
