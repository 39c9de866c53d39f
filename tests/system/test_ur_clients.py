"""Clients of UR robots, unmodified, beside a client on Zenoh: what they read is what the robot tells."""

import json
import math
import struct
import time
from types import SimpleNamespace

import msgspec
import pytest
from tests.conformance.served import PATIENCE, Served
from tests.conformance.wire import Q1, Wire
from tests.places import own_address
from tests.system.ur_object import Client, started

from tvist_controller.instruments.snapshot import Instruments
from tvist_lab.recordings.mcap_file import read
from tvist_plant.description import load
from tvist_protocol.io import Io

pytestmark = pytest.mark.realtime

pytest.importorskip("rtde_receive")

FAR = [0.6, -2.9, 0.3, -1.4, 0.2, 0.4]
TICK, BOOTED = 0.002, 40.0
OF_STATE = {
    "getActualQ": "actual_q",
    "getActualQd": "actual_qd",
    "getActualTCPPose": "actual_TCP_pose",
    "getActualTCPSpeed": "actual_TCP_speed",
    "getActualToolAccelerometer": "actual_tool_accelerometer",
    "getRobotMode": "robot_mode",
    "getSafetyMode": "safety_mode",
    "getRuntimeState": "runtime_state",
}
"""Getters whose values `state` carries."""
OF_INSTRUMENTS = {
    "getSpeedScaling": "speed_scaling",
    "getTargetQ": "target_q",
    "getTargetQd": "target_qd",
    "getTargetQdd": "target_qdd",
    "getTargetMoment": "target_moment",
    "getActualCurrent": "actual_current",
    "getActualDigitalInputBits": "actual_digital_input_bits",
    "getActualDigitalOutputBits": "actual_digital_output_bits",
    "getActualExecutionTime": "actual_execution_time",
    "getActualJointVoltage": "actual_joint_voltage",
    "getActualMainVoltage": "actual_main_voltage",
    "getActualMomentum": "actual_momentum",
    "getActualRobotCurrent": "actual_robot_current",
    "getActualRobotVoltage": "actual_robot_voltage",
    "getActualTCPForce": "actual_TCP_force",
    "getFtRawWrench": "ft_raw_wrench",
    "getJointControlOutput": "joint_control_output",
    "getJointMode": "joint_mode",
    "getJointTemperatures": "joint_temperatures",
    "getPayload": "payload",
    "getPayloadCog": "payload_cog",
    "getPayloadInertia": "payload_inertia",
    "getRobotStatus": "robot_status_bits",
    "getSafetyStatusBits": "safety_status_bits",
    "getStandardAnalogInput0": "standard_analog_input0",
    "getStandardAnalogInput1": "standard_analog_input1",
    "getStandardAnalogOutput0": "standard_analog_output0",
    "getStandardAnalogOutput1": "standard_analog_output1",
    "getTargetCurrent": "target_current",
    "getTargetSpeedFraction": "target_speed_fraction",
    "getTargetTCPPose": "target_TCP_pose",
    "getTargetTCPSpeed": "target_TCP_speed",
}
"""Getters whose values are computed, and RTDE's names of them."""
MADE_BY_THE_CLIENT = {
    "getDigitalInState": lambda of: [bool(of.actual_digital_input_bits >> bit & 1) for bit in range(18)],
    "getDigitalOutState": lambda of: [bool(of.actual_digital_output_bits >> bit & 1) for bit in range(18)],
    "getOutputDoubleRegister": lambda of: [getattr(of, f"output_double_register_{k}") for k in range(12, 20)],
    "getOutputIntRegister": lambda of: [getattr(of, f"output_int_register_{k}") for k in range(12, 20)],
    "getSpeedScalingCombined": lambda of: of.speed_scaling * of.target_speed_fraction,
    "isEmergencyStopped": lambda of: bool(of.safety_status_bits >> 7 & 1),
    "isProtectiveStopped": lambda of: bool(of.safety_status_bits >> 2 & 1),
}
"""Getters whose values the client makes of several."""


def until(call, wanted):
    """Ask until the answer is the wanted one."""
    deadline = time.monotonic() + PATIENCE
    while (found := call()) != wanted:
        assert time.monotonic() < deadline, f"{found}, not {wanted}"


def bits(value):
    """Every number as its bytes, so that equal means equal to the last bit."""
    if isinstance(value, list):
        return [bits(number) for number in value]
    return struct.pack(">d", value) if isinstance(value, float) else value


def live(wire, token):
    """Move, switch, write: so that hardly any value stays what it was."""
    wire.listen("event")
    motion = wire.command("move_j", token=token, q=FAR)["id"]
    wire.command("set_io", token=token, digital_output_mask=0x2A55A, digital_outputs=0x2A55A)
    wire.command("set_tcp", token=token, offset=[0.01, -0.02, 0.15, 0.1, 0.2, -0.3])
    wire.command("set_registers", token=token, bank="output_int", first=12, values=[*range(-4, 4)])
    wire.command(
        "set_registers", token=token, bank="output_double", first=12, values=[math.pi**k for k in range(8)]
    )
    wire.command("simulation.set_inputs", token=token, digital_input_mask=0x15A5A, digital_inputs=0x15A5A,
                 standard_analog_input=[2.5, 0.0125], analog_input_types=1)  # fmt: skip
    wire.wait("event", lambda event: event["kind"] == "motion_done" and event["id"] == motion)
    wire.command("set_speed", token=token, fraction=0.7)
    motion = wire.command("move_j", token=token, q=Q1)["id"]
    wire.wait("event", lambda event: event["kind"] == "motion_done" and event["id"] == motion)


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    """What a client read while another one moved the robot; and the states, and inputs and outputs, of that time.

    At half the speed: the client has to read all of a tick before the next one comes.
    """
    path = tmp_path_factory.mktemp("recorded") / "all.mcap"
    options = (
        "--profile",
        "real",
        "--start",
        "Q1",
        "--ur-address",
        own_address(1),
        "--record",
        str(path),
        "--speed",
        "0.5",
    )
    with Served(*options) as served:
        with Wire(served.endpoint) as wire, wire.control() as token:
            wire.listen("io")
            wire.wait("io")
            with started("ur_reader.py", own_address(1)) as reader:
                assert reader.stdout.readline() == "reading\n"
                live(wire, token)
                out, _ = reader.communicate(timeout=PATIENCE)
            assert reader.returncode == 0
            wire.until(wire.state()["tick"])
            ios = [msgspec.convert(io, Io) for io in wire.received["io"]]
        assert served.end() == 0
    recorded = read(path)
    assert recorded.complete
    assert not any(recorded.dropped.values())
    instruments, snapshots, pending = Instruments(load("ur5e")), {}, sorted(ios, key=lambda io: io.tick)
    now = pending[0]
    for state in recorded.states:
        while pending and pending[0].tick <= state.tick:
            now = pending.pop(0)
        snapshots[state.tick] = instruments.snapshot(state, now)
    return SimpleNamespace(
        **json.loads(out),
        at={snapshot.timestamp: snapshot for snapshot in snapshots.values()},
        first=ios[0].tick,
    )


@pytest.fixture(scope="module")
def pairs(session):
    """What was read at a tick, and the tick itself."""
    return [(read, session.at[read["getTimestamp"]]) for read in session.read]


def test_the_client_stays_and_reads_one_tick_after_another(session, pairs, measured):
    assert session.connected
    measured("ticks read with every getter", len(pairs))
    stamps = [found["getTimestamp"] for found, _ in pairs]
    assert stamps == sorted(set(stamps))
    assert len(stamps) > 1
    assert all(snapshot.state.tick >= session.first for _, snapshot in pairs)


def test_every_getter_is_looked_at(pairs):
    assert set(pairs[0][0]) == {"getTimestamp", *OF_STATE, *OF_INSTRUMENTS, *MADE_BY_THE_CLIENT}


@pytest.mark.parametrize(
    "getter",
    ["getActualQ", "getTargetMoment", "getActualTCPForce", "getJointTemperatures", "getRuntimeState",
     "getOutputIntRegister", "getDigitalOutState", "getDigitalInState"],
)  # fmt: skip
def test_something_was_going_on(pairs, getter):
    assert len({json.dumps(found[getter]) for found, _ in pairs}) > 1


def test_time_is_the_ticks_forty_seconds_on(pairs):
    for found, snapshot in pairs:
        assert found["getTimestamp"] == BOOTED + snapshot.state.timestamp
        assert snapshot.state.timestamp == snapshot.state.tick * TICK


@pytest.mark.parametrize("getter", OF_STATE)
def test_a_getter_tells_what_state_does_to_the_last_bit(pairs, getter):
    for found, snapshot in pairs:
        assert bits(found[getter]) == bits(getattr(snapshot.state, OF_STATE[getter])), snapshot.state.tick


@pytest.mark.parametrize("getter", OF_INSTRUMENTS)
def test_a_getter_tells_what_the_instruments_compute_from_state_and_io(pairs, getter):
    for found, snapshot in pairs:
        assert bits(found[getter]) == bits(getattr(snapshot, OF_INSTRUMENTS[getter])), snapshot.state.tick


@pytest.mark.parametrize("getter", MADE_BY_THE_CLIENT)
def test_a_getter_tells_what_its_variables_say(pairs, getter):
    for found, snapshot in pairs:
        assert found[getter] == MADE_BY_THE_CLIENT[getter](snapshot), snapshot.state.tick


@pytest.fixture(scope="module")
def quiet():
    """A robot for clients that set."""
    with Served("--ur", "--ur-address", own_address(2)) as served:
        yield served


def test_everything_that_can_be_set_is_and_zenoh_shows_it(quiet):
    with (
        Wire(quiet.endpoint) as wire,
        Client("rtde_io", "RTDEIOInterface", own_address(2)) as setter,
        Client("rtde_receive", "RTDEReceiveInterface", own_address(2)) as robot,
    ):
        wire.listen("io")
        for call, first, count in (
            ("setStandardDigitalOut", 0, 8),
            ("setConfigurableDigitalOut", 8, 8),
            ("setToolDigitalOut", 16, 2),
        ):
            for number in range(count):
                assert getattr(setter, call)(number, True)
                until(lambda bit=first + number: robot.getDigitalOutState(bit), True)
            assert getattr(setter, call)(0, False)
            until(lambda bit=first: robot.getDigitalOutState(bit), False)
        assert wire.info()["control"] == "ur-127.0.0.1"
        assert setter.setSpeedSlider(0.5)
        until(robot.getTargetSpeedFraction, 0.5)
        assert setter.setAnalogOutputVoltage(0, 0.4)
        until(robot.getStandardAnalogOutput0, 4.0)
        assert setter.setAnalogOutputCurrent(1, 0.25)
        until(robot.getStandardAnalogOutput1, 0.008)
        for number in range(18, 23):
            assert setter.setInputIntRegister(number, -number)
            assert setter.setInputDoubleRegister(number, number / 7)
        io = wire.wait("io", lambda io: io["input_double_register"][22] == 22 / 7)
        assert io["input_int_register"][18:23] == [-18, -19, -20, -21, -22]
        assert io["input_double_register"][18:23] == [number / 7 for number in range(18, 23)]
        assert io["actual_digital_output_bits"] == 0x2FEFE
        assert io["standard_analog_output"] == [4.0, 0.008]
        assert io["target_speed_fraction"] == 0.5
        assert setter.isConnected()
        assert setter.setSpeedSlider(1.0)
        until(robot.getTargetSpeedFraction, 1.0)


def test_of_two_clients_the_second_is_told_that_its_variables_are_in_use(quiet):
    with Client("rtde_io", "RTDEIOInterface", own_address(2)) as first:
        assert first.setInputIntRegister(18, 1)
        with (
            pytest.raises(AssertionError, match="already in use"),
            Client("rtde_io", "RTDEIOInterface", own_address(2)),
        ):
            pass
        assert first.setInputIntRegister(18, 2)
    with Client("rtde_io", "RTDEIOInterface", own_address(2)) as second:
        assert second.setInputIntRegister(18, 3)


@pytest.fixture
def dashboard(quiet):
    with Client("dashboard_client", "DashboardClient", own_address(2)) as dashboard:
        dashboard.connect()
        dashboard.brakeRelease()
        until(dashboard.robotmode, "Robotmode: RUNNING")
        yield dashboard


def test_the_dashboard_says_what_the_robot_is(dashboard):
    assert dashboard.isConnected()
    assert dashboard.polyscopeVersion().startswith("5.22.")
    assert dashboard.getRobotModel() == "UR5"
    assert dashboard.getSerialNumber().isdecimal()
    assert dashboard.isInRemoteControl()
    assert (dashboard.safetymode(), dashboard.safetystatus()) == (
        "Safetymode: NORMAL",
        "Safetystatus: NORMAL",
    )
    for call in (dashboard.popup, dashboard.addToLog):
        call("words")
    for call in (dashboard.closePopup, dashboard.closeSafetyPopup):
        call()
    dashboard.send("robotmode\n")
    assert dashboard.receive() == "Robotmode: RUNNING"
    dashboard.quit()
    dashboard.disconnect()
    assert not dashboard.isConnected()


def test_the_dashboard_switches_the_power(dashboard):
    dashboard.powerOff()
    until(dashboard.robotmode, "Robotmode: POWER_OFF")
    with pytest.raises(AssertionError, match="Failed to execute: play"):
        dashboard.play()
    dashboard.powerOn()
    until(dashboard.robotmode, "Robotmode: IDLE")
    dashboard.brakeRelease()
    until(dashboard.robotmode, "Robotmode: RUNNING")
    dashboard.restartSafety()
    until(dashboard.robotmode, "Robotmode: POWER_OFF")


def test_the_dashboard_plays_pauses_and_stops_a_program(dashboard):
    with pytest.raises(AssertionError, match=r"File not found: missing\.urp"):
        dashboard.loadURP("missing.urp")
    dashboard.loadURP("paper.urp")
    assert dashboard.getLoadedProgram() == "Loaded program: /programs/paper.urp"
    assert dashboard.programState() == "STOPPED paper.urp"
    assert not dashboard.running()
    dashboard.play()
    until(dashboard.running, wanted=True)
    dashboard.pause()
    until(dashboard.programState, "PAUSED paper.urp")
    dashboard.play()
    until(dashboard.programState, "PLAYING paper.urp")
    dashboard.stop()
    until(dashboard.programState, "STOPPED paper.urp")


def test_a_protective_stop_is_seen_and_unlocked(quiet, dashboard):
    with (
        Wire(quiet.endpoint) as wire,
        Client("rtde_receive", "RTDEReceiveInterface", own_address(2)) as robot,
    ):
        dashboard.disconnect()  # and with it goes its control
        until(lambda: wire.info()["control"], None)
        dashboard.connect()
        token = wire.command("take_control", client="wire")["token"]
        assert not dashboard.isInRemoteControl()
        wire.command("simulation.inject", token=token, fault="protective_stop")
        until(robot.isProtectiveStopped, wanted=True)
        assert dashboard.safetymode() == "Safetymode: PROTECTIVE_STOP"
        with pytest.raises(AssertionError):  # somebody else has control
            dashboard.unlockProtectiveStop()
        wire.command("release_control", token=token)
        dashboard.unlockProtectiveStop()
        until(robot.isProtectiveStopped, wanted=False)
        assert dashboard.safetymode() == "Safetymode: NORMAL"
