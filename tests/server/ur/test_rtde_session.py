"""RTDE's connections: set-up, samples, inputs and who owns them."""

import struct
from collections import defaultdict
from itertools import pairwise
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tvist_protocol.commands import SetSpeed
from tvist_protocol.io import Registers, SetIo, SetRegisters
from tvist_server.gateways.ur import version
from tvist_server.gateways.ur.robot import InputOwners
from tvist_server.gateways.ur.rtde.board import Board
from tvist_server.gateways.ur.rtde.inputs import matching
from tvist_server.gateways.ur.rtde.session import RtdeSession, ticks_between
from tvist_server.rtde.codec import PackageReader

from . import rtde_client as client

YES, NO = b"\x01", b"\x00"
ints = [f"input_int_register_{k}" for k in range(48)]
doubles = [f"input_double_register_{k}" for k in range(48)]


class Client:
    """A connection seen from its other end."""

    def __init__(self, robot, control):
        self.control = control
        self.stream = bytearray()
        self.session = RtdeSession(robot, control, self.stream.extend, robot.boards)
        self.session.opened()

    def say(self, *packages):
        """The answers to these packages."""
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
        """A connection that has asked for these input recipes."""
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
    robot.inputs, robot.boards = InputOwners(), defaultdict(Board)
    return robot


@pytest.fixture
def one(robot, control):
    return Client(robot, control)


@pytest.fixture
def other(robot, control):
    return Client(robot, control)


class TestSetUp:
    def test_versions_one_and_two_are_spoken_and_no_others(self, one):
        for number in range(5):
            assert one.say(client.version(number)) == [("V", YES if number in {1, 2} else NO)]
        for payload in (b"", b"\x00"):
            assert one.say(client.package("V", payload)) == [("V", NO)]

    def test_the_controllers_version_is_four_numbers(self, one):
        numbers = (version.MAJOR, version.MINOR, version.BUGFIX, version.BUILD)
        assert one.say(client.package("v")) == [("v", struct.pack(">4I", *numbers))]
        assert numbers[:2] == (5, 22)

    def test_outputs_are_answered_with_their_types(self, one):
        one.say(client.version())
        names = ["timestamp", "actual_q", "joint_mode", "runtime_state", "output_bit_register_64"]
        expected = b"\x01DOUBLE,VECTOR6D,VECTOR6INT32,UINT32,BOOL"
        assert one.say(client.outputs(names)) == [("O", expected)]

    def test_a_comma_at_the_end_of_the_names_changes_nothing(self, one):
        one.say(client.version())
        with_comma = client.package("O", struct.pack(">d", 500.0) + b"timestamp,actual_q,")
        assert one.say(with_comma) == one.say(client.outputs(["timestamp", "actual_q"]))
        assert one.say(client.package("I", b"input_int_register_0,")) == [("I", b"\x01INT32")]

    @pytest.mark.parametrize("before", [[], ["input_int_register_0"]])
    def test_a_start_without_outputs_is_refused_and_one_with_them_is_not(self, one, before):
        one.say(client.version(), *([client.inputs(before)] if before else []))
        assert one.say(client.package("S")) == [("S", NO)]
        assert one.say(client.outputs(["timestamp"]), client.package("S"))[1] == ("S", YES)

    def test_outputs_that_are_not_there_are_named_and_cannot_be_started(self, one):
        one.say(client.version())
        assert one.say(client.outputs(["timestamp", "nonsense"])) == [("O", b"\x00DOUBLE,NOT_FOUND")]
        assert one.say(client.package("S")) == [("S", NO)]
        assert one.say(client.outputs(["timestamp"]), client.package("S"))[1] == ("S", YES)

    def test_no_client_owns_what_is_reserved_and_clients_that_come_and_go_free_none_of_it(
        self, one, other, robot
    ):
        reserved = matching(["speed_slider_*", "input_int_register_[0-9]"])
        assert set(reserved) == {"speed_slider_mask", "speed_slider_fraction", *ints[:10]}
        robot.inputs.take(reserved, "a fieldbus")
        for client_ in (one, other):
            client_.say(client.version())
            wanted = ["speed_slider_mask", "standard_digital_output", ints[9], ints[10]]
            assert client_.say(client.inputs(wanted)) == [("I", b"\x00IN_USE,UINT8,IN_USE,INT32")]
            client_.session.closed()

    def test_inputs_are_numbered_in_order_and_wrong_ones_take_no_number(self, one):
        one.say(client.version())
        assert one.say(client.inputs(["input_int_register_0"])) == [("I", b"\x01INT32")]
        wrong = ["input_int_register_1", "nonsense"]
        assert one.say(client.inputs(wrong)) == [("I", b"\x00INT32,NOT_FOUND")]
        assert one.say(client.inputs([])) == [("I", b"\x00")]
        assert one.say(client.inputs(["input_int_register_0"])) == [("I", b"\x02INT32")]

    def test_more_recipes_than_a_byte_can_number_are_not_taken(self, one):
        one.say(client.version())
        numbers = [one.say(client.inputs(["input_int_register_0"]))[0][1][0] for _ in range(257)]
        assert numbers == [*range(1, 256), 0, 0]

    def test_nothing_is_said_unasked_before_the_start(self, one, snapshot):
        one.say(client.version())
        wrong = [
            client.package("U", b"\x09abc"),
            client.package("U"),
            client.package("?"),
            client.package("M"),
        ]
        assert one.say(*wrong) == []
        assert one.session.sample(snapshot) == b""

    def test_a_text_from_the_client_is_taken(self, one):
        one.started()
        message = bytes([3]) + b"abc" + bytes([2]) + b"me" + bytes([3])
        assert one.say(client.package("M", message), client.package("M")) == []

    def test_ten_thousand_names_are_answered_as_far_as_one_package_goes(self, one):
        one.say(client.version())
        for names in (["a"] * 10_000, ["timestamp"] * 6_000, [""] * 10_000, ["x" * 60_000]):
            ((letter, payload),) = one.say(client.outputs(names))
            assert letter == "O"
            words = payload[1:].decode().split(",")
            assert set(words) <= {"NOT_FOUND", "DOUBLE"}
            assert len(words) == min(len(names), len(words))
        ((letter, payload),) = one.say(client.package("I", b"a," * 10_000))
        assert (letter, payload[0]) == ("I", 0)
        assert payload[1:].decode().split(",") == ["NOT_FOUND"] * ((0xFFFF - 4 + 1) // 10)


class TestVersionOne:
    def test_names_come_alone_and_so_do_types(self, one, snapshot):
        assert one.say(client.package("O", b"timestamp,actual_q")) == [("O", b"DOUBLE,VECTOR6D")]
        assert one.say(client.package("S")) == [("S", YES)]
        found = client.decoded(one.session.sample(snapshot), ["timestamp", "actual_q"], version=1)
        assert found == {"timestamp": snapshot.timestamp, "actual_q": snapshot.actual_q}

    def test_what_is_not_there_is_not_found(self, one):
        assert one.say(client.package("O", b"timestamp,nonsense")) == [("O", b"DOUBLE,NOT_FOUND")]
        assert one.say(client.package("S")) == [("S", NO)]

    def test_a_text_message_has_neither_lengths_nor_source(self, one):
        one.say(client.package("O", b"timestamp"), client.package("S"))
        ((letter, payload),) = one.say(client.package("U", b"\x05"))
        assert letter == "M"
        assert payload == b"\x02there is no input recipe 5"

    def test_it_can_be_asked_for(self, one, snapshot):
        one.say(client.version(2), client.version(1))
        one.say(client.package("O", b"timestamp"), client.package("S"))
        assert client.decoded(one.session.sample(snapshot), ["timestamp"], version=1)


class TestSamples:
    @pytest.mark.parametrize("frequency", [500, 250, 125, 100, 50, 25, 20, 10, 5])
    def test_time_between_samples_is_the_periods_to_the_last_tick(self, one, snapshots, frequency):
        one.started(frequency=frequency)
        samples = [sample for sample in map(one.session.sample, snapshots) if sample]
        times = [client.decoded(sample, ["timestamp"])["timestamp"] for sample in samples]
        assert times[0] == snapshots[0].timestamp
        assert len(times) == -(-100 * frequency // 500)
        for before, after in pairwise(times):
            assert after - before == pytest.approx(1.0 / frequency, abs=1e-9)

    @given(st.floats())
    def test_any_frequency_is_some_number_of_ticks(self, frequency):
        assert 1 <= ticks_between(frequency) <= 500

    @given(st.integers(1, 500))
    def test_a_frequency_is_rounded_up_to_the_next_there_is(self, frequency):
        ticks = ticks_between(frequency)
        assert 500 / ticks >= frequency - 1e-9
        assert 500 / (ticks + 1) < frequency

    def test_ticks_that_nobody_showed_do_not_move_the_others(self, one, snapshots):
        one.started(["control_step"], frequency=50)
        shown = [s for k, s in enumerate(snapshots) if k not in {10, 11, 12, 30}]
        steps = [
            client.decoded(sample, ["control_step"])["control_step"] - snapshots[0].state.tick
            for sample in map(one.session.sample, shown)
            if sample
        ]
        assert steps == [0, 13, 20, 31, 40, 50, 60, 70, 80, 90]

    def test_samples_end_with_a_pause_and_go_on_with_the_same_recipe(self, one, snapshots):
        one.started()
        assert one.session.sample(snapshots[0])
        assert one.say(client.package("P")) == [("P", YES)]
        assert not any(map(one.session.sample, snapshots[1:20]))
        assert one.say(client.package("S")) == [("S", YES)]
        found = client.decoded(one.session.sample(snapshots[20]), ["timestamp"])
        assert found["timestamp"] == snapshots[20].timestamp

    def test_a_new_recipe_replaces_the_old_one(self, one, snapshots):
        one.started(["actual_q"])
        one.say(client.outputs(["robot_mode"]))
        assert client.decoded(one.session.sample(snapshots[5]), ["robot_mode"]) == {"robot_mode": 7}


class TestOwnership:
    def test_a_variable_belongs_to_one_connection(self, one, other):
        one.with_inputs(ints[:3])
        other.say(client.version())
        assert other.say(client.inputs([ints[3], ints[1]])) == [("I", b"\x00INT32,IN_USE")]
        assert other.say(client.inputs([ints[3]])) == [("I", b"\x01INT32")]

    def test_what_a_wrong_recipe_asked_for_stays_free(self, one, other):
        one.say(client.version(), client.inputs([ints[0], "nonsense"]))
        other.with_inputs(ints[:1])

    def test_one_connection_may_have_it_in_many_recipes(self, one):
        one.with_inputs(*[ints[:4]] * 23)

    def test_closing_frees_it_at_once(self, one, other):
        one.with_inputs(ints, doubles)
        one.session.closed()
        other.with_inputs(ints, doubles)

    def test_closing_frees_nothing_of_others(self, one, other, robot, control):
        one.with_inputs(ints[:1])
        other.with_inputs(ints[1:2])
        one.session.closed()
        third = Client(robot, control)
        third.say(client.version())
        assert third.say(client.inputs(ints[:2])) == [("I", b"\x00INT32,IN_USE")]

    def test_speed_and_outputs_are_in_use_while_somebody_else_has_control(self, one, control):
        one.say(client.version())
        control.held_by_other = True
        names = ["speed_slider_mask", "tool_digital_output", "standard_analog_output_0", ints[0]]
        assert one.say(client.inputs(names)) == [("I", b"\x00IN_USE,IN_USE,IN_USE,INT32")]
        assert one.say(client.inputs([ints[0], "external_force_torque"])) == [("I", b"\x01INT32,VECTOR6D")]
        control.held_by_other = False
        assert one.say(client.inputs(names))[0][1][0] == 2


def test_what_only_a_slow_client_reads_is_not_computed_for_the_others(one, other, ur5e, monkeypatch):
    arm, computed = ur5e(), []
    monkeypatch.setattr(type(arm.instruments._rigid), "momentum", lambda *_: computed.append(1) or 0.0)
    one.started(("actual_q",))
    other.started(("actual_momentum",), 100.0)
    due = 0
    for _ in range(20):
        one.session.sample(arm.tick())
        due += other.session.sample(arm.tick()) != b""
    assert len(computed) == due == 8
    other.session.closed()
    for _ in range(20):
        one.session.sample(arm.tick())
    assert len(computed) == due


def shown(robot, **changes):
    """Let the robot show other terminals and registers."""
    io = robot.latest.io
    fields = {name: getattr(io, name) for name in io.__struct_fields__}
    robot.latest = SimpleNamespace(io=type(io)(**(fields | changes)))


class TestRegisters:
    def test_registers_in_a_row_are_one_command(self, one):
        one.with_inputs(ints[4:9])
        (command,) = one.put(1, ints[4:9], 1, 2, 3, 4, 5)
        assert command == SetRegisters(bank="input_int", first=4, values=(1, 2, 3, 4, 5))

    def test_what_did_not_change_is_not_sent_again(self, one, robot):
        one.with_inputs(doubles[:6])
        assert len(one.put(1, doubles[:6], 1.0, 2.0, 3.0, 4.0, 5.0, 6.0)) == 1
        shown(robot, input_double_register=[1.0, 2.0, 3.0, 4.0, 5.0, 6.0] + [0.0] * 42)
        assert one.put(1, doubles[:6], 1.0, 2.0, 3.0, 4.0, 5.0, 6.0) == []
        (command,) = one.put(1, doubles[:6], 1.0, 2.5, 3.0, 4.5, 5.0, 6.0)
        assert command == SetRegisters(bank="input_double", first=1, values=(2.5, 3.0, 4.5))

    def test_what_is_on_its_way_is_not_sent_again(self, one, control):
        one.with_inputs(ints[:1])
        control.wait()
        assert len(one.put(1, ints[:1], 7)) == 1
        assert one.put(1, ints[:1], 7) == []
        (command,) = one.put(1, ints[:1], 0)
        assert command.values == (0,)

    def test_a_value_and_back_are_both_sent_before_the_robot_shows_either(self, one):
        one.with_inputs(ints[:1])
        sent = [one.put(1, ints[:1], value) for value in (0, 5, 0)]
        assert [[command.values for command in commands] for commands in sent] == [[], [(5,)], [(0,)]]

    def test_what_somebody_else_wrote_is_written_over(self, one, robot):
        one.with_inputs(ints[:1])
        one.put(1, ints[:1], 5)
        shown(robot, input_int_register=[9] + [0] * 47)
        (command,) = one.put(1, ints[:1], 5)
        assert command.values == (5,)

    def test_what_a_program_watches_is_sent_every_time(self, one, robot):
        names = [ints[0], doubles[3], "input_bit_registers0_to_31"]
        one.with_inputs(names)
        one.put(1, names, 5, 1.5, 1)
        seen = {"input_int_register": [5] + [0] * 47, "input_bit_register": [1, 0, 0, 0]}
        seen["input_double_register"] = [0.0, 0.0, 0.0, 1.5] + [0.0] * 44
        shown(robot, **seen)
        assert one.put(1, names, 5, 1.5, 1) == []
        shown(robot, watched=[ints[0]], **seen)
        assert [command.values for command in one.put(1, names, 5, 1.5, 1)] == [(5,)]
        shown(robot, watched=["input_bit_registers0_to_31"], **seen)
        (command,) = one.put(1, names, 5, 1.5, 1)
        assert (command.bank, command.first, len(command.values)) == ("input_bit", 0, 32)

    def test_registers_of_a_package_are_one_command_so_that_programs_see_it_as_a_whole(self, one):
        names = [ints[0], ints[1], ints[7], doubles[0], "input_bit_register_64"]
        one.with_inputs(names)
        assert one.put(1, names, 1, 1, 1, 1.0, True) == [
            SetRegisters(
                bank="input_int",
                first=0,
                values=(1, 1),
                also=(
                    Registers(bank="input_int", first=7, values=(1,)),
                    Registers(bank="input_double", first=0, values=(1.0,)),
                    Registers(bank="input_bit", first=64, values=(True,)),
                ),
            )
        ]

    def test_a_word_is_thirty_two_bits(self, one):
        names = ["input_bit_registers32_to_63"]
        one.with_inputs(names)
        (command,) = one.put(1, names, 0x80000001)
        assert (command.bank, command.first) == ("input_bit", 32)
        assert command.values == (True, *[False] * 30, True)

    def test_inputs_are_taken_before_any_start(self, one):
        one.with_inputs(ints[:1])
        assert len(one.put(1, ints[:1], 3)) == 1
        assert one.heard() == []

    def test_bytes_too_many_are_ignored(self, one):
        one.with_inputs(doubles[:12])
        values = [float(k) for k in range(1, 13)]
        package = client.data(1, doubles[:12], values)
        one.session.receive(client.package("U", package[3:] + bytes(48)))
        assert one.control.commands[-1].values == tuple(values)
        assert len(one.put(1, doubles[:12], *reversed(values))) == 1

    def test_of_bytes_too_few_the_old_values_stay(self, one):
        one.with_inputs(ints[:2])
        one.put(1, ints[:2], 1, 2)
        one.control.commands.clear()
        one.session.receive(client.package("U", client.data(1, ints[:2], (8, 9))[3:-1]))
        assert [command.values for command in one.control.commands] == [(8,)]

    def test_what_is_no_number_leaves_the_register_and_is_said(self, one):
        one.started().with_inputs(doubles[:2])
        (command,) = one.put(1, doubles[:2], float("nan"), 3.0)
        assert (command.first, command.values) == (1, (3.0,))
        assert b"input_double_register_0" in one.texts()[0]

    def test_before_the_robot_has_told_anything_everything_is_news(self, one, robot):
        robot.latest = None
        one.with_inputs(ints[:2], ["speed_slider_mask", "speed_slider_fraction"])
        assert len(one.put(1, ints[:2], 0, 0)) == 1
        assert len(one.put(2, ["speed_slider_mask", "speed_slider_fraction"], 1, 1.0)) == 1


class TestSpeed:
    names = ("speed_slider_mask", "speed_slider_fraction")

    def test_it_is_set_where_the_mask_says_so(self, one):
        one.with_inputs(self.names)
        assert one.put(1, self.names, 0, 0.5) == []
        assert one.put(1, self.names, 1, 0.5) == [SetSpeed(token="the-token", fraction=0.5)]

    def test_it_is_set_once(self, one, robot):
        one.with_inputs(self.names)
        one.put(1, self.names, 1, 0.5)
        shown(robot, target_speed_fraction=0.5)
        assert one.put(1, self.names, 1, 0.5) == []

    @pytest.mark.parametrize("fraction", [-0.1, 1.5, float("nan"), float("inf")])
    def test_what_it_cannot_be_is_said(self, one, fraction):
        one.started().with_inputs(self.names)
        assert one.put(1, self.names, 1, fraction) == []
        assert b"speed_slider_fraction" in one.texts()[0]

    def test_a_mask_without_a_fraction_sets_nothing(self, one):
        one.with_inputs(self.names[:1])
        assert one.put(1, self.names[:1], 1) == []

    def test_somebody_elses_control_is_respected_and_said_once(self, one, control):
        one.started().with_inputs(self.names)
        control.held_by_other = True
        for _ in range(100):
            assert one.put(1, self.names, 1, 0.5) == []
        assert len(one.texts()) == 1

    def test_a_refusal_is_said(self, one, control):
        one.started().with_inputs(self.names)
        control.refuse(why="not now")
        one.put(1, self.names, 1, 0.25)
        ((letter, payload),) = one.heard()
        assert letter == "M"
        size = payload[0]
        assert payload[1 : 1 + size] == b"not now"
        assert payload[-1] == 2
        assert payload[2 + size : -1] == b"RTDE"
        assert payload[1 + size] == len(b"RTDE")

    def test_no_sentence_comes_without_a_start(self, one, control):
        one.with_inputs(self.names)
        control.refuse(why="not now")
        one.put(1, self.names, 1, 0.25)
        assert one.heard() == []


class TestOutputs:
    digital = tuple(
        f"{group}_digital_output{part}"
        for group in ("standard", "configurable", "tool")
        for part in ("_mask", "")
    )
    analog = (
        "standard_analog_output_mask",
        "standard_analog_output_type",
        "standard_analog_output_0",
        "standard_analog_output_1",
    )

    def test_groups_of_digital_outputs_have_their_places(self, one):
        one.with_inputs(self.digital)
        (command,) = one.put(1, self.digital, 0x81, 0xFF, 0x01, 0x01, 0xFF, 0x02)
        assert isinstance(command, SetIo)
        assert command.digital_output_mask == 0x81 | 0x01 << 8 | 0x2 << 16
        assert command.digital_outputs == 0x81 | 0x01 << 8 | 0x2 << 16

    def test_only_what_changes_is_set(self, one, robot):
        one.with_inputs(self.digital)
        shown(robot, actual_digital_output_bits=0b1100)
        (command,) = one.put(1, self.digital, 0b1111, 0b0110, 0, 0, 0, 0)
        assert (command.digital_output_mask, command.digital_outputs) == (0b1010, 0b0010)

    def test_outputs_may_come_in_recipes_of_their_own(self, one):
        standard, tool = self.digital[:2], self.digital[4:]
        one.with_inputs(standard, tool)
        (first,) = one.put(1, standard, 1, 1)
        (second,) = one.put(2, tool, 1, 1)
        assert (first.digital_output_mask, second.digital_output_mask) == (1, 1 << 16)

    def test_masks_without_values_set_nothing(self, one):
        names = [name for name in (*self.digital, *self.analog) if name.endswith("_mask")]
        one.with_inputs(names)
        assert one.put(1, names, *[0xFF] * len(names)) == []

    def test_analog_outputs_are_shares_of_a_range(self, one):
        one.with_inputs(self.analog)
        (command,) = one.put(1, self.analog, 0b11, 0b10, 0.25, 0.75)
        assert command.standard_analog_output_mask == 0b11
        assert command.standard_analog_output_type == 0b10
        assert (command.standard_analog_output_0, command.standard_analog_output_1) == (0.25, 0.75)

    def test_an_analog_output_that_shows_what_is_wanted_is_left(self, one, robot):
        one.with_inputs(self.analog)
        shown(robot, standard_analog_output=[0.004 + 0.016 * 0.3, 3.0], analog_io_types=0b1000)
        assert one.put(1, self.analog, 0b11, 0b10, 0.3, 0.3) == []
        (command,) = one.put(1, self.analog, 0b11, 0b11, 0.3, 0.3)
        assert command.standard_analog_output_mask == 0b01

    def test_a_share_beyond_its_range_is_said(self, one):
        one.started().with_inputs(self.analog)
        (command,) = one.put(1, self.analog, 0b11, 0, 1.5, 0.5)
        assert command.standard_analog_output_mask == 0b10
        assert b"standard_analog_output_0" in one.texts()[0]

    def test_a_force_sensors_values_reach_a_program_also_if_they_stay_the_same(self, one, robot):
        names = ("external_force_torque",)
        one.started().with_inputs(names)
        shown(robot, program="p", program_state="PLAYING")
        for force in (1.0, 2.0, 2.0):
            (command,) = one.put(1, names, (force,) * 6)
            assert (command.wrench, command.token) == ((force,) * 6, "the-token")
        assert one.texts() == []

    def test_a_force_sensors_values_take_no_control(self, one, robot, control):
        names = ("external_force_torque",)
        one.started().with_inputs(names)
        shown(robot, program_state="STOPPED")
        assert one.put(1, names, (1.0,) * 6) == []
        shown(robot, program="p", program_state="PLAYING")
        control.held_by_other = True
        assert one.put(1, names, (1.0,) * 6) == []
        (text,) = one.texts()
        assert b"another client has control" in text


CONVERSATION = [
    client.version(),
    client.package("v"),
    client.outputs(["timestamp", "actual_q", "output_int_register_3"], 250.0),
    client.inputs(["input_int_register_0", "input_double_register_1"]),
    client.inputs(["speed_slider_mask", "speed_slider_fraction", "nonsense"]),
    client.package("S"),
    client.data(1, ["input_int_register_0", "input_double_register_1"], [7, 1.5]),
    client.package("U", b"\x09"),
    client.package("P"),
    client.package("M", b"\x03abc\x01x\x03"),
    client.package("S"),
]


def result(robot, control, cuts):
    """Answers and commands of the conversation, cut at these places."""
    robot.inputs = InputOwners()
    one, whole = Client(robot, control), b"".join(CONVERSATION)
    control.commands.clear()
    for first, last in zip([0, *cuts], [*cuts, len(whole)], strict=True):
        one.session.receive(whole[first:last])
    return one.heard(), list(control.commands)


class TestStream:
    def test_it_may_be_cut_at_every_byte(self, robot, control):
        length = len(b"".join(CONVERSATION))
        expected = result(robot, control, [])
        assert result(robot, control, list(range(1, length))) == expected
        for cut in range(length):
            assert result(robot, control, [cut]) == expected

    def test_a_size_without_room_for_the_header_is_taken_for_a_header_alone(self, one):
        for size in range(3):
            lie = struct.pack(">HB", size, ord("S"))
            assert one.say(lie, client.version()) == [("V", YES)]

    def test_a_size_that_promises_more_swallows_just_that(self, one):
        lie = struct.pack(">HB", 200, ord("?"))
        assert one.say(lie, bytes(197), client.version()) == [("V", YES)]

    @given(st.lists(st.binary(max_size=2000), max_size=40))
    def test_no_more_is_held_than_one_package(self, chunks):
        reader = PackageReader()
        for chunk in chunks:
            reader.feed(chunk)
            assert len(reader._buffer) < 0xFFFF

    def test_a_million_bytes_of_one_package_after_another_leave_nothing(self, one):
        assert len(one.say(client.package("P") * 20_000)) == 20_000
        assert len(one.session._reader._buffer) == 0
