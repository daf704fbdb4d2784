"""Files of other programs: names, text, places; and people who do more than walk."""

import re
from types import SimpleNamespace

import numpy as np
import pytest
from written import Y_UP, write_bvh

from hrc_env.cli.import_motion import ImportMotion
from hrc_env.core.errors import ConfigError
from hrc_env.core.skeleton import JOINT, JOINTS
from hrc_env.geometry.rotations import about_axis
from hrc_env.mocap.names import read_joint_names
from hrc_env.mocap.read import read_recording
from hrc_env.worker.body import SEGMENT, SEGMENTS

PARTS = ("clavicle", "upper_arm", "forearm", "hand", "thigh", "shank", "foot", "toes")
MIDDLE = ("pelvis", "abdomen", "torso", "chest", "neck", "head")
PROGRAMS = {
    "Second Life, Poser": (
        "hip abdomen waist chest neck head",
        "lCollar lShldr lForeArm lHand lThigh lShin lFoot lToe",
    ),
    "iClone": (
        "RL_BoneRoot CC_Base_Hip CC_Base_Waist CC_Base_Spine02 CC_Base_NeckTwist01 CC_Base_Head",
        "CC_Base_L_Clavicle CC_Base_L_Upperarm CC_Base_L_Forearm CC_Base_L_Hand CC_Base_L_Thigh"
        " CC_Base_L_Calf CC_Base_L_Foot CC_Base_L_ToeBase",
    ),
    "VRM": (
        "J_Bip_C_Hips J_Bip_C_Spine J_Bip_C_Chest J_Bip_C_UpperChest J_Bip_C_Neck J_Bip_C_Head",
        "J_Bip_L_Shoulder J_Bip_L_UpperArm J_Bip_L_LowerArm J_Bip_L_Hand J_Bip_L_UpperLeg"
        " J_Bip_L_LowerLeg J_Bip_L_Foot J_Bip_L_ToeBase",
    ),
    "MikuMikuDance": (
        "center groove waist upper_body neck head",
        "shoulder_L arm_L elbow_L wrist_L leg_L knee_L ankle_L toe_L",
    ),
    "Source": (
        "pelvis spine_0 spine_1 spine_2 neck_0 head_0",
        "clavicle_L arm_upper_L arm_lower_L hand_L leg_upper_L leg_lower_L ankle_L ball_L",
    ),
    "MakeHuman": (
        "root spine05 spine03 spine01 neck01 head",
        "clavicle.L upperarm01.L lowerarm01.L wrist.L upperleg01.L lowerleg01.L foot.L toe1-1.L",
    ),
    "Rigify": (
        "spine spine.001 spine.002 spine.003 spine.004 spine.006",
        "shoulder.L upper_arm.L forearm.L hand.L thigh.L shin.L foot.L toe.L",
    ),
    "a program of its own": (
        "Hips Spine Spine1 Spine2 Neck Head",
        "L_Clav L_UpperArm L_Cubitus L_Hand L_Thigh L_Genu L_Foot L_Toe",
    ),
}  # fmt: skip


def segment_names(middle, left):
    """What a program calls each segment; its right ones are the left ones with another letter."""
    called = dict(zip(MIDDLE, middle.split(), strict=True))
    for part, name in zip(PARTS, left.split(), strict=True):
        called[f"left_{part}"] = name
        called[f"right_{part}"] = re.sub(r"^l(?=[A-Z])|(?<![A-Za-z])L(?![a-z])", swapped, name)
    return called.__getitem__


def swapped(letter):
    return {"l": "r", "L": "R"}[letter[0]]


def written(work, folder, **traps):
    """A walk as a BVH file, and its text."""
    options = {"unit_m": 0.01, "axes": Y_UP, **traps}
    position, rotation = options.pop("segments", (work.position, work.rotation))
    path = write_bvh(folder / "walk.bvh", position, rotation, work.fps, **options)
    return path, path.read_text()


# --- Names ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("program", PROGRAMS)
def test_files_that_differ_in_names_alone_are_the_same_person(work, tmp_path, program):
    usual = read_recording(written(work, tmp_path)[0])
    other = read_recording(written(work, tmp_path, name=segment_names(*PROGRAMS[program]))[0])
    assert np.array_equal(other.joints_world, usual.joints_world)


def test_what_hangs_where_an_unknown_name_stands_is_said(work, tmp_path):
    called = segment_names(*PROGRAMS["a program of its own"])
    said = " ".join(read_recording(written(work, tmp_path, name=called)[0]).notes)
    assert "left_elbow is assumed to be L_Cubitus, which lies between L_UpperArm and L_Ha" in said
    called = segment_names(*PROGRAMS["Rigify"])
    said = " ".join(read_recording(written(work, tmp_path, name=called)[0]).notes)
    assert "The head is assumed to be spine.006" in said


def numbered(segment):
    return f"Bone.{SEGMENTS.index(segment):03d}"


STARTS = {
    "shoulder": "upper_arm", "elbow": "forearm", "wrist": "hand", "hip": "thigh", "knee": "shank",
    "ankle": "foot", "foot": "toes",
}  # fmt: skip
BY_HAND = {
    f"{side}_{joint}": numbered(f"{side}_{segment}")
    for side in ("left", "right")
    for joint, segment in STARTS.items()
} | {"head": numbered("head")}  # fmt: skip


def test_names_that_say_nothing_are_told_by_hand(work, tmp_path):
    path, _ = written(work, tmp_path, name=numbered)
    with pytest.raises(ConfigError, match=r"Missing: left_shoulder.*--joint left_shoulder=NAME"):
        read_recording(path)
    capture = read_recording(path, joints=BY_HAND)
    assert capture.node_names[JOINT["left_knee"]] == BY_HAND["left_knee"]
    usual = read_recording(written(work, tmp_path)[0]).joints_world
    known = [j for j, joint in enumerate(JOINTS) if not joint.endswith(("nose", "foot"))]
    assert np.allclose(capture.joints_world[:, known], usual[:, known])


def test_the_command_takes_names_one_by_one_or_from_a_file(work, tmp_path):
    path, _ = written(
        work, tmp_path, name=numbered, segments=(work.position[:60], work.rotation[:60])
    )
    lines = [f'{joint} = "{name}"' for joint, name in BY_HAND.items() if joint != "head"]
    (tmp_path / "names.toml").write_text("\n".join(lines))
    entries = (str(tmp_path / "names.toml"), f"head={BY_HAND['head']}")
    assert read_joint_names(entries) == BY_HAND
    assert ImportMotion(path, tmp_path / "clip.npz", joint=entries, up="y").run() == 0


@pytest.mark.parametrize(
    ("joints", "told"),
    [
        ({"left_shin": "LeftLeg"}, "Unknown joint 'left_shin'.*left_knee"),
        ({"left_knee": "LeftLag"}, "Did you mean 'LeftLeg'"),
        ({"left_knee": "LeftLeg", "left_hip": "leftleg"}, "left_knee, left_hip must be different"),
    ],
)
def test_names_by_hand_that_cannot_be_are_refused(work, tmp_path, joints, told):
    path, _ = written(work, tmp_path)
    with pytest.raises(ConfigError, match=told):
        read_recording(path, joints=joints)


def test_an_entry_that_is_no_name_and_no_file_is_refused():
    with pytest.raises(ConfigError, match=r"Expected JOINT=NAME.*got 'left_knee'"):
        read_joint_names(["left_knee"])


# --- Text ----------------------------------------------------------------------------------------


def with_commas(text):
    return re.sub(r"(\d)\.(\d)", r"\1,\2", text)


def between_numbers(sign):
    return lambda text: re.sub(r"(?<=\d) (?=-?\d)", sign, text)


TEXTS = {
    "UTF-8 with a mark": lambda text: text.encode("utf-8-sig"),
    "UTF-16": lambda text: text.encode("utf-16"),
    "UTF-16 without a mark": lambda text: text.encode("utf-16-le"),
    "UTF-16, the other order": lambda text: text.encode("utf-16-be"),
    "decimal commas": lambda text: with_commas(text).encode(),
    "decimal commas in the frames": lambda text: with_commas(text).replace("0,02", "0.02").encode(),
    "decimal commas and semicolons": lambda text: between_numbers(";")(with_commas(text)).encode(),
    "commas between numbers": lambda text: between_numbers(", ")(text).encode(),
    "no blanks": lambda text: re.sub(r"(Frames|Time): 0?", r"\1:", text).encode(),
    "remarks": lambda text: ("# by hand\n" + text.replace("MOTION", "MOTION // now")).encode(),
    "blanks and empty lines": lambda text: text.replace("\n", " \t\r\n\r\n").encode(),
    "braces behind names": lambda text: re.sub(r"\n\s*\{\n\s*", " { ", text).encode(),
    "an end of file sign": lambda text: text.encode() + b"\x1a\0",
}  # fmt: skip


@pytest.mark.parametrize("form", TEXTS)
def test_a_file_is_read_however_its_text_is_written(work, tmp_path, form):
    path, text = written(work, tmp_path)
    usual = read_recording(path)
    path.write_bytes(TEXTS[form](text))
    other = read_recording(path)
    assert np.array_equal(other.joints_world, usual.joints_world)
    assert (other.fps, other.notes) == (usual.fps, usual.notes)


@pytest.mark.parametrize("nothing", ["nan", "-nan(ind)", "-1.#IND", "inf"])
def test_numbers_that_are_none_are_missing_joints_and_never_0(work, tmp_path, nothing):
    path, text = written(work, tmp_path)
    usual, lines = read_recording(path), text.splitlines()
    words = lines[-30].split()
    lines[-30] = " ".join([*words[:6], nothing, *words[7:]])
    path.write_text("\n".join(lines))
    mended = read_recording(path)
    assert "were interpolated" in mended.notes[0]
    assert np.abs(mended.joints_world - usual.joints_world).max() < 0.02


# --- Places --------------------------------------------------------------------------------------


def turned(work, turn, middle, segments=SEGMENTS):
    """Segments turned by (T, 3, 3) about points (T, 3)."""
    position, rotation = work.position.copy(), work.rotation.copy()
    those = [SEGMENT[each] for each in segments]
    arm = turn[:, None] @ (position[:, those] - middle[:, None])[..., None]
    position[:, those] = arm[..., 0] + middle[:, None]
    rotation[:, those] = turn[:, None] @ rotation[:, those]
    return position, rotation


def hands_up(work):
    """The walk with both arms raised."""
    arms = [each for each in SEGMENTS if each.endswith(("upper_arm", "forearm", "hand"))]
    about = np.broadcast_to(about_axis("x", np.pi), (len(work.position), 3, 3))
    return turned(work, about, np.zeros((len(work.position), 3)), arms)


def under_a_root(text, offset):
    """A file's text with hips whose OFFSET is elsewhere, under a root that does not move."""
    head, motion = text.split("MOTION\n")
    head = re.sub(r"OFFSET.*", f"OFFSET {offset}", head, count=1).replace("ROOT", "JOINT", 1)
    root = "ROOT joint_Root\n{\nOFFSET 0 0 0\nCHANNELS 3 Xposition Yposition Zposition\n"
    rows = motion.splitlines()
    rows[2:] = [f"0 0 0 {row}" for row in rows[2:]]
    return head.replace("JOINT Hips", root + "JOINT Hips", 1) + "}\nMOTION\n" + "\n".join(rows)


@pytest.mark.parametrize("offset", ["0.8 94 -452", "-11.3 91.3 32.6", "3 310 20"])
def test_places_stand_for_offset_and_nobody_is_said_to_hang(work, tmp_path, offset):
    path, text = written(work, tmp_path, segments=hands_up(work))
    usual = read_recording(path)
    wrists, nose = usual.joints_world[:, [JOINT["left_wrist"], JOINT["right_wrist"]], 2], 0
    assert (wrists.min(1) > usual.joints_world[:, nose, 2]).mean() > 0.5
    path.write_text(under_a_root(text, offset))
    other = read_recording(path)
    assert np.allclose(other.joints_world, usual.joints_world)
    assert other.notes == usual.notes


def test_places_that_are_0_at_rest_are_added_to_offset_and_that_is_said(work, tmp_path):
    path, text = written(work, tmp_path)
    usual, (head, motion) = read_recording(path), text.split("MOTION\n")
    rows = motion.splitlines()
    for k, row in enumerate(rows[2:], 2):
        x, y, z, rest = row.split(maxsplit=3)
        rows[k] = f"{x} {float(y) - 95.0} {z} {rest}"
    head = re.sub(r"OFFSET.*", "OFFSET 0 95 0", head, count=1)
    path.write_text(f"{head}MOTION\n" + "\n".join(rows))
    other = read_recording(path)
    assert np.allclose(other.joints_world, usual.joints_world)
    assert "Positions were added to OFFSET" in " ".join(other.notes)


# --- People --------------------------------------------------------------------------------------


def rising(work, axis, degrees, first_s, lasts_s):
    """Turns of somebody who begins upright."""
    t = np.arange(len(work.position)) / work.fps
    return about_axis(axis, np.radians(degrees) * np.clip((t - first_s) / lasts_s, 0.0, 1.0))


@pytest.mark.parametrize("axes", [np.eye(3), Y_UP], ids=["z", "y"])
def test_who_falls_is_known_to_have_stood_up_before(work, tmp_path, axes):
    foot = work.position[:, SEGMENT["pelvis"]] * [1.0, 1.0, 0.0]
    segments = turned(work, rising(work, "y", 90.0, 1.0, 0.6), foot)
    path, _ = written(work, tmp_path, segments=segments, axes=axes)
    nose_m = read_recording(path, allow_off_floor=True).joints_world[:, 0, 2]
    assert nose_m[:40].min() > 1.4
    assert nose_m[-40:].max() < 0.5


def test_who_turns_a_cartwheel_is_upright_before_and_after(work, tmp_path):
    raised = SimpleNamespace(**vars(work))
    raised.position, raised.rotation = hands_up(work)
    middle = work.position[:, SEGMENT["pelvis"]]
    path, _ = written(
        work, tmp_path, segments=turned(raised, rising(work, "x", 360.0, 1.0, 1.2), middle)
    )
    nose_m = read_recording(path).joints_world[:, 0, 2]
    assert min(nose_m[0], nose_m[-1]) > 1.4
    assert nose_m.min() < 0.6


def test_the_upward_axis_can_be_said(work, tmp_path):
    lying = work.joints @ about_axis("x", np.pi / 2).T
    np.savez(tmp_path / "lying.npz", joints=lying, fps=work.fps)
    assert read_recording(tmp_path / "lying.npz").joints_world[0, 0, 2] > 1.4
    said = read_recording(tmp_path / "lying.npz", up="+z", allow_off_floor=True)
    assert np.ptp(said.joints_world[0, :, 2]) < 0.7
    with pytest.raises(ConfigError, match=r"must be one of \+z, .*got '\+w'"):
        read_recording(tmp_path / "lying.npz", up="w")


def test_who_runs_need_not_rest_a_foot(work, tmp_path, capsys):
    bounce = 0.06 * np.sin(0.4 * np.arange(len(work.joints)))
    joints = work.joints + bounce[:, None, None] * [0.0, 0.0, 1.0]
    np.savez(tmp_path / "slow.npz", joints=joints, fps=50.0)
    with pytest.raises(ConfigError, match="rests for"):
        read_recording(tmp_path / "slow.npz")
    np.savez(tmp_path / "fast.npz", joints=joints, fps=125.0)
    assert ImportMotion(tmp_path / "fast.npz", tmp_path / "clip.npz").run() == 0
    assert "nan" not in capsys.readouterr().out
