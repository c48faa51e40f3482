"""A hand of MuJoCo becomes a URDF that is the same hand: poses, masses, volumes and couplings, each compared with MuJoCo's own."""

from __future__ import annotations

import importlib.util
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pytest
import regrasp

mujoco = pytest.importorskip("mujoco", reason="mujoco is not installed")

from mjcf_support import GECKO, assert_same_poses, forward, in_body, model_of, random_positions, sphere_scene  # noqa: E402
from regrasp.from_mjcf import Conversion, convert  # noqa: E402
from regrasp.from_mjcf.__main__ import main  # noqa: E402
from urdf_model import Urdf  # noqa: E402


@pytest.fixture(scope="module")
def gecko(tmp_path_factory: pytest.TempPathFactory) -> Conversion:
    return convert(GECKO, tmp_path_factory.mktemp("converted") / "gecko")


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
    extension = '<mujoco><compiler strippath="false" fusestatic="false" discardvisual="false" boundmass="1e-9" boundinertia="1e-12"/></mujoco>'
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
            assert (
                np.abs(ours.body(f"{finger}_distal").xpos - in_body(stand, theirs.body(f"{finger}_distal").xpos)).max()
                < 1e-6
            )
            assert np.abs(expected).max() < 1.0


def test_masses_and_inertias_are_mujocos(gecko: Conversion):
    urdf = Urdf(gecko.urdf)
    model = model_of(GECKO)
    assert sum(urdf.masses.values()) == pytest.approx(
        float(sum(model.body_mass)) - float(model.body("ball").mass[0]), rel=1e-12
    )
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
    assert volumes.keys() == {"stand", "palm"} | {
        f"{f}_{p}" for f in ("east", "north", "west", "south") for p in ("proximal", "middle", "distal")
    }
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
    assert [urdf.joints[f"east_{name}"].effort for name in ("abduction", "flexion", "middle", "distal")] == [
        1.0,
        2.0,
        1.0,
        None,
    ]
    hand = regrasp.load_hand(gecko.hand_file or "")
    assert len(hand.joints) == 12
    assert [joint.name for joint in hand.coupled_joints] == [
        "east_distal",
        "north_distal",
        "west_distal",
        "south_distal",
    ]


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
            assert np.abs(tip - in_body(data.body("stand"), data.geom(f"{name}_tip").xpos)).max() < 2e-6


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
    assert '    ["east_distal", "west_distal"],\n]' in (gecko.hand_file or Path()).read_text()
    assert main([str(GECKO), "-o", str(tmp_path / "new")]) == 0
    out = capsys.readouterr().out
    assert "left out: sites: east_touch, north_touch, west_touch, south_touch\n" in out
    assert f"wrote  {tmp_path / 'new' / 'hand.toml'}\n" in out


def test_the_same_model_gives_the_same_bytes(gecko: Conversion, tmp_path: Path):
    again = convert(GECKO, tmp_path / "again")
    files = sorted(path.relative_to(gecko.urdf.parent) for path in gecko.urdf.parent.rglob("*") if path.is_file())
    assert [path.name for path in files] == [
        "hand.toml",
        "hand.urdf",
        "bracket.stl",
        "bracket_2.stl",
        "ellipsoid_crest.stl",
        "plate.stl",
    ]
    for path in files:
        assert (gecko.urdf.parent / path).read_bytes() == (again.urdf.parent / path).read_bytes(), path


def test_the_hand_plans_a_sphere(gecko: Conversion, tmp_path: Path):
    scene = sphere_scene(tmp_path, gecko.hand_file, [0.0202, 0.0, 0.0953])
    found = regrasp.plan(regrasp.load_scene(scene), seed=1, time_limit=60)
    assert isinstance(found, regrasp.Plan), str(found)
    assert regrasp.check(found)


def test_the_shadow_hand_of_gymnasium_robotics(tmp_path: Path):
    """MJCF with STL, a scene around it, and tendons that couple the last joints. Its package is looked at, not run."""
    package = importlib.util.find_spec("gymnasium_robotics")
    if package is None or package.origin is None:
        pytest.skip("gymnasium-robotics is not installed")
    path = Path(package.origin).parent / "envs" / "assets" / "hand" / "reach.xml"
    made = convert(path, tmp_path / "shadow")
    urdf, model = Urdf(made.urdf), model_of(path)
    followers = {name: joint.mimic[0] for name, joint in urdf.joints.items() if joint.mimic}
    assert followers == {f"robot0:{finger}J0": f"robot0:{finger}J1" for finger in ("FF", "MF", "RF", "LF")}
    rng = np.random.default_rng(4)
    drawn = [random_positions(model, rng) for _ in range(100)]
    for positions in drawn:
        positions.update({name: urdf.position(name, positions) for name in followers})
    assert_same_poses(model, urdf, drawn)
    inside = [model.body(link).id for link in urdf.links]
    assert sum(urdf.masses.values()) == pytest.approx(float(sum(model.body_mass[inside])), rel=1e-12)
    # Planned with the file as it is, where the fingertips rest.
    hand = regrasp.load_hand(made.hand_file or "")
    assert (hand.base_link, len(hand.fingers), len(hand.joints)) == ("robot0:palm", 5, 18)
    middle = hand.tips([q for finger in hand.fingers for q in finger.rest]).mean(axis=0)
    found = regrasp.plan(regrasp.load_scene(sphere_scene(tmp_path, made.hand_file, middle)), seed=1, time_limit=60)
    assert isinstance(found, regrasp.Plan), str(found)
    assert regrasp.check(found)


def test_urdfs_of_ours_are_plain_xml(gecko: Conversion):
    robot = ElementTree.parse(gecko.urdf).getroot()
    assert (robot.tag, robot.get("name")) == ("robot", "gecko")
