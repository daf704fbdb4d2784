"""Entries of the info of a step or a reset: cost, incidents, tracking, workers and cameras."""

from collections.abc import Sequence

import numpy as np

from hrc_env.core.declared import Records2
from hrc_env.core.infos import MISCALIBRATED, MORE_PEOPLE, Info, of_workers
from hrc_env.core.records import PoseEstimate, RobotState, WorkerTruth
from hrc_env.core.typing import Bools, Ints
from hrc_env.core.vacancy import Vacancy
from hrc_env.geometry.distances import least_separation
from hrc_env.motion import generator
from hrc_env.rewards import RewardTerm
from hrc_env.safety import incidents
from hrc_env.safety.cost import Cost, CostConfig, split_cost, sum_cost
from hrc_env.safety.incidents import Incident, IncidentMonitor
from hrc_env.tracking import metrics


def cost_info(
    cost: Cost, happened: Records2[Incident], pushed: Bools, present: Bools, config: CostConfig
) -> Info:
    """Return the cost, its parts and the separation, under the names that safe-RL libraries read.

    Args:
        cost: the cost of the step.
        happened: (B, W) incidents of the step, `incidents.INCIDENT`.
        pushed: mask (B, W) of the workers that push the robot by a touch.
        present: mask (B, W) of the workers that are in the scene.
        config: settings of the cost.
    """
    parts = split_cost(cost, happened, pushed, config)
    total = sum_cost(parts, config)
    return {
        "cost": total,
        "cost_sum": total,
        **{f"cost_{name}": value for name, value in parts.items()},
        "safety/min_separation_m": np.where(present.any(1), cost.min_separation_m, np.nan),
    }


def reset_info(
    robot: RobotState,
    truth: WorkerTruth,
    present: Bools,
    terms: Sequence[RewardTerm],
    config: CostConfig,
) -> Info:
    """Return the infos of a reset about reward, cost and incidents.

    They are 0, or NaN for quantities that are not always measured, except the separation, which is
    computed from the initial poses.

    Args:
        robot: states of the robots.
        truth: true poses of the workers.
        present: mask (B, W) of the workers that are in the scene.
        terms: terms of the reward.
        config: settings of the cost.
    """
    n = len(present)
    capsules = robot.capsules_world, robot.capsule_radius_m
    gaps_m = least_separation(*capsules, truth.capsules_world, truth.capsule_radius_m).distance_m
    names = ("", "_sum", *(f"_{name}" for name in ("proximity", "contact", *config.components)))
    happened = dict.fromkeys(incidents.SUMMARY.names or (), 0.0)
    happened |= dict.fromkeys(incidents.NOT_ALWAYS_MEASURED, np.nan)
    nearest_m = gaps_m.min(1, initial=np.inf, where=present)
    return {
        **{f"reward/{term.name}": np.zeros(n) for term in terms},
        **{f"cost{name}": np.zeros(n) for name in names},
        "safety/min_separation_m": np.where(present.any(1), nearest_m, np.nan),
        **{f"safety/{name}": np.full(n, value) for name, value in happened.items()},
        "safety/time_to_stop_s": np.zeros(n),
    }


def incident_info(
    happened: Records2[Incident], monitor: IncidentMonitor, robot: RobotState
) -> Info:
    """Return infos about the incidents of a step.

    Args:
        happened: (B, W) incidents of the step, `incidents.INCIDENT`.
        monitor: monitor of the incidents in the episodes.
        robot: states of the robots.
    """
    summary = incidents.summarize(happened, monitor.history)
    return {
        **{f"safety/{name}": summary[name] for name in incidents.SUMMARY.names or ()},
        "safety/time_to_stop_s": monitor.find_stop_time(robot),
    }


def tracking_info(
    estimate: PoseEstimate, truth: WorkerTruth, present: Bools, identities: metrics.Identities
) -> Info:
    """Return the errors of the tracks and the changes of their identities; NaN without a track.

    Args:
        estimate: estimate of the workers' poses.
        truth: true poses of the workers.
        present: mask (B, W) of the workers that are in the scene.
        identities: previous assignment of tracks to workers, which is updated in place.
    """
    errors = metrics.measure_errors(estimate, truth.joints_world, present, identities)
    return {f"tracking/{name}": errors[name] for name in metrics.TRACKING.names or ()}


def worker_info(activity: Ints, body: Ints, happened: Records2[Incident] | None) -> Info:
    """Return the activity and body of each worker, and the contacts that begin in this step.

    Args:
        activity: (B, W) index of the activity.
        body: (B, W) index of the body.
        happened: (B, W) incidents of a step; None in a reset.
    """
    none = np.full(activity.shape, -1)
    kind, region = (none, none) if happened is None else (happened["kind"], happened["region"])
    worn = np.where(activity == generator.ABSENT, -1, body)
    return of_workers(activity=activity, body=worn, contact_kind=kind, contact_region=region)


def perception_info(cameras: tuple[str, ...], suspected: Bools, vacancy: Vacancy | None) -> Info:
    """Return whether cameras contradict the others, and whether there are more people than slots.

    Args:
        cameras: names of the C cameras.
        suspected: (B, C) whether each camera contradicts the others.
        vacancy: state of the floor; None without cameras, in which case no infos are returned.
    """
    if vacancy is None:
        return {}
    flags = suspected.astype(float)
    return {
        MISCALIBRATED: flags.sum(1),
        **{f"{MISCALIBRATED}_{name}": flags[:, c] for c, name in enumerate(cameras)},
        MORE_PEOPLE: vacancy.others.any.astype(float),
    }


def words_of(bodies: tuple[str, ...]) -> dict[str, tuple[str, ...]]:
    """Return the names to which the indices in infos refer, by kind of index.

    Args:
        bodies: names of the workers' bodies.
    """
    return {
        "activity": generator.activity_names,
        "body": bodies,
        "contact_kind": incidents.KINDS,
        "contact_region": incidents.REGION_NAMES,
    }
