"""Writes the files of the robot `upper_body`: a torso, two arms and two four-finger hands, 43 independent joints.

    python3 make.py

Kinematics: the dimensions published for DLR's Justin with four-finger hands (Saut 2010, sec. VI). Shapes are our own capsules, boxes and
balls. Speeds, torques and masses stand in `MOTORS` and `MASSES` below, with their sources. All lengths in metres, angles in degrees here.
"""

import math
from pathlib import Path

FOLDER = Path(__file__).parent
QUARTER = math.pi / 2

# Joint speeds in rad/s, torques in N m, accelerations in rad/s^2.
#   arm:   KUKA LBR iiwa 14 R820, from its URDF in the package iiwa_stack. The arm of DLR's Justin is of the same class.
#   torso: no numbers are published; those of the two strongest joints of the same arm.
#   hand:  Allegro Hand V4: 0.7 N m per joint by its data sheet, 3.14 rad/s by its URDF; the acceleration is the scenes' default.
MOTORS = {
    "arm": [
        (1.4835, 320, 8.57), (1.4835, 320, 8.57), (1.7453, 176, 8.74), (1.309, 176, 11.36), (2.2689, 110, 12.23),
        (2.3562, 40, 15.72), (2.3562, 40, 15.72),
    ],
    "torso": [(1.4835, 320, 8.57)] * 4,
    "hand": [(3.14, 0.7, 20.0)],
}
# Masses in kg. Arm: LBR iiwa 14 R820, the same URDF. Hand: Allegro Hand, its URDF (the palm takes what its fingers leave over).
# Base, torso and head: estimates.
MASSES = {
    "base": 40.0, "torso_yaw": 8.0, "torso_1": 8.0, "torso_2": 8.0, "torso_3": 15.0, "head": 2.0,
    "arm_1": 5.76, "arm_2": 6.35, "arm_3": 3.5, "arm_4": 3.5, "arm_5": 3.5, "arm_6": 1.8, "arm_7": 1.2,
    "palm": 0.4154, "rotation": 0.04, "base_joint": 0.0119, "prox": 0.065, "mid": 0.0355, "dist": 0.03,
}
# What the sources of masses do not state: bodies are taken as balls of this radius.
INERTIA_RADIUS = {"torso": 0.12, "arm": 0.07, "hand": 0.02}


def number(value):
    """Twelve decimals are far below what any of the dimensions are known to, and keep axes that meet within 1e-12."""
    return f"{value:.15g}"


def numbers(values):
    return " ".join(number(value) for value in values)


def capsule(start, end, radius):
    """A capsule between two points of the link frame."""
    middle = [(a + b) / 2 for a, b in zip(start, end)]
    way = [b - a for a, b in zip(start, end)]
    length = math.dist(start, end)
    pitch = math.acos(way[2] / length)
    yaw = math.atan2(way[1], way[0])
    origin = f'<origin xyz="{numbers(middle)}" rpy="0 {number(pitch)} {number(yaw)}"/>'
    return origin + f'<geometry><capsule radius="{number(radius)}" length="{number(length)}"/></geometry>'


def box(center, size):
    return f'<origin xyz="{numbers(center)}"/><geometry><box size="{numbers(size)}"/></geometry>'


def ball(center, radius):
    return f'<origin xyz="{numbers(center)}"/><geometry><sphere radius="{number(radius)}"/></geometry>'


def link(name, shapes=(), mass=None, radius=None, at=(0, 0, 0)):
    if not shapes and mass is None:
        return f'  <link name="{name}"/>\n'
    text = f'  <link name="{name}">\n'
    if mass is not None:
        inertia = number(0.4 * mass * radius * radius)
        text += (
            f'    <inertial><origin xyz="{numbers(at)}"/><mass value="{number(mass)}"/>'
            f'<inertia ixx="{inertia}" ixy="0" ixz="0" iyy="{inertia}" iyz="0" izz="{inertia}"/></inertial>\n'
        )
    for shape in shapes:
        text += f"    <visual>{shape}</visual>\n    <collision>{shape}</collision>\n"
    return text + "  </link>\n"


def joint(name, parent, child, xyz, rpy, limits=None, motor=None, mimic=None):
    """A joint that turns about z between limits in degrees; a fixed one without limits."""
    kind = "fixed" if limits is None else "revolute"
    text = (
        f'  <joint name="{name}" type="{kind}">\n    <parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{numbers(xyz)}" rpy="{numbers(rpy)}"/>\n'
    )
    if limits is not None:
        lower, upper = (math.radians(limit) for limit in limits)
        velocity, effort, _ = motor
        text += (
            f'    <axis xyz="0 0 1"/><limit lower="{number(lower)}" upper="{number(upper)}" '
            f'velocity="{number(velocity)}" effort="{number(effort)}"/>\n'
        )
    if mimic is not None:
        text += f'    <mimic joint="{mimic}"/>\n'
    return text + "  </joint>\n"


def robot(name, comment, body):
    head = f"<!-- Written by make.py; change that. {comment} -->"
    return f'<?xml version="1.0"?>\n{head}\n<robot name="{name}">\n{body}</robot>\n'


def torso():
    radius = INERTIA_RADIUS["torso"]
    motors = MOTORS["torso"]
    text = link("base", [
        '<origin xyz="0 0 0.03"/><geometry><cylinder radius="0.15" length="0.06"/></geometry>',
    ], MASSES["base"], radius)
    text += link("torso_yaw", [box([0, 0, 0], [0.15, 0.26, 0.08])], MASSES["torso_yaw"], radius)
    # The frames of torso_1 to torso_3: x up along the segment, y ahead, z to the left.
    for name in ("torso_1", "torso_2"):
        segment = box([0.17, 0, 0], [0.22, 0.17, 0.26])
        text += link(name, [segment], MASSES[name], radius, [0.15, 0, 0])
    text += link("torso_3", [box([0.135, 0.088, 0], [0.27, 0.19, 0.32])], MASSES["torso_3"], radius, [0.135, 0.088, 0])
    text += link("head", [ball([0.135, 0, 0], 0.13)], MASSES["head"], radius, [0.135, 0, 0])
    text += joint("torso_yaw", "base", "torso_yaw", [0, 0, 0.1055], [0, 0, 0], (-140, 200), motors[0])
    text += joint("torso_1", "torso_yaw", "torso_1", [0, 0, 0], [-QUARTER, -QUARTER, 0], (-70, 90), motors[1])
    text += joint("torso_2", "torso_1", "torso_2", [0.3, 0, 0], [0, 0, 0], (0, 135), motors[2])
    text += joint("torso_3", "torso_2", "torso_3", [0.3, 0, 0], [0, 0, 0], (-135, 0), motors[3])
    # The neck does not move; the head stands above its dock.
    text += joint("neck", "torso_3", "head", [0.2593, 0.088, 0], [0, 0, 0])
    return text


def arm(side):
    """Joints 1 to 3 meet in the shoulder, 4 is the elbow, 5 to 7 meet in the wrist."""
    right = side == "right"
    sign = 1 if right else -1
    radius, motors = INERTIA_RADIUS["arm"], MOTORS["arm"]
    upper, fore, wrist = 0.4 * sign, 0.39 * sign, 0.118
    name = [f"{side}_arm_{k}" for k in range(8)]
    name[0] = f"{side}_dock"
    # z of arm_2 and arm_4 is the axis of the joint; y of both points along the segment, the left ones the other way; y of arm_7 to the hand.
    shapes = {
        # The motor of joint 2 sticks out of the shoulder.
        1: [ball([0, 0, 0], 0.09), capsule([0, 0, 0], [0, -0.05 * sign, 0], 0.06)],
        2: [capsule([0, 0, 0], [0, 0.55 * upper, 0], 0.06)],
        # The motor of joint 4 sticks out of the elbow.
        3: [ball([0, 0, 0], 0.075), capsule([0, 0, 0], [0, -0.05 * sign, 0], 0.06)],
        4: [capsule([0, 0, 0], [0, 0.58 * fore, 0], 0.06)],
        5: [ball([0, 0, 0], 0.065), capsule([0, 0, 0], [0, 0, -0.07 * sign], 0.055)],
        7: [capsule([0, 0, 0], [0, 0.55 * wrist, 0], 0.045)],
    }
    middles = {2: [0, upper / 2, 0], 4: [0, fore / 2, 0], 7: [0, wrist / 4, 0]}
    places = [
        ([0.19, 0.088, -0.256 * sign], [math.pi, math.pi / 6, math.pi] if right else [0, math.pi / 6, 0]),
        ([0, 0, 0], [0, 0, 0] if right else [math.pi, 0, 0]),
        ([0, 0, 0], [QUARTER, 0, 0]),
        ([0, upper, 0], [-QUARTER, -QUARTER, 0]),
        ([0, 0, 0], [QUARTER, 0, 0]),
        ([0, fore, 0], [QUARTER, 0, -math.pi] if right else [-QUARTER, 0, 0]),
        ([0, 0, 0], [sign * QUARTER, -sign * QUARTER, 0]),
        ([0, 0, 0], [sign * QUARTER, sign * QUARTER, 0]),
        ([0, wrist, 0], [QUARTER, 0, -math.pi] if right else [-QUARTER, 0, 0]),
    ]
    limits = [(-170, 170), (-120, 120), (-170, 170), (-120, 120), (-170, 170), (-45, 80), (-45, 135)]
    text = link(name[0])
    for k in range(1, 8):
        text += link(name[k], shapes.get(k, []), MASSES[f"arm_{k}"], radius, middles.get(k, [0, 0, 0]))
    text += link(f"{side}_flange")
    text += joint(name[0], "torso_3", name[0], *places[0])
    for k in range(1, 8):
        text += joint(name[k], name[k - 1], name[k], *places[k], limits[k - 1], motors[k - 1])
    return text + joint(f"{side}_flange", name[7], f"{side}_flange", *places[8])


# Segments of a finger: name, length, radius. The last one ends with the fingertip, a ball.
SEGMENTS = [("prox", 0.0678, 0.0185), ("mid", 0.03, 0.0145), ("dist", 0.029, 0.013)]
TIP_RADIUS = SEGMENTS[-1][2]
FINGER_LIMITS = {"base": (-20, 20), "prox": (-19, 90), "mid": (0, 70), "dist": (0, 70)}
# Rest postures in degrees: an open hand, the thumb turned before the palm.
REST = {"thumb": [60, 0, -10, 5], "fore": [0, -10, 5], "middle": [0, -10, 5], "ring": [0, -10, 5]}


def finger_joints(finger):
    return (["rotation"] if finger == "thumb" else []) + ["base", "prox", "mid", "dist"]


def hand(side):
    """The root is the palm: z to the fingers, the thumb at +y; the palm faces +x on the right hand and -x on the left one."""
    sign = 1 if side == "right" else -1
    mass, radius, motor = MASSES, INERTIA_RADIUS["hand"], MOTORS["hand"][0]
    palm = box([-0.012 * sign, 0, 0.0625], [0.082, 0.123, 0.165])
    text = link("palm", [palm], mass["palm"], radius, [-0.012 * sign, 0, 0.0625])
    bases = {
        "fore": ([-0.003 * sign, 0.04025, 0.15584], [-QUARTER, -1.535314, QUARTER]),
        "middle": ([-0.003 * sign, 0, 0.16056], [0, -QUARTER, 0]),
        "ring": ([-0.003 * sign, -0.04025, 0.15584], [QUARTER, -1.536466, -QUARTER]),
        "thumb": ([0, 0.0855, -0.10282 * sign], [sign * 0.017446, sign * 0.959825, 1.592094]),
    }
    for finger, (xyz, rpy) in bases.items():
        parent = "palm"
        if finger == "thumb":
            parent = "thumb_rotation"
            root = capsule([0, 0.035, -0.09 * sign], [0, 0.0855, -0.10282 * sign], 0.0195)
            text += link(parent, [root], mass["rotation"], radius, [0, 0.06, -0.096 * sign])
            turn = [math.pi, 0, math.pi] if side == "right" else [0, 0, 0]
            text += joint(parent, "palm", parent, [-0.003 * sign, 0.0271, 0], turn, (0, 90), motor)
        text += link(f"{finger}_base", [], mass["base_joint"], 0.01)
        text += joint(f"{finger}_base", parent, f"{finger}_base", xyz, rpy, FINGER_LIMITS["base"], motor)
        parent, place = f"{finger}_base", ([0, 0, 0], [-sign * QUARTER, 0, 0])
        for segment, length, thick in SEGMENTS:
            name = f"{finger}_{segment}"
            shapes = [capsule([0, 0, 0], [length, 0, 0], thick)]
            if segment == "prox":
                # Thinner at its end, so that a bent finger does not touch itself.
                shapes = [capsule([0.004, 0, 0], [0.045, 0, 0], thick), capsule([0.045, 0, 0], [length, 0, 0], 0.0145)]
            text += link(name, shapes, mass[segment], 0.01, [length / 2, 0, 0])
            mimic = f"{finger}_mid" if segment == "dist" else None
            text += joint(name, parent, name, *place, FINGER_LIMITS[segment], motor, mimic)
            parent, place = name, ([length, 0, 0], [0, 0, 0])
    return text


def hand_file(side):
    text = (
        f"# The {side} hand of the robot upper_body: four fingers, 13 joints. Written by make.py; change that.\n"
        f'format = "regrasp-hand"\nformat_version = 1\nurdf = "{side}_hand.urdf"\n'
    )
    for finger in ("thumb", "fore", "middle", "ring"):
        moving = [name for name in finger_joints(finger) if name != "dist"]
        rest = ", ".join(
            f"{finger}_{name} = {number(round(math.radians(angle), 4))}" for name, angle in zip(moving, REST[finger])
        ).replace(" = 0,", " = 0.0,")
        text += (
            f'\n[[fingers]]\nname = "{finger}"\ntip_link = "{finger}_dist"\n'
            f'tip = {{ shape = "sphere", radius = {TIP_RADIUS}, center = [{SEGMENTS[-1][1]}, 0.0, 0.0] }}\n'
            f"rest = {{ {rest} }}\n"
        )
    return text


ROBOT = """\
# A torso of three independent joints, two arms of seven and two hands of thirteen: 43 in all. Written by make.py; change that.
format = "regrasp-robot"
format_version = 1
name = "upper_body"

[[models]]
urdf = "body.urdf"

# The chest stays upright: its joint turns back what the two before it turn. Its limits become 0 <= torso_1 + torso_2 <= 135 degrees.
[[couplings]]
joint = "torso_3"
terms = [{ leader = "torso_1", multiplier = -1.0 }, { leader = "torso_2", multiplier = -1.0 }]

[[arms]]
name = "right"
base_link = "right_dock"
mount_link = "right_flange"
home = { right_arm_1 = 0.6, right_arm_2 = -1.3, right_arm_3 = 0.3, right_arm_4 = 1.6, right_arm_5 = -0.6 }

[[arms]]
name = "left"
base_link = "left_dock"
mount_link = "left_flange"
home = { left_arm_1 = 0.6, left_arm_2 = -1.3, left_arm_3 = 0.3, left_arm_4 = 1.6, left_arm_5 = -0.6 }

[[hands]]
name = "right"
hand = "right_hand.toml"
arm = "right"

[[hands]]
name = "left"
hand = "left_hand.toml"
arm = "left"

[rest]
torso_1 = -0.5
torso_2 = 1.0
"""


def accelerations():
    """What URDFs cannot say."""
    text = f"\n# In rad/s^2. What has no line of its own is a joint of a hand.\n[accelerations]\ndefault = {MOTORS['hand'][0][2]}\n"
    for name, motor in zip(("torso_yaw", "torso_1", "torso_2"), MOTORS["torso"]):
        text += f"{name} = {motor[2]}\n"
    for side in ("right", "left"):
        for k, motor in enumerate(MOTORS["arm"]):
            text += f"{side}_arm_{k + 1} = {motor[2]}\n"
    return text


def facing(text):
    """The robot file with the yaw of the torso held at zero: each arm then has a side that the other does not reach."""
    title, _, rest = text.partition("\n")
    title = "# The robot of robot.toml with the yaw of the torso held at zero: 42 joints. Written by make.py; change that."
    rest = rest.replace('name = "upper_body"', 'name = "upper_body_facing"')
    lines = [line for line in rest.split("\n") if not line.startswith("torso_yaw")]
    return "\n".join([title, *lines]).rstrip("\n") + "\n\n[held]\ntorso_yaw = 0.0\n"


def files():
    """The text of every file, by name."""
    about = "Dimensions as published for DLR's Justin (Saut 2010, sec. VI); shapes are our own."
    texts = {"body.urdf": robot("upper_body", about, torso() + arm("right") + arm("left")), "robot.toml": ROBOT + accelerations()}
    texts["facing.toml"] = facing(texts["robot.toml"])
    for side in ("right", "left"):
        texts[f"{side}_hand.urdf"] = robot(f"{side}_hand", about, hand(side))
        texts[f"{side}_hand.toml"] = hand_file(side)
    return texts


def main():
    for name, text in files().items():
        (FOLDER / name).write_text(text)


if __name__ == "__main__":
    main()
