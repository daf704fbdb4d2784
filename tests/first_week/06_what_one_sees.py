"""Goals, capsules and cameras in pictures, and what is not in the images that policies see."""

import gymnasium
import numpy as np

import hrc_env

HOW = {"perception": "keypoints", "render_mode": "rgb_array", "width": 480, "height": 360}


def picture(camera=None, seed=0, **more):
    env = gymnasium.make("HRCReach-v0", **HOW, **more)
    env.reset(seed=seed)
    for _ in range(10):
        env.step(np.zeros(6, np.float32))
    image = env.unwrapped.render(camera=camera)
    env.close()
    return image


def unlike(a, b):
    """The number of pixels that differ."""
    return int((np.abs(a.astype(int) - b) > 8).any(-1).sum())


# The goal is drawn, also in films, and can be left out.
plain = picture(render_markers=False)
print("pixels of the goal:", unlike(picture(), plain))
assert 50 < unlike(picture(), plain) < 2000

# What distances are taken of: the robot, people as believed and as they are.
capsules = picture(overlay="capsules")
print("pixels of capsules:", unlike(capsules, plain))
assert unlike(capsules, plain) > 5000

# Through the cameras of the rig, from viewpoints, and through a camera of one's own.
own = hrc_env.CameraConfig("own", (1.5, -1.5, 1.8), (0.0, 0.0, 1.0))
views = [picture(camera) for camera in ("camera_1", 1, "top", own)]
assert all(unlike(view, plain) > 50_000 for view in views)

# At any time and in any size, without a render mode: `env.views`.
env = hrc_env.HRCEnv(perception="truth")
env.reset(seed=0)
assert env.views.picture(size=(320, 200), capsules=True).shape == (200, 320, 3)
assert env.views.picture(depth=True, camera="camera_3", size=(64, 48)).dtype == np.float32
assert env.mosaic().ndim == 3
try:
    env.views.picture(camera="camera_9")
except hrc_env.ConfigError as error:
    print(error)
env.close()
try:
    hrc_env.HRCEnv(perception="none", overlay="capsule")
except hrc_env.ConfigError as error:
    print(error)
