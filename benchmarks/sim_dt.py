"""How coarse may a physics substep be? The table behind `SceneConfig.sim_dt`.

    python -m benchmarks.sim_dt            # prints the table, writes out/sim_dt.json

Error: the arm follows joint velocities commanded at 25 Hz with peaks of 0.6 to 1.3 rad/s,
smooth (sines) or jumping (to and fro at the full slew limit); the tool is compared with where
the exact integral of the slew-limited command would have it. Contacts: the arm is driven into
the floor and into a worker for two seconds and then away again; penetration comes from the
capsules' geometry.
"""

import time
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Column, Table

from hrc_env.core.records import WorkerPath
from hrc_env.core.results import Metric, over, write_results
from hrc_env.geometry import chains
from hrc_env.geometry.distances import least_separation
from hrc_env.scene.build import Scene, SceneConfig, build
from hrc_env.scene.physics import Physics, no_workers
from hrc_env.worker.body import load_body, rest_motion, worker_capsules

CTRL_DT = 0.04
SEEDS = range(8)
STEPS_S = (0.004, 0.005, 0.008, 0.010)
OUT = Path("out/sim_dt.json")
EXCURSION = np.array([1.0, 1.0, 1.0, 1.0, 0.6, 1.0])
"""Less for the fifth joint, so that the tool does not meet the forearm."""


def substeps(scene: Scene) -> int:
    """Substeps of a control step."""
    return round(CTRL_DT / scene.config.sim_dt)


def standing(scene: Scene, batch: int, xy: tuple[float, float]) -> WorkerPath:
    """A worker who stands still at `xy`, for every environment and substep."""
    rest = rest_motion(load_body(scene.bodies[0]))
    lead = (batch, substeps(scene), 1)

    def spread(array: np.ndarray) -> np.ndarray:
        return np.broadcast_to(array, (*lead, *array.shape)).copy()

    position = rest.position_world + np.array([*xy, 0.0])
    return WorkerPath(spread(position), spread(rest.quaternion_wxyz))


def smooth_targets(rng: np.random.Generator, n_steps: int, batch: int) -> np.ndarray:
    """(n_steps, B, 6) sines of 0.4 to 0.8 Hz with peaks of 0.6 to 1.3 rad/s round home."""
    time_s = CTRL_DT * np.arange(n_steps)[:, None, None]
    peak = rng.uniform(0.6, 1.3, (batch, 6)) * rng.choice((-1, 1), (batch, 6))
    rate = 2 * np.pi * rng.uniform(0.4, 0.8, (batch, 6))
    return EXCURSION * peak * np.cos(rate * time_s)


def jumping_targets(rng: np.random.Generator, n_steps: int, batch: int) -> np.ndarray:
    """(n_steps, B, 6) square waves of 0.6 to 1.3 rad/s that turn every 0.4 to 0.8 s."""
    step = np.arange(n_steps)[:, None, None]
    peak = rng.uniform(0.6, 1.3, (batch, 6)) * rng.choice((-1, 1), (batch, 6))
    half = rng.integers(10, 21, (batch, 6))
    return EXCURSION * peak * np.where((step + half // 2) // half % 2 == 0, 1.0, -1.0)


def tool_error_mm(scene: Scene, targets: np.ndarray) -> np.ndarray:
    """(n,) distance of the tool from the integral of the command, at every control step."""
    batch, slew = targets.shape[1], scene.config.slew_rad_s2
    physics, still = Physics(scene, batch), no_workers(batch, substeps(scene))
    command, reference, errors = np.zeros((batch, 6)), physics.q, []
    for wanted in targets:
        change = np.clip(wanted - command, -slew * CTRL_DT, slew * CTRL_DT)
        ramp_s = np.abs(change) / slew
        reference = reference + command * CTRL_DT + change * (CTRL_DT - ramp_s / 2)
        command = command + change
        physics.step(wanted, still)
        here = chains.tool(scene.chain, physics.q)[:, :3, 3]
        there = chains.tool(scene.chain, reference)[:, :3, 3]
        errors.append(1000 * np.linalg.norm(here - there, axis=-1))
    return np.concatenate(errors)


def floor_contact(scene: Scene) -> dict[str, float]:
    """Drive the arm down for two seconds, then up for one."""
    physics, still = Physics(scene, 1), no_workers(1, substeps(scene))
    physics.reset(np.array([0]), np.array([[0.0, -0.8, 0.6, -1.37, -1.57, 0.0]]))
    deepest, speed = 0.0, 0.0
    for step in range(75):
        physics.step(np.array([[0, 0.8 if step < 50 else -0.8, 0, 0, 0, 0.0]]), still)
        bottom = chains.capsules(scene.chain, physics.q)[..., 2].min(-1)
        deepest = min(deepest, float((bottom - scene.chain.capsule_radius_m).min()))
        if 40 <= step < 50:
            speed = max(speed, float(np.abs(physics.qd).max()))
    above = chains.capsules(scene.chain, physics.q)[..., 2].min() - 0.05
    return {"depth_mm": -1000 * deepest, "pressed_rad_s": speed, "away_m": float(above)}


def worker_contact(scene: Scene) -> dict[str, float]:
    """Turn the stretched arm into a standing worker at 1 rad/s, then away."""
    physics = Physics(scene, 1)
    physics.reset(np.array([0]), np.array([[-1.2, -0.9, 1.2, -1.87, -1.57, 0.0]]))
    path = standing(scene, 1, (0.45, 0.0))
    body = load_body(scene.bodies[0])
    person = worker_capsules(body, path)[:, -1].reshape(1, -1, 2, 3)
    deepest, speed, gap_m = np.inf, 0.0, np.inf
    for step in range(75):
        physics.step(np.array([[1.0 if step < 50 else -1.0, 0, 0, 0, 0, 0.0]]), path)
        arm = chains.capsules(scene.chain, physics.q)
        gap = least_separation(arm, scene.chain.capsule_radius_m, person, body.capsule_radius_m)
        gap_m = float(gap.distance_m[0])
        deepest = min(deepest, gap_m)
        if 40 <= step < 50:
            speed = max(speed, float(np.abs(physics.qd).max()))
    return {"depth_mm": -1000 * deepest, "pressed_rad_s": speed, "away_m": gap_m}


def step_us(scene: Scene, batch: int) -> float:
    """Microseconds of one control step of one environment, the worker walking along."""
    physics, path = Physics(scene, batch), standing(scene, batch, (1.6, 0.4))
    command, times = np.full((batch, 6), 0.3), []
    for step in range(300 if batch == 1 else 40):
        begin = time.perf_counter()
        physics.step(command * (1 if step % 20 < 10 else -1), path)
        times.append(time.perf_counter() - begin)
    return 1e6 * float(np.median(times)) / batch


def measure(sim_dt: float) -> dict[str, Metric]:
    """One row of the table."""
    name = f"{1000 * sim_dt:g}ms"
    scene = build(SceneConfig(sim_dt=sim_dt), n_workers=1)
    empty = build(SceneConfig(sim_dt=sim_dt))
    metrics: dict[str, Metric] = {}
    for kind, targets in (("smooth", smooth_targets), ("jumping", jumping_targets)):
        errors = [
            tool_error_mm(empty, targets(np.random.default_rng(seed), 150, 32)) for seed in SEEDS
        ]
        for share in (50, 95):
            each = [float(np.percentile(error, share)) for error in errors]
            metrics[f"tool_error_p{share}.{kind}.{name}"] = over(each, "mm")
    for what, contact in (("floor", floor_contact(empty)), ("worker", worker_contact(scene))):
        for key, value in contact.items():
            key, unit = key.rsplit("_", 1) if key.endswith(("_mm", "_m")) else (key, "rad/s")
            metrics[f"contact_{key}.{what}.{name}"] = over([value], unit)
    for batch in (1, 64):
        metrics[f"step_us.{batch}.{name}"] = over([step_us(scene, batch)], "us")
    return metrics


def main() -> None:
    """Measure, print, write."""
    metrics: dict[str, Metric] = {}
    for sim_dt in STEPS_S:
        metrics.update(measure(sim_dt))
    names = sorted({key.rsplit(".", 1)[0] for key in metrics})
    columns = [f"{1000 * sim_dt:g}ms" for sim_dt in STEPS_S]
    table = Table(Column("median (largest) over seeds", no_wrap=True), *columns)
    for name in names:
        row = [metrics[f"{name}.{column}"] for column in columns]
        table.add_row(name, *(f"{each.value:.3g} ({each.high:.3g}) {each.unit}" for each in row))
    Console(width=130).print(table)
    write_results(OUT, {"ctrl_dt": CTRL_DT}, list(SEEDS), metrics)


if __name__ == "__main__":
    main()
