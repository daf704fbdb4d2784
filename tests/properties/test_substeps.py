"""The physics substep is fine enough: the tool follows commands, and contacts are calm."""

from collections.abc import Callable

import numpy as np
import pytest
from figures import Figure

from assets.workers.poses import rest_motion
from benchmarks.common import exactly
from hrc_env.core.records import WorkerPath
from hrc_env.core.results import over
from hrc_env.core.typing import Floats
from hrc_env.geometry import chains
from hrc_env.geometry.distances import least_separation
from hrc_env.scene.build import Scene, SceneConfig, build
from hrc_env.scene.physics import Physics, make_empty_path
from hrc_env.worker.body import load_body, worker_capsules

CTRL_DT_S = 0.04
SEEDS = range(100, 108)
"""The default substep was chosen on seeds 0 to 7."""
EXCURSION = np.array([1.0, 1.0, 1.0, 1.0, 0.6, 1.0])
"""Less for the fifth joint, so that the tool does not meet the forearm."""


def n_substeps(scene: Scene) -> int:
    """Return the number of substeps in a control step."""
    return round(CTRL_DT_S / scene.config.sim_dt)


def make_commands(kind: str, seed: int, n_steps: int = 150, batch: int = 32) -> Floats:
    """Return (n_steps, B, 6) velocities with peaks of 0.6 to 1.3 rad/s.

    "smooth" are sines of 0.4 to 0.8 Hz; "jumping" are square waves that turn after 0.4 to 0.8 s.
    """
    rng, step = np.random.default_rng(seed), np.arange(n_steps)[:, None, None]
    peak = rng.uniform(0.6, 1.3, (batch, 6)) * rng.choice((-1, 1), (batch, 6))
    if kind == "smooth":
        rate = 2 * np.pi * rng.uniform(0.4, 0.8, (batch, 6))
        return EXCURSION * peak * np.cos(rate * CTRL_DT_S * step)
    half = rng.integers(10, 21, (batch, 6))
    return EXCURSION * peak * np.where((step + half // 2) // half % 2 == 0, 1.0, -1.0)


def measure_tool_error_mm(scene: Scene, wanted: Floats) -> Floats:
    """Return the distances of the tool from the exact integral of slew-limited commands."""
    batch, slew = wanted.shape[1], scene.config.slew_rad_s2
    physics, nobody = Physics(scene, batch), make_empty_path(batch, n_substeps(scene))
    command, reference, errors_mm = np.zeros((batch, 6)), physics.q, []
    for target in wanted:
        change = np.clip(target - command, -slew * CTRL_DT_S, slew * CTRL_DT_S)
        ramp_s = np.abs(change) / slew
        reference = reference + command * CTRL_DT_S + change * (CTRL_DT_S - ramp_s / 2)
        command = command + change
        physics.step(target, nobody)
        here = chains.tool_frame(scene.chain, physics.q)[:, :3, 3]
        there = chains.tool_frame(scene.chain, reference)[:, :3, 3]
        errors_mm.append(1000 * np.linalg.norm(here - there, axis=-1))
    return np.concatenate(errors_mm)


def push_into(
    scene: Scene,
    start: tuple[list[float], list[float]],
    path: WorkerPath,
    gap_m: Callable[[Floats], float],
) -> tuple[float, float, float]:
    """Drive the arm into something for two seconds, then away from it for one.

    Returns:
        The deepest penetration [mm], the fastest joint while it presses [rad/s], and the gap at
        the end [m].
    """
    q_rad, push_rad_s = start
    physics, gaps_m, speeds = Physics(scene, 1), [], []
    physics.reset(np.array([0]), np.array([q_rad]))
    for step in range(75):
        physics.step(np.array([push_rad_s]) * (1 if step < 50 else -1), path)
        gaps_m.append(gap_m(chains.capsules(scene.chain, physics.q)))
        speeds.append(float(np.abs(physics.qd).max()))
    return -1000 * min(gaps_m), max(speeds[40:50]), gaps_m[-1]


def push_into_floor() -> tuple[float, float, float]:
    """Drive the arm down onto the floor."""
    scene = build(SceneConfig())

    def gap_m(arm: Floats) -> float:
        return float((arm[..., 2].min(-1) - scene.chain.capsule_radius_m).min())

    start = [0.0, -0.8, 0.6, -1.37, -1.57, 0.0], [0, 0.8, 0, 0, 0, 0.0]
    return push_into(scene, start, make_empty_path(1, n_substeps(scene)), gap_m)


def push_into_worker() -> tuple[float, float, float]:
    """Turn the stretched arm, at 1 rad/s, into a worker who stands still."""
    scene = build(SceneConfig(), n_workers=1)
    body, lead = load_body(scene.bodies[0]), (1, n_substeps(scene), 1, 1, 1)
    rest = rest_motion(body)
    position_m = rest.position_world + np.array([0.45, 0.0, 0.0])
    path = WorkerPath(np.tile(position_m, lead), np.tile(rest.quaternion_wxyz, lead))
    person = worker_capsules(body, path)[:, -1].reshape(1, -1, 2, 3)

    def gap_m(arm: Floats) -> float:
        ends = (arm, scene.chain.capsule_radius_m, person, body.capsule_radius_m)
        return float(least_separation(*ends).distance_m[0])

    start = [-1.2, -0.9, 1.2, -1.87, -1.57, 0.0], [1.0, 0, 0, 0, 0, 0.0]
    return push_into(scene, start, path, gap_m)


@pytest.mark.long
def test_the_tool_follows_the_integral_of_commands(figures):
    """The intervals are the least and the largest over eight seeds of 32 arms."""
    scene, found = build(SceneConfig()), []
    for kind, most_mm in (("smooth", 1.0), ("jumping", 2.0)):
        each = [measure_tool_error_mm(scene, make_commands(kind, seed)) for seed in SEEDS]
        p95_mm = over([float(np.percentile(errors_mm, 95)) for errors_mm in each], "mm")
        found.append(Figure(f"substep.tool_error_p95.{kind}", p95_mm, most=most_mm))
    figures.hold(*found)


@pytest.mark.long
@pytest.mark.parametrize("push", [push_into_floor, push_into_worker], ids=["floor", "worker"])
def test_contacts_are_shallow_and_calm(push, figures, request):
    name = f"substep.contact.{request.node.callspec.id}"
    depth_mm, pressed_rad_s, away_m = (exactly(each, "") for each in push())
    figures.hold(
        Figure(f"{name}.depth_mm", depth_mm, least=0.0, most=5.0),
        Figure(f"{name}.pressed_rad_s", pressed_rad_s, most=0.1),
        Figure(f"{name}.away_m", away_m, least=0.5),
    )
