"""A robot whose MJCF or record is wrong in one thing only is refused, and is taken without it."""

import re
from dataclasses import asdict, replace

import mujoco
import numpy as np
import pytest

from hrc_env.core.errors import ConfigError
from hrc_env.scene.robot import ROBOTS, Hand, Robot, Suction, check_robot, find_robot, make_chain

WEIGHT = '<inertial pos="0 0 .1" mass="1" diaginertia=".01 .01 .01"/>'
RODS = {name: f'<geom name="{name}" type="capsule" size=".03" fromto="0 0 0 0 0 .2"/>'
        for name in ("socket", "turret", "boom", "thumb", "finger")}  # fmt: skip
TURN, LIFT = (f'<joint name="{name}" axis="{axis}" range="-2 1"/>'
              for name, axis in (("turn", "0 0 1"), ("lift", "0 1 0")))  # fmt: skip
LEFT, RIGHT = (f'<joint name="{name}" type="slide" axis="{axis}" range="0 .04"/>'
               for name, axis in (("left", "1 0 0"), ("right", "-1 0 0")))  # fmt: skip
TIP, FIXED = '<site name="tip" pos="0 0 .2"/>', '<site name="plate"/>'
ELBOW = '</body><body name="boom" pos="0 0 .2">'
FINGERS = f"""<body name="left">{WEIGHT}{LEFT}{RODS["thumb"]}</body>
<body name="right">{WEIGHT}{RIGHT}{RODS["finger"]}</body>"""
TURNS, LIFTS = (f'<intvelocity joint="{name}" kp="100" actrange="-2 1" ctrlrange="-1 1"/>'
                for name in ("turn", "lift"))  # fmt: skip
TURN_RATE, LIFT_RATE = (f'<velocity name="{name}" joint="{name}" kv="9" ctrlrange="-1 1"/>'
                        for name in ("turn", "lift"))  # fmt: skip
MOTOR = '<position name="close" joint="left" kp="9" ctrlrange="0 .04"/>'
BARE = f"""<mujoco><compiler angle="radian"/><worldbody><body name="foot">{RODS["socket"]}
<body name="turret" pos="0 0 .1">{WEIGHT}{TURN}{RODS["turret"]}
<body name="boom" pos="0 0 .2">{WEIGHT}{LIFT}{RODS["boom"]}{TIP}<body name="mount">{FIXED}</body>
</body></body></body></worldbody>
<actuator>{TURNS}{LIFTS}{TURN_RATE}{LIFT_RATE}</actuator></mujoco>"""
GRIPPING = BARE.replace(TIP, TIP + FINGERS).replace("</actuator>", f"{MOTOR}</actuator>")
ARM = Robot("arm", BARE, ("turn", "lift"), ("turret", "boom"), ("boom",), "tip", (0.0, 0.0),
            (0.1, 0.1))  # fmt: skip
HAND = Hand(("left", "right"), (), "close", ("thumb",))
GRIPPER = replace(ARM, mjcf=GRIPPING, capsules=("turret", "boom", "thumb"), hand=HAND)
CUPS = Suction("tip", "gauge", 10.0, (), ("boom",))
IN_ORDER, SERVOS = (
    "must be all joints of its MJCF, in the same order",
    "needs an <intvelocity> for every joint",
)


def changed(robot: Robot, *edits: tuple[str, str], **fields: object) -> Robot:
    """Return a robot with texts of its MJCF and fields of its record replaced."""
    text = str(robot.mjcf)
    for old, new in edits:
        assert old in text
        text = text.replace(old, new)
    return replace(robot, mjcf=text, **fields)


def dropping(name: str, text: str) -> tuple[str, str]:
    """Return the edit that takes an attribute out of an element."""
    return text, re.sub(f' {name}="[^"]*"', "", text)


SLIDING = LIFT.replace("<joint", '<joint type="slide"')
ACCEPTED = {
    "two hinges": ARM,
    "a hinge and a slide": changed(ARM, (LIFT, SLIDING)),
    "a hand": GRIPPER,
    "cups": replace(ARM, suction=CUPS),
    "a tool on what is fixed to the last link": replace(ARM, tool_site="plate"),
    "no foot": changed(ARM, (f'<body name="foot">{RODS["socket"]}', ""),
                       ("</body></worldbody>", "</worldbody>")),
    "home where all ranges end": replace(ARM, home_q=(1.0, 1.0)),
    "home where all ranges begin": replace(ARM, home_q=(-2.0, -2.0)),
    "a slew for each joint": replace(ARM, slew=(1.0, 2.0)),
    "a link without joints or mass": changed(ARM, ("</body>\n</body>", "<body/></body>\n</body>")),
}  # fmt: skip


@pytest.mark.parametrize("name", ACCEPTED)
def test_a_robot_in_which_nothing_is_wrong_is_taken(name):
    check_robot(ACCEPTED[name])


REFUSED = {
    "a hinge without a range": (changed(ARM, dropping("range", LIFT)), IN_ORDER),
    "the first hinge without a range": (
        changed(ARM, dropping("range", TURN), home_q=(0.0, 0.0)), IN_ORDER),
    "a ball as the last joint": (
        changed(ARM, (LIFT, '<joint name="lift" type="ball" range="0 1"/>')), IN_ORDER),
    "a ball as the first joint": (
        changed(ARM, (TURN, '<joint name="turn" type="ball" range="0 1"/>')), IN_ORDER),
    "joints in another order": (replace(ARM, joints=("lift", "turn")), IN_ORDER),
    "a joint that is not named": (
        changed(ARM, ('<body name="mount">', f'<body name="mount">{WEIGHT}{LEFT}')), IN_ORDER),
    "fingers in another order": (
        replace(GRIPPER, hand=replace(HAND, joints=("right", "left"))), IN_ORDER),
    "a first finger that turns": (
        changed(GRIPPER, (LEFT, LEFT.replace("slide", "hinge"))), IN_ORDER),
    "a last finger that turns": (
        changed(GRIPPER, (RIGHT, RIGHT.replace("slide", "hinge"))), IN_ORDER),
    "a finger without a range": (changed(GRIPPER, dropping("range", RIGHT)), IN_ORDER),
    "fingers and no hand": (replace(GRIPPER, hand=None), IN_ORDER),
    "rates in another order": (changed(ARM, (TURN_RATE + LIFT_RATE, LIFT_RATE + TURN_RATE)),
                               SERVOS),
    "integrals in another order": (changed(ARM, (TURNS + LIFTS, LIFTS + TURNS)), SERVOS),
    "a rate in the place of an integral": (
        changed(ARM, (LIFTS, LIFT_RATE.replace(' name="lift"', ""))), SERVOS),
    "an integral in the place of a rate": (changed(ARM, (LIFT_RATE, LIFTS)), SERVOS),
    "a motor that is a servo": (
        replace(GRIPPER, hand=replace(HAND, motor="lift")), SERVOS),
    "a motor for every finger": (
        changed(GRIPPER, (MOTOR, MOTOR + MOTOR.replace("close", "too"))), SERVOS),
    "a motor and no hand": (
        changed(ARM, ("</actuator>", '<motor joint="lift" ctrlrange="0 1"/></actuator>')), SERVOS),
    "a rate without a limit": (changed(ARM, dropping("ctrlrange", LIFT_RATE)), SERVOS),
    "an integral without a limit": (changed(ARM, dropping("ctrlrange", TURNS)), SERVOS),
    "a motor without a limit": (changed(GRIPPER, dropping("ctrlrange", MOTOR)), SERVOS),
    "links side by side": (
        changed(ARM, ('<body name="boom" pos="0 0 .2">', ELBOW),
                ("</body></body></body></worldbody>", "</body></body></worldbody>")),
        "must be a single chain"),
    "a link that has two joints": (
        changed(ARM, (f'<body name="boom" pos="0 0 .2">{WEIGHT}{LIFT}', '<body name="boom">'),
                (TURN, TURN + LIFT)),
        "must be a single chain"),
    "a tool on the first link": (
        changed(ARM, (TIP, ""), (RODS["turret"], RODS["turret"] + TIP)), "must be on the last"),
    "a tool on the foot": (
        changed(ARM, (TIP, ""), (RODS["socket"], RODS["socket"] + TIP)), "must be on the last"),
    "no such tool": (replace(ARM, tool_site="top"), "has no site 'top'"),
    "a capsule on the foot": (
        replace(ARM, capsules=("socket", "boom")), "'socket' is not part of a link"),
    "a sphere among the capsules": (
        changed(ARM, (RODS["boom"], '<geom name="boom" type="sphere" size=".03"/>')),
        "'boom' must be a capsule"),
    "home above the last range": (replace(ARM, home_q=(0.0, 1.0001)), "outside the joints'"),
    "home above the first range": (replace(ARM, home_q=(1.0001, 0.0)), "outside the joints'"),
    "home below the last range": (replace(ARM, home_q=(0.0, -2.0001)), "outside the joints'"),
    "home below the first range": (replace(ARM, home_q=(-2.0001, 0.0)), "outside the joints'"),
    "a first link without mass": (
        changed(ARM, (f'<body name="turret" pos="0 0 .1">{WEIGHT}', '<body name="turret">')),
        "'turret' needs an <inertial>"),
    "a last link without mass": (
        changed(ARM, (f'<body name="boom" pos="0 0 .2">{WEIGHT}', '<body name="boom">')),
        "'boom' needs an <inertial>"),
    "a first link without mass or foot": (
        changed(ACCEPTED["no foot"],
                (f'<body name="turret" pos="0 0 .1">{WEIGHT}', '<body name="turret">')),
        "'turret' needs an <inertial>"),
    "a finger without mass": (
        changed(GRIPPER, (f'<body name="right">{WEIGHT}', '<body name="right">')),
        "'right' needs an <inertial>"),
    "something watched that is no capsule": (
        replace(ARM, watched_capsules=("boom", "tip")), "watched"),
    "a hand's capsule that is none": (
        replace(GRIPPER, hand=replace(HAND, spans=("thumb", "thump"))), "Did you mean 'thumb'"),
    "cups' capsule that is none": (
        replace(ARM, suction=replace(CUPS, spans=("boon",))), "Did you mean 'boom'"),
    "no robot": ("arm", "must be a Robot, got str"),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_a_robot_in_which_one_thing_is_wrong_is_refused(name):
    robot, said = REFUSED[name]
    with pytest.raises(ConfigError, match=said):
        check_robot(robot)


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"hand": HAND, "suction": CUPS}, "has a hand and suction"),
        ({"home_q": ()}, "home_q must be 2"),
        ({"home_q": (0.0,)}, "home_q must be 2"),
        ({"home_q": (0.0, 0.0, 0.0)}, "home_q must be 2"),
        ({"home_q": (0.0, np.inf)}, "home_q must be 2"),
        ({"spread_rad": ()}, "spread_rad must be 2"),
        ({"spread_rad": (0.1, 0.1, 0.1)}, "spread_rad must be 2"),
        ({"spread_rad": (np.nan, 0.1)}, "spread_rad must be 2"),
        ({"slew": (1.0,)}, "slew must be 2"),
        ({"slew": (1.0, np.nan)}, "slew must be 2"),
    ],
)
def test_a_record_that_fits_no_robot_is_refused(fields, said):
    with pytest.raises(ConfigError, match=said):
        replace(ARM, **fields)


@pytest.mark.parametrize("robot", [3, None, ("ur10e_like",), "ur10e_lik"])
def test_what_is_neither_a_name_nor_a_robot_is_none(robot):
    with pytest.raises(ConfigError, match="robot"):
        find_robot(robot)


def test_a_robot_is_called_by_its_name_or_itself():
    assert find_robot(ARM) == ARM
    assert find_robot(asdict(ARM)) == ARM
    assert find_robot("ur10e_like") is ROBOTS["ur10e_like"]


def test_what_is_refused_is_told_with_the_robots_name():
    """What the MJCF's reader says counts as well."""
    for robot in (replace(ARM, tool_site="top"), replace(ARM, mjcf="<mujoco><")):
        with pytest.raises(ConfigError, match=r"^arm: "):
            make_chain(robot, (0.0, 0.0, 0.0))


def test_what_is_refused_compiles():
    """What is wrong is for the check to find: MuJoCo takes each of these."""
    for robot, _ in REFUSED.values():
        if isinstance(robot, Robot):
            mujoco.MjSpec.from_string(str(robot.mjcf)).compile()
