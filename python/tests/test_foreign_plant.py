"""A hand of somebody else's MuJoCo model: the wide hand with position drives, as a model that knows nothing of plans."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import regrasp

mujoco: Any = pytest.importorskip("mujoco")

from regrasp.execute import Executor, ForeignPlant, ForeignSettings, turns  # noqa: E402
from regrasp.execute.settings import PLANNER  # noqa: E402

SCENES = Path(__file__).parents[2] / "scenes"
HERE = regrasp.Pose(np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]))


@pytest.fixture(scope="module")
def plan() -> regrasp.Plan:
    found = regrasp.plan(regrasp.load_scene(SCENES / "sphere_90x.toml"), seed=1, settings=PLANNER)
    assert isinstance(found, regrasp.Plan)
    return found


@pytest.fixture(scope="module")
def model(plan: regrasp.Plan, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The model of the plan's scene, turned and moved as a whole, with position actuators of 3 N m/rad and joints of other names."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        spec = mujoco.MjSpec.from_string(regrasp.export_mjcf(plan))
    for key in list(spec.keys):
        spec.delete(key)
    for actuator in spec.actuators:
        actuator.set_to_position(kp=3.0, kv=0.1)
        actuator.target = f"other:{actuator.target}"
    for joint in spec.joints:
        joint.name = f"other:{joint.name}"
    spec.body("palm").pos = [0.3, -0.2, 0.5]
    spec.compile()
    path = tmp_path_factory.mktemp("foreign") / "hand.xml"
    path.write_text(spec.to_xml())
    return path


def plant_of(model: Path, plan: regrasp.Plan, **changes: Any) -> ForeignPlant:
    arguments: dict[str, Any] = {
        "root": "palm",
        "object_body": "object",
        "world_from_root": HERE,
        "mjcf_name": lambda name: f"other:{name}",
        "tips": {finger: f"{finger}_distal" for finger in plan.fingers},
        "settings": ForeignSettings(seed=1),
    }
    return ForeignPlant(str(model), plan, **{**arguments, **changes})


def test_goals_are_reached_by_position_drives_of_a_foreign_model(plan: regrasp.Plan, model: Path) -> None:
    plant = plant_of(model, plan)
    assert plant.stiffness.tolist() == [3.0] * len(plan.joint_names) and (plant.damping > 0.1).all()
    # Seen from the scene, wherever the model has its hand.
    assert np.linalg.norm(plant.pose.position - plan.object_positions[0]) < 0.002
    assert plant.touching() == len(plan.fingers)
    assert plan._source is not None  # pyright: ignore[reportPrivateUsage]
    session = regrasp.Session(plan._source, settings=PLANNER)  # pyright: ignore[reportPrivateUsage]
    executor = Executor(session, plant, stiffness=plant.stiffness, damping=plant.damping)
    log = executor.run(turns(plant.pose, count=2, seed=3, largest=0.6))
    assert log.status == "done" and log.n_reached == 2, log.message
    for goal in log.goals:
        assert goal.true_distance is not None and goal.true_distance < 0.002
    # It holds on by itself.
    for _ in range(250):
        plant.apply(plant.holding if executor.log.goals == [] else executor._resting())  # pyright: ignore[reportPrivateUsage]
    assert plant.touching() >= 3


def test_models_that_lack_something_are_refused(plan: regrasp.Plan, model: Path) -> None:
    with pytest.raises(ValueError, match='no joint "east_abduction"'):
        plant_of(model, plan, mjcf_name=str)
    with pytest.raises(ValueError, match='no body "fist"'):
        plant_of(model, plan, object_body="fist")
    with pytest.raises(ValueError, match='no joint "thumb"'):
        plant_of(model, plan, followers={"thumb": (plan.joint_names[0], 1.0, 0.0)})
    with pytest.raises(ValueError, match="0 position actuators, not one"):
        text = model.read_text().replace("<general ", "<motor ", 1)
        head, _, tail = text.partition("<motor ")
        end = tail.index("/>")
        name = tail.split('joint="')[1].split('"')[0]
        other = model.with_name("motor.xml")
        other.write_text(f'{head}<motor joint="{name}"{tail[end:]}')
        plant_of(other, plan)
