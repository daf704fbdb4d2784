"""Columns of the control vector, with which an activity describes one moment before any anatomy.

Angles are in radians, lengths in metres, both in the world frame unless stated otherwise. Relaxed
arms are given relative to their shoulder, in a level frame that turns with the chest; grasping arms
are given in the world, with the share by which they follow their target.
"""

ROOT_X, ROOT_Y, HEADING = 0, 1, 2
"""Position of the root on the floor [m] and heading [rad], the frame of other columns."""
PELVIS_Z = 3
"""Wanted height of the pelvis [m]; legs that are too short lower it."""
PELVIS_PITCH, PELVIS_ROLL, PELVIS_YAW = 4, 5, 6
"""Tilt of the pelvis forward and to the right, and its turn from the heading [rad]."""
SPINE_FLEX, SPINE_SIDE, SPINE_TWIST = 7, 8, 9
"""Flexion, side bend and twist of the spine [rad], summed over abdomen, torso and chest."""
HEAD_PITCH, HEAD_YAW = 10, 11
"""Turn of the head from the chest, shared by neck and head [rad]; down and left are positive."""
SWIVEL = 12
"""Outward turn of the left elbow from hanging [rad]; the next column is the right elbow's."""
HAND_OFFSET = 14
"""Grip of the left hand from its shoulder: ahead, left, up [m]; the right hand's follows."""
N_BLENDED = 20
"""Number of columns that are blended when one activity follows another, the first ones."""
HAND_TARGET = 20
"""Target of the left hand's grip in the world, x, y, z [m]; the right hand's follows."""
HAND_SHARE = 26
"""Share by which the left hand follows its target; the next column is the right hand's."""
ANKLE = 28
"""Left ankle: x, y, z [m], heading of the foot, pitch of the foot, pitch of the toes [rad].

The heel up is positive; the right ankle's six columns follow.
"""
PROP = 40
"""Prop that is held, an index into `props.PROPS`; 0 for nothing."""
PROP_POSE = 41
"""Pose of the prop: origin x, y, z [m], yaw, pitch, roll [rad]."""
N_CONTROLS = 47
"""Number of columns."""
