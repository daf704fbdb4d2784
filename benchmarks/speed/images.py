"""Processor time of camera images in observations.

    python -m benchmarks.speed.images

The contenders are a step without images, with one image and with all images, a call of `render()`,
and the images of all cameras rendered in the style of `render()`. They are measured in turn, so
that noise of the machine affects them equally. Results are medians of processor time [ms] with
quartiles, and ratios to `render()` and to a step; the option `--out` writes them as JSON.
"""

import json
import sys
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import tyro
from rich.console import Console
from rich.table import Table

from hrc_env.core.results import provenance, write_whole
from hrc_env.geometry.cameras import resize

STEP, RENDER = "a step without images", "render(), with shadows"


@dataclass(frozen=True)
class Arguments:
    """Measure the time of camera images in observations."""

    rounds: int = 60
    """Number of measurements of each contender."""
    size: int = 84
    """Width and height of images [px]."""
    task: str = "HRCReach-v0"
    """Id of the environment."""
    out: Path | None = None
    """JSON file to which the results are written."""


def contenders(arguments: Arguments, exits: ExitStack) -> dict[str, Callable[[], Any]]:
    """Return a function for each contender, by name."""
    size = arguments.size

    def make(**given: Any) -> Any:
        env = gymnasium.make(arguments.task, perception="keypoints", max_episode_steps=-1, **given)
        exits.callback(env.close)
        env.reset(seed=0)
        return env.unwrapped

    def make_step(env: Any) -> Callable[[], Any]:
        rng, n = np.random.default_rng(0), env.action_space.shape
        return lambda: env.step(rng.uniform(-1, 1, n).astype(np.float32))

    def make_draw(env: Any) -> Callable[[], Any]:
        return env.simulation.draw_images

    one = make(observe_images={"height": size, "width": size, "cameras": [0]})
    every = make(observe_images=(size, size))
    shown = make(render_mode="rgb_array", width=size, height=size)
    rig = [resize(camera, size, size) for camera in shown.simulation.scene.cameras]
    return {
        STEP: make_step(shown),
        "a step with one image": make_step(one),
        "a step with all images": make_step(every),
        "one image": make_draw(one),
        "all images": make_draw(every),
        RENDER: shown.render,
        "all cameras as for people": lambda: shown.views._drawn(rig, shown.views.glance()),
    }


def measure(arguments: Arguments) -> dict[str, list[float]]:
    """Measure the processor time of all turns, by name of the contender [ms]."""
    with ExitStack() as exits:
        turns = contenders(arguments, exits)
        took: dict[str, list[float]] = {name: [] for name in turns}
        for round_ in range(arguments.rounds + 2):
            for name, turn in turns.items():
                started_s = time.process_time()
                turn()
                if round_ >= 2:  # the first rounds also render static objects
                    took[name].append(1e3 * (time.process_time() - started_s))
    return took


def main(arguments: Arguments) -> int:
    """Measure the times, print a table, write the results, and return the exit status."""
    took = measure(arguments)
    table = Table("", "ms", "quartiles", "of render()", "of a step")
    numbers = {}
    for name, values in took.items():
        low, middle, high = np.percentile(values, (25, 50, 75)).tolist()
        of_render, of_step = (float(np.median(np.divide(values, took[k]))) for k in (RENDER, STEP))
        numbers[name] = {
            "ms": middle, "quartiles_ms": [low, high], "of_render": of_render, "of_step": of_step,
        }  # fmt: skip
        cells = f"{middle:.2f}", f"{low:.2f} to {high:.2f}", f"{of_render:.2f}", f"{of_step:.2f}"
        table.add_row(name, *cells)
    Console().print(table)
    if arguments.out is not None:
        record = {**provenance(), "size_px": arguments.size, "task": arguments.task}
        write_whole(arguments.out, json.dumps({**record, "measured": numbers}, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main(tyro.cli(Arguments, description=__doc__)))
