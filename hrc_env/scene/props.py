"""Props in the drawing model: a mocap body per worker and thing, under the floor when unused.

Only the drawing model has them; physics knows nothing of what the workers hold.
"""

from typing import Any

import mujoco
import numpy as np

from hrc_env.core.records import Held
from hrc_env.core.typing import Ints
from hrc_env.scene.primitives import DECORATION, WORKER_CAPSULES
from hrc_env.worker.body import assets_dir
from hrc_env.worker.props import PROP_NAMES

PARKED_M = (0.0, 0.0, -30.0)
"""Where things are that nobody holds [m]."""


def add_props(spec: Any, prefixes: tuple[str, ...]) -> None:
    """Everything that can be held, once a worker, parked; call after the workers are added.

    Args:
        spec: the model.
        prefixes: what the names of each worker's bodies start with.
    """
    for prefix in prefixes:
        props = mujoco.MjSpec.from_file(str(assets_dir() / "scenes" / "props.xml"))
        spec.attach(props, prefix=prefix, frame=spec.worldbody.add_frame())


def prop_mocap(model: mujoco.MjModel, prefixes: tuple[str, ...]) -> Ints:
    """(W, len(PROPS) - 1) mocap row of every worker's things; they follow the workers' rows."""
    names = PROP_NAMES[1:]
    rows = [model.body(prefix + name).mocapid[0] for prefix in prefixes for name in names]
    return np.array(rows, np.int64).reshape(len(prefixes), len(names))


def pose_props(model: mujoco.MjModel, data: mujoco.MjData, rows: Ints, held: Held | None) -> None:
    """Put into the hands what is held, all else under the floor, where no camera draws it.

    Args:
        model: a drawing model of the caller's own; its things' groups are changed.
        data: of that model; its mocap poses are changed.
        rows: (W, len(PROPS) - 1) of `prop_mocap`.
        held: of one environment, arrays (W, ...); None: nothing is held.
    """
    if not rows.size:
        return
    data.mocap_pos[rows] = PARKED_M
    shown = np.zeros(0, np.int64)
    if held is not None:
        busy = np.flatnonzero(held.kind > 0)
        shown = rows[busy, held.kind[busy] - 1]
        data.mocap_pos[shown] = held.position_world[busy]
        data.mocap_quat[shown] = held.quaternion_wxyz[busy]
    of_geom = model.body_mocapid[model.geom_bodyid]
    things = of_geom >= rows.min()
    model.geom_group[things] = np.where(
        np.isin(of_geom[things], shown), DECORATION, WORKER_CAPSULES
    )
