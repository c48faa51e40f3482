"""Hands of MuJoCo become URDFs that are the same hands: poses, masses, volumes and couplings, each compared with MuJoCo's own."""

from __future__ import annotations

import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import regrasp
from urdf_model import Urdf

mujoco = pytest.importorskip("mujoco", reason="mujoco is not installed")

from regrasp.from_mjcf import Conversion, MjcfError, convert  # noqa: E402
from regrasp.from_mjcf.__main__ import main  # noqa: E402

GECKO = Path(__file__).parent / "data" / "mjcf" / "gecko.xml"


@pytest.fixture(scope="module")
def gecko(tmp_path_factory: pytest.TempPathFactory) -> Conversion:
    return convert(GECKO, tmp_path_factory.mktemp("converted") / "gecko")


def model_of(path: Path) -> Any:
    return mujoco.MjModel.from_xml_path(str(path))


def wrong(tmp_path: Path, world: str, rest: str = "", **arguments: Any) -> str:
    """What `convert` says about a model that it refuses."""
    model = tmp_path / "bad.xml"
    model.write_text(f"<mujoco><worldbody>{world}</worldbody>{rest}</mujoco>")
    with pytest.raises(MjcfError) as caught:
        convert(model, tmp_path / "refused", **arguments)
    assert not (tmp_path / "refused").exists()
    return str(caught.value)


def converted(tmp_path: Path, world: str, rest: str = "", **arguments: Any) -> tuple[Conversion, Urdf, Any]:
    model = tmp_path / "hand.xml"
    model.write_text(f"<mujoco><worldbody>{world}</worldbody>{rest}</mujoco>")
    made = convert(model, tmp_path / "out", **arguments)
    return made, Urdf(made.urdf), model_of(model)


def random_positions(model: Any, rng: np.random.Generator) -> dict[str, float]:
    """Of all hinges and slides within their ranges; those that follow where MuJoCo's equality constraints want them."""
    positions: dict[str, float] = {}
    for joint in range(model.njnt):
        if int(model.jnt_type[joint]) in (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)):
            low, high = model.jnt_range[joint] if model.jnt_limited[joint] else (-3.0, 3.0)
            positions[model.joint(joint).name] = float(rng.uniform(low, high))
    for index in range(model.neq):
        if int(model.eq_type[index]) == int(mujoco.mjtEq.mjEQ_JOINT) and model.eq_active0[index]:
            follower, leader = model.joint(int(model.eq_obj1id[index])), model.joint(int(model.eq_obj2id[index]))
            off = positions[leader.name] - float(leader.qpos0[0])
            bend = sum(float(c) * off**power for power, c in enumerate(model.eq_data[index][:5]))
            positions[follower.name] = float(follower.qpos0[0]) + bend
    return positions


def forward(model: Any, positions: dict[str, float]) -> Any:
    data = mujoco.MjData(model)
    for name, position in positions.items():
        data.qpos[model.joint(name).qposadr[0]] = position
    mujoco.mj_kinematics(model, data)
    return data


def assert_same_poses(model: Any, urdf: Urdf, count: int = 100) -> None:
    """Every body and every geom, in `count` random postures, within 1e-9."""
    rng = np.random.default_rng(1)
    root = model.body(urdf.root).id
    for _ in range(count):
        positions = random_positions(model, rng)
        data = forward(model, positions)
        world_from_root = np.eye(4)
        world_from_root[:3, :3], world_from_root[:3, 3] = data.xmat[root].reshape(3, 3), data.xpos[root]
        # Followers by the URDF's own words.
        own = {name: position for name, position in positions.items() if name in urdf.joints and not urdf.joints[name].mimic}
        poses = urdf.forward(own, world_from_root)
        for body in range(model.nbody):
            name = model.body(body).name
            if name in poses:
                assert np.abs(poses[name][:3, 3] - data.xpos[body]).max() < 1e-9, name
                assert np.abs(poses[name][:3, :3] - data.xmat[body].reshape(3, 3)).max() < 1e-9, name
        for shape in urdf.shapes:
            geom = model.geom(shape.name).id if shape.name and not shape.name.startswith("number ") else int(shape.name.split()[1])
            pose = poses[shape.link] @ shape.link_from_shape
            assert np.abs(pose[:3, 3] - data.geom_xpos[geom]).max() < 1e-9, shape.name
            assert np.abs(pose[:3, :3] - data.geom_xmat[geom].reshape(3, 3)).max() < 1e-9, shape.name


def test_bodies_and_geoms_stand_where_mujoco_has_them(gecko: Conversion):
    urdf = Urdf(gecko.urdf)
    model = model_of(GECKO)
    assert urdf.root == "stand"
    assert {name for name in urdf.links if "/" not in name} == {
        model.body(body).name for body in range(1, model.nbody) if model.body(body).name != "ball"
    }
    assert_same_poses(model, urdf)


def test_mujoco_reads_the_urdf_as_the_same_hand(gecko: Conversion):
    """A third way: MuJoCo's own reader of URDFs."""
    text = gecko.urdf.read_text()
    extension = (
        '<mujoco><compiler strippath="false" fusestatic="false" discardvisual="false" boundmass="1e-9" boundinertia="1e-12"/></mujoco>'
    )
    beside = gecko.urdf.with_name("with_extension.urdf")
    beside.write_text(text.replace("</robot>", f"{extension}</robot>"))
    try:
        read = model_of(beside)
    finally:
        beside.unlink()
    model = model_of(GECKO)
    rng = np.random.default_rng(2)
    for _ in range(20):
        positions = random_positions(model, rng)
        stand = forward(model, {}).body("stand")
        theirs, ours = forward(model, positions), forward(read, positions)
        for finger in ("east", "north", "west", "south"):
            expected = stand.xmat.reshape(3, 3).T @ (theirs.geom(f"{finger}_tip").xpos - stand.xpos)
            assert np.abs(ours.body(f"{finger}_distal").xpos - _in(stand, theirs.body(f"{finger}_distal").xpos)).max() < 1e-6
            assert np.abs(expected).max() < 1.0


def _in(body: Any, point: Any) -> Any:
    return body.xmat.reshape(3, 3).T @ (point - body.xpos)


def test_masses_and_inertias_are_mujocos(gecko: Conversion):
    urdf = Urdf(gecko.urdf)
    model = model_of(GECKO)
    assert sum(urdf.masses.values()) == pytest.approx(float(sum(model.body_mass)) - float(model.body("ball").mass[0]), rel=1e-12)
    for link, mass in urdf.masses.items():
        body = model.body(link)
        assert mass == pytest.approx(float(body.mass[0]), rel=1e-12)
        turn = np.empty(9)
        mujoco.mju_quat2Mat(turn, body.iquat)
        tensor = turn.reshape(3, 3) @ np.diag(body.inertia) @ turn.reshape(3, 3).T
        center, own = urdf.inertias[link]
        assert np.abs(center - body.ipos).max() < 1e-12
        assert np.abs(own - tensor).max() < 1e-9 * np.abs(tensor).max()


def test_volumes_are_mujocos(gecko: Conversion):
    """With a density of 1 and inertia from the geoms, MuJoCo's masses are volumes."""
    spec = mujoco.MjSpec.from_file(str(GECKO))
    spec.compiler.inertiafromgeom = int(mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE)
    for geom in spec.geoms:
        geom.density = 1.0
    for default in (spec.find_default(name) for name in ("gecko", "shown", "felt", "distal")):
        default.geom.density = 1.0
    for mesh in spec.meshes:
        mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_EXACT
    model = spec.compile()
    urdf = Urdf(gecko.urdf)
    volumes: dict[str, float] = {}
    for shape in {(shape.link, shape.name): shape for shape in urdf.shapes}.values():
        volume = shape.volume()
        if shape.name == "crest":
            # An ellipsoid, of triangles with their corners on it.
            exact = 4 / 3 * np.pi * 0.01 * 0.006 * 0.004
            assert 0.997 * exact < volume < exact
            volume = exact
        volumes[shape.link] = volumes.get(shape.link, 0.0) + volume
    assert volumes.keys() == {"stand", "palm"} | {f"{f}_{p}" for f in ("east", "north", "west", "south") for p in ("proximal", "middle", "distal")}
    for link, volume in volumes.items():
        assert volume == pytest.approx(float(model.body(link).mass[0]), rel=1e-6), link


def test_couplings_and_limits_and_efforts(gecko: Conversion):
    urdf = Urdf(gecko.urdf)
    assert urdf.joints["east_distal"].mimic == ("east_middle", 0.8, 0.0)
    leader, multiplier, offset = urdf.joints["north_distal"].mimic or ("", 0.0, 0.0)
    # At its reference position of 5 degrees the leader bends the follower by 0.1 rad from its own of -5 degrees.
    assert (leader, multiplier) == ("north_middle", 0.8)
    assert offset == pytest.approx(np.radians(-5) + 0.1 - 0.8 * np.radians(5), abs=1e-12)
    assert urdf.joints["east_flexion"].limits == pytest.approx((np.radians(-75), np.radians(60)))
    # The smaller side of the force range, by the gear.
    assert [urdf.joints[f"east_{name}"].effort for name in ("abduction", "flexion", "middle", "distal")] == [1.0, 2.0, 1.0, None]
    hand = regrasp.load_hand(gecko.hand_file or "")
    assert len(hand.joints) == 12
    assert [joint.name for joint in hand.coupled_joints] == ["east_distal", "north_distal", "west_distal", "south_distal"]


def test_regrasp_has_the_tips_where_mujoco_has_them(gecko: Conversion):
    hand = regrasp.load_hand(gecko.hand_file or "")
    model = model_of(GECKO)
    rng = np.random.default_rng(3)
    assert [finger.tip.shape for finger in hand.fingers] == ["sphere"] * 4
    assert [finger.tip.radius for finger in hand.fingers] == pytest.approx([0.005] * 4)
    for _ in range(100):
        positions = random_positions(model, rng)
        data = forward(model, positions)
        tips = hand.tips([positions[name] for name in hand.joint_names])
        for finger, tip in zip(hand.fingers, tips, strict=True):
            name = finger.joint_names[0].split("_")[0]
            # Hand files have tips to the micrometre.
            assert np.abs(tip - _in(data.body("stand"), data.geom(f"{name}_tip").xpos)).max() < 2e-6


def test_what_is_left_out_is_named(gecko: Conversion, tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    assert gecko.problem is None
    assert gecko.left_out == {
        "bodies outside the hand": ("ball",),
        "equality constraints that are not active": ("locked", "mount"),
        "tendons": ("flexor",),
        "contact pairs (friction and condim of their own)": ("east_tip and north_tip",),
        "sites": ("east_touch", "north_touch", "west_touch", "south_touch"),
        "cameras": ("eye",),
        "sensors": ("east_touch",),
    }
    assert 'allow = [\n    ["east_distal", "west_distal"],\n]' in (gecko.hand_file or Path()).read_text()
    assert main([str(GECKO), "-o", str(tmp_path / "new")]) == 0
    out = capsys.readouterr().out
    assert "left out: sites: east_touch, north_touch, west_touch, south_touch\n" in out
    assert f"wrote  {tmp_path / 'new' / 'hand.toml'}\n" in out


def test_the_same_model_gives_the_same_bytes(gecko: Conversion, tmp_path: Path):
    again = convert(GECKO, tmp_path / "again")
    files = sorted(path.relative_to(gecko.urdf.parent) for path in gecko.urdf.parent.rglob("*") if path.is_file())
    assert [path.name for path in files] == ["hand.toml", "hand.urdf", "bracket.stl", "bracket_2.stl", "ellipsoid_crest.stl", "plate.stl"]
    for path in files:
        assert (gecko.urdf.parent / path).read_bytes() == (again.urdf.parent / path).read_bytes(), path


def test_the_hand_plans_a_sphere(gecko: Conversion, tmp_path: Path):
    scene = tmp_path / "sphere.toml"
    scene.write_text(
        'format = "regrasp-scene"\nformat_version = 1\ntask = "in_hand"\n'
        f'[hand]\nfile = "{gecko.hand_file}"\n'
        '[object]\nname = "sphere"\nsphere = { radius = 0.032 }\nmass = 0.05\nfriction = 0.8\n'
        "[start]\nposition = [0.0202, 0.0, 0.0953]\n"
        '[goal]\nturn = { axis = "z", angle_deg = 60 }\n'
    )
    found = regrasp.plan(regrasp.load_scene(scene), seed=1, time_limit=60)
    assert isinstance(found, regrasp.Plan), str(found)
    assert regrasp.check(found)


FINGERS = """
<body name="{name}"><geom size="0.02"/>{joint}
  <body name="{name}_a" pos="0 0.03 0"><joint name="{name}_a" range="-60 60" axis="1 0 0"/><geom type="capsule" size="0.005 0.02"/></body>
  <body name="{name}_b" pos="0 -0.03 0"><joint name="{name}_b" range="-60 60" axis="1 0 0"/><geom type="capsule" size="0.005 0.02"/></body>
</body>"""


def palm(name: str = "palm", joint: str = "") -> str:
    return FINGERS.format(name=name, joint=joint)


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
    world = palm().replace('name="palm_a" range', 'name="palm_a" ref="20" range').replace('name="palm_b" range', 'name="palm_b" ref="-10" range')
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
    rest = """<tendon><fixed name="cord"><joint joint="palm_a" coef="0.01"/><joint joint="palm_b" coef="0.01"/></fixed></tendon>
      <actuator><motor tendon="cord" ctrlrange="-2 2"/></actuator>"""
    made, urdf, _ = converted(tmp_path, palm(), rest)
    assert urdf.joints["palm_a"].mimic is None
    assert urdf.joints["palm_a"].effort == pytest.approx(0.02)
    assert made.left_out["tendons"] == ("cord",)
    (note,) = (note for note in made.notes if "one actuator pulls" in note)
    table = note.partition("\n")[2]
    assert table == '[[couplings]]\njoint = "palm_b"\nleader = "palm_a"\nmultiplier = 1.0'
    # The table can be pasted.
    hand_file = made.hand_file or Path()
    hand_file.write_text(f"{hand_file.read_text()}\n{table}\n")
    with pytest.raises(regrasp.InputError) as caught:
        regrasp.load_hand(hand_file)
    # The joints here are of two fingers, which is another matter.
    assert caught.value.code == "U209"


@pytest.mark.parametrize(
    ("rest", "words"),
    [
        ('<equality><joint name="e" joint1="palm_a" joint2="palm_b" polycoef="0 1 0.5 0 0"/></equality>', '"palm_a" follows "palm_b" by the polynomial 0, 1, 0.5, 0, 0'),
        ('<equality><joint name="e" joint1="palm_a" joint2="palm_b" polycoef="0 0 1 0 0"/></equality>', "without a linear term"),
        ('<equality><connect name="e" body1="palm_a" body2="palm_b" anchor="0 0 0"/></equality>', 'connect constraint "e" closes a loop'),
        ('<equality><weld name="e" body1="palm_a" body2="palm_b"/></equality>', 'weld constraint "e" closes a loop'),
        ('<equality><joint name="e" joint1="palm_a" joint2="palm_b"/><joint name="f" joint1="palm_a" joint2="palm_b"/></equality>', 'constraint "f": joint "palm_a" follows another joint already'),
    ],
)  # fmt: skip
def test_constraints_that_a_urdf_cannot_hold(tmp_path: Path, rest: str, words: str):
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


def test_the_root(tmp_path: Path):
    table = '<body name="table"><geom type="box" size="1 1 0.1"/></body><geom type="plane" size="1 1 1" name="floor"/>'
    # A hand that floats, and a table: joints of the root are how it is mounted.
    made, urdf, _ = converted(tmp_path, table + palm(joint='<freejoint name="float"/>'))
    assert urdf.root == "palm"
    assert made.left_out["bodies outside the hand"] == ("table",)
    assert made.left_out["joints that move the root body"] == ("float",)
    # Two hands: choose.
    both = palm("first") + palm("second")
    assert '--root "first", --root "second"; or --root world' in wrong(tmp_path, both)
    (tmp_path / "one").mkdir()
    _, urdf, _ = converted(tmp_path / "one", both, root="second")
    assert urdf.links == ["second", "second_a", "second_b"]
    (tmp_path / "all").mkdir()
    made, urdf, model = converted(tmp_path / "all", both + table, root="world")
    assert urdf.root == "world" and "second_b" in urdf.links
    assert made.left_out["planes and height fields"] == ("floor",)
    assert_same_poses(model, urdf, 5)
    # Fingers on the world itself.
    fingers = palm().partition("/>")[2].rpartition("</body>")[0]
    assert '--root "palm_a", --root "palm_b"; or --root world' in wrong(tmp_path, fingers)


def test_names_that_are_wrong(tmp_path: Path):
    assert 'there is no body "plam"; did you mean --root "palm"?' in wrong(tmp_path, palm(), root="plam")
    assert "no body has a hinge or a slide" in wrong(tmp_path, '<body name="rock"><geom size="0.1"/></body>')
    with pytest.raises(MjcfError, match="there is no such file"):
        convert(tmp_path / "gone.xml", tmp_path / "out")
    (tmp_path / "text.xml").write_text("<mujoco><worldbdy/></mujoco>")
    with pytest.raises(MjcfError, match="MuJoCo cannot read it"):
        convert(tmp_path / "text.xml", tmp_path / "out")


def test_folders_of_others_are_left_alone(tmp_path: Path):
    (tmp_path / "model").mkdir()
    (tmp_path / "model" / "palm.stl").write_text("mine")
    with pytest.raises(MjcfError, match="not empty"):
        convert(GECKO, tmp_path / "model")
    assert [path.name for path in (tmp_path / "model").iterdir()] == ["palm.stl"]
    convert(GECKO, tmp_path / "new")
    convert(GECKO, tmp_path / "new")


def test_a_urdf_that_is_no_hand_is_written_with_the_reason(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    model = tmp_path / "far.xml"
    world = palm().replace("0.03", "30").replace("0.02", "20").replace("0.005", "5")
    model.write_text(f"<mujoco><worldbody>{world}</worldbody></mujoco>")
    assert main([str(model), "-o", str(tmp_path / "out")]) == 2
    assert "U216" in capsys.readouterr().err
    assert (tmp_path / "out" / "hand.urdf").is_file() and not (tmp_path / "out" / "hand.toml").exists()


def test_the_command_that_the_reader_of_urdfs_prints_works(tmp_path: Path):
    """U108 names the command; it is run as it stands."""
    (tmp_path / "hand.xml").write_text(f"<mujoco><worldbody>{palm()}</worldbody></mujoco>")
    with pytest.raises(regrasp.InputError) as caught:
        regrasp.load_hand(tmp_path / "hand.xml")
    assert caught.value.code == "U108"
    command = caught.value.fix.split("#")[0].split()
    assert command[:3] == ["python", "-m", "regrasp.from_mjcf"]
    run = subprocess.run([sys.executable, *command[1:]], cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert run.returncode == 0, run.stderr
    assert len(regrasp.load_hand(tmp_path / "hand" / "hand.toml").fingers) == 2


def test_radians_that_are_taken_for_degrees_are_told(tmp_path: Path):
    made, _, _ = converted(tmp_path, palm().replace("-60 60", "-1 1"))
    assert any('angle="radian"' in note for note in made.notes)
    (tmp_path / "right").mkdir()
    made, _, _ = converted(tmp_path / "right", palm())
    assert not made.notes


def test_the_command_line_takes_a_base(tmp_path: Path, regrasp_cli: Any):
    """A hand on an arm, with a head beside it: the fix that is printed works."""
    arm = ""
    for name in ("shoulder", "elbow", "wrist"):
        arm += f'<body name="{name}" pos="0 0 0.1"><joint name="{name}" range="-60 60"/><geom size="0.01"/>'
    head = '<body name="head" pos="0.2 0 0"><joint name="head" range="-60 60"/><geom type="capsule" size="0.01 0.02"/></body>'
    world = f'<body name="torso"><geom size="0.02"/>{head}{arm}{palm()}{"</body>" * 3}</body>'
    made, _, _ = converted(tmp_path, world)
    assert made.problem is not None and made.problem.code == "U208"
    assert made.problem.fix == "regrasp inspect with --base palm"
    options = made.problem.fix.partition("with ")[2].split()
    done = regrasp_cli("inspect", made.urdf, *options, "-o", made.urdf.with_name("hand.toml"), "--samples", "100")
    assert done.returncode == 0, done.stderr
    hand = regrasp.load_hand(made.urdf.with_name("hand.toml"))
    assert (hand.base_link, hand.joint_names) == ("palm", ("palm_a", "palm_b"))
    refused = regrasp_cli("inspect", made.urdf.with_name("hand.toml"), "--base", "palm")
    assert (refused.returncode, "A505" in refused.stderr) == (2, True)


def test_urdfs_of_ours_are_plain_xml(gecko: Conversion):
    robot = ElementTree.parse(gecko.urdf).getroot()
    assert (robot.tag, robot.get("name")) == ("robot", "gecko")
