"""Stored pictures of a rendered worker, and films made of them."""

from pathlib import Path

import numpy as np

from hrc_env.perception.blazepose import crop_window

DATA = Path(__file__).parent / "data"
PICTURES = sorted(path.name for path in DATA.glob("*.png"))


class Stills:
    """An image source whose cameras see stored pictures."""

    def __init__(self, images):
        self.images = list(images)

    def crop(self, camera_index, window):
        return crop_window(self.images[camera_index], window)


def hung_in_a_room(picture, left, top, width=1920, height=1080):
    """A large grey image with the picture at a place, enlarged twice."""
    room = np.full((height, width, 3), 128, np.uint8)
    large = picture.repeat(2, axis=0).repeat(2, axis=1)
    room[top : top + len(large), left : left + large.shape[1]] = large
    return room
