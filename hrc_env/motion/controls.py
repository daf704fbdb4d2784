"""The control vector: what an activity says of one moment, before any anatomy; its columns.

Radians and metres, in the world unless said. Relaxed arms are given relative to their shoulder (in
a level frame that turns with the chest), grasping ones in the world, with the share of these.
"""

ROOT_X, ROOT_Y, HEADING = 0, 1, 2
"""Where the worker is and looks: the ground frame of everything below."""
PELVIS_Z, PELVIS_PITCH, PELVIS_ROLL, PELVIS_YAW = 3, 4, 5, 6
"""Wished height of the pelvis (the legs may allow less), its tilt, its turn from the heading."""
SPINE_FLEX, SPINE_SIDE, SPINE_TWIST = 7, 8, 9
"""Sums over abdomen, torso and chest."""
HEAD_PITCH, HEAD_YAW = 10, 11
"""Relative to the chest, shared by neck and head; down and left positive."""
SWIVEL = 12
"""12, 13: how far the left and right elbow are turned outwards from hanging."""
HAND_OFFSET = 14
"""14-16 left, 17-19 right: grip from its shoulder, forward, left, up [m]."""
N_BLENDED = 20
"""The columns before this one are blended when an activity follows another."""
HAND_TARGET = 20
"""20-22 left, 23-25 right: grip in the world [m]."""
HAND_SHARE = 26
"""26, 27: 0 relaxed, 1 at the target."""
ANKLE = 28
"""28-33 left, 34-39 right: ankle x, y, z, heading of the foot, pitch of the foot (heel up
positive), pitch of the toes."""
PROP = 40
"""What is held, an index into `props.PROPS`; 0 nothing."""
PROP_POSE = 41
"""41-46: origin of the prop's frame [m], its yaw, pitch and roll."""
N_CONTROLS = 47
