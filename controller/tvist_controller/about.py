"""Description of a controller, as `info` returns it."""

from importlib.metadata import version

from tvist_controller.calibrations import available, fits
from tvist_controller.controller import Controller
from tvist_controller.reporting.stop_report import stopping
from tvist_plant.description import RobotDescription
from tvist_plant.plant import PERIOD, Plant
from tvist_protocol.channels import COMMANDS, tag
from tvist_protocol.geometry import Capsule, Geometry, Mesh, World, WorldShape
from tvist_protocol.info import CalibrationInfo, Info, Limits
from tvist_protocol.values import PROTOCOL_VERSION

VERSION = version("tvist")
FIELDS = {tag(kind): list(kind.__struct_fields__) for kind in COMMANDS}
"""Fields of each command, by its type."""


def info_of(controller: Controller) -> Info:
    """Describe the robot, its limits and its present setup."""
    setup, limits, lease = controller.setup, controller.setup.description.limits, controller.session.lease
    hold = controller.stepping.hold
    calibration = controller.filters.source.calibration
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
            velocity=list(limits.velocity),
            acceleration=list(limits.acceleration),
            jerk=list(limits.jerk),
            torque=list(limits.torque),
            payload=limits.payload,
        ),
        payload=controller.declared,
        calibration=None
        if calibration is None
        else CalibrationInfo(
            name=calibration.name,
            payload_mass=calibration.payload.mass,
            fits_payload=fits(calibration, controller.declared, controller.filters.source.name),
            fits_arm=controller.filters.source.fits_arm,
            seed=calibration.provenance.seed,
            f_d_range=calibration.provenance.measured_f_d_range,
            zeta_range=calibration.provenance.measured_zeta_range,
            shipped=calibration.name in available(),
        ),
        shaper=tvist.name,
        modes=tvist.estimator.modes,
        estimator=controller.filters.source.name,
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
        geometry=geometry_of(setup.description, _world_of(controller.cycle.plant)),
        watched=place if watched else None,
        moved=place if controller.supervision is not None else None,
    )


def _world_of(plant: Plant) -> World | None:
    """What stands around an arm, for clients that draw it; None if nothing does."""
    things = plant.things()
    if things is None:
        return None
    shapes = [
        WorldShape(
            kind=one.kind, size=list(one.size), pose=list(one.pose), body=one.body, colour=list(one.colour)
        )
        for one in things.shapes
    ]
    return World(name=things.name, bodies=list(things.bodies), shapes=shapes, unseen=things.unseen)


def geometry_of(description: RobotDescription, world: World | None = None) -> Geometry:
    """Kinematics and shape of an arm and its world, for clients that draw it."""
    kinematics, collision = description.kinematics, description.collision
    return Geometry(
        a=list(kinematics.a),
        d=list(kinematics.d),
        alpha=list(kinematics.alpha),
        placement=list(kinematics.placement),
        bending=sorted(description.link_flexibility.links),
        capsules=[
            Capsule(name=body.name, link=body.link, start=body.start, end=body.end, radius=body.radius)
            for body in collision.bodies
        ],
        meshes=[
            Mesh(link=mesh.link, file=mesh.file, placement=mesh.placement, scale=mesh.scale)
            for mesh in description.meshes
        ],
        payload_radius=collision.payload_radius,
        floor=collision.floor,
        has_floor=collision.has_floor,
        world=world,
    )
