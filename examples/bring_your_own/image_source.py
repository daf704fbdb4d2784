"""An image source of your own: films or live images of any rig, instead of the renderer.

python examples/bring_your_own/image_source.py rig.toml camera_1.mp4 camera_2.mp4 ...
"""

import sys
from pathlib import Path

import imageio.v2 as imageio
import numpy as np

from hrc_env import PoseTracker, crop_window, read_rig


class Frames:
    """Source of images: the present image of every camera, (H, W, 3) RGB each."""

    def __init__(self, images):
        self.images = images

    def crop(self, camera_index, window):
        return crop_window(self.images[camera_index], window)


def poses(rig, films):
    """Yield the middle of the body (3,) and its deviation [m] for every set of frames; None: no
    person."""
    tracker = PoseTracker(read_rig(rig), dt_s=1 / 25)
    for images in zip(*(imageio.get_reader(film) for film in films), strict=False):
        estimate = tracker.update(Frames(images))
        if not estimate.tracked[0, 0]:
            yield None
            continue
        deviation_m = np.sqrt(np.trace(estimate.cov_world[0, 0], axis1=1, axis2=2).mean() / 3)
        yield estimate.mean_world[0, 0].mean(0), deviation_m
    tracker.close()


if __name__ == "__main__":
    for n, found in enumerate(poses(Path(sys.argv[1]), sys.argv[2:])):
        print(n, "no person" if found is None else "{} m, +- {:.3f} m".format(*found))
