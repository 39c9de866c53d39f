"""Inputs, outputs, registers and tool centre point: settings are published, and nothing else changes."""

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tvist_controller.instruments.peripherals import Peripherals
from tvist_controller.setup import paper_payload
from tvist_protocol.commands import PowerOff, PowerOn
from tvist_protocol.io import BITS, Registers, SetIo, SetRegisters, SetTcp, SimulationSetInputs
from tvist_protocol.modes import RobotMode
from tvist_protocol.replies import Done
from tvist_protocol.simulation import SimulationInject

from .robots import UR5E, Robot

BITS18 = st.integers(0, 2**18 - 1)


def told(peripherals: Peripherals):
    return peripherals.io(1, paper_payload(UR5E), 1.0, {"program": None}, [0.0] * 6)


def test_io_contains_the_external_force(robot):
    robot.tick(50)
    assert robot.controller.io().actual_TCP_force == pytest.approx([0.0] * 6, abs=1.0)
    robot.send(SimulationInject, fault="torque", joint=0, value=20.0, seconds=4.0)
    robot.tick(1000)
    force = np.array(robot.controller.io().actual_TCP_force)
    assert 1.0 < np.linalg.norm(force[:3]) + np.linalg.norm(force[3:]) < 200.0
    robot.send(PowerOff)
    robot.tick(500)
    assert robot.controller.io().actual_TCP_force == [0.0] * 6


@given(st.lists(st.tuples(BITS18, BITS18), max_size=8))
def test_masks_select_the_digital_signals_that_change(steps):
    peripherals, bits = Peripherals(lambda _: None), [False] * 18
    for mask, values in steps:
        peripherals.set_outputs(SetIo(token="", digital_output_mask=mask, digital_outputs=values))
        peripherals.set_inputs(SimulationSetInputs(token="", digital_input_mask=mask, digital_inputs=values))
        bits = [bool(values >> k & 1) if mask >> k & 1 else bits[k] for k in range(18)]
    expected = sum(on << k for k, on in enumerate(bits))
    assert told(peripherals).actual_digital_output_bits == expected
    assert told(peripherals).actual_digital_input_bits == expected


@given(st.integers(0, 3), st.integers(0, 3), st.floats(0, 1), st.floats(0, 1))
def test_an_analog_output_is_a_fraction_of_its_range(mask, kind, first, second):
    peripherals, shares = Peripherals(lambda _: None), (first, second)
    fields = {f"standard_analog_output_{number}": share for number, share in enumerate(shares)}
    masks = {"standard_analog_output_mask": mask, "standard_analog_output_type": kind}
    peripherals.set_outputs(SetIo(token="", **masks, **fields))
    io = told(peripherals)
    for number, share in enumerate(shares):
        chosen = mask >> number & 1
        voltage = bool(chosen and kind >> number & 1)
        assert bool(io.analog_io_types >> (2 + number) & 1) == voltage
        expected = 10.0 * share * chosen if voltage else 0.004 + 0.016 * share * chosen
        assert io.standard_analog_output[number] == pytest.approx(expected, abs=1e-15)


@given(
    st.sampled_from(["input_bit", "output_bit"]),
    st.lists(
        st.tuples(st.integers(0, BITS - 1), st.lists(st.booleans(), min_size=1, max_size=40)), max_size=5
    ),
)
def test_bit_registers_are_published_in_words_of_32(bank, writes):
    peripherals, bits = Peripherals(lambda _: None), [False] * BITS
    for first, values in writes:
        fitting = values[: BITS - first]
        command = SetRegisters(token="", bank=bank, first=first, values=tuple(fitting))
        peripherals.write_registers(command, 1)
        bits[first : first + len(fitting)] = fitting
    words = [sum(bits[32 * w + k] << k for k in range(32)) for w in range(4)]
    assert getattr(told(peripherals), f"{bank}_register") == words
    other = "output_bit" if bank == "input_bit" else "input_bit"
    assert getattr(told(peripherals), f"{other}_register") == [0] * 4


def test_io_is_published_once_per_tick_with_a_change(robot):
    assert robot.controller.changed_io().tick == 1  # as it begins
    robot.tick(3)
    assert robot.controller.changed_io() is None
    robot.send(SetIo, digital_output_mask=1, digital_outputs=1)
    robot.send(SetIo, digital_output_mask=2, digital_outputs=2)
    io = robot.controller.changed_io()
    assert (io.tick, io.actual_digital_output_bits) == (4, 3)
    assert robot.controller.changed_io() is None


def test_a_tcp_changes_only_the_tool_pose():
    plain, tool = Robot(), Robot()
    offset = (0.03, -0.02, 0.15, 0.3, -0.2, 0.1)
    assert tool.send(SetTcp, offset=offset) == Done()
    for robot in (plain, tool):
        robot.tick()
    flange, moved = (robot.states[-1] for robot in (plain, tool))
    same = set(flange.__struct_fields__) - {"actual_TCP_pose", "actual_TCP_speed"}
    assert all(getattr(flange, name) == getattr(moved, name) for name in same)
    placed = _placement(flange.actual_TCP_pose) * _placement(offset)
    assert np.allclose(placed.homogeneous, _placement(moved.actual_TCP_pose).homogeneous, atol=1e-12)


def test_power_on_without_brake_release_leaves_the_arm_idle():
    robot = Robot(mode="POWER_OFF")
    for release, mode in ((False, "IDLE"), (False, "IDLE"), (True, "RUNNING"), (False, "RUNNING")):
        assert robot.send(PowerOn, release_brakes=release) == Done()
        assert robot.tick().robot_mode == RobotMode[mode]


def _placement(pose):
    return pin.SE3(pin.exp3(np.array(pose[3:])), np.array(pose[:3]))


def test_registers_of_several_banks_are_written_together(robot):
    more = (
        Registers(bank="input_double", first=3, values=(0.5, 2)),
        Registers(bank="input_bit", values=(True,)),
    )
    assert robot.send(SetRegisters, bank="input_int", values=(7,), also=more) == Done()
    io = robot.controller.io()
    assert (io.input_int_register[0], io.input_bit_register[0]) == (7, 1)
    assert list(map(repr, io.input_double_register[3:5])) == ["0.5", "2.0"]
