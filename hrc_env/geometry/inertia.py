"""Joint-space mass matrix of a serial chain, and the effective mass at a point of it.

The mass matrix is the sum over the links of J^T m J + J_w^T I J_w, with the Jacobians J of the
link's centre of mass and J_w of its angular velocity, plus the armature of the joints on the
diagonal. A load counts as a point mass at the tool point. At a point with Jacobian J_p, the
effective mass along a unit vector n is that of the operational space (Khatib 1987, DOI
10.1109/JRA.1987.1087068):

    m_R = 1 / (n^T J_p M(q)^-1 J_p^T n)

Its inverse is called mobility. It is 0 along directions in which no joint moves the point.
"""

from typing import NamedTuple

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Bools, Floats, Points3, Transforms
from hrc_env.geometry.chains import SerialChain, lever, transform_point


class LinkInertias(NamedTuple):
    """Masses and inertias of the N links of a chain.

    Units are given for hinges. Parts behind further joints, such as fingers, count as rigidly
    attached to their link.
    """

    mass_kg: Floats
    """Mass of each link (N,) [kg]."""
    centre_m: Points3
    """Centre of mass of each link in its frame (N, 3) [m]."""
    inertia_kg_m2: Floats
    """Inertia of each link about its centre of mass, along the axes of its frame (N, 3, 3)
    [kg m^2]."""
    armature_kg_m2: Floats
    """Inertia of the rotor of each joint as seen by the joint (N,) [kg m^2]; [kg] for a slide."""


def find_mass_matrices(
    chain: SerialChain, inertias: LinkInertias, frames: Transforms, load_kg: Floats
) -> Floats:
    """Return the joint-space mass matrices (B, N, N) of robots [kg m^2; kg for slides].

    Args:
        chain: kinematics of the robots.
        inertias: masses and inertias of the links.
        frames: (B, N, 4, 4) poses of the links in the world.
        load_kg: (B,) mass of the load at the tool point [kg].
    """
    matrices = np.empty((len(frames), chain.n_joints, chain.n_joints))
    _write_mass_matrices(frames, chain.slides, inertias, chain.link_from_tool, load_kg, matrices)
    return matrices


@kernel
def find_mobility(inverse: Floats, row: Floats) -> float:
    """Return the mobility n^T J M^-1 J^T n of a point along n [1/kg].

    Args:
        inverse: (N, N) inverse of the mass matrix.
        row: (N,) n^T J.
    """
    total = 0.0
    for i in range(len(row)):
        for j in range(len(row)):
            total += row[i] * inverse[i, j] * row[j]
    return max(total, 0.0)


@kernel(makes_arrays=True)
def _write_mass_matrices(
    frames: Transforms,
    slides: Bools,
    inertias: LinkInertias,
    link_from_tool: Transforms,
    load_kg: Floats,
    matrices: Floats,
) -> None:
    """Compute the mass matrices `matrices` (B, N, N); see `find_mass_matrices`."""
    n = len(slides)
    linear, angular, turned = np.empty((n, 3)), np.empty((n, 3)), np.empty((3, 3))
    for b in range(len(frames)):
        M = matrices[b]
        for i in range(n):
            for j in range(n):
                M[i, j] = inertias.armature_kg_m2[i] if i == j else 0.0
        for link in range(n):
            frame = frames[b, link]
            centre = transform_point(frame, inertias.centre_m[link])
            _rotate_inertia(frame, inertias.inertia_kg_m2[link], turned)
            for i in range(link + 1):
                x, y, z = lever(frames[b, i], slides[i], centre)
                linear[i, 0], linear[i, 1], linear[i, 2] = x, y, z
                for k in range(3):
                    angular[i, k] = 0.0 if slides[i] else frames[b, i, k, 2]
            for i in range(link + 1):
                for j in range(link + 1):
                    for k in range(3):
                        M[i, j] += inertias.mass_kg[link] * linear[i, k] * linear[j, k]
                        for m in range(3):
                            M[i, j] += angular[i, k] * turned[k, m] * angular[j, m]
        tool = transform_point(frames[b, n - 1], link_from_tool[:, 3])
        for i in range(n):
            x, y, z = lever(frames[b, i], slides[i], tool)
            linear[i, 0], linear[i, 1], linear[i, 2] = x, y, z
        for i in range(n):
            for j in range(n):
                for k in range(3):
                    M[i, j] += load_kg[b] * linear[i, k] * linear[j, k]


@kernel
def _rotate_inertia(frame: Transforms, inertia: Floats, turned: Floats) -> None:
    """Write R I R^T to `turned` (3, 3), with R the rotation of a frame (4, 4)."""
    for i in range(3):
        for j in range(3):
            turned[i, j] = 0.0
            for k in range(3):
                for m in range(3):
                    turned[i, j] += frame[i, k] * inertia[k, m] * frame[j, m]
