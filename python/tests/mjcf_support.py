"""What the tests of `regrasp.from_mjcf` share: small models, and comparisons with MuJoCo."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from urdf_model import Urdf

mujoco = pytest.importorskip("mujoco", reason="mujoco is not installed")

from regrasp.from_mjcf import Conversion, MjcfError, convert  # noqa: E402

GECKO = Path(__file__).parent / "data" / "mjcf" / "gecko.xml"


FINGERS = """
<body name="{name}"><geom size="0.02"/>{joint}
  <body name="{name}_a" pos="0 0.03 0"><joint name="{name}_a" range="-60 60" axis="1 0 0"/><geom type="capsule" size="0.005 0.02"/></body>
  <body name="{name}_b" pos="0 -0.03 0"><joint name="{name}_b" range="-60 60" axis="1 0 0"/><geom type="capsule" size="0.005 0.02"/></body>
</body>"""


def palm(name: str = "palm", joint: str = "") -> str:
    return FINGERS.format(name=name, joint=joint)


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


def assert_same_poses(model: Any, urdf: Urdf, drawn: list[dict[str, float]] | None = None) -> None:
    """Every body and every geom, in the postures `drawn` or in 100 random ones, within 1e-9."""
    rng = np.random.default_rng(1)
    root = model.body(urdf.root).id
    for positions in drawn or [random_positions(model, rng) for _ in range(100)]:
        data = forward(model, positions)
        world_from_root = np.eye(4)
        world_from_root[:3, :3], world_from_root[:3, 3] = data.xmat[root].reshape(3, 3), data.xpos[root]
        # Followers by the URDF's own words.
        own = {
            name: position
            for name, position in positions.items()
            if name in urdf.joints and not urdf.joints[name].mimic
        }
        poses = urdf.forward(own, world_from_root)
        for body in range(model.nbody):
            name = model.body(body).name
            if name in poses:
                assert np.abs(poses[name][:3, 3] - data.xpos[body]).max() < 1e-9, name
                assert np.abs(poses[name][:3, :3] - data.xmat[body].reshape(3, 3)).max() < 1e-9, name
        for shape in urdf.shapes:
            geom = (
                model.geom(shape.name).id
                if shape.name and not shape.name.startswith("number ")
                else int(shape.name.split()[1])
            )
            pose = poses[shape.link] @ shape.link_from_shape
            assert np.abs(pose[:3, 3] - data.geom_xpos[geom]).max() < 1e-9, shape.name
            assert np.abs(pose[:3, :3] - data.geom_xmat[geom].reshape(3, 3)).max() < 1e-9, shape.name


def in_body(body: Any, point: Any) -> Any:
    return body.xmat.reshape(3, 3).T @ (point - body.xpos)


def sphere_scene(folder: Path, hand_file: Path | None, position: Any) -> Path:
    """A ball of 64 mm, to be turned by 60 degrees."""
    scene = folder / "sphere.toml"
    scene.write_text(
        'format = "regrasp-scene"\nformat_version = 1\ntask = "in_hand"\n'
        f'[hand]\nfile = "{hand_file}"\n'
        '[object]\nname = "sphere"\nsphere = { radius = 0.032 }\nmass = 0.05\nfriction = 0.8\n'
        f"[start]\nposition = {[round(float(x), 4) for x in position]}\n"
        '[goal]\nturn = { axis = "z", angle_deg = 60 }\n'
    )
    return scene
