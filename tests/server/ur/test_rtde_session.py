"""RTDE connections: set-up, samples, inputs and their owners."""

import struct
from collections import defaultdict
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tvist_protocol.commands import SetSpeed
from tvist_protocol.io import Registers, SetIo, SetRegisters
from tvist_server.gateways.ur.robot import InputOwners
from tvist_server.gateways.ur.rtde.package_encoder import PackageEncoder
from tvist_server.gateways.ur.rtde.session import RtdeSession, ticks_between
from tvist_server.gateways.ur.rtde.variables import matching
from tvist_server.gateways.ur.version import VERSION

from . import rtde_client as client
from .conftest import io

YES, NO = b"\x01", b"\x00"
ints = [f"input_int_register_{k}" for k in range(48)]
doubles = [f"input_double_register_{k}" for k in range(48)]


class Client:
    def __init__(self, robot, control):
        self.control = control
        self.stream = bytearray()
        self.session = RtdeSession(robot, control, self.stream.extend, robot.encoders)
        self.session.opened()

    def say(self, *packages):
        self.session.receive(b"".join(packages))
        return self.heard()

    def heard(self):
        heard = client.packages(bytes(self.stream))
        self.stream.clear()
        return heard

    def texts(self):
        return [payload for letter, payload in self.heard() if letter == "M"]

    def started(self, names=("timestamp",), frequency=500.0):
        answers = self.say(client.version(), client.outputs(names, frequency), client.package("S"))
        assert answers[0] == ("V", YES)
        assert answers[2] == ("S", YES)
        return self

    def with_inputs(self, *recipes):
        self.say(client.version())
        for number, names in enumerate(recipes, 1):
            types = ",".join(client.INPUT_TYPES[name] for name in names).encode()
            assert self.say(client.inputs(names)) == [("I", bytes([number]) + types)]
        return self

    def put(self, number, names, *values):
        before = len(self.control.commands)
        self.session.receive(client.data(number, names, values))
        return self.control.commands[before:]


@pytest.fixture
def robot(robot):
    robot.inputs, robot.encoders = InputOwners(), defaultdict(PackageEncoder)
    return robot


@pytest.fixture
def one(robot, control):
    return Client(robot, control)


def test_only_protocol_versions_1_and_2_are_accepted(one):
    for payload in (*(struct.pack(">H", number) for number in range(5)), b"", b"\x00"):
        spoken = payload in {b"\x00\x01", b"\x00\x02"}
        assert one.say(client.package("V", payload)) == [("V", YES if spoken else NO)]
    assert one.say(client.package("v")) == [("v", struct.pack(">4I", *VERSION))]
    assert VERSION[:2] == (5, 22)


def test_outputs_start_only_with_a_valid_recipe(one):
    one.say(client.version(), client.inputs(ints[:1]))
    assert one.say(client.package("S")) == [("S", NO)]
    assert one.say(client.outputs(["timestamp", "nonsense"])) == [("O", b"\x00DOUBLE,NOT_FOUND")]
    assert one.say(client.package("S")) == [("S", NO)]
    names = ["timestamp", "actual_q", "joint_mode", "runtime_state", "output_bit_register_64"]
    expected = b"\x01DOUBLE,VECTOR6D,VECTOR6INT32,UINT32,BOOL"
    assert one.say(client.outputs(names), client.package("S")) == [("O", expected), ("S", YES)]


def test_input_recipes_are_numbered_and_invalid_ones_are_not(one):
    one.say(client.version())
    assert one.say(client.inputs(ints[:1])) == [("I", b"\x01INT32")]
    assert one.say(client.inputs([ints[1], "nonsense"])) == [("I", b"\x00INT32,NOT_FOUND")]
    assert one.say(client.inputs([])) == [("I", b"\x00")]
    numbers = [one.say(client.inputs(ints[:1]))[0][1][0] for _ in range(256)]
    assert numbers == [*range(2, 256), 0, 0]  # a byte numbers no more


def test_nothing_is_sent_before_the_start(one, snapshot):
    one.say(client.version())
    wrong = [client.package("U", b"\x09abc"), *map(client.package, "U?M")]
    assert one.say(*wrong) == []
    assert one.session.sample(snapshot) == b""


def test_an_overlong_recipe_is_answered_in_one_package(one):
    one.say(client.version())
    ((letter, payload),) = one.say(client.package("I", b"a," * 10_000))
    assert (letter, payload[0]) == ("I", 0)
    assert payload[1:].decode().split(",") == ["NOT_FOUND"] * ((0xFFFF - 4 + 1) // 10)


def test_version_1_has_no_recipe_ids_and_text_sources(one, snapshot):
    assert one.say(client.package("O", b"timestamp,nonsense")) == [("O", b"DOUBLE,NOT_FOUND")]
    assert one.say(client.package("O", b"timestamp,actual_q")) == [("O", b"DOUBLE,VECTOR6D")]
    assert one.say(client.package("S")) == [("S", YES)]
    found = client.decoded(one.session.sample(snapshot), ["timestamp", "actual_q"], version=1)
    assert found == {"timestamp": snapshot.timestamp, "actual_q": snapshot.actual_q}
    assert one.say(client.package("U", b"\x05")) == [("M", b"\x02there is no input recipe 5")]


@pytest.mark.parametrize("frequency", [500, 125, 5])
def test_samples_are_one_period_apart(one, snapshots, frequency):
    one.started(frequency=frequency)
    samples = [sample for sample in map(one.session.sample, snapshots) if sample]
    times = [client.decoded(sample, ["timestamp"])["timestamp"] for sample in samples]
    assert times[0] == snapshots[0].timestamp
    assert len(times) == -(-100 * frequency // 500)
    assert np.diff(times) == pytest.approx(1.0 / frequency, abs=1e-9)


@given(st.floats() | st.integers(1, 500))
def test_a_frequency_is_rounded_up_to_a_divisor(frequency):
    ticks = ticks_between(frequency)
    assert 1 <= ticks <= 500
    if 1 <= frequency <= 500:
        assert 500 / (ticks + 1) < frequency <= 500 / ticks + 1e-9


def test_missed_ticks_do_not_shift_later_samples(one, snapshots):
    one.started(["control_step"], frequency=50)
    shown = [s for k, s in enumerate(snapshots) if k not in {10, 11, 12, 30}]
    samples = [sample for sample in map(one.session.sample, shown) if sample]
    ticks = [client.decoded(sample, ["control_step"])["control_step"] for sample in samples]
    steps = [tick - snapshots[0].state.tick for tick in ticks]
    assert steps == [0, 13, 20, 31, 40, 50, 60, 70, 80, 90]


def test_samples_pause_and_resume_with_the_newest_recipe(one, snapshots):
    one.started()
    assert one.session.sample(snapshots[0])
    assert one.say(client.package("P")) == [("P", YES)]
    assert not any(map(one.session.sample, snapshots[1:20]))
    assert one.say(client.package("S")) == [("S", YES)]
    assert client.decoded(one.session.sample(snapshots[20]), ["timestamp"])
    one.say(client.outputs(["robot_mode"]))
    assert client.decoded(one.session.sample(snapshots[25]), ["robot_mode"]) == {"robot_mode": 7}


def test_an_input_belongs_to_one_connection_until_it_closes(one, robot, control):
    other, third = Client(robot, control), Client(robot, control)
    one.with_inputs(ints[:3], ints[:3])  # as many recipes of its own as it likes
    one.say(client.inputs([ints[4], "nonsense"]))  # a wrong recipe owns nothing
    other.say(client.version())
    assert other.say(client.inputs([ints[4], ints[1]])) == [("I", b"\x00INT32,IN_USE")]
    assert other.say(client.inputs(ints[3:5])) == [("I", b"\x01INT32,INT32")]
    one.session.closed()
    third.say(client.version())
    assert third.say(client.inputs(ints[2:4])) == [("I", b"\x00INT32,IN_USE")]
    assert third.say(client.inputs(ints[:3])) == [("I", b"\x01INT32,INT32,INT32")]


def test_speed_and_outputs_are_in_use_while_another_client_has_control(one, control):
    one.say(client.version())
    control.held_by_other = True
    names = ["speed_slider_mask", "tool_digital_output", "standard_analog_output_0", ints[0]]
    assert one.say(client.inputs(names)) == [("I", b"\x00IN_USE,IN_USE,IN_USE,INT32")]
    assert one.say(client.inputs([ints[0], "external_force_torque"])) == [("I", b"\x01INT32,VECTOR6D")]
    control.held_by_other = False
    assert one.say(client.inputs(names))[0][1][0] == 2


def test_reserved_inputs_are_in_use_for_every_client(one, robot, control):
    reserved = matching(("speed_slider_*", "input_int_register_[0-9]"))
    assert set(reserved) == {*SPEED, *ints[:10]}
    assert matching(("speed_slider_*", "input_int_register_[0-9]")) is reserved
    robot.inputs.take(reserved, "a fieldbus")
    for client_ in (one, Client(robot, control)):
        client_.say(client.version())
        wanted = ["speed_slider_mask", "standard_digital_output", ints[9], ints[10]]
        assert client_.say(client.inputs(wanted)) == [("I", b"\x00IN_USE,UINT8,IN_USE,INT32")]
        client_.session.closed()


def shown(robot, **changes):
    """Let the robot show other terminals and registers."""
    robot.latest = SimpleNamespace(io=io(**changes))


SPEED = ("speed_slider_mask", "speed_slider_fraction")
DIGITAL = tuple(client.BYTES)
ANALOG = tuple(f"standard_analog_output_{part}" for part in ("mask", "type", "0", "1"))
MASKS = [name for name in (*DIGITAL, *ANALOG) if name.endswith("_mask")]
SIX = {"input_double_register": [1.0, 2.0, 3.0, 4.0, 5.0, 6.0] + [0.0] * 42}
HALF = {"standard_analog_output": [0.004 + 0.016 * 0.3, 3.0], "analog_io_types": 0b1000}
NAN = float("nan")


def bank(name, first, *values):
    return SetRegisters(bank=f"input_{name}", first=first, values=values)


def outputs(**fields):
    return SetIo(token="the-token", **fields)


WRITTEN = {
    "registers in a row": (ints[4:9], {}, (1, 2, 3, 4, 5), bank("int", 4, 1, 2, 3, 4, 5)),
    "what the robot shows already": (doubles[:6], SIX, (1, 2, 3, 4, 5, 6), None),
    "what differs, from first to last": (doubles[:6], SIX, (1, 2.5, 3, 4.5, 5, 6), bank("double", 1, 2.5, 3.0, 4.5)),
    "a word of bits": (["input_bit_registers32_to_63"], {}, (0x80000001,), bank("bit", 32, True, *[False] * 30, True)),
    "no number beside a number": (doubles[:2], {}, (NAN, 3.0), bank("double", 1, 3.0)),
    "a speed that is masked out": (SPEED, {}, (0, 0.5), None),
    "a speed": (SPEED, {}, (1, 0.5), SetSpeed(token="the-token", fraction=0.5)),
    "the speed that is shown": (SPEED, {"target_speed_fraction": 0.5}, (1, 0.5), None),
    "a mask without a speed": (SPEED[:1], {}, (1,), None),
    "masks without values": (MASKS, {}, [0xFF] * len(MASKS), None),
    "digital outputs": (
        DIGITAL, {}, (0x81, 0xFF, 0x01, 0x01, 0xFF, 0x02),
        outputs(digital_output_mask=0x20181, digital_outputs=0x20181)
    ),
    "digital outputs that differ": (
        DIGITAL, {"actual_digital_output_bits": 0b1100}, (0b1111, 0b0110, 0, 0, 0, 0),
        outputs(digital_output_mask=0b1010, digital_outputs=0b0010)
    ),
    "analog outputs as shares of their ranges": (
        ANALOG, {}, (0b11, 0b10, 0.25, 0.75),
        outputs(standard_analog_output_mask=0b11, standard_analog_output_type=0b10,
                standard_analog_output_0=0.25, standard_analog_output_1=0.75)
    ),
    "analog outputs that are shown": (ANALOG, HALF, (0b11, 0b10, 0.3, 0.3), None),
}  # fmt: skip
"""Names of a recipe, what the robot shows, the values that come, and the command that they make."""


@pytest.mark.parametrize("case", WRITTEN)
def test_a_package_becomes_one_command_with_the_changed_values(one, robot, case):
    names, changes, values, command = WRITTEN[case]
    shown(robot, **changes)
    one.with_inputs(names)
    assert one.put(1, names, *values) == ([] if command is None else [command])
    assert one.heard() == []  # no why comes without a start


@pytest.mark.parametrize(
    ("names", "values", "named", "commands"),
    [
        (doubles[:2], (NAN, 3.0), b"input_double_register_0", 1),
        *((SPEED, (1, fraction), b"speed_slider_fraction", 0) for fraction in (-0.1, 1.5, NAN, float("inf"))),
        (ANALOG, (0b11, 0, 1.5, 0.5), b"standard_analog_output_0", 1),
    ],
)
def test_an_invalid_value_is_left_out_and_reported(one, names, values, named, commands):
    one.started().with_inputs(names)
    assert len(one.put(1, names, *values)) == commands
    assert named in one.texts()[0]


def test_pending_writes_are_not_repeated(one, robot, control):
    one.with_inputs(ints[:1])
    control.wait()
    sent = [one.put(1, ints[:1], value) for value in (0, 5, 5, 0)]
    assert sent == [[], [bank("int", 0, 5)], [], [bank("int", 0, 0)]]
    control.answer()
    shown(robot, input_int_register=[9] + [0] * 47)
    assert one.put(1, ints[:1], 0) == [bank("int", 0, 0)]  # somebody else has written there


def test_watched_registers_are_sent_every_time(one, robot):
    names = [ints[0], doubles[3], "input_bit_registers0_to_31"]
    one.with_inputs(names)
    one.put(1, names, 5, 1.5, 1)
    seen = {"input_int_register": [5] + [0] * 47, "input_bit_register": [1, 0, 0, 0]}
    seen["input_double_register"] = [0.0, 0.0, 0.0, 1.5] + [0.0] * 44
    shown(robot, **seen)
    assert one.put(1, names, 5, 1.5, 1) == []
    shown(robot, watched=[ints[0]], **seen)
    assert one.put(1, names, 5, 1.5, 1) == [bank("int", 0, 5)]
    shown(robot, watched=["input_bit_registers0_to_31"], **seen)
    (command,) = one.put(1, names, 5, 1.5, 1)
    assert (command.bank, command.first, len(command.values)) == ("input_bit", 0, 32)


def test_registers_of_a_package_are_one_command(one):
    names = [ints[0], ints[1], ints[7], doubles[0], "input_bit_register_64"]
    one.with_inputs(names)
    places = (("input_int", 7, 1), ("input_double", 0, 1.0), ("input_bit", 64, True))
    also = tuple(Registers(bank=name, first=first, values=(value,)) for name, first, value in places)
    command = SetRegisters(bank="input_int", first=0, values=(1, 1), also=also)
    assert one.put(1, names, 1, 1, 1, 1.0, True) == [command]


def test_writing_without_control_is_reported_once(one, control):
    one.started().with_inputs(SPEED)
    control.held_by_other = True
    for _ in range(100):
        assert one.put(1, SPEED, 1, 0.5) == []
    assert len(one.texts()) == 1


def test_a_refusal_is_sent_with_its_source(one, control):
    one.started().with_inputs(SPEED)
    control.refuse(why="not now")
    one.put(1, SPEED, 1, 0.25)
    assert one.heard() == [("M", b"\x07not now\x04RTDE\x02")]


def test_external_forces_are_sent_even_if_they_repeat(one, robot, control):
    names = ("external_force_torque",)
    one.started().with_inputs(names)
    shown(robot, program_state="STOPPED")
    assert one.put(1, names, (1.0,) * 6) == []  # they take no control
    shown(robot, program="p", program_state="PLAYING")
    for force in (1.0, 2.0, 2.0):
        (command,) = one.put(1, names, (force,) * 6)
        assert (command.wrench, command.token) == ((force,) * 6, "the-token")
    assert one.texts() == []
    control.held_by_other = True
    assert one.put(1, names, (1.0,) * 6) == []
    (text,) = one.texts()
    assert b"another client has control" in text


TWO = ["input_int_register_0", "input_double_register_1"]
CONVERSATION = [
    client.version(), client.package("v"), client.outputs(["timestamp", "actual_q"], 250.0), client.inputs(TWO),
    client.inputs([*SPEED, "nonsense"]), client.package("S"), client.data(1, TWO, [7, 1.5]),
    client.package("U", b"\x09"), client.package("P"), client.package("M", b"\x03abc\x01x\x03"), client.package("S"),
]  # fmt: skip


def test_the_stream_may_be_split_at_any_byte(robot, control):
    whole, results = b"".join(CONVERSATION), []
    for size in (len(whole), 1, 2, 7, 64):
        robot.inputs = InputOwners()
        one = Client(robot, control)
        control.commands.clear()
        for at in range(0, len(whole), size):
            one.session.receive(whole[at : at + size])
        results.append((one.heard(), list(control.commands)))
    assert results == results[:1] * 5


@pytest.mark.parametrize(("size", "swallowed"), [(0, 0), (2, 0), (200, 197)])
def test_a_wrong_package_size_skips_at_least_the_header(one, size, swallowed):
    lie = struct.pack(">HB", size, ord("?"))
    assert one.say(lie, bytes(swallowed), client.version()) == [("V", YES)]
