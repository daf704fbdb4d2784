"""Columns of the control vector, which describes a pose independently of the body.

Angles are in radians and lengths in metres, in the world frame unless stated otherwise. Relaxed
arms are defined relative to the shoulder, in a level frame that turns with the chest. Grasping arms
are defined by a target in the world and a weight between 0 (relaxed) and 1 (at the target).
"""

ROOT_X, ROOT_Y, HEADING = 0, 1, 2
"""Position of the root on the floor [m] and heading [rad]."""
PELVIS_Z = 3
"""Desired height of the pelvis [m]; it is lower if the legs do not reach that far."""
PELVIS_PITCH, PELVIS_ROLL, PELVIS_YAW = 4, 5, 6
"""Tilt of the pelvis forward and to the right, and its yaw relative to the heading [rad]."""
SPINE_FLEX, SPINE_SIDE, SPINE_TWIST = 7, 8, 9
"""Flexion, lateral bend and twist of the spine [rad], summed over abdomen, torso and chest."""
HEAD_PITCH, HEAD_YAW = 10, 11
"""Pitch and yaw of the head relative to the chest [rad]; down and left are positive."""
SWIVEL = 12
"""Outward swivel of the left elbow from its lowest position [rad]; the right elbow is next."""
HAND_OFFSET = 14
"""Grip of the left hand from its shoulder: ahead, left, up [m]; the right hand's columns follow."""
N_BLENDED = 20
"""Number of leading columns that are blended when one activity follows another."""
HAND_TARGET = 20
"""Target of the left hand's grip in the world: x, y, z [m]; the right hand's columns follow."""
HAND_SHARE = 26
"""Weight of the left hand's target, from 0 to 1; the right hand's column follows."""
ANKLE = 28
"""Left ankle: x, y, z [m], heading of the foot, pitch of the foot, pitch of the toes [rad].

A pitch with the heel up is positive; the right ankle's six columns follow.
"""
PROP = 40
"""Held prop, an index into `props.PROPS`; 0 for none."""
PROP_POSE = 41
"""Pose of the prop: origin x, y, z [m], yaw, pitch, roll [rad]."""
N_CONTROLS = 47
"""Number of columns."""
