"""Which joints and constraints of a model become what, and which are refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import regrasp

mujoco = pytest.importorskip("mujoco", reason="mujoco is not installed")

from mjcf_support import assert_same_poses, converted, forward, palm, wrong  # noqa: E402
from regrasp.from_mjcf import MjcfError, convert  # noqa: E402
from regrasp.from_mjcf.__main__ import main  # noqa: E402


def test_slides_and_unlimited_hinges(tmp_path: Path):
    world = """<body name="palm"><geom size="0.02"/>
      <body name="left" pos="0.02 0 0" euler="0 90 0">
        <joint name="slide" type="slide" axis="0 0 1" range="0 0.04" ref="0.01"/><joint name="turn" pos="0.003 0 0.001" ref="30" axis="1 1 0"/>
        <geom size="0.01" pos="0 0 0.03"/></body>
      <body name="right" pos="-0.02 0 0" quat="0.1 0.2 0.3 0.4"><joint name="spin" axis="0 0 2"/><geom type="capsule" size="0.004 0.02"/></body>
    </body>"""
    made, urdf, model = converted(tmp_path, world, velocity=2.5)
    assert [urdf.joints[name].kind for name in ("slide", "turn", "spin")] == ["prismatic", "continuous", "continuous"]
    assert urdf.joints["slide"].limits == pytest.approx((0.0, 0.04))
    assert_same_poses(model, urdf)
    assert regrasp.load_hand(made.urdf).joints[0].velocity == 2.5


def test_bodies_and_joints_without_names(tmp_path: Path):
    world = """<body><geom size="0.02"/>
      <body pos="0 0.03 0"><joint range="-60 60" axis="1 0 0"/><geom type="capsule" size="0.005 0.02"/></body>
      <body pos="0 -0.03 0"><joint range="-60 60" axis="1 0 0"/><geom type="capsule" size="0.005 0.02"/></body></body>"""
    _, urdf, _ = converted(tmp_path, world)
    assert urdf.links == ["body_1", "body_2", "body_3"]
    assert list(urdf.joints) == ["joint_0", "joint_1"]


def test_a_joint_that_an_equality_holds_is_fixed_there(tmp_path: Path):
    rest = '<equality><joint joint1="palm_a" polycoef="0.3 0 0 0 0"/></equality>'
    _, urdf, model = converted(tmp_path, palm(), rest)
    joint = urdf.joints["palm_a"]
    assert joint.kind == "fixed"
    data = forward(model, {"palm_a": 0.3})
    poses = urdf.forward({"palm_b": 0.0}, np.eye(4))
    assert np.abs(poses["palm_a"][:3, :3] - data.body("palm_a").xmat.reshape(3, 3)).max() < 1e-12


def test_a_narrow_tendon_is_a_coupling(tmp_path: Path):
    rest = """<tendon><fixed name="cord" limited="true" range="0.001 0.002"><joint joint="palm_a" coef="0.01"/><joint joint="palm_b" coef="-0.02"/></fixed></tendon>
      <actuator><motor joint="palm_b" ctrlrange="-2 3" gear="0.5"/></actuator>"""
    made, urdf, _ = converted(tmp_path, palm(), rest)
    leader, multiplier, offset = urdf.joints["palm_a"].mimic or ("", 0.0, 0.0)
    # 0.01 a - 0.02 b = 0.0015.
    assert (leader, multiplier, offset) == ("palm_b", pytest.approx(2.0), pytest.approx(0.15))
    assert urdf.joints["palm_b"].effort == pytest.approx(1.0)
    assert "tendons" not in made.left_out
    assert any('tendon "cord" keeps joint "palm_a"' in note for note in made.notes)


def test_tendons_of_fixed_length_are_couplings(tmp_path: Path):
    """Compared with MuJoCo's own lengths, at reference positions that are not 0."""
    world = (
        palm()
        .replace('name="palm_a" range', 'name="palm_a" ref="20" range')
        .replace('name="palm_b" range', 'name="palm_b" ref="-10" range')
    )
    fixed = '<fixed name="{}"><joint joint="palm_a" coef="0.03"/><joint joint="palm_b" coef="{}"/></fixed>'
    one = '<fixed name="single"><joint joint="{}" coef="-0.02"/></fixed>'
    cases = [
        (f"<tendon>{fixed.format('cord', -0.02)}</tendon>", '<tendon tendon1="cord" polycoef="0.001 0 0 0 0"/>', lambda lengths: lengths[0]),
        (f"<tendon>{one.format('palm_a').replace('single', 'cord')}{one.format('palm_b')}</tendon>", '<tendon tendon1="cord" tendon2="single" polycoef="0.001 0.5 0 0 0"/>', lambda lengths: lengths[0] - 0.5 * lengths[1]),
    ]  # fmt: skip
    for index, (tendons, equality, length) in enumerate(cases):
        folder = tmp_path / str(index)
        folder.mkdir()
        rest = f'{tendons}<equality>{equality}</equality><actuator><motor joint="palm_a"/></actuator>'
        made, urdf, model = converted(folder, world, rest)
        assert urdf.joints["palm_a"].mimic is None and urdf.joints["palm_b"].mimic is not None
        assert not made.left_out
        data = mujoco.MjData(model)
        for angle in (-0.3, 0.0, 0.4):
            data.qpos[:] = [angle, urdf.position("palm_b", {"palm_a": angle})]
            mujoco.mj_fwdPosition(model, data)
            # The constraint's own error is 0.
            assert abs(data.efc_pos[0]) < 1e-12
            assert length(data.ten_length) == pytest.approx(length(model.tendon_length0) + 0.001, abs=1e-12)
    (tmp_path / "held").mkdir()
    rest = f'<tendon>{one.format("palm_b")}</tendon><equality><tendon tendon1="single" polycoef="0.004 0 0 0 0"/></equality>'
    _, urdf, _ = converted(tmp_path / "held", world, rest)
    assert urdf.joints["palm_b"].kind == "fixed"


def test_a_tendon_that_one_actuator_pulls_is_told(tmp_path: Path):
    """With an option to be pasted."""
    world = palm().replace(
        '<geom type="capsule"',
        '<body name="tip" pos="0 0 0.03"><joint name="tip" range="-60 60" axis="1 0 0"/>'
        '<geom type="capsule" size="0.005 0.01"/></body><geom type="capsule"',
        1,
    )
    rest = """<tendon><fixed name="cord"><joint joint="palm_a" coef="0.01"/><joint joint="tip" coef="0.01"/></fixed></tendon>
      <actuator><motor tendon="cord" ctrlrange="-2 2"/></actuator>"""
    made, urdf, _ = converted(tmp_path, world, rest)
    assert urdf.joints["tip"].mimic is None
    assert urdf.joints["tip"].effort == pytest.approx(0.02)
    assert made.left_out["tendons"] == ("cord",)
    (note,) = (note for note in made.notes if "one actuator pulls" in note)
    option = note.partition("--couple ")[2].strip('"')
    assert option == "tip=palm_a"
    # As it is printed, and with a multiplier.
    for text, multiplier in ((option, 1.0), ("tip=-0.5*palm_a", -0.5)):
        assert main([str(tmp_path / "hand.xml"), "-o", str(tmp_path / "again"), "--couple", text]) == 0
        hand = regrasp.load_hand(tmp_path / "again" / "hand.toml")
        followers = [(joint.name, joint.follows, joint.multiplier) for joint in hand.coupled_joints]
        assert followers == [("tip", "palm_a", multiplier)]
    with pytest.raises(MjcfError, match='the hand has no joint "tipp"; did you mean "tip"'):
        convert(tmp_path / "hand.xml", tmp_path / "wrong", couple={"tipp": ("palm_a", 1.0)})


FOLLOWS = '<joint name="{}" joint1="palm_a" joint2="palm_b" polycoef="{}"/>'
REFUSED = {
    FOLLOWS.format("e", "0 1 0.5 0 0"): '"palm_a" follows "palm_b" by the polynomial 0, 1, 0.5, 0, 0',
    FOLLOWS.format("e", "0 0 1 0 0"): "without a linear term",
    FOLLOWS.format("e", "0 1 0 0 0")
    + FOLLOWS.format("f", "0 2 0 0 0"): 'constraint "f": joint "palm_a" follows another',
    '<connect name="e" body1="palm_a" body2="palm_b" anchor="0 0 0"/>': 'connect constraint "e" closes a loop',
    '<weld name="e" body1="palm_a" body2="palm_b"/>': 'weld constraint "e" closes a loop',
}


@pytest.mark.parametrize("constraint", REFUSED)
def test_constraints_that_a_urdf_cannot_hold(tmp_path: Path, constraint: str):
    rest, words = f"<equality>{constraint}</equality>", REFUSED[constraint]
    message = wrong(tmp_path, palm(), rest)
    assert words in message and "--lenient" in message
    made, _, _ = converted(tmp_path, palm(), rest, lenient=True)
    assert any(words in note and note.endswith("left out") for note in made.notes)


def test_joints_that_follow_each_other_in_a_circle(tmp_path: Path):
    rest = '<equality><joint joint1="palm_a" joint2="palm_b"/><joint joint1="palm_b" joint2="palm_a"/></equality>'
    assert "in a circle: palm_a -> palm_b" in wrong(tmp_path, palm(), rest)


def test_ball_joints_and_endless_slides_are_refused_by_name(tmp_path: Path):
    for joint, words in (
        ('<joint name="wobble" type="ball"/>', 'joint "wobble" is a ball joint'),
        ('<joint name="rail" type="slide"/>', 'joint "rail" slides without limits; give it a range'),
    ):
        world = f'<body name="base"><geom size="0.02"/>{palm(joint=joint)}</body>'
        assert words in wrong(tmp_path, world)
        made, urdf, model = converted(tmp_path, world, lenient=True)
        assert any(words in note and note.endswith("held where it is") for note in made.notes)
        poses = urdf.forward({}, np.eye(4))
        assert np.abs(poses["palm_a"][:3, 3] - forward(model, {}).body("palm_a").xpos).max() < 1e-12
