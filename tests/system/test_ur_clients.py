"""The unmodified client ur-rtde reads the robot's values, and its commands take effect."""

import math
import struct

import msgspec
import pytest
from tests.conformance.served import Served
from tests.conformance.wire import Wire
from tests.places import own_address
from tests.system.ur_object import Client
from tests.system.waiting import eventually

from tvist_controller.instruments.snapshot import Instruments
from tvist_plant.description import load
from tvist_protocol import Io, State

from .test_ur_lockstep import lockstep

rtde_receive = pytest.importorskip("rtde_receive")

Q1 = [0.0, -math.pi, 0.0, -math.pi / 2, 0.0, 0.0]
NEAR = [0.1, -3.1, 0.1, -1.5, 0.05, 0.1]
HOME = [-1.60, -1.727, -2.203, -0.808, 1.595, -0.031]
TICK, BOOTED = 0.002, 40.0
OF_STATE = {
    "actual_q", "actual_qd", "actual_TCP_pose", "actual_TCP_speed", "actual_tool_accelerometer", "robot_mode",
    "safety_mode", "runtime_state",
}  # fmt: skip
"""Variables of `state`; the instruments compute the others."""
MADE_BY_THE_CLIENT = {
    "getDigitalInState": lambda of: [bool(of.actual_digital_input_bits >> bit & 1) for bit in range(18)],
    "getDigitalOutState": lambda of: [bool(of.actual_digital_output_bits >> bit & 1) for bit in range(18)],
    "getOutputDoubleRegister": lambda of: [getattr(of, f"output_double_register_{k}") for k in range(12, 20)],
    "getOutputIntRegister": lambda of: [getattr(of, f"output_int_register_{k}") for k in range(12, 20)],
    "getSpeedScalingCombined": lambda of: of.speed_scaling * of.target_speed_fraction,
    "isEmergencyStopped": lambda of: bool(of.safety_status_bits >> 7 & 1),
    "isProtectiveStopped": lambda of: bool(of.safety_status_bits >> 2 & 1),
}
"""Getters whose values the client computes."""
SEVERAL = {
    "getDigitalInState": range(18),
    "getDigitalOutState": range(18),
    "getOutputIntRegister": range(12, 20),
    "getOutputDoubleRegister": range(12, 20),
}
"""Getters with a number as argument, and the numbers."""


def bits(value):
    """Return numbers as bytes, so that equal means equal to the last bit."""
    if isinstance(value, list):
        return [bits(number) for number in value]
    return struct.pack(">d", value) if isinstance(value, float) else value


def read(robot, getters, tick):
    """Return the value of each getter at a tick, after waiting for its sample."""
    eventually(lambda: robot.getTimestamp() == BOOTED + tick * TICK)
    return {
        name: [getattr(robot, name)(number) for number in SEVERAL[name]]
        if name in SEVERAL
        else getattr(robot, name)()
        for name in getters
    }


def variable(getter, snapshot):
    """Return RTDE's name of a getter's value: target_TCP_pose for getTargetTCPPose."""
    if getter == "getRobotStatus":
        return "robot_status_bits"
    names = {*OF_STATE, *dir(snapshot)}
    (name,) = (name for name in names if f"get{name.replace('_', '')}".lower() == getter.lower())
    return name


def assert_told(found, snapshot):
    for getter, value in found.items():
        if getter in MADE_BY_THE_CLIENT:
            assert value == MADE_BY_THE_CLIENT[getter](snapshot), getter
        else:
            name = variable(getter, snapshot)
            told = getattr(snapshot.state if name in OF_STATE else snapshot, name)
            assert bits(value) == bits(told), getter


def test_each_getter_returns_the_value_of_the_robot_to_the_last_bit(tmp_path):
    of_the_client = dir(rtde_receive.RTDEReceiveInterface)
    getters = [name for name in of_the_client if name.startswith(("get", "is")) and name != "isConnected"]
    assert len(getters) > 45
    instruments, found = Instruments(load("ur5e")), []
    with lockstep(11, tmp_path / "run.mcap") as (served, host), Wire(served.endpoint) as wire:
        wire.listen("state", "io")
        token = wire.command("take_control", client="wire")["token"]
        told = 0

        def step(ticks):
            """Advance time; return the last tick and the instruments' values at it."""
            nonlocal told
            last = wire.step(token, ticks)["tick"]
            ios = sorted(wire.received["io"], key=lambda io: io["tick"])
            for state in wire.received["state"][told:]:
                io = next((io for io in reversed(ios) if io["tick"] <= state["tick"]), ios[0])
                snapshot = instruments.snapshot(msgspec.convert(state, State), msgspec.convert(io, Io))
            told = len(wire.received["state"])
            return last, snapshot

        step(1)
        with Client("rtde_receive", "RTDEReceiveInterface", host, "500.0") as robot:
            wire.command("move_j", token=token, q=NEAR)
            for ticks in (100, 50, 350):
                last, snapshot = step(ticks)
                found.append(read(robot, getters, last))
                assert_told(found[-1], snapshot)
                wire.command("set_io", token=token, digital_output_mask=0x2A55A, digital_outputs=0x2A55A)
                wire.command("set_tcp", token=token, offset=[0.01, -0.02, 0.15, 0.1, 0.2, -0.3])
                numbers = {"output_int": [*range(-4, 4)], "output_double": [math.pi**k for k in range(8)]}
                for bank, values in numbers.items():
                    wire.command("set_registers", token=token, bank=bank, first=12, values=values)
                inputs = {"digital_input_mask": 0x15A5A, "digital_inputs": 0x15A5A}
                analog = {"standard_analog_input": [2.5, 0.0125], "analog_input_types": 1}
                wire.command("simulation.set_inputs", token=token, **inputs, **analog)
                wire.command("set_speed", token=token, fraction=0.7)
            assert robot.isConnected()
        assert served.end() == 0
    for name in (
        "getActualQ", "getTargetMoment", "getActualTCPForce", "getJointTemperatures", "getRuntimeState",
        "getOutputIntRegister", "getDigitalOutState", "getDigitalInState", "getSpeedScalingCombined",
    ):  # fmt: skip
        assert found[0][name] != found[-1][name]


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    """A robot whose time passes as fast as it computes: the session that holds its clock, and its address."""
    path = tmp_path_factory.mktemp("alone") / "run.mcap"
    with lockstep(12, path) as (served, host), Wire(served.endpoint) as wire:
        clock = wire.take("clock", "stepper")
        wire.step(clock, 1)
        _steps = [wire.begin("simulation.step", token=clock, ticks=100_000) for _ in range(50)]
        yield wire, host
        assert served.end() == 0


def test_outputs_registers_and_slider_are_set(alone):
    wire, host = alone
    wire.listen("io")
    with (
        Client("rtde_io", "RTDEIOInterface", host) as setter,
        Client("rtde_receive", "RTDEReceiveInterface", host) as seen,
    ):
        for kind, first, count in (("Standard", 0, 8), ("Configurable", 8, 8), ("Tool", 16, 2)):
            switch = getattr(setter, f"set{kind}DigitalOut")
            for number in range(count):
                assert switch(number, True)
                eventually(lambda bit=first + number: seen.getDigitalOutState(bit))
            assert switch(0, False)
            eventually(lambda bit=first: not seen.getDigitalOutState(bit))
        assert setter.setSpeedSlider(0.5)
        assert setter.setAnalogOutputVoltage(0, 0.4)
        eventually(lambda: seen.getStandardAnalogOutput0() == 4.0)
        assert setter.setAnalogOutputCurrent(1, 0.25)
        eventually(lambda: seen.getStandardAnalogOutput1() == 0.008)
        for number in range(18, 23):
            assert setter.setInputIntRegister(number, -number)
            assert setter.setInputDoubleRegister(number, number / 7)
        io = wire.wait("io", lambda io: io["input_double_register"][22] == 22 / 7)
        assert io["input_int_register"][18:23] == [-18, -19, -20, -21, -22]
        assert io["input_double_register"][18:23] == [number / 7 for number in range(18, 23)]
        assert io["actual_digital_output_bits"] == 0x2FEFE
        assert io["standard_analog_output"] == [4.0, 0.008]
        assert io["target_speed_fraction"] == 0.5
        second = Client("rtde_io", "RTDEIOInterface", host)
        with pytest.raises(AssertionError, match="already in use"), second:
            pass
        assert setter.setSpeedSlider(1.0)
        eventually(lambda: seen.getTargetSpeedFraction() == 1.0)


def test_dashboard_describes_switches_and_runs_the_robot(alone):
    with Client("dashboard_client", "DashboardClient", alone[1]) as dashboard:
        dashboard.connect()
        assert dashboard.polyscopeVersion().startswith("5.22.")
        assert dashboard.getRobotModel() == "UR5"
        assert dashboard.getSerialNumber().isdecimal()
        assert (dashboard.safetymode(), dashboard.isInRemoteControl()) == ("Safetymode: NORMAL", True)
        for call in (dashboard.popup, dashboard.addToLog):
            call("words")
        dashboard.closePopup()
        dashboard.powerOff()
        eventually(lambda: dashboard.robotmode() == "Robotmode: POWER_OFF")
        with pytest.raises(AssertionError, match="Failed to execute: play"):
            dashboard.play()
        dashboard.powerOn()
        eventually(lambda: dashboard.robotmode() == "Robotmode: IDLE")
        dashboard.brakeRelease()
        eventually(lambda: dashboard.robotmode() == "Robotmode: RUNNING")
        with pytest.raises(AssertionError, match=r"File not found: missing\.urp"):
            dashboard.loadURP("missing.urp")
        dashboard.loadURP("paper.urp")
        assert dashboard.getLoadedProgram() == "Loaded program: /programs/paper.urp"
        dashboard.play()
        eventually(dashboard.running)
        dashboard.stop()
        eventually(lambda: dashboard.programState() == "STOPPED paper.urp")


@pytest.fixture(scope="module")
def live():
    """Address of a robot in real time."""
    with Served("--ur", "--ur-address", own_address(13)):
        yield own_address(13)


@pytest.fixture
def seen(live):
    with Client("rtde_receive", "RTDEReceiveInterface", live) as seen:
        yield seen


@pytest.fixture
def arm(live):
    """A client that moves the robot by its own program; it waits by the wall clock."""
    with Client("rtde_control", "RTDEControlInterface", live) as arm:
        yield arm
        arm.stopScript()


def beside(*changes):
    """Return HOME with changed joints, given as pairs of a joint and its change."""
    q = list(HOME)
    for joint, change in changes:
        q[joint] += change
    return q


@pytest.mark.realtime
def test_kinematics_payload_and_tool_equal_those_of_the_robot(arm, seen):
    assert arm.moveJ(HOME, 1.0, 1.5)
    pose = seen.getTargetTCPPose()
    q = arm.getInverseKinematics(pose)
    assert q == pytest.approx(HOME, abs=1e-3)
    tool = [0.0, 0.0, 0.1, 0.0, 0.0, 0.0]
    assert math.dist(arm.getForwardKinematics(q, tool)[:3], pose[:3]) == pytest.approx(0.1, abs=1e-6)
    assert not arm.getInverseKinematicsHasSolution([9.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert arm.setTcp(tool)
    assert arm.getTCPOffset() == tool
    assert arm.setTcp([0.0] * 6)
    assert arm.setPayload(1.0, [0.0, 0.0, 0.05])
    eventually(lambda: seen.getPayload() == 1.0)
    assert arm.setPayload(0.0, [0.0, 0.0, 0.0])


@pytest.mark.realtime
def test_moves_servoing_and_speeds_end_at_their_targets(arm, seen):
    near = beside((0, 0.05), (2, 0.03))
    assert arm.moveJ(near, 1.0, 1.5)
    eventually(lambda: seen.getActualQ() == pytest.approx(near, abs=1e-3))
    pose = seen.getActualTCPPose()
    corner = [pose[0], pose[1], pose[2] + 0.03, *pose[3:]]
    end = [pose[0], pose[1] - 0.03, pose[2] + 0.03, *pose[3:]]
    assert arm.moveL([[*corner, 0.2, 0.8, 0.01], [*end, 0.2, 0.8, 0.0]], True)
    eventually(lambda: arm.getAsyncOperationProgress() < 0)
    eventually(lambda: seen.getActualTCPPose()[:3] == pytest.approx(end[:3], abs=1e-3))
    assert arm.moveJ_IK(pose, 1.0, 1.5)
    eventually(lambda: seen.getActualTCPPose()[:3] == pytest.approx(pose[:3], abs=1e-3))
    for _ in range(60):
        assert arm.servoJ(beside((0, 0.02)), 0.0, 0.0, 0.002, 0.03, 1000.0)
    eventually(lambda: abs(seen.getActualQ()[0] - HOME[0] - 0.02) < 1e-3)
    assert arm.servoStop(2.0)
    assert arm.speedJ([0.0, 0.0, 0.0, 0.0, 0.0, 0.1], 1.0, 0.2)
    eventually(lambda: seen.getTargetQ()[5] > HOME[5] + 0.005)
    assert arm.speedStop(2.0)
    eventually(lambda: max(map(abs, seen.getTargetQd())) < 1e-6)


@pytest.mark.realtime
def test_force_mode_freedrive_contacts_and_custom_script(arm, seen):
    before = seen.getActualTCPPose()
    arm.forceMode([0.0] * 6, [0, 0, 1, 0, 0, 0], [0, 0, -10.0, 0, 0, 0], 2, [2, 2, 1.5, 1, 1, 1])
    eventually(lambda: seen.getActualTCPPose()[2] < before[2] - 0.001)
    assert arm.forceModeStop() is True
    assert arm.freedriveMode([1, 1, 1, 0, 0, 0], [0.0] * 6) is True
    assert arm.getFreedriveStatus() == 0
    assert arm.endFreedriveMode() is True
    assert arm.teachMode() is True
    assert arm.endTeachMode() is True
    assert arm.startContactDetection([0, 0, -1, 0, 0, 0]) is True
    assert arm.stopContactDetection() is False  # nothing was touched
    assert arm.sendCustomScriptFunction("mine", "write_output_integer_register(12, 4711)\n")
    eventually(lambda: seen.getOutputIntRegister(12) == 4711)
    eventually(arm.isProgramRunning)  # the client has sent its own program again


@pytest.mark.realtime
def test_arm_moves_again_after_a_protective_stop(live, arm, seen):
    arm.triggerProtectiveStop()  # False: the program is suspended before it can report that it is done
    eventually(seen.isProtectiveStopped)
    with Client("dashboard_client", "DashboardClient", live) as dashboard:
        dashboard.connect()
        assert dashboard.safetymode() == "Safetymode: PROTECTIVE_STOP"
        dashboard.unlockProtectiveStop()
    eventually(lambda: not seen.isProtectiveStopped())
    assert arm.reuploadScript()
    eventually(arm.isProgramRunning)
    assert arm.moveJ(HOME, 1.0, 1.5)
