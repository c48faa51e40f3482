"""Plans what a multi-fingered hand has to do to turn an object, and judges plans independently.

    scene = regrasp.load_scene("scene.toml")
    result = regrasp.plan(scene, seed=7)
    if result:
        result.save("plan.json")
        assert regrasp.check(result)
    else:
        print(result)

SI units and radians; rotations are `quat_xyzw`; joint vectors are in the order of `joint_names`.
"""

from ._errors import Diagnostic, InputError, InternalError, RegraspError
from ._grasps import GraspList, NoGrasps, check_grasps, grasps_mjcf, list_grasps
from ._mbm import MotionProblem, import_mbm
from ._model import (
    CoupledJoint,
    Finger,
    Hand,
    InputFile,
    Joint,
    Object,
    Obstacle,
    Pose,
    Query,
    Scene,
    Shape,
    Support,
    Task,
    Tip,
    load_hand,
    load_scene,
)
from ._plan import CONTACT_MODES, Plan, Segment
from ._planning import check, export_mjcf, place, plan, plan_motion, plan_pick_and_place, view
from ._regrasp import __version__
from ._result import (
    Cause,
    Clearance,
    Failure,
    MetBody,
    Moment,
    NearestMiss,
    Progress,
    Report,
    RobotMiss,
    TriedExchange,
    Violation,
    WantedHand,
)
from ._robot_plan import RobotPlan, RobotSegment
from ._session import QueryTimes, Session, Start

__all__ = [
    "CONTACT_MODES",
    "Cause",
    "Clearance",
    "CoupledJoint",
    "Diagnostic",
    "Failure",
    "Finger",
    "GraspList",
    "Hand",
    "InputError",
    "InputFile",
    "InternalError",
    "Joint",
    "MetBody",
    "Moment",
    "MotionProblem",
    "NearestMiss",
    "NoGrasps",
    "Object",
    "Obstacle",
    "Plan",
    "Pose",
    "Progress",
    "Query",
    "QueryTimes",
    "RegraspError",
    "Report",
    "RobotMiss",
    "RobotPlan",
    "RobotSegment",
    "Scene",
    "Segment",
    "Session",
    "Shape",
    "Start",
    "Support",
    "Task",
    "Tip",
    "TriedExchange",
    "Violation",
    "WantedHand",
    "__version__",
    "check",
    "check_grasps",
    "export_mjcf",
    "grasps_mjcf",
    "import_mbm",
    "list_grasps",
    "load_hand",
    "load_scene",
    "place",
    "plan",
    "plan_motion",
    "plan_pick_and_place",
    "view",
]
