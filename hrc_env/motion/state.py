"""The state of the workers' motion: one structured array, rows are environments and workers.

Metres, seconds, radians. Kernels take one worker's record (`Worker`). The fields of `_PLAN` are
written when an activity begins (`activities`), and its closed form reads them.
"""

from typing import Any, TypeAlias

import numpy as np

from hrc_env.motion import controls as c
from hrc_env.motion.anatomy import N_ROUND, N_SIZES
from hrc_env.worker.body import N_SEGMENTS

MAX_VIA, MAX_STEPS, N_ROOTS = 8, 72, 48
"""Most corners of a path, and steps of one walk: 30 m at 0.8 m/s, and turns at its ends; moments
at which a clip's root is noted."""
N_POINTS, N_FRAMES = N_SEGMENTS + 4, N_SEGMENTS + 1
"""Rows that the kinematics work in: the segments', then some of their own (`kinematics`)."""

_SCRATCH = [
    ("q", "f8", (c.N_CONTROLS,)),  # control vector
    ("p", "f8", (N_POINTS, 3)),  # origins of the segments
    ("r", "f8", (N_FRAMES, 3, 3)),  # world_from_segment
    ("later_p", "f8", (N_POINTS, 3)), ("later_r", "f8", (N_FRAMES, 3, 3)),
    ("goals", "f8", (6,)),  # of the hands, while work is planned
    ("handover", "f8", (2, c.N_BLENDED)),  # q where an activity ended, and a little later
    # Of who has fallen: share of what follows, the trunk's turn about its length, shares by which
    # elbows and knees are turned outwards
    ("fallen", "f8"), ("rolled", "f8"), ("elbows_out", "f8"), ("knees_out", "f8"),
]  # fmt: skip
_EPISODE = [
    ("present", "?"),  # whether they are in this episode
    ("body", "i8"),  # row of the bodies that there are; the next four are its `Anatomy`
    ("bones", "f8", (N_SEGMENTS, 3)), ("frame", "f8", (N_SEGMENTS, 3, 3)),
    ("size", "f8", (N_SIZES,)), ("round", "f8", (N_ROUND, 5)),
    ("speed_m_s", "f8"),  # at which they walk
    ("squat_share", "f8"),  # of squatting when lifting
    ("right_handed", "f8"),  # probability of using the right hand when either would do
    ("phases", "f8", (5,)),  # of their sway
]  # fmt: skip
_NOW = [
    ("clock_s", "f8"),  # since the episode began
    ("activity", "i8"),  # index into `ACTIVITY_NAMES`
    ("time_s", "f8"), ("duration_s", "f8"),  # since it began; how long it lasts
    ("pace", "f8"), ("pace_wished", "f8"),  # of its time: 1 as planned, 0 halted, < 0 taken back
    ("blend", "f8", (c.N_BLENDED, 2)),  # what the one before left over: value, rate at time 0
    ("stance", "f8", (2, 5)),  # footprints that it begins on: left, right; columns as `prints`
    ("prints", "f8", (MAX_STEPS, 5)),  # of its steps: x, y, heading, share of a full stride, height
    # What the worker is about
    ("spot", "f8", (4,)),  # place where they work or go to: x, y, heading, height of the work
    ("until_s", "f8"), ("since_s", "f8"),  # clock until which they stay; wait for a way (0: do not)
    ("job", "i8"),  # index into the jobs
    ("going", "i8"),  # THERE, UNDER_WAY, WAITING
    ("at", "i8"),  # kind of the place, index into `WORKPLACE_KINDS`, NOWHERE or ON_STAGE
    # What they noticed of the robot
    ("robot_world", "f8", (2, 3)),  # elbow and tool when last looked at; infinite: not yet
    ("acts_at", "f8"),  # clock at which they will react; infinite: noticed nothing
    ("doing", "i8"), ("doing_until", "f8"),  # NO_REACTION, PAUSE or BACK_AWAY now; until when
    ("calm_until", "f8"),  # before which clock nothing startles them
    ("delay_s", "f8"), ("reaction", "i8"), ("reaction_s", "f8"),  # drawn when an activity begins
    ("cued", "i8"),  # how far what they wait for has come, see `reactions.attend`
]  # fmt: skip
_PLAN = [
    ("start_x", "f8"), ("start_y", "f8"), ("start_yaw", "f8"),  # root on the floor, heading
    ("end_x", "f8"), ("end_y", "f8"), ("end_yaw", "f8"),  # the same when it ends
    ("step_start", "f8"), ("step_period", "f8"), ("step_swing", "f8"),  # first lift-off; from one
    ("step_first", "i8"), ("step_count", "i8"),  # to the next; in the air; foot (0 left); number
    ("undo_at", "f8"),  # when the steps are gone back, the last one first; 0: never
    ("lasts", "f8"),  # how long all of it takes, of activities that end as they began
    ("load_prop", "i8"),  # what they go about with (0: nothing), from one activity to the next
    ("load_at", "f8", (6,)),  # from the root: ahead, left, up, yaw, pitch, roll
    ("load_grip", "f8", (6,)), ("load_used", "f8", (2,)),  # where hands hold it; whether they do
    # Walking
    ("sharpest", "f8"), ("n_pieces", "i8"), ("length", "f8"),  # of the path: greatest curvature
    ("path", "f8", (2 * MAX_VIA + 1, 6)),  # its pieces, see `paths`
    ("depart", "f8"), ("ramp", "f8"), ("travel_s", "f8"), ("top_m_s", "f8"),  # the root's way
    ("turn_in", "f8"), ("turn_in_s", "f8"),  # from the heading into the path
    ("turn_out", "f8"), ("turn_out_s", "f8"), ("turn_out_at", "f8"),  # and out of it
    ("follow", "f8"),  # whether they face along the path (1) or side-step (0)
    ("trip_at", "f8"), ("trip", "f8"),  # a foot catches; how badly (0: never)
    ("flight_s", "f8"),  # how much longer feet are in the air at the top speed of a run
    ("fall_yaw", "f8"), ("fall_pace", "f8"),  # which way and how fast they fall at `trip_at`
    ("lie_s", "f8"), ("lie_roll", "f8"), ("front", "i8"),  # lying; the foot that gets up first
    ("fall_x", "f8"), ("fall_y", "f8"),  # where it is that they stumble: balls of both feet
    ("taken_s", "f8"), ("tipped", "f8"), ("stoop", "f8"),  # pushing: to the handle; barrow; trunk
    # Reaching, lifting, work in place
    ("lean", "f8"), ("twist", "f8"), ("squat", "f8"),  # of the trunk, see `posture.lean`
    ("out_at", "f8"), ("out_s", "f8"), ("hold_s", "f8"), ("back_s", "f8"),  # hands leave, stay
    ("target", "f8", (6,)), ("used", "f8", (2,)),  # grips, left and right; whether they go there
    ("gaze_yaw", "f8"), ("gaze_pitch", "f8"), ("gaze", "f8", (3,)),  # or a point
    ("fidget_m", "f8"), ("fidget_hz", "f8"),  # the work that reaching hands do
    ("raised", "f8", (6,)), ("raise_s", "f8"), ("carry_s", "f8"),  # a load held up
    ("settle_s", "f8"), ("kneel", "f8"), ("crouch", "f8"), ("ahead", "f8"),  # getting down
    ("tool", "i8"), ("side", "i8"), ("take_s", "f8"),  # in which hand; to take it from the belt
    ("tool_pose", "f8", (6,)),  # at work, or of a load where it stands: x, y, z, yaw, pitch, roll
    ("midway", "f8", (6,)), ("shoulder_s", "f8"),  # a load when it is up; from there to be carried
    ("hidden", "?"),  # a load that is somebody else's until it is gripped, and after
    ("stroke", "i8"), ("stroke_m", "f8"), ("stroke_hz", "f8"), ("burst_s", "f8"),  # see `strokes`
    ("wander_m", "f8"), ("down_m", "f8"),  # how far they move between bursts: to and fro; down
    ("treads", "f8"), ("riser_m", "f8"), ("up_s", "f8"),  # climbing
    ("left_rad", "f8"), ("left_s", "f8"), ("right_rad", "f8"), ("right_s", "f8"),  # looking round
    # Playing a clip
    ("clip_row", "i8"), ("clip_frames", "i8"), ("clip_fps", "f8"),  # among all clips' frames
    ("clip_yaw", "f8"), ("clip_s", "f8"),
    ("roots", "f8", (N_ROOTS, 2)),  # where the root will be, for those who walk round it
]  # fmt: skip
WORKER = np.dtype((np.record, np.dtype(_EPISODE + _NOW + _PLAN + _SCRATCH, align=True)))
"""One worker; `np.zeros((B, W), WORKER)` are all."""
Worker: TypeAlias = Any
Workers: TypeAlias = Any
"""A record of WORKER, and an array of them."""
Pair = tuple[float, float]
Triple = tuple[float, float, float]
Place = tuple[float, float, float, float]
"""x, y [m], yaw [rad], height of the work [m]."""
N_START = 16
"""Uniform numbers that a start function may use."""

STAND, WALK, REACH, LIFT, TURN, CARRY, PUSH, STUMBLE, STEP_BACK, LOOK_ROUND = range(10)
PICK_UP, SET_DOWN, HAND_OVER, RECEIVE, SQUATTING, KNEELING, HAMMER, DRILL = range(10, 18)
OVERHEAD, SAW, MEASURE, POINT, LUNGE, CLIMB, CLIP, RUN, FALL = range(18, 27)
SCREW, TAKE = 27, 28
ACTIVITY_NAMES = (
    "stand", "walk", "reach", "lift", "turn", "carry", "push", "stumble", "step back",
    "look round", "pick up", "set down", "hand over", "receive", "squat", "kneel", "hammer",
    "drill", "drill overhead", "saw", "measure", "point", "lunge", "climb", "clip",
    "run", "fall", "screw", "take",
)  # fmt: skip
GOING, IDLE = (WALK, TURN, CARRY, STUMBLE, STEP_BACK), (STAND, LOOK_ROUND)
TAKING, GIVING = (PICK_UP, RECEIVE), (SET_DOWN, HAND_OVER)
"""Activities that share a closed form."""
WAYS = (WALK, TURN, CARRY, PUSH, STUMBLE, CLIP, RUN, FALL)
"""Activities that are no job to be done at a place."""
NOWHERE, ON_STAGE = -1, -2
"""What is at a place that is none: nothing any more; room for a clip, which is played next."""
THERE, UNDER_WAY, WAITING = range(3)
NO_REACTION, PAUSE, BACK_AWAY = range(3)
