"""How coarse may a physics substep be? The table behind `SceneConfig.sim_dt`.

    python -m benchmarks.sim_dt            # prints the table, writes out/sim_dt

Error: the arm follows joint velocities commanded at 25 Hz with peaks of 0.6 to 1.3 rad/s,
smooth (sines) or jumping (to and fro at the full slew limit); the tool is compared with where
the exact integral of the slew-limited command would have it. Contacts: the arm is driven into
the floor and into a worker for two seconds and then away again; penetration comes from the
capsules' geometry.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from assets.workers.poses import rest_motion
from benchmarks.common import exactly, publish
from hrc_env.core.records import WorkerPath
from hrc_env.core.results import Metric, over
from hrc_env.core.typing import Floats
from hrc_env.experiments.study.report import Column, Report, table_of
from hrc_env.geometry import chains
from hrc_env.geometry.distances import least_separation
from hrc_env.scene.build import Scene, SceneConfig, build
from hrc_env.scene.physics import Physics, no_workers
from hrc_env.worker.body import load_body, worker_capsules

CTRL_DT = 0.04
SEEDS = range(8)
STEPS_S = (0.004, 0.005, 0.008, 0.010)
OUT = Path("out/sim_dt")
GapOf = Callable[[Floats], float]
EXCURSION = np.array([1.0, 1.0, 1.0, 1.0, 0.6, 1.0])
"""Less for the fifth joint, so that the tool does not meet the forearm."""


def substeps(scene: Scene) -> int:
    """Substeps of a control step."""
    return round(CTRL_DT / scene.config.sim_dt)


def targets(kind: str, seed: int, n_steps: int = 150, batch: int = 32) -> Floats:
    """(n_steps, B, 6) velocities with peaks of 0.6 to 1.3 rad/s: sines of 0.4 to 0.8 Hz round home,
    or square waves that turn every 0.4 to 0.8 s."""
    rng, step = np.random.default_rng(seed), np.arange(n_steps)[:, None, None]
    peak = rng.uniform(0.6, 1.3, (batch, 6)) * rng.choice((-1, 1), (batch, 6))
    if kind == "smooth":
        rate = 2 * np.pi * rng.uniform(0.4, 0.8, (batch, 6))
        return EXCURSION * peak * np.cos(rate * CTRL_DT * step)
    half = rng.integers(10, 21, (batch, 6))
    return EXCURSION * peak * np.where((step + half // 2) // half % 2 == 0, 1.0, -1.0)


def tool_error_mm(scene: Scene, wanted: Floats) -> Floats:
    """(n,) distance of the tool from the integral of the command, at every control step."""
    batch, slew = wanted.shape[1], scene.config.slew_rad_s2
    physics, still = Physics(scene, batch), no_workers(batch, substeps(scene))
    command, reference, errors = np.zeros((batch, 6)), physics.q, []
    for target in wanted:
        change = np.clip(target - command, -slew * CTRL_DT, slew * CTRL_DT)
        ramp_s = np.abs(change) / slew
        reference = reference + command * CTRL_DT + change * (CTRL_DT - ramp_s / 2)
        command = command + change
        physics.step(target, still)
        here = chains.tool(scene.chain, physics.q)[:, :3, 3]
        there = chains.tool(scene.chain, reference)[:, :3, 3]
        errors.append(1000 * np.linalg.norm(here - there, axis=-1))
    return np.concatenate(errors)


def contact(
    scene: Scene, q: list[float], pushed: list[float], path: WorkerPath, gap_m: GapOf
) -> dict[str, Metric]:
    """Drive the arm from q into something for two seconds, then away for one."""
    physics, gaps, speeds = Physics(scene, 1), [], []
    physics.reset(np.array([0]), np.array([q]))
    for step in range(75):
        physics.step(np.array([pushed]) * (1 if step < 50 else -1), path)
        gaps.append(gap_m(chains.capsules(scene.chain, physics.q)))
        speeds.append(float(np.abs(physics.qd).max()))
    return {
        "depth": exactly(-1000 * min(gaps), "mm"),
        "pressed": exactly(max(speeds[40:50]), "rad/s"),
        "away": exactly(gaps[-1], "m"),
    }


def floor_contact(scene: Scene) -> dict[str, Metric]:
    """Down onto the floor."""

    def gap_m(arm: Floats) -> float:
        return float((arm[..., 2].min(-1) - scene.chain.capsule_radius_m).min())

    q, pushed = [0.0, -0.8, 0.6, -1.37, -1.57, 0.0], [0, 0.8, 0, 0, 0, 0.0]
    return contact(scene, q, pushed, no_workers(1, substeps(scene)), gap_m)


def worker_contact(scene: Scene) -> dict[str, Metric]:
    """Turn the stretched arm into a worker who stands still, at 1 rad/s."""
    body, lead = load_body(scene.bodies[0]), (1, substeps(scene), 1, 1, 1)
    rest = rest_motion(body)
    position = rest.position_world + np.array([0.45, 0.0, 0.0])
    path = WorkerPath(np.tile(position, lead), np.tile(rest.quaternion_wxyz, lead))
    person = worker_capsules(body, path)[:, -1].reshape(1, -1, 2, 3)

    def gap_m(arm: Floats) -> float:
        ends = (arm, scene.chain.capsule_radius_m, person, body.capsule_radius_m)
        return float(least_separation(*ends).distance_m[0])

    q, pushed = [-1.2, -0.9, 1.2, -1.87, -1.57, 0.0], [1.0, 0, 0, 0, 0, 0.0]
    return contact(scene, q, pushed, path, gap_m)


def measure(sim_dt: float) -> dict[str, Metric]:
    """One row of the table."""
    name = f"{1000 * sim_dt:g}ms"
    scene = build(SceneConfig(sim_dt=sim_dt), n_workers=1)
    empty = build(SceneConfig(sim_dt=sim_dt))
    metrics: dict[str, Metric] = {}
    for kind in ("smooth", "jumping"):
        errors = [tool_error_mm(empty, targets(kind, seed)) for seed in SEEDS]
        for share in (50, 95):
            each = [float(np.percentile(error, share)) for error in errors]
            metrics[f"tool_error_p{share}.{kind}.{name}"] = over(each, "mm")
    for what, found in (("floor", floor_contact(empty)), ("worker", worker_contact(scene))):
        metrics |= {f"contact_{key}.{what}.{name}": metric for key, metric in found.items()}
    return metrics


def main() -> None:
    """Measure, print, write."""
    metrics: dict[str, Metric] = {}
    for sim_dt in STEPS_S:
        metrics |= measure(sim_dt)
    names = [f"{1000 * sim_dt:g}ms" for sim_dt in STEPS_S]
    rows = dict.fromkeys(key.rsplit(".", 1)[0] for key in metrics)
    rows = {row: f"{row} [{metrics[f'{row}.{names[0]}'].unit}]" for row in rows}
    columns = [Column(f"{{}}.{name}", name, 3) for name in names]
    lead = (__doc__ or "").strip() + " Medians over seeds, in brackets the least and the largest."
    parts = [table_of("", rows, columns, metrics)]
    report = Report("Physics substeps", lead, parts, "the least and the largest over seeds")
    publish(OUT, report, {"ctrl_dt": CTRL_DT}, list(SEEDS), metrics)


if __name__ == "__main__":
    main()
