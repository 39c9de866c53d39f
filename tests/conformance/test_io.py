"""Inputs, outputs and registers on the wire."""


def test_a_change_is_told_before_the_state_of_its_tick_and_then_once_a_second(stepped):
    order = []
    stepped.listen("state", "io")
    with stepped.control() as token:
        stepped.step(token, 1)
        answer = stepped.command("set_io", token=token, digital_output_mask=0x101, digital_outputs=0x100)
        assert answer == {"type": "done"}
        since = {topic: len(stepped.received[topic]) for topic in ("state", "io")}
        tick = stepped.step(token, 3)["tick"]
        order = stepped.received["io"][since["io"] :]
    io = next(message for message in order if message["tick"] == tick - 2)
    assert io["actual_digital_output_bits"] == 0x100
    again = stepped.next("io")
    newly_made = {name: again[name] for name in ("tick", "actual_TCP_force")}
    assert again == {**io, **newly_made}
    assert again["tick"] > io["tick"]


def test_who_comes_late_is_told_all_the_same(live):
    live.listen("io")
    io = live.wait("io")
    assert io["tcp_offset"] == [0.0] * 6
    assert io["payload"]["mass"] == 5.0
    assert io["target_speed_fraction"] == 1.0
    assert len(io["input_int_register"]) == len(io["output_double_register"]) == 48


def test_registers_of_clients_take_no_control_and_those_of_the_robot_do(live):
    live.listen("io")
    written = live.command("set_registers", bank="input_double", first=24, values=[1.5, -2])
    assert written == {"type": "done"}
    io = live.wait("io", lambda io: io["input_double_register"][24] == 1.5)
    assert io["input_double_register"][25] == -2.0
    refused = live.command("set_registers", bank="output_int", values=[1])
    assert (refused["code"], refused["where"]) == ("missing_field", "token")
    with live.control() as token:
        assert live.command("set_registers", token=token, bank="output_int", values=[7])["type"] == "done"
        live.wait("io", lambda io: io["output_int_register"][0] == 7)
        wrong = live.command("set_registers", token=token, bank="output_bit", first=120, values=[True] * 9)
        assert (wrong["code"], wrong["where"], wrong["limit"]) == ("out_of_range", "values", 128)


def test_a_tool_centre_point_moves_the_pose(live):
    with live.control() as token:
        before = live.state()["actual_TCP_pose"]
        assert live.command("set_tcp", token=token, offset=[0, 0, 0.1, 0, 0, 0])["type"] == "done"
        after = live.next("state", lambda state: state["actual_TCP_pose"][:3] != before[:3])[
            "actual_TCP_pose"
        ]
        moved = sum((a - b) ** 2 for a, b in zip(after[:3], before[:3], strict=True)) ** 0.5
        assert 0.0999 < moved < 0.1001
        assert live.command("set_tcp", token=token, offset=[0] * 6)["type"] == "done"
