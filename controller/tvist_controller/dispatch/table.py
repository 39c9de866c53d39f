"""The table of commands; it needs no robot, since admission and planning use it in other threads."""

from typing import Any

import numpy as np

from tvist_controller.dispatch import motion_commands, program_commands
from tvist_controller.dispatch.robot import RobotParts
from tvist_controller.foresight.collision import CLEARANCE
from tvist_controller.planning.filter_planner import FilterPlanner
from tvist_controller.planning.kinematic_planner import KinematicPlanner
from tvist_controller.planning.plan import CommandCall, CommandRow, Planning
from tvist_controller.planning.snapshot import FILTER, TOOL
from tvist_controller.refusal import RefusalError, check_body, check_joints, invalid, wrong_mode
from tvist_controller.safety.faults import check_fault
from tvist_controller.setup import body, payload_of
from tvist_plant.description import RobotDescription
from tvist_plant.plant import SimulatedArm
from tvist_protocol import commands as c
from tvist_protocol import io
from tvist_protocol.kinematics import ForwardKinematics, InverseKinematics
from tvist_protocol.replies import Accepted, Done, Reply
from tvist_protocol.simulation import SimulationInject, SimulationReset, SimulationStep
from tvist_protocol.values import PROTOCOL_VERSION

# ---------------------------------------------------------------------- rights


def _check_version(command: c.TakeControl | c.TakeClock, _: RobotDescription) -> None:
    if command.protocol != PROTOCOL_VERSION:
        must = f"{PROTOCOL_VERSION}, the version of this server"
        raise invalid("protocol", command.protocol, must, PROTOCOL_VERSION, "unsupported_version")


def _take_control(robot: RobotParts, call: CommandCall[c.TakeControl]) -> Reply:
    lease = robot.session.take(call.command.client, call.command.lease_s, call.now, call.session)
    return Accepted(token=lease.token, lease_s=lease.seconds)


_RIGHTS = (
    CommandRow(c.TakeControl, _take_control, lease="none", check=_check_version),
    CommandRow(c.KeepAlive, lambda _, __: None),  # every command renews the lease
    # The new holder takes control with its own token.
    CommandRow(
        c.HandOver, lambda robot, call: robot.session.hand_over(call.command.client, call.now, call.session)
    ),
    CommandRow(c.ReleaseControl, lambda robot, _: robot.session.release()),
    CommandRow(
        c.TakeClock,
        lambda robot, call: Accepted(token=robot.session.take_clock(call.command.client, call.session)),
        lease="none",
        check=_check_version,
    ),
    CommandRow(
        c.ReleaseClock, lambda robot, call: robot.session.release_clock(call.command.token), lease="none"
    ),
)

# ---------------------------------------------------------------------- filter, payload, terminals


def _filter(make: Any) -> Planning:
    """Return how to plan a command by `make(filter planner, command, state of the present filter)`."""
    return Planning(FILTER, FilterPlanner, lambda planner, command, now: make(planner, command, now.filter))


_FILTERS = (
    CommandRow(
        c.SetShaper,
        lambda robot, call: robot.assumed.choose(call.planned()),
        plan=_filter(
            lambda planner, command, now: planner.choose(
                command.name, command.modes, now.source, now.declared, "name"
            )
        ),
    ),
    CommandRow(
        c.SetEstimator,
        lambda robot, call: robot.assumed.estimate(call.planned()),
        plan=Planning(FILTER, FilterPlanner, FilterPlanner.estimate),
        long=True,
    ),
)
_SETTINGS = (
    CommandRow(
        c.SetPayload,
        lambda robot, call: robot.assumed.declare(call.command, call.planned()),
        changes_io=True,
        check=lambda command, arm: check_body(payload_of(command), rated=arm.limits.payload),
        plan=_filter(lambda planner, command, now: planner.with_payload(payload_of(command), now)),
    ),
    CommandRow(
        c.Forget,
        lambda robot, call: robot.assumed.forget(call.planned),
        changes_io=True,
        plan=_filter(lambda planner, _, now: planner.with_payload(now.given, now)),
    ),
    CommandRow(io.SetIo, lambda robot, call: robot.peripherals.set_outputs(call.command), changes_io=True),
    CommandRow(
        io.SetRegisters,
        lambda robot, call: robot.peripherals.write_registers(call.command, call.tick),
        lease="if named",
        changes_io=True,
    ),
    CommandRow(
        io.SetTcp, lambda robot, call: robot.peripherals.set_tcp(call.command.offset), changes_io=True
    ),
    CommandRow(
        io.SimulationSetInputs,
        lambda robot, call: robot.peripherals.set_inputs(call.command),
        changes_io=True,
    ),
)

# ---------------------------------------------------------------------- simulation and kinematics


def _check_reset(command: SimulationReset, description: RobotDescription) -> None:
    if command.q is not None:
        check_joints(command.q, description)
    if command.payload is not None:
        check_body(command.payload, "payload")


def _place(robot: RobotParts, call: CommandCall[SimulationReset]) -> Reply:
    command, chosen, cycle = call.command, call.planned(), robot.cycle
    plant, motion, cell = cycle.plant, robot.motion, robot.cell
    if not isinstance(plant, SimulatedArm):
        why = f"the plant {type(plant).__name__} cannot be placed: it has no method reset"
        raise RefusalError("unknown_type", "type", why)
    q = cycle.position if command.q is None else np.array(command.q, dtype=float)
    carried = None if command.payload is None else body(command.payload)
    if cell is not None:
        carried = carried or cell.empty
    placed = [] if carried is None else [carried]
    if command.q is not None:
        placed = [motion.collisions.declared, *(placed or [plant.payload])]
    blamed = "payload" if command.q is None and command.payload is not None else "q"
    met = motion.collisions.misplaced(q, *placed)
    limit = None if met is None else CLEARANCE
    met = met or plant.obstacle(q, carried)
    if met is not None:
        why = f"{met}: choose a posture in which the arm and its payload are clear"
        raise RefusalError("collision", blamed, why, limit)
    robot.programs.end("simulation.reset")
    motion.abandon("simulation.reset")
    robot.faults.clear()
    if chosen is not None:
        robot.assumed.use(chosen)
    if command.seed is not None:
        robot.seed = command.seed
    cycle.reset(q, carried=carried, seed=robot.seed)
    if cell is not None and carried is not None:
        cell.begin(carried)
    robot.safety.put(command.mode)
    if command.mode is not None:
        robot.modes.stops.clear()
    robot.true_modes = {}
    robot.modes.update()
    robot.report = robot.reported(cycle.sample)
    robot.force_control.begin_anew()
    motion.past.clear()
    return Done(tick=robot.tick_number)


def _check_step(robot: RobotParts, call: CommandCall[SimulationStep]) -> Reply:
    """Check that a client may advance time; the host then does so."""
    command = call.command
    robot.session.check_step(command, call.now)
    if command.setpoints is not None and not robot.motion.streaming:
        raise wrong_mode("no stream is running: send servo_start first", "setpoints")
    setpoints = command.setpoints or ()
    if len(setpoints) > command.ticks:
        why = f"setpoints has {len(setpoints)} entries: must be at most {command.ticks}, one per tick"
        raise RefusalError("out_of_range", "setpoints", why, command.ticks)
    for number, setpoint in enumerate(setpoints):
        check_joints(setpoint.q, robot.setup.description, f"setpoints[{number}].q")
    return Done(tick=robot.tick_number + command.ticks)


_SIMULATION = (
    CommandRow(
        SimulationReset,
        _place,
        check=_check_reset,
        plan=_filter(
            lambda planner, command, now: None if command.shaper is None
            else planner.choose(command.shaper, 1, now.source, now.declared)
        ),
    ),
    CommandRow(SimulationStep, _check_step, lease="none", long=True),
    CommandRow(
        SimulationInject,
        lambda robot, call: robot.faults.inject(call.command, call.tick),
        check=check_fault,
    ),
)  # fmt: skip
_QUESTIONS = tuple(
    CommandRow(
        kind, lambda _, call: call.planned(), lease="none", plan=Planning(TOOL, KinematicPlanner, make)
    )
    for kind, make in (
        (InverseKinematics, KinematicPlanner.posture),
        (ForwardKinematics, KinematicPlanner.pose),
    )
)

COMMANDS: dict[type[c.Command], CommandRow] = {
    row.message: row
    for row in (
        *_RIGHTS, *motion_commands.ROWS, *_FILTERS, *_SETTINGS, *program_commands.ROWS,
        *_SIMULATION, *_QUESTIONS,
    )
}  # fmt: skip
HARMLESS: frozenset[type[c.Command]] = frozenset(row.message for row in (*_RIGHTS, *_FILTERS, *_QUESTIONS))
"""Commands that do not affect the arm, accepted also by a watched robot."""
