"""An activity's plan: the fixed-size row of numbers that its closed form in time reads.

Columns that all activities share come first; of the rest, walking and the work of hands
use the same ones.
"""

START_X, START_Y, START_YAW = 0, 1, 2
"""Where the worker stands (their root on the floor, their heading) when it begins."""
END_X, END_Y, END_YAW = 3, 4, 5
"""Where they stand when it ends."""
STEP_START, STEP_PERIOD, STEP_SWING, STEP_FIRST, STEP_COUNT = 6, 7, 8, 9, 10
"""First lift-off [s], time from one lift-off to the next (of the other foot) and in the air
[s], foot that begins (0 left), number of steps; their footprints are in `MotionState.prints`."""
UNDO_AT = 11
"""When the steps are gone back, the last one first [s]; 0: never."""
LASTS = 12
"""How long all of it takes [s], of activities that end as they began."""
LOAD_PROP, LOAD_AT, LOAD_GRIP, LOAD_USED = 13, 14, 20, 26
"""What the worker goes about with (0: nothing), which stays from one activity to the next: its
pose from the worker's root: ahead, left, up [m], yaw, pitch, roll; where the left and the right
hand hold it, in its own frame (3 + 3); whether they do (1 + 1)."""
N_LOAD = 15
OWN = LOAD_PROP + N_LOAD
"""First column of the activity's own."""

SHARPEST, N_PIECES, LENGTH, DEPART, RAMP, DURATION, SPEED = range(OWN, OWN + 7)
TURN_IN, TURN_IN_S, TURN_OUT, TURN_OUT_AT, TURN_OUT_S, FOLLOW = range(OWN + 7, OWN + 13)
"""Walk. Greatest curvature of the path [1/m], number of its pieces, its length, when the root
sets off, how long it gathers speed, how long it travels, its top speed; how far the path's first
heading is from the worker's, how long that turn takes; the same at the end, with its
beginning; whether they face along the path (1) or side-step (0)."""
TRIP_AT, TRIP = OWN + 13, OWN + 14
"""Walk. When the swinging foot catches something [s], and how badly (0: never)."""
TAKEN_S, TIPPED, STOOP = OWN + 15, OWN + 16, OWN + 17
"""Push. How long the hands take to the handle, and back from it [s]; how far a wheelbarrow is
tipped forward by who holds it [rad]; how far the trunk leans to a handle, as `posture.lean`."""

LEAN, TWIST, SQUAT, OUT_AT, OUT_S, HOLD_S, BACK_S = range(OWN, OWN + 7)
"""Reach and lift. How far the trunk goes (1: as far as it can), its turn, share of squatting;
when the hands leave, how long they take, stay, and take back."""
TARGET, GAZE_YAW, GAZE_PITCH = OWN + 7, OWN + 13, OWN + 14
"""Targets of the left and right grip (3 + 3), where to look."""
USE_LEFT, USE_RIGHT, FIDGET, FIDGET_HZ = range(OWN + 15, OWN + 19)
"""Reach. Which hands go (1) or stay (0); size [m] and rate of the work they do out there."""
RAISED, RAISE_S, CARRY_S = OWN + 19, OWN + 25, OWN + 26
"""Lift. Where the grips are with the load held up (3 + 3), how long raising and carrying take."""
GAZE_X, GAZE_Y, GAZE_Z = RAISED, RAISED + 1, RAISED + 2
SETTLE_S, KNEEL, CROUCH, AHEAD = range(RAISED + 3, RAISED + 7)
"""Work. The point looked at; how long getting down (and up) takes, whether on a knee, on the
haunches (1 or 0), how far the root moves with the feet's steps [m]."""
TOOL, SIDE, TAKE_S, TOOL_POSE = OWN + 27, OWN + 28, OWN + 29, OWN + 30
"""Work. Index of the tool, the hand that has it (0 left), how long the hand goes to the belt,
the tool's pose at work (6: x, y, z, yaw, pitch, roll in the world). Loads: what, and its pose
where it stands."""
MIDWAY, SHOULDER_S, HIDDEN = OWN + 36, OWN + 42, OWN + 43
"""Loads. The load's pose when it is up (6, world), how long it goes from there to where it is
carried, whether it is somebody else's until it is gripped (and after)."""
STROKE, STROKE_M, STROKE_HZ, BURST_S, WANDER_M = range(OWN + 42, OWN + 47)
"""Work. What the tool does (an index into `strokes`), how far, how often, for how long at a
time, and how far it moves along the work between."""
TREADS, RISER_M, UP_S = range(OWN, OWN + 3)
"""Climb. How many treads, how high each is, how long going up takes."""
LEFT_RAD, LEFT_S, RIGHT_RAD, RIGHT_S = range(OWN, OWN + 4)
"""Look round. How far the gaze goes to one side and the other, until when it stays there [s]."""
CLIP_ROW, CLIP_FRAMES, CLIP_FPS, CLIP_YAW, CLIP_S = range(OWN, OWN + 5)
"""Clip. First row of its frames among all, how many, how many a second; heading that it is turned
to; how long it plays [s]."""
ROOTS, N_ROOTS = OWN + 5, 48
"""Clip. Where the root is (x, y) at so many moments, at equal intervals from its beginning to its
end: coarse, for those who walk round it."""
MAX_VIA, PIECE = 8, 6
"""Most corners of a path; columns of a piece, see `paths`."""
PATH = OWN + 18
"""Walk. First of the path's pieces, a line before, between and after the corners' arcs."""
N_PLAN = PATH + PIECE * (2 * MAX_VIA + 1)

MAX_STEPS = 72
"""Most steps of one walk: 30 m at the pace of 0.8 m/s, and turns at its ends."""

SPEED_TRAIT, SQUAT_TRAIT, RIGHT_HANDED, PHASE = 0, 1, 2, 3
"""What a worker keeps for an episode: walking speed, share of squatting when lifting,
probability of using the right hand when either would do, and five phases of their sway."""
N_TRAITS = 8

STAND, WALK, REACH, LIFT = range(4)
TURN, CARRY, PUSH, STUMBLE, STEP_BACK = range(4, 9)
LOOK_ROUND, PICK_UP, SET_DOWN, HAND_OVER, RECEIVE = range(9, 14)
SQUATTING, KNEELING, HAMMER, DRILL, OVERHEAD, SAW, MEASURE, POINT = range(14, 22)
LUNGE, CLIMB, CLIP = 22, 23, 24
ACTIVITY_NAMES = (
    "stand", "walk", "reach", "lift", "turn", "carry", "push", "stumble", "step back",
    "look round", "pick up", "set down", "hand over", "receive", "squat", "kneel", "hammer",
    "drill", "drill overhead", "saw", "measure", "point", "lunge", "climb", "clip",
)  # fmt: skip
GOING = (WALK, TURN, CARRY, STUMBLE, STEP_BACK)
TAKING, GIVING = (PICK_UP, RECEIVE), (SET_DOWN, HAND_OVER)
"""Activities that share a closed form."""
