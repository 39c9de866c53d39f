"""The control line for studies: blocks of the paper's Figure 6, parameters, joint motions, tool pose."""

from tvist_controller.foresight.collision import CLEARANCE, CollisionModel
from tvist_controller.foresight.stops import resting_after
from tvist_controller.kinematics.arm import Arm, InverseDynamics
from tvist_controller.kinematics.pose import placement_vector, turned
from tvist_controller.line.cycle import ControlCycle
from tvist_controller.line.differentiator import STILL, central_differences
from tvist_controller.line.elastic_feed_forward import ElasticFeedForward
from tvist_controller.line.limits import REBOUND, TORQUE_SHARE, acceleration_on_way
from tvist_controller.line.whole_motion import DriveCommandSeries, DrivenLine, respond
from tvist_controller.planning.filter_planner import choose_filter, wanted_modes
from tvist_controller.planning.fitting import keeping_motion
from tvist_controller.refusal import RefusalError
from tvist_controller.setup import Setup, body, paper_payload
from tvist_controller.sources.calibrations import available as calibrations
from tvist_controller.sources.calibrations import (
    drivetrain,
    elastic_feed_forward,
    estimator_of,
    known_friction,
    mass_matrix,
    modal_estimator,
)
from tvist_controller.sources.calibrations import load as load_calibration
from tvist_controller.sources.mode_source import ModeSource
from tvist_controller.sources.own_shapers import OwnShaper, RecordedShaper
from tvist_controller.trajectory import JointLine, MotionLimits, PlannedMotion, Trajectory, quickest_motion

__all__ = [
    "CLEARANCE",
    "REBOUND",
    "STILL",
    "TORQUE_SHARE",
    "Arm",
    "CollisionModel",
    "ControlCycle",
    "DriveCommandSeries",
    "DrivenLine",
    "ElasticFeedForward",
    "InverseDynamics",
    "JointLine",
    "ModeSource",
    "MotionLimits",
    "OwnShaper",
    "PlannedMotion",
    "RecordedShaper",
    "RefusalError",
    "Setup",
    "Trajectory",
    "acceleration_on_way",
    "body",
    "calibrations",
    "central_differences",
    "choose_filter",
    "drivetrain",
    "elastic_feed_forward",
    "estimator_of",
    "keeping_motion",
    "known_friction",
    "load_calibration",
    "mass_matrix",
    "modal_estimator",
    "paper_payload",
    "placement_vector",
    "quickest_motion",
    "respond",
    "resting_after",
    "turned",
    "wanted_modes",
]
