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
[s], foot that begins (0 left), number of steps; their footprints are in `MotionState.print_`."""
OWN = 12
"""First column of the activity's own."""

SHARPEST, N_PIECES, LENGTH, DEPART, RAMP, DURATION, SPEED = range(OWN, OWN + 7)
TURN_IN, TURN_IN_S, TURN_OUT, TURN_OUT_AT, TURN_OUT_S, FOLLOW = range(OWN + 7, OWN + 13)
"""Walk. Greatest curvature of the path [1/m], number of its pieces, its length, when the root
sets off, how long it gathers speed, how long it travels, its top speed; how far the path's first
heading is from the worker's, how long that turn takes; the same at the end, with its
beginning; whether they face along the path (1) or side-step (0)."""
MAX_VIA, PIECE = 8, 6
"""Most corners of a path; columns of a piece, see `paths`."""
PATH = OWN + 40
"""Walk. First of the path's pieces, a line before, between and after the corners' arcs."""

LEAN, TWIST, SQUAT, OUT_AT, OUT_S, HOLD_S, BACK_S = range(OWN, OWN + 7)
"""Reach and lift. How far the trunk goes (1: as far as it can), its turn, share of squatting;
when the hands leave, how long they take, stay, and take back."""
TARGET, GAZE_YAW, GAZE_PITCH = OWN + 7, OWN + 13, OWN + 14
"""Targets of the left and right grip (3 + 3), where to look."""
USE_LEFT, USE_RIGHT, FIDGET, FIDGET_HZ = range(OWN + 15, OWN + 19)
"""Reach. Which hands go (1) or stay (0); size [m] and rate of the work they do out there."""
RAISED, RAISE_S, CARRY_S = OWN + 19, OWN + 25, OWN + 26
"""Lift. Where the grips are with the load held up (3 + 3), how long raising and carrying take."""
N_PLAN = PATH + PIECE * (2 * MAX_VIA + 1)

MAX_STEPS = 72
"""Most steps of one walk: 30 m at the pace of 0.8 m/s, and turns at its ends."""

SPEED_TRAIT, SQUAT_TRAIT, RIGHT_HANDED, PHASE = 0, 1, 2, 3
"""What a worker keeps for an episode: walking speed, share of squatting when lifting,
probability of using the right hand when either would do, and five phases of their sway."""
N_TRAITS = 8

STAND, WALK, REACH, LIFT = range(4)
ACTIVITY_NAMES = ("stand", "walk", "reach", "lift")
