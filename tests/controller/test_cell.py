"""A cell follows the robot tick by tick: wires, a Robotiq 2F, and parts that load the arm."""

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.own_arm import OwnArm

from tvist_controller.cell.description import CellWire
from tvist_controller.cell.gripper import CLOSED, OPEN, Gripper, Requests, answer
from tvist_controller.cell.live_cell import TRANSFER, Wires
from tvist_controller.host import Host
from tvist_controller.setup import Setup
from tvist_lab.replay import replay
from tvist_plant.plant import PERIOD
from tvist_protocol.programs import ProgramRun
from tvist_protocol.simulation import SimulationReset

from .cells import HERE, TOOL, a_cell, in_cell, part
from .robots import UR5E, Kept, Robot
from .scripts import failure, finish, run, said, script, start

WIRES = (
    CellWire(output="standard 1", input="configurable 2", after=0.1),
    CellWire(output="tool 0", input="tool 1", inverted=True),
)


def carried(robot):
    return robot.controller.cycle.plant.payload


class TestWires:
    @given(st.lists(st.booleans(), max_size=200), st.integers(0, 30), st.booleans())
    def test_a_wired_input_equals_its_output_delayed_even_for_short_pulses(self, signal, ticks, inverted):
        wires = Wires(
            [CellWire(output="standard 0", input="standard 0", after=ticks * PERIOD, inverted=inverted)]
        )
        delay, now, inputs = max(1, ticks), int(inverted), []
        for tick, on in enumerate([False, *signal], start=1):
            inputs.append(now)
            mask, values = wires.tick(tick, int(on))
            now = values if mask else now
        outputs = [False] * delay + [False, *signal]
        assert [bool(one) != inverted for one in inputs] == outputs[: len(inputs)]

    def test_a_program_waits_for_an_input_that_a_wire_sets_later(self):
        robot = in_cell(wires=WIRES)
        tool, wait = (
            "textmsg(get_tool_digital_in(1))",
            "while not get_configurable_digital_in(2):\n n = n + 1\n sync()\n end",
        )
        run(robot, tool, "sync()", tool, "set_standard_digital_out(1, True)", "n = 0", wait, "textmsg(n)")
        assert said(robot) == ["False", "True", "50"]
        assert robot.controller.io().actual_digital_input_bits == 1 << 10 | 1 << 17


class TestProtocol:
    @pytest.mark.parametrize(("request_", "answered"), [
        (b"SET ACT 1 GTO 1 POS 255 SPE 255 FOR 150\n", b"ack"),
        (b"SET SID 9\n", b"ack"), (b"SET SID 2\n", b""), (b"\n", b""),
        (b"GET POS\n", b"POS 3\n"), (b"GET OBJ\r\n", b"OBJ 3\n"), (b"GET SID\n", b"SID [9]\n"),
        (b"GET POS", b"003"), (b"GET FLT", b"00"), (b"GET STA", b"0"), (b"GET SID", b"[9]              "),
        *[(b"SET POS %s\n" % value, b"?") for value in (b"256", b"-1", b"12.5", b"1e2", b"9" * 900)],
        *[(wrong, b"?") for wrong in (b"SET ACT 2\n", b"SET POS\n", b"SET XYZ 1\n", b"GET XYZ")],
        (b"\xff\xfe\n", b"?"), (b"x" * 2000, b"?"),
    ])  # fmt: skip
    def test_gripper_requests_get_the_answers_of_the_urcap(self, request_, answered):
        gripper = Gripper(0.085, activated=False)
        assert b"".join(answer(gripper, one) for one in Requests().cut(request_)) == answered

    @given(st.data())
    def test_gripper_requests_may_be_split_anywhere(self, data):
        whole = b"SET POS 9\nSET SPE 3 FOR 4\n\nGET POS\nSET GTO 1\n"
        at = sorted(data.draw(st.sets(st.integers(1, len(whole) - 1)).filter(lambda cuts: 34 not in cuts)))
        requests = Requests()
        pieces = [whole[a:b] for a, b in zip([0, *at], [*at, len(whole)], strict=True)]
        assert [one for piece in pieces for one in requests.cut(piece)] == [
            line + b"\n" for line in whole.split(b"\n") if line
        ]


@pytest.mark.parametrize(("speed", "seconds"), [(255, 0.085 / 0.15), (0, 0.085 / 0.02)])
def test_fingers_close_at_the_set_speed(speed, seconds):
    gripper, seen = Gripper(0.085, activated=True), []
    gripper.write({"POS": 255, "SPE": speed, "GTO": 1})
    while not seen or (seen[-1] == 0 and len(seen) < 5000):
        seen.append(gripper.read("OBJ"))
        gripper.tick(lambda _wide, _narrow: None)
    assert seen[-1] == 3
    assert len(seen) - 1 == pytest.approx(seconds / PERIOD, abs=1)
    assert (gripper.read("POS"), gripper.read("PRE"), gripper.opening) == (CLOSED, 255, 0.0)


class TestParts:
    def test_a_gripped_part_loads_the_arm_until_it_is_released(self):
        robot = in_cell(part((0.002, 0, 0, 0, 0, np.pi - 0.1)))  # half a turn swaps the fingers
        run(
            robot,
            "rq_close_and_wait()",
            "textmsg(rq_is_object_detected(), rq_current_pos_mm())",
            "sleep(0.5)",
            "movel(pose_add(get_actual_tcp_pose(), p[0, 0, 0.1, 0, 0, 0]))",
            "rq_open_and_wait()",
            "sleep(0.5)",
        )
        holds, seen, lies = said(robot)
        assert (holds, seen) == ("cell: the gripper holds box (1.5 kg)", "True50")
        place = np.array([float(word) for word in lies.partition("p[")[2].rstrip("]").split(",")])
        np.testing.assert_allclose(
            place[:3], HERE.position + HERE.rotation[:, 0] * 0.002 + [0, 0, 0.1], atol=2e-3
        )
        assert carried(robot).mass == TOOL["mass"]

    def test_the_carried_body_combines_tool_and_part(self):
        robot = in_cell(part((0, 0, 0.004, 0, 0, 0), cog=(0, 0, 0.01)))
        run(robot, "rq_close_and_wait()", "sleep(0.5)")
        load = carried(robot)
        assert load.mass == pytest.approx(2.4)
        assert load.com[2] == pytest.approx((0.9 * 0.06 + 1.5 * 0.177) / 2.4, abs=1e-3)  # the arm sags
        xx, _, _, yy, _, zz = load.inertia
        far = 0.9 * 1.5 / 2.4 * (0.177 - 0.06) ** 2  # of two points
        box = [1.5 / 12 * (a * a + b * b) for a, b in ((0.05, 0.08), (0.06, 0.08), (0.06, 0.05))]
        np.testing.assert_allclose([xx, yy, zz], np.add(box, [far, far, 0]), atol=2e-4)

    def test_the_weight_of_a_part_is_transferred_gradually_to_a_resting_arm(self):
        robot = in_cell(part())
        start(robot, "rq_close_and_wait()", "sleep(1)")
        masses = [0.0]
        while masses[-1] < 2.4 - 1e-9:
            robot.tick()
            masses.append(carried(robot).mass)
        rising = [one for one in masses if one > 0.9]
        np.testing.assert_allclose(np.diff(rising), 1.5 / TRANSFER, atol=1e-9)
        finish(robot)
        assert np.abs(np.diff(robot.column("actual_q"), axis=0)).max() < 1e-5

    @pytest.mark.parametrize(
        ("away", "said_"),
        [
            ((0, 0.02, 0, 0, 0, 0), r"box lies (19|20)\.\d mm and 0.0\d rad"),
            ((0, 0, 0, 0, 0.5, 0), r"and 0\.(49|50) rad"),
        ],
    )
    def test_a_part_out_of_reach_is_not_gripped_and_a_warning_gives_its_distance(self, away, said_):
        robot = in_cell(part(away))
        run(robot, "rq_close_and_wait()", "textmsg(rq_is_object_detected(), rq_current_pos())")
        assert said(robot) == [f"False{CLOSED}"]
        assert any(re.search(said_, why) for why in robot.warnings())
        assert carried(robot).mass == TOOL["mass"]

    def test_a_reset_restores_the_initial_cell(self):
        robot = in_cell(part())
        run(robot, "rq_close_and_wait()", "sleep(0.5)")
        robot.send(SimulationReset)
        assert carried(robot).mass == TOOL["mass"]
        run(robot, "textmsg(rq_current_pos())", "rq_close_and_wait()", "textmsg(rq_is_object_detected())")
        assert said(robot)[-3::2] == [str(OPEN), "True"]

    def test_a_tool_changer_swaps_tools_and_leaves_the_part_behind(self):
        other = TOOL | {"name": "hook", "mass": 0.3, "while_on": "tool 0"}
        robot = in_cell(part(), tools=[TOOL, other])
        run(robot, "rq_close_and_wait()", "sleep(0.5)", "set_tool_digital_out(0, True)", "sleep(0.1)")
        assert carried(robot).mass == 0.3
        assert "cell: box lies at" in said(robot)[-2]
        run(robot, "set_tool_digital_out(0, False)", "sleep(0.1)")
        assert carried(robot).mass == TOOL["mass"]


PREAMBLE = """def put(name, value):
  socket_set_var(name, value, "1")
  sync()
  return socket_read_byte_list(3, "1") == [3, 97, 99, 107]
end
def rq_close_and_wait():
  put("POS", 255)
  put("GTO", 1)
  state = 48
  while state == 48:
    socket_send_string("GET OBJ", "1")
    sync()
    got = socket_read_byte_list(1, "1")
    state = got[1]
  end
  textmsg("by socket ", state - 48)
end
socket_open("127.0.0.1", 63352, "1")""".splitlines()
"""Functions as the URCap brings them along, which talk to the gripper by a socket."""


class TestPrograms:
    def test_preamble_functions_reach_the_simulated_gripper_by_a_local_socket(self):
        robot = in_cell(part())
        run(robot, *PREAMBLE, "rq_close_and_wait()", 'textmsg(socket_get_var("POS", "1"))')
        assert said(robot)[1:] == ["by socket 2", str(round(CLOSED - 0.05 / 0.085 * (CLOSED - OPEN)))]
        assert robot.controller.programs.sockets.orders == []

    def test_gripper_functions_fail_without_a_gripper(self):
        robot = in_cell(gripper=None)
        run(robot, "rq_open()")
        assert "there is no gripper" in failure(robot).why

    def test_moving_an_inactive_gripper_fails(self):
        robot = in_cell(gripper={"model": "2F-85"})
        run(robot, "rq_close_and_wait()")
        assert "rq_activate_and_wait" in failure(robot).why
        run(robot, "rq_activate_and_wait()", "rq_move_and_wait_mm(20)", "textmsg(rq_current_pos_mm())")
        assert float(said(robot)[-1]) == pytest.approx(20.0, abs=0.2)


def test_a_replay_with_gripper_requests_is_bit_equal():
    robot, kept = in_cell(part(), wires=WIRES), Kept()
    host = Host(robot.controller, kept)
    first = robot.controller.setup
    text = script(
        "set_standard_digital_out(1, True)", "sleep(0.6)", f"movej({[one + 0.1 for one in HERE.vector]})"
    )
    for tick in range(900):
        if tick == 20:
            robot.controller.receive(ProgramRun(token=robot.token, text=text))
        if tick == 50:
            assert host.ask_gripper(b"SET GTO 1 POS 255\n") == b"ack"
        if tick % 7 == 0:
            assert host.ask_gripper(b"GET POS\n").startswith(b"POS ")
        host.tick()
    assert [entry.kind for entry in kept.entries] == ["gripper"]
    assert any("holds box" in event.why for event in kept.events if event.kind == "text")
    done = replay(Setup.from_builtins(first.to_builtins()), kept.entries, kept.states)
    assert done.first_difference is None


def test_parts_need_a_plant_whose_payload_can_change():
    with pytest.raises(ValueError, match="the plant OwnArm cannot carry another payload"):
        Robot(cell=a_cell(part()), plant=OwnArm(UR5E, UR5E.payload))
    assert Robot(cell=a_cell(), plant=OwnArm(UR5E, UR5E.payload)).controller.cell is not None
