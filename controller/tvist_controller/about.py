"""Description of a controller for the command `info`."""

from functools import cache
from importlib.metadata import version

import msgspec
import numpy as np

from tvist_controller.controller import Controller
from tvist_controller.foresight.stops import StopPlanner
from tvist_controller.kinematics.arm import InverseDynamics
from tvist_controller.line.differentiator import Floats, Target
from tvist_controller.setup import body, paper_payload
from tvist_controller.sources.calibrations import available, fits
from tvist_plant.description import RobotDescription
from tvist_plant.plant import PERIOD
from tvist_plant.surroundings import Things
from tvist_protocol.channels import COMMANDS, tag
from tvist_protocol.geometry import Geometry
from tvist_protocol.info import CalibrationInfo, Info, Limits, Stopping
from tvist_protocol.values import PROTOCOL_VERSION

SPEEDS = (0.33, 0.66, 1.0)
"""Fractions of a joint's velocity limit at which stops are computed, as in UR's manuals [-]."""
POSTURES = 500
"""Number of random postures searched for the stretched-out one, which needs most holding torque."""
VERSION = version("tvist")
FIELDS = {tag(kind): list(kind.__struct_fields__) for kind in COMMANDS}


def info_of(controller: Controller) -> Info:
    """Describe the robot, its limits and its present setup."""
    setup, limits = controller.setup, controller.setup.description.limits
    lease, hold = controller.session.lease, controller.session.clock
    calibration = controller.assumed.source.calibration
    watched = controller.watching is not None
    place = None if setup.plant is None else setup.plant.place
    own = (setup.calibration.name,) if setup.calibration is not None else ()
    tvist = controller.cycle.tvist
    return Info(
        name=setup.name,
        protocol=PROTOCOL_VERSION,
        version=VERSION,
        model=setup.description.robot.model,
        joints=list(setup.description.robot.joints),
        rate_hz=1.0 / PERIOD,
        clock=setup.clock,
        limits=Limits(
            position=[(-limit, limit) for limit in limits.position],
            velocity=[*limits.velocity],
            acceleration=[*limits.acceleration],
            jerk=[*limits.jerk],
            torque=[*limits.torque],
            payload=limits.payload,
        ),
        payload=controller.declared,
        calibration=None
        if calibration is None
        else CalibrationInfo(
            name=calibration.name,
            payload_mass=calibration.payload.mass,
            fits_payload=fits(calibration, controller.declared, controller.assumed.source.name),
            fits_arm=controller.assumed.source.fits_arm,
            seed=calibration.provenance.seed,
            f_d_range=calibration.provenance.measured_f_d_range,
            zeta_range=calibration.provenance.measured_zeta_range,
            shipped=calibration.name in available(),
        ),
        shaper=tvist.name,
        modes=tvist.estimator.modes,
        estimator=controller.assumed.source.name,
        calibrations=sorted({*available(), *own}),
        shapers=list(setup.registry.names()),
        control=None if lease is None else lease.client,
        stepper=None if hold is None else hold.client,
        commands=FIELDS,
        tick=controller.tick_number,
        stopping=list(stopping(setup.description)),
        robot_mode=controller.modes.now[0] if watched else controller.motion.activity.robot_mode,
        safety_mode=controller.modes.now[1] if watched else controller.motion.safety_mode,
        stop=controller.modes.stop_reason,
        arm=controller.arm,
        programs=controller.programs.kept.names,
        poses=setup.description.poses,
        geometry=geometry_of(setup.description, controller.cycle.plant.things()),
        watched=place if watched else None,
        moved=place if controller.supervision is not None else None,
    )


def geometry_of(description: RobotDescription, things: Things | None = None) -> Geometry:
    """Return kinematics and shapes of an arm and its surroundings for clients that draw them."""
    kinematics, collision = description.kinematics, description.collision
    content = {
        **msgspec.structs.asdict(kinematics),
        "bending": sorted(description.link_flexibility.links),
        "capsules": collision.bodies,
        "meshes": description.meshes,
        "payload_radius": collision.payload_radius,
        "floor": collision.floor,
        "has_floor": collision.has_floor,
        "world": things,
    }
    return msgspec.convert(content, Geometry, from_attributes=True)


# ---------------------------------------------------------------------- stops, as a safety report requires them


def stopping(description: RobotDescription) -> tuple[Stopping, ...]:
    """Return the stops of the joint that takes longest to stop, without payload and with the rated payload.

    One joint turns, either way, with the arm stretched out. The first call for a description takes 20 ticks.
    """
    return _found(msgspec.json.encode(description))


@cache
def _found(described: bytes) -> tuple[Stopping, ...]:
    description, rows = msgspec.json.decode(described, type=RobotDescription), []
    for mass in (0.0, description.limits.payload):
        dynamics = InverseDynamics(description, body(paper_payload(description, mass)))
        planner = StopPlanner(description, dynamics)
        q = _stretched(description, dynamics)
        for speed in SPEEDS:
            found = [
                (stop.duration, float(np.abs(stop.end - q).max()), name)
                for joint, name in enumerate(description.robot.joints)
                for sign in (-1.0, 1.0)
                if (
                    stop := planner.by_joints(
                        _turning(q, joint, sign * speed * description.limits.velocity[joint]),
                        None,
                        lambda _: True,
                    )
                )
            ]
            if found:
                duration, way, name = max(found)
                rows.append(Stopping(payload=mass, speed=speed, joint=name, duration=duration, way=way))
    return tuple(rows)


def _stretched(description: RobotDescription, dynamics: InverseDynamics) -> Floats:
    """Return the trial posture in which gravity uses the largest share of a joint's torque limit."""
    random, limits = np.random.default_rng(0), np.array(description.limits.torque)
    named = [np.array(pose) for pose in description.poses.values()]
    postures = [*named, *random.uniform(-np.pi, np.pi, (POSTURES, description.joints))]
    return max(postures, key=lambda q: float((np.abs(dynamics.gravity(q)) / limits).max()))


def _turning(q: Floats, joint: int, velocity: float) -> Target:
    qd = np.zeros_like(q)
    qd[joint] = velocity
    return Target(q, qd, np.zeros_like(q))
