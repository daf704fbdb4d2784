"""State of the workers' motion, a structured array with axes for environments and workers.

Lengths are in metres, times in seconds, angles in radians. A kernel takes the record of one worker
(`Worker`) or an array of them. The fields are attributes of `WORKER` rows in Python, too.
"""

from typing import Annotated

import numpy as np

from hrc_env.core.declared import dtype_of
from hrc_env.core.typing import Floats
from hrc_env.motion import controls as c
from hrc_env.motion.anatomy import N_ROUND, N_SIZES
from hrc_env.motion.rows import with_fields
from hrc_env.worker.body import N_SEGMENTS

MAX_VIA = 8
"""Maximum number of corners of a path."""
MAX_STEPS = 72
"""Maximum number of steps of one walk, sufficient for 30 m at 0.8 m/s with turns at both ends."""
N_ROOTS = 48
"""Number of samples of the root's path that are stored for a clip."""
N_POINTS = N_SEGMENTS + 4
"""Number of points in the kinematics: the segments, followed by four auxiliary points."""
N_FRAMES = N_SEGMENTS + 1
"""Number of rotations in the kinematics: the segments, followed by one auxiliary rotation."""


class Worker:
    """Record of a worker with body, current activity, the plan of the activity, and scratch space.

    The fields from `start_x` to `roots` are set when an activity begins, and are the parameters of
    its closed-form motion (package `activities`). Yaw, pitch and roll are rotations about z, y and
    x: world_from_object = Rz(yaw) Ry(pitch) Rx(roll).
    """

    # The episode.
    is_present: bool
    """Whether the worker is present in this episode."""
    body: int
    """Row of the worker's body in the pool; the next four fields are the `Anatomy` of this body."""
    bones: Annotated[Floats, (N_SEGMENTS, 3)]
    """Origin of each segment in its parent's frame at rest [m]."""
    frame: Annotated[Floats, (N_SEGMENTS, 3, 3)]
    """Axes of each limb bone at rest, as rows (bone, hinge x bone, hinge); otherwise zero."""
    lengths: Annotated[Floats, (N_SIZES,)]
    """Body dimensions [m], with the columns described at `anatomy.N_SIZES`."""
    trunk_ends: Annotated[Floats, (N_ROUND, 5)]
    """Ends of the trunk's capsules: segment, position (3) in its frame [m], radius [m]."""
    speed_m_s: float
    """Preferred walking speed [m/s]."""
    squat_share: float
    """Degree of squatting instead of bending the trunk in a lift, from 0 to 1."""
    right_handed: float
    """Probability that the right hand is used if both hands are suitable."""
    phases: Annotated[Floats, (5,)]
    """Phases of the worker's postural sway, as fractions of the periods."""

    # The current activity and errand.
    clock_s: float
    """Time since the episode began [s]."""
    activity: int
    """Current activity, an index into `ACTIVITY_NAMES`."""
    time_s: float
    """Time since the activity began, on the clock of the activity [s]."""
    duration_s: float
    """Duration of the activity on the clock of the activity [s]."""
    pace: float
    """Rate of the activity's clock: 1 as planned, 0 if halted, negative for reversed motion."""
    wanted_pace: float
    """Target value of `pace`."""
    blend: Annotated[Floats, (c.N_BLENDED, 2)]
    """Difference from the controls of the previous activity: value and rate at time 0."""
    stance: Annotated[Floats, (2, 5)]
    """Footprints of the left and right foot at the beginning, with the columns of `footprints`."""
    footprints: Annotated[Floats, (MAX_STEPS, 5)]
    """Footprint of each step: x, y [m], heading [rad], step length / full stride, height [m]."""
    place: Annotated[Floats, (4,)]
    """Destination of the errand: x, y [m], heading [rad], height of the work [m]."""
    stay_until_s: float
    """Episode time until which the worker stays at the workplace [s]."""
    waiting_since_s: float
    """Episode time since which the worker has waited for a free path [s]; 0 if not waiting."""
    job: int
    """Current job, an index into the schedule's jobs."""
    travel: int
    """Progress of the errand: `THERE`, `UNDER_WAY` or `WAITING`."""
    place_kind: int
    """Kind of the destination, an index into `WORKPLACE_KINDS`, `NOWHERE` or `ON_STAGE`."""

    # The worker and the robot.
    robot_world: Annotated[Floats, (2, 3)]
    """World positions of the robot's elbow and tool when last observed [m]; initially infinite."""
    reacts_at_s: float
    """Episode time of the worker's next reaction to the robot [s]; infinite if none is pending."""
    current_reaction: int
    """Current reaction: `NO_REACTION`, `PAUSE` or `BACK_AWAY`."""
    reaction_until_s: float
    """Episode time at which the current reaction ends [s]."""
    calm_until_s: float
    """Episode time until which the worker does not react again [s]."""
    reaction_delay_s: float
    """Delay of the next reaction [s], sampled when an activity begins."""
    planned_reaction: int
    """Kind of the next reaction, sampled when an activity begins."""
    reaction_s: float
    """Duration of the next reaction [s], sampled when an activity begins."""
    signal: int
    """Current stage of the task's signal, as defined in `reactions.follow_signal`."""

    # The plan of the activity: where it begins and ends, its steps, the load.
    start_x: float
    """World x of the root when the activity begins [m]."""
    start_y: float
    """World y of the root when the activity begins [m]."""
    start_yaw: float
    """Heading when the activity begins [rad]."""
    end_x: float
    """World x of the root when the activity ends [m]."""
    end_y: float
    """World y of the root when the activity ends [m]."""
    end_yaw: float
    """Heading when the activity ends [rad]."""
    step_start: float
    """Time at which the first foot lifts off [s]."""
    step_period: float
    """Time from one lift-off to the next [s]."""
    step_swing: float
    """Duration of a foot's swing [s]."""
    step_first: int
    """Foot that takes the first step: 0 left, 1 right."""
    step_count: int
    """Number of steps."""
    undo_at: float
    """Time from which the steps are retraced in reverse order [s]; 0 for never."""
    total_s: float
    """Duration of an activity in which the second half reverses the first half in time [s]."""
    load_prop: int
    """Prop that is carried from one activity to the next, an index into `PROPS`; 0 for nothing."""
    load_at: Annotated[Floats, (6,)]
    """Pose of the load relative to the root: ahead, left, up [m], yaw, pitch, roll [rad]."""
    load_grip: Annotated[Floats, (6,)]
    """Grips of the left and the right hand in the load's frame [m]."""
    load_used: Annotated[Floats, (2,)]
    """Flags of the left and the right hand: 1 if it holds the load, otherwise 0."""

    # Walking, running, falling, pushing.
    sharpest: float
    """Maximum curvature of the path [1/m]."""
    n_pieces: int
    """Number of lines and arcs of the path."""
    length: float
    """Length of the path [m]."""
    path: Annotated[Floats, (2 * MAX_VIA + 1, 6)]
    """Lines and arcs of the path, one per row; the module `paths` explains the columns."""
    depart: float
    """Time at which the root starts to move [s]."""
    ramp: float
    """Time in which the root accelerates to its top speed, and decelerates from it [s]."""
    travel_s: float
    """Duration of the root's motion along the path [s]."""
    top_m_s: float
    """Top speed along the path [m/s]."""
    turn_in: float
    """Initial heading relative to the path's direction [rad], which the first turn removes."""
    turn_in_s: float
    """Duration of the turn into the path [s]."""
    turn_out: float
    """Angle from the path's final direction to the final heading [rad]."""
    turn_out_s: float
    """Duration of the turn out of the path [s]."""
    turn_out_at: float
    """Time at which the turn out of the path begins [s]."""
    follow: float
    """Orientation on the path: 1 to face along it, 0 to keep the heading and side-step."""
    trip_at: float
    """Time at which a foot is caught in a stumble or fall [s]."""
    trip: float
    """Severity of the stumble in [0, 1]; 0 for none."""
    flight_s: float
    """Additional swing time at the top speed of a run [s]; 0 for a walk."""
    fall_yaw: float
    """Direction of the fall [rad]."""
    fall_pace: float
    """Speed of the fall relative to `falling.POSES`."""
    lie_s: float
    """Time for which the worker lies on the floor [s]."""
    lie_roll: float
    """Rotation of the lying trunk about its long axis [rad], positive to the left."""
    front: int
    """Foot on which the worker gets up first: 0 left, 1 right."""
    fall_x: float
    """World x of the midpoint between the balls of the feet at the stumble [m]."""
    fall_y: float
    """World y of the midpoint between the balls of the feet at the stumble [m]."""
    grasp_s: float
    """Time to grasp the handles of a cart, and time to release them [s]."""
    tilt: float
    """Tilt of a wheelbarrow while it is pushed [rad]."""
    stoop: float
    """Lean of the trunk towards the handles of a cart, as defined in `posture.lean`."""

    # Reaching, lifting, work in place.
    lean: float
    """Lean of the trunk at full reach, as defined in `posture.lean`."""
    twist: float
    """Twist of the trunk at full reach [rad]."""
    squat: float
    """Fraction of the lean that is achieved by bending the knees."""
    out_at: float
    """Time at which the hands start to move [s]."""
    out_s: float
    """Time that the hands need to reach their targets [s]."""
    hold_s: float
    """Time for which the hands stay at their targets [s]."""
    back_s: float
    """Time that the hands need to return [s]."""
    target: Annotated[Floats, (6,)]
    """World positions of the targets of the left and the right grip [m]."""
    hands_used: Annotated[Floats, (2,)]
    """Flags of the left and the right hand: 1 if it moves to its target, otherwise 0."""
    gaze_yaw: float
    """Yaw of the head towards the work [rad]; left is positive."""
    gaze_pitch: float
    """Pitch of the head towards the work [rad]; down is positive."""
    gaze: Annotated[Floats, (3,)]
    """Point in the world at which the worker looks [m]."""
    fidget_m: float
    """Amplitude of the small movements of hands at the target of a reach [m]."""
    fidget_hz: float
    """Frequency of the small movements of hands at the target of a reach [Hz]."""
    raised: Annotated[Floats, (6,)]
    """World positions of the left and the right grip when the load is raised [m]."""
    raise_s: float
    """Time to raise the load [s]."""
    carry_s: float
    """Time for which the load is held up [s]."""
    settle_s: float
    """Time to lower the body to the work [s]."""
    kneel: float
    """Degree of kneeling, from 0 (upright) to 1 (on one knee)."""
    crouch: float
    """Degree of squatting, from 0 (upright) to 1 (full squat)."""
    ahead: float
    """Displacement of the root along the heading while the body is lowered [m]."""
    tool: int
    """Tool of the work, an index into `PROPS`; 0 for empty hands."""
    side: int
    """Hand that holds the tool: 0 left, 1 right."""
    take_s: float
    """Time to take the tool from the belt [s]."""
    tool_pose: Annotated[Floats, (6,)]
    """Pose of the tool at work, or of a load at rest: x, y, z [m], yaw, pitch, roll [rad]."""
    midway: Annotated[Floats, (6,)]
    """Pose of a load held up in front of the body: x, y, z [m], yaw, pitch, roll [rad]."""
    shoulder_s: float
    """Time to move a load from in front of the body to the shoulder [s]."""
    is_hidden: bool
    """Whether the load is shown only while gripped, since another person holds it otherwise."""
    stroke: int
    """Kind of stroke, one of the constants in `activities.strokes`."""
    stroke_m: float
    """Size of a stroke [m]."""
    stroke_hz: float
    """Frequency of the strokes [Hz]."""
    burst_s: float
    """Duration of a burst of strokes [s]."""
    wander_m: float
    """Distance to the left by which the work moves back and forth between bursts [m]."""
    down_m: float
    """Distance by which the work moves down between bursts [m]."""
    treads: float
    """Number of treads to climb."""
    riser_m: float
    """Rise from tread to tread [m]."""
    up_s: float
    """Time to climb up [s]."""
    left_rad: float
    """First turn of the head when the worker looks round [rad]."""
    left_s: float
    """Time at which the head starts to move from its first to its second turn [s]."""
    right_rad: float
    """Second turn of the head when the worker looks round [rad]."""
    right_s: float
    """Time at which the head starts to return from its second turn [s]."""

    # Playing a clip.
    clip_row: int
    """Index of the clip's first frame in `Clips.frames`."""
    clip_frames: int
    """Number of frames of the clip."""
    clip_fps: float
    """Frame rate of the clip [Hz]."""
    clip_yaw: float
    """Heading at which the clip is played [rad]."""
    clip_s: float
    """Duration of the playback [s]."""
    roots: Annotated[Floats, (N_ROOTS, 2)]
    """World x, y of the root at equal intervals over the clip [m], avoided by other workers."""

    # Scratch space of the kernels.
    q: Annotated[Floats, (c.N_CONTROLS,)]
    """Current control vector, with the columns in `controls`."""
    p: Annotated[Floats, (N_POINTS, 3)]
    """Origins of the segments in the world [m], followed by auxiliary points."""
    r: Annotated[Floats, (N_FRAMES, 3, 3)]
    """Rotation world_from_segment of each segment, followed by an auxiliary rotation."""
    later_p: Annotated[Floats, (N_POINTS, 3)]
    """Value of `p` a short time later [m], from which velocities are computed."""
    later_r: Annotated[Floats, (N_FRAMES, 3, 3)]
    """Value of `r` a short time later, from which angular velocities are computed."""
    goals: Annotated[Floats, (6,)]
    """World positions of the targets of both hands, used while work is planned [m]."""
    handover: Annotated[Floats, (2, c.N_BLENDED)]
    """Control vector at the end of an activity and a short time later, for blending."""
    fall_share: float
    """Weight of the fallen posture in the pose, in [0, 1]."""
    trunk_roll: float
    """Rotation of a fallen trunk about its long axis [rad]."""
    elbows_out: float
    """Degree to which the elbows of a fallen worker point outwards, in [0, 1]."""
    knees_out: float
    """Degree to which the knees of a fallen worker point outwards, in [0, 1]."""


@with_fields(Worker)
class WorkerRow(np.void):
    """A row of `WORKER` in Python; the fields of `Worker` are its attributes."""


WORKER = np.dtype((WorkerRow, dtype_of(Worker)))
"""NumPy data type of a `Worker`; the fields of its rows are attributes in Python, too."""
N_START = 16
"""Number of uniform random numbers available to a start function."""

STAND, WALK, REACH, LIFT, TURN, CARRY, PUSH, STUMBLE, STEP_BACK, LOOK_ROUND = range(10)
PICK_UP, SET_DOWN, HAND_OVER, RECEIVE, SQUATTING, KNEELING, HAMMER, DRILL = range(10, 18)
OVERHEAD, SAW, MEASURE, POINT, LUNGE, CLIMB, CLIP, RUN, FALL = range(18, 27)
SCREW, TAKE = 27, 28
ACTIVITY_NAMES = (
    "stand",
    "walk",
    "reach",
    "lift",
    "turn",
    "carry",
    "push",
    "stumble",
    "step back",
    "look round",
    "pick up",
    "set down",
    "hand over",
    "receive",
    "squat",
    "kneel",
    "hammer",
    "drill",
    "drill overhead",
    "saw",
    "measure",
    "point",
    "lunge",
    "climb",
    "clip",
    "run",
    "fall",
    "screw",
    "take",
)
"""Name of each activity, by its index."""
GOING = (WALK, TURN, CARRY, STUMBLE, STEP_BACK)
"""Activities with the closed-form motion of a walk."""
IDLE = (STAND, LOOK_ROUND)
"""Activities in which a load is held without being moved."""
TAKING = (PICK_UP, RECEIVE)
"""Activities with the closed-form motion of picking up a load."""
GIVING = (SET_DOWN, HAND_OVER)
"""Activities with the closed-form motion of picking up a load, reversed in time."""
WAYS = (WALK, TURN, CARRY, PUSH, STUMBLE, CLIP, RUN, FALL)
"""Activities not available to jobs."""
NOWHERE = -1
"""Value of `place_kind` for a worker without an errand."""
ON_STAGE = -2
"""Value of `place_kind` if the destination is a location with room to play a clip."""
THERE, UNDER_WAY, WAITING = range(3)
NO_REACTION, PAUSE, BACK_AWAY = range(3)
