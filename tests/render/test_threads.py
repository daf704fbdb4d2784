"""An environment used by more than one thread, never by two at once; and what is left at exit."""

import gc
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing

import gymnasium
import mujoco
import numpy as np
import pytest

from hrc_env.core.errors import RenderingError
from hrc_env.scene import gl
from hrc_env.scene.build import build
from hrc_env.scene.render import CropRenderer

KIND = {"perception": "keypoints", "render_mode": "rgb_array", "width": 96, "height": 64}
STILL = np.zeros(6, np.float32)
EMPTY = "<mujoco/>"
LEFT_OPEN = """
import sys, threading, time, gymnasium, numpy, hrc_env
def begin(level):
    how = dict(perception=level, render_mode="rgb_array", width=64, height=64)
    env = gymnasium.make("HRCReach-v0", **how)
    env.reset(seed=0)
    env.render()
    return env
def draw_for_ever():
    env = begin("truth")
    drawn.set()
    while True:
        env.render()
left = begin("keypoints")
drawn = threading.Event()
threading.Thread(target=draw_for_ever, daemon=True).start()
drawn.wait(60)
"""


def elsewhere(work, *arguments):
    """What work gives in a thread that lives no longer."""
    with ThreadPoolExecutor(1) as thread:
        return thread.submit(work, *arguments).result()


def played(env):
    """The picture after two steps of an episode."""
    env.reset(seed=3)
    for _ in range(2):
        env.step(STILL)
    return env.render()


@pytest.fixture(scope="module")
def picture():
    with closing(gymnasium.make("HRCReach-v0", **KIND)) as env:
        return played(env)


def test_made_in_one_thread_drawn_in_others_closed_in_another(picture):
    env = elsewhere(lambda: gymnasium.make("HRCReach-v0", **KIND))
    np.testing.assert_array_equal(elsewhere(played, env), picture)
    np.testing.assert_array_equal(elsewhere(env.render), picture)
    np.testing.assert_array_equal(env.render(), picture)
    elsewhere(env.close)


def test_a_pool_draws_several_environments_at_once(picture):
    envs = [gymnasium.make("HRCReach-v0", **KIND) for _ in range(3)]
    with ThreadPoolExecutor(3) as pool:
        for some in (envs, envs[::-1]):
            for seen in pool.map(played, some):
                np.testing.assert_array_equal(seen, picture)
        list(pool.map(lambda env: env.close(), envs))


@pytest.mark.usefixtures("pixels")
def test_pixels_are_seen_from_any_thread():
    def seen(call):
        env = call(lambda: gymnasium.make("HRCReach-v0", perception="pixels"))
        observed = [call(lambda: env.reset(seed=0))[0]]
        observed += [call(env.step, STILL)[0] for _ in range(3)]
        call(env.close)
        return observed

    here = seen(lambda work, *arguments: work(*arguments))
    np.testing.assert_array_equal(seen(elsewhere), here)


def test_what_was_current_before_is_so_afterwards():
    """Somebody else's context, on the same thread."""
    ours = gl.new_context(8, 8, mujoco.MjModel.from_xml_string(EMPTY))
    theirs = gl.new_context(8, 8, mujoco.MjModel.from_xml_string(EMPTY))
    rectangle, pixel = mujoco.MjrRect(0, 0, 8, 8), np.zeros((8, 8, 3), np.uint8)
    with theirs.current() as looks:
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, looks)
        with ours.current():
            pass
        ours.free()
        mujoco.mjr_rectangle(rectangle, 1.0, 0.0, 1.0, 1.0)
        mujoco.mjr_readPixels(pixel, None, rectangle, looks)
    theirs.free()
    assert pixel[4, 4].tolist() == [255, 0, 255]


def test_a_renderer_is_collected_in_another_thread():
    kept = [CropRenderer(build(n_workers=1))]
    kept[0].show()
    elsewhere(lambda: (kept.clear(), gc.collect()))
    assert not kept


def test_a_freed_context_says_so():
    drawing = gl.new_context(8, 8, mujoco.MjModel.from_xml_string(EMPTY))
    drawing.free()
    drawing.free()
    with pytest.raises(RenderingError, match="freed"), drawing.current():
        pass


@pytest.mark.usefixtures("pixels")
def test_pixels_are_seen_to_the_very_end(process):
    """Threads of the interpreter take no more work when it is ending."""
    done = process(
        "-c",
        "import atexit, gymnasium, hrc_env, numpy\n"
        "env = gymnasium.make('HRCReach-v0', perception='pixels')\n"
        "env.reset(seed=0)\n"
        "atexit.register(lambda: print(env.step(numpy.zeros(6, numpy.float32))[1]))\n",
    )
    assert done.returncode == 0, done.stderr
    assert "Error" not in done.stderr
    float(done.stdout)


def test_an_open_environment_ends_without_a_word(process):
    done = process("-c", LEFT_OPEN)
    assert done.returncode == 0, done.stderr
    assert not done.stderr
