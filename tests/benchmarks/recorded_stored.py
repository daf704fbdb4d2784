"""A small made-up recording: a rig of four, a body that turns, its detections, its files."""

import numpy as np

from benchmarks.recorded.detections import Detections
from benchmarks.tracking.rigs import make_rig
from benchmarks.tracking.walks import walk
from hrc_env.geometry.cameras import project

SIGMA_PX = 3.0

CAMERA = """
<camera serial="{name}">
  <transform {place} z="1500"/>
  <intrinsic focalLengthU="64000" focalLengthV="64640" centerPointU="31968" centerPointV="63968"
    radialDistortion1="-0.05" radialDistortion2="0.1" radialDistortion3="0"
    tangentalDistortion1="0.001" tangentalDistortion2="0.002"/>
</camera>
"""


UP = 'r21="0" r22="0" r23="1"'
AT_FRONT = f'r11="1" r12="0" r13="0" {UP} r31="0" r32="-1" r33="0" x="0" y="-4000"'
AT_RIGHT = f'r11="0" r12="1" r13="0" {UP} r31="1" r32="0" r33="0" x="4000" y="0"'


def calibration(path, places=(AT_FRONT, AT_RIGHT)):
    """A Qualisys file with level cameras, 4 m from the world's upright axis."""
    cameras = "".join(CAMERA.format(name=f"cam{k}", place=place) for k, place in enumerate(places))
    path.write_text(f"<calibration><cameras>{cameras}</cameras></calibration>")
    return path


def recording(n_frames):
    """(P, joints (T, J, 3), detections) of a walk seen by the lab's cameras."""
    rig = make_rig("lab")
    joints = walk(rig.walk_m, [1000], n_frames)[:, 0]
    px = np.stack([project(rig.P, frame[None])[0][0] for frame in joints])
    px = px + SIGMA_PX * np.random.default_rng(0).standard_normal(px.shape)
    shape = px.shape[:-1]
    detections = Detections(px, np.full(shape, 0.9), np.full(shape, SIGMA_PX), 0.04)
    return rig, joints, detections
