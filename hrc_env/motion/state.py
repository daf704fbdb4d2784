"""State of the workers' motion: one structured array, with axes for environments and workers.

Lengths are in metres, times in seconds, angles in radians. A kernel takes the record of one worker
(`Worker`) or an array of them. `WORKER` rows are NumPy records, so Python code reads and writes
fields as attributes, too.
"""

from typing import Annotated

import numpy as np

from hrc_env.core.declared import dtype_of
from hrc_env.core.typing import Floats
from hrc_env.motion import controls as c
from hrc_env.motion.anatomy import N_ROUND, N_SIZES
from hrc_env.worker.body import N_SEGMENTS

MAX_VIA = 8
"""Greatest number of corners of a path."""
MAX_STEPS = 72
"""Greatest number of steps of one walk: 30 m at 0.8 m/s and the turns at its ends."""
N_ROOTS = 48
"""Number of moments at which the root of a clip is stored."""
N_POINTS = N_SEGMENTS + 4
"""Rows of points in the kinematics: the segments, then four auxiliary points."""
N_FRAMES = N_SEGMENTS + 1
"""Rows of rotations in the kinematics: the segments, then one auxiliary rotation."""


class Worker:
    """One simulated worker: body, current activity, the plan of that activity and scratch space.

    The fields from `start_x` to `roots` are written when an activity begins (`activities`); the
    closed form of the activity reads them. Yaw, pitch and roll are turns about z, y and x, applied
    in that order from the world to the object.
    """

    # The episode.
    is_present: bool
    """Whether the worker takes part in this episode."""
    body: int
    """Row of the worker's body in the pool of bodies; the next four fields are its `Anatomy`."""
    bones: Annotated[Floats, (N_SEGMENTS, 3)]
    """Origin of each segment in its parent's frame at rest [m]."""
    frame: Annotated[Floats, (N_SEGMENTS, 3, 3)]
    """Rows bone, hinge x bone and hinge of each limb bone at rest; zero for other segments."""
    lengths: Annotated[Floats, (N_SIZES,)]
    """Lengths of the body [m]; `anatomy` names the columns."""
    trunk_ends: Annotated[Floats, (N_ROUND, 5)]
    """Ends of the trunk's capsules: segment, position in its frame (3) [m], radius [m]."""
    speed_m_s: float
    """Preferred walking speed [m/s]."""
    squat_share: float
    """Share of squatting, rather than bowing, in a lift."""
    right_handed: float
    """Probability of using the right hand where either would do."""
    phases: Annotated[Floats, (5,)]
    """Phases of the worker's sway, in periods."""

    # The current activity and errand.
    clock_s: float
    """Time since the episode began [s]."""
    activity: int
    """Current activity, an index into `ACTIVITY_NAMES`."""
    time_s: float
    """Time since the activity began, on the activity's own clock [s]."""
    duration_s: float
    """Duration of the activity on its own clock [s]."""
    pace: float
    """Rate of the activity's clock: 1 as planned, 0 halted, negative while it is undone."""
    wanted_pace: float
    """Pace that `pace` approaches."""
    blend: Annotated[Floats, (c.N_BLENDED, 2)]
    """Difference to the previous activity at time 0, value and rate, which decays."""
    stance: Annotated[Floats, (2, 5)]
    """Footprints at the beginning, left and right; columns as in `footprints`."""
    footprints: Annotated[Floats, (MAX_STEPS, 5)]
    """Footprint of each step: x, y [m], heading [rad], share of a full stride, height [m]."""
    place: Annotated[Floats, (4,)]
    """Place of the errand: x, y [m], heading [rad], height of the work [m]."""
    stay_until_s: float
    """Clock until which the worker stays at the place [s]."""
    waiting_since_s: float
    """Clock since which the worker has been waiting for a free way [s]; 0 if not waiting."""
    job: int
    """Current job, an index into the schedule's jobs."""
    travel: int
    """Progress of the errand: `THERE`, `UNDER_WAY` or `WAITING`."""
    place_kind: int
    """Kind of the place, an index into `WORKPLACE_KINDS`, or `NOWHERE` or `ON_STAGE`."""

    # The worker and the robot.
    robot_world: Annotated[Floats, (2, 3)]
    """Elbow and tool of the robot in the world at the last look [m]; infinite before the first."""
    reacts_at_s: float
    """Clock at which the worker will react to the robot [s]; infinite if nothing was noticed."""
    current_reaction: int
    """Current reaction: `NO_REACTION`, `PAUSE` or `BACK_AWAY`."""
    reaction_until_s: float
    """Clock at which the current reaction ends [s]."""
    calm_until_s: float
    """Clock before which nothing startles the worker [s]."""
    reaction_delay_s: float
    """Delay of the next reaction [s], drawn when an activity begins."""
    planned_reaction: int
    """Kind of the next reaction, drawn when an activity begins."""
    reaction_s: float
    """Duration of the next reaction [s], drawn when an activity begins."""
    signal: int
    """Stage of the task's signal that the worker waits for, see `reactions.follow_signal`."""

    # The plan of the activity: where it begins and ends, its steps, the load.
    start_x: float
    """World x of the root at the beginning [m]."""
    start_y: float
    """World y of the root at the beginning [m]."""
    start_yaw: float
    """Heading at the beginning [rad]."""
    end_x: float
    """World x of the root at the end [m]."""
    end_y: float
    """World y of the root at the end [m]."""
    end_yaw: float
    """Heading at the end [rad]."""
    step_start: float
    """Time of the first lift-off [s]."""
    step_period: float
    """Time from one lift-off to the next [s]."""
    step_swing: float
    """Time that a foot is in the air [s]."""
    step_first: int
    """Foot of the first step: 0 left, 1 right."""
    step_count: int
    """Number of steps."""
    undo_at: float
    """Time from which the steps are retraced, the last one first [s]; 0 for never."""
    total_s: float
    """Duration of an activity with a second half that mirrors the first [s]."""
    load_prop: int
    """Prop that is carried from one activity to the next, an index into `PROPS`; 0 for nothing."""
    load_at: Annotated[Floats, (6,)]
    """Pose of the load relative to the root: ahead, left, up [m], yaw, pitch, roll [rad]."""
    load_grip: Annotated[Floats, (6,)]
    """Grips of the left and the right hand in the load's frame [m]."""
    load_used: Annotated[Floats, (2,)]
    """1 for each hand, left and right, that holds the load, else 0."""

    # Walking, running, falling, pushing.
    sharpest: float
    """Greatest curvature of the path [1/m]."""
    n_pieces: int
    """Number of pieces of the path."""
    length: float
    """Length of the path [m]."""
    path: Annotated[Floats, (2 * MAX_VIA + 1, 6)]
    """Pieces of the path, lines and arcs; `paths` explains the columns."""
    depart: float
    """Time at which the root sets off [s]."""
    ramp: float
    """Time in which the root gathers its top speed, and again loses it [s]."""
    travel_s: float
    """Time that the root moves along the path [s]."""
    top_m_s: float
    """Top speed along the path [m/s]."""
    turn_in: float
    """Angle of the turn from the first heading into the path [rad]."""
    turn_in_s: float
    """Duration of the turn into the path [s]."""
    turn_out: float
    """Angle of the turn out of the path into the last heading [rad]."""
    turn_out_s: float
    """Duration of the turn out of the path [s]."""
    turn_out_at: float
    """Time at which the turn out of the path begins [s]."""
    follow: float
    """1 to face along the path, 0 to keep the heading and side-step."""
    trip_at: float
    """Time at which a foot catches [s]."""
    trip: float
    """Severity of the stumble in [0, 1]; 0 for none."""
    flight_s: float
    """Additional time in the air at the top speed of a run [s]; 0 in a walk."""
    fall_yaw: float
    """Direction of the fall [rad]."""
    fall_pace: float
    """Rate of the fall relative to `falling.POSES`."""
    lie_s: float
    """Time that the worker lies on the floor [s]."""
    lie_roll: float
    """Turn of the lying trunk about its length [rad]; positive to the left."""
    front: int
    """Foot on which the worker gets up first: 0 left, 1 right."""
    fall_x: float
    """World x between the balls of both feet at the stumble [m]."""
    fall_y: float
    """World y between the balls of both feet at the stumble [m]."""
    grasp_s: float
    """Time to take hold of the handles of a cart, and to release them [s]."""
    tilt: float
    """Tilt of a wheelbarrow while it is pushed [rad]."""
    stoop: float
    """Lean of the trunk to the handles, as in `posture.lean`."""

    # Reaching, lifting, work in place.
    lean: float
    """Lean of the trunk at full reach, see `posture.lean`."""
    twist: float
    """Turn of the trunk at full reach [rad]."""
    squat: float
    """Share of the lean that the knees take."""
    out_at: float
    """Time at which the hands leave [s]."""
    out_s: float
    """Time that the hands take to arrive [s]."""
    hold_s: float
    """Time that the hands stay [s]."""
    back_s: float
    """Time that the hands take to return [s]."""
    target: Annotated[Floats, (6,)]
    """Targets of the grips of the left and the right hand in the world [m]."""
    hands_used: Annotated[Floats, (2,)]
    """1 for each hand, left and right, that goes to its target, else 0."""
    gaze_yaw: float
    """Turn of the head to the work [rad]; left is positive."""
    gaze_pitch: float
    """Pitch of the head to the work [rad]; down is positive."""
    gaze: Annotated[Floats, (3,)]
    """Point in the world that the worker looks at [m]."""
    fidget_m: float
    """Amplitude of the work that reaching hands do [m]."""
    fidget_hz: float
    """Rate of the work that reaching hands do [Hz]."""
    raised: Annotated[Floats, (6,)]
    """Grips of the left and the right hand with the load lifted, in the world [m]."""
    raise_s: float
    """Time to raise the load [s]."""
    carry_s: float
    """Time to hold the load up [s]."""
    settle_s: float
    """Time to get down to the work [s]."""
    kneel: float
    """Share of kneeling: 1 on one knee, 0 upright."""
    crouch: float
    """Share of crouching: 1 on the haunches, 0 upright."""
    ahead: float
    """Displacement of the root on getting down [m], along the heading."""
    tool: int
    """Prop of the work, an index into `PROPS`; 0 for empty hands."""
    side: int
    """Hand that holds the tool: 0 left, 1 right."""
    take_s: float
    """Time to take the tool from the belt [s]."""
    tool_pose: Annotated[Floats, (6,)]
    """Pose of the tool at work, or of a load that stands: x, y, z [m], yaw, pitch, roll [rad]."""
    midway: Annotated[Floats, (6,)]
    """Pose of a load held up before the body: x, y, z [m], yaw, pitch, roll [rad]."""
    shoulder_s: float
    """Time to bring a load from before the body to where it is carried [s]."""
    is_hidden: bool
    """Whether the load is another person's until it is gripped, and so is not drawn."""
    stroke: int
    """Kind of stroke, see `strokes`."""
    stroke_m: float
    """Size of a stroke [m]."""
    stroke_hz: float
    """Rate of the strokes [Hz]."""
    burst_s: float
    """Duration of a burst of strokes [s]."""
    wander_m: float
    """Distance to the left that the work moves to and fro between bursts [m]."""
    down_m: float
    """Distance that the work moves down between bursts [m]."""
    treads: float
    """Number of treads to climb."""
    riser_m: float
    """Rise from tread to tread [m]."""
    up_s: float
    """Time to climb up [s]."""
    left_rad: float
    """First turn of the head on looking round [rad]."""
    left_s: float
    """Time at which the head leaves its first turn [s]."""
    right_rad: float
    """Second turn of the head on looking round [rad]."""
    right_s: float
    """Time at which the head leaves its second turn [s]."""

    # Playing a clip.
    clip_row: int
    """First frame of the clip among the frames of all clips."""
    clip_frames: int
    """Number of frames of the clip."""
    clip_fps: float
    """Frame rate of the clip [Hz]."""
    clip_yaw: float
    """Heading at which the clip is played [rad]."""
    clip_s: float
    """Time that playing the frames takes [s]."""
    roots: Annotated[Floats, (N_ROOTS, 2)]
    """World x, y of the root over the clip at equal intervals [m], for others to keep clear of."""

    # Scratch space of the kernels.
    q: Annotated[Floats, (c.N_CONTROLS,)]
    """Control vector of the current moment, see `controls`."""
    p: Annotated[Floats, (N_POINTS, 3)]
    """Origins of the segments in the world [m], then the kinematics' auxiliary points."""
    r: Annotated[Floats, (N_FRAMES, 3, 3)]
    """Rotation world_from_segment of each segment, then the kinematics' auxiliary rotation."""
    later_p: Annotated[Floats, (N_POINTS, 3)]
    """Copy of `p` a moment later [m], for velocities."""
    later_r: Annotated[Floats, (N_FRAMES, 3, 3)]
    """Copy of `r` a moment later, for angular velocities."""
    goals: Annotated[Floats, (6,)]
    """Targets of both hands in the world while work is planned [m]."""
    handover: Annotated[Floats, (2, c.N_BLENDED)]
    """Control vector at the end of an activity, and a moment later."""
    fall_share: float
    """Share of the fallen posture in the pose."""
    trunk_roll: float
    """Turn of a fallen trunk about its length [rad]."""
    elbows_out: float
    """Share by which the elbows of a fallen worker point outwards."""
    knees_out: float
    """Share by which the knees of a fallen worker point outwards."""


WORKER = np.dtype((np.record, dtype_of(Worker)))
"""NumPy's type of a `Worker`; its rows have attributes in Python, too."""
N_START = 16
"""Number of uniform draws that a start function may use."""

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
"""Name of each activity, by its number."""
GOING = (WALK, TURN, CARRY, STUMBLE, STEP_BACK)
"""Activities with the closed form of a walk."""
IDLE = (STAND, LOOK_ROUND)
"""Activities in which a load is merely held."""
TAKING = (PICK_UP, RECEIVE)
"""Activities with the closed form of picking up."""
GIVING = (SET_DOWN, HAND_OVER)
"""Activities with the closed form of picking up, backwards in time."""
WAYS = (WALK, TURN, CARRY, PUSH, STUMBLE, CLIP, RUN, FALL)
"""Activities that are not a job to be done at a place."""
NOWHERE = -1
"""Kind of place of a worker without an errand."""
ON_STAGE = -2
"""Kind of place with room to play a clip."""
THERE, UNDER_WAY, WAITING = range(3)
NO_REACTION, PAUSE, BACK_AWAY = range(3)
