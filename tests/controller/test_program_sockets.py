"""Sockets of programs lose no data, and time-outs need robot time and wall time."""

from struct import pack

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tvist_controller.programs.sockets import Close, Expire, Open, Send, SocketEvent, Taken, Wait, Waited
from tvist_protocol.programs import ProgramLoad, ProgramPlay, ProgramRun, ProgramStop

from .scripts import a_robot, failure, finish, playing, said, script, start

OPENS = 'socket_open("10.0.0.2", 50001)'


class Far:
    """The other end of a program's sockets: `tell` brings news, `take` collects orders."""

    def __init__(self, robot):
        self._sockets, self.orders = robot.controller.programs.sockets, []

    def take(self):
        self.orders += self._sockets.orders
        self._sockets.orders.clear()

    def tell(self, change, data=b"", number=1):
        self._sockets.hear(SocketEvent(number, change, data))

    def of(self, kind):
        self.take()
        return [order for order in self.orders if isinstance(order, kind)]

    @property
    def sent(self):
        return b"".join(order.data for order in self.of(Send))

    def expire(self):
        """Let the wall time of the waits that ask for it pass."""
        for order in self.of(Expire):
            self.tell("expired", number=order.wait)


def opened(*lines):
    """Return a robot whose program has an open socket and continues with these lines."""
    robot = a_robot()
    far = Far(robot)
    start(robot, OPENS, *lines)
    robot.tick()
    far.tell("opened")
    return robot, far


def ints(*values):
    return pack(f">{len(values)}i", *values)


def test_socket_open_connects_and_returns_the_result():
    robot = a_robot()
    far = Far(robot)
    text = script('textmsg(socket_open("host.local", 30, "one"))', 'textmsg(socket_open("h", 7, "two"))')
    robot.controller.receive(ProgramRun(token=robot.token, text=text), origin="10.0.0.9")
    robot.tick(20)
    assert far.of(Open) == [Open(1, "10.0.0.9", "host.local", 30)]
    far.tell("opened")
    robot.tick()
    far.tell("failed", number=2)
    assert said(finish(robot)) == ["True", "False"]
    assert robot.warnings() == ['socket_open: "two" has no connection to h port 7']
    assert {order.socket for order in far.of(Close)} == {1, 2}


def test_a_program_played_by_another_machine_has_no_origin():
    robot = a_robot()
    far = Far(robot)
    text = script(OPENS)
    robot.controller.receive(ProgramLoad(name="cell.urp", text=text), origin="10.0.0.9")
    for origin in ("10.0.0.9", "127.0.0.1"):
        robot.controller.receive(ProgramPlay(token=robot.token), origin=origin)
        robot.tick()
        robot.send(ProgramStop)
    robot.controller.receive(ProgramLoad(name="cell.urp"), origin="127.0.0.1")
    robot.controller.receive(ProgramPlay(token=robot.token), origin="127.0.0.1")
    robot.tick()
    assert [order.origin for order in far.of(Open)] == ["10.0.0.9", None, None]


@settings(max_examples=20, deadline=None)
@given(
    st.lists(
        st.one_of(
            st.lists(st.integers(-(2**31), 2**31 - 1), min_size=1, max_size=5),
            st.text(st.characters(codec="ascii", exclude_characters="\n\r\0"), min_size=1, max_size=9),
        ),
        min_size=1,
        max_size=6,
    ),
    st.data(),
)
def test_messages_are_read_once_and_whole_however_the_bytes_are_split(messages, data):
    lines, stream, expected = [], b"", []
    for message in messages:
        if isinstance(message, list):
            lines.append(f"textmsg(socket_read_binary_integer({len(message)}, timeout=0))")
            stream += ints(*message)
            expected.append(str([len(message), *message]))
        else:
            lines.append("textmsg(socket_read_line(timeout=0))")
            stream += message.encode() + data.draw(st.sampled_from([b"\n", b"\r\n"]))
            expected.append(message)
    robot, far = opened(*lines)
    size_of_all = len(stream)
    while stream:
        size = data.draw(st.integers(1, len(stream)))
        far.tell("received", stream[:size])
        stream = stream[size:]
        robot.tick(data.draw(st.integers(0, 3)))
    assert said(finish(robot)) == expected
    assert sum(order.amount for order in far.of(Taken)) == size_of_all


def test_a_read_times_out_only_after_robot_time_and_wall_time():
    robot, far = opened("textmsg(socket_read_binary_integer(2, timeout=0.02))")
    robot.tick(10)
    assert not far.of(Expire)  # the first tick opened the socket
    robot.tick()
    (expire,) = far.of(Expire)
    assert expire.seconds == 0.02
    robot.tick(500)
    assert playing(robot)
    far.expire()
    assert said(finish(robot)) == ["[0, -1, -1]"]


def test_incomplete_data_stays_for_the_next_read():
    robot, far = opened(*["textmsg(socket_read_binary_integer(2, timeout=0.02))"] * 3)
    robot.tick(20)
    far.tell("received", ints(7, 8) + b"\0\0")
    robot.tick(20)
    far.expire()
    robot.tick(1)
    far.tell("received", b"\0\5" + ints(6))
    assert said(finish(robot)) == ["[2, 7, 8]", "[0, -1, -1]", "[2, 5, 6]"]


def test_a_socket_closed_remotely_returns_received_data_then_failures():
    read = "socket_read_binary_integer(1, timeout=0)"
    robot, far = opened(f"textmsg({read})", "i = 0", f"while i < 100:\n if {read}[0] <= 0:\n i = i + 1\n end\n end",
                        'textmsg(socket_send_string("x"))')  # fmt: skip
    far.tell("received", ints(4) + b"\1")
    far.tell("closed")
    robot.tick(90)
    assert playing(robot)
    assert said(finish(robot, 40)) == ["[1, 4]", "False"]
    assert not far.sent
    assert failure(robot) is None


def test_a_flood_of_received_data_does_not_block_a_tick():
    robot, far = opened("while True:", "  socket_read_binary_integer(1, timeout=0)", "end")
    for _ in range(200):
        far.tell("received", bytes(4000))
        robot.tick()
    assert playing(robot)
    assert 200 * 4 * 20 < sum(order.amount for order in far.of(Taken)) < 200 * 4000


SENDS = {
    "socket_send_int(-2)": b"\xff\xff\xff\xfe",
    "socket_send_byte(200)": b"\xc8",
    "socket_send_byte(-1)": b"\xff",
    'socket_send_line("a")': b"a\n",
    "socket_send_string([1, 2.5])": b"[1, 2.5]",
    'socket_set_var("POS", 7)': b"SET POS 7\n",
}


def test_send_functions_send_the_expected_bytes():
    robot, far = opened(*SENDS)
    finish(robot)
    assert [order.data for order in far.of(Send)] == [*SENDS.values()]


@pytest.mark.parametrize(("call", "received", "value"), [
    ("socket_read_ascii_float(2)", b"( 1.5 , -2e-1 )", "[2, 1.5, -0.2]"),
    ("socket_read_ascii_float(2)", b"(1.5)", "[0, nan, nan]"),
    ("socket_read_ascii_float(1)", b"(1.5", None),
    pytest.param("socket_read_ascii_float(1)", b"(" + b"1" * 60_000 + b"x)", "[0, nan]", id="a long number"),
    ("socket_read_line()", b"one\r\ntwo\n", "one"),
    ("socket_read_string()", b"a\nb", "a\nb"),
    ('socket_read_string(prefix=" >", suffix="<")', b"xx>hello<>world<", "hello"),
    (r'socket_read_string(suffix="\n", interpret_escape=True)', b"a b\nc", "a b"),
    ('socket_get_var("POS")', b"POS 12\n", "12"),
    ('socket_get_var("POS")', b"VEL 12\n", "0"),
    ('socket_get_var("POS")', b"\r\n\nPOS 12\n", "12"),
])  # fmt: skip
def test_read_functions_parse_received_bytes(call, received, value):
    robot, far = opened(f"textmsg({call})")
    far.tell("received", received)
    robot.tick(3)
    assert said(robot) == ([] if value is None else [value])
    assert far.sent == (b"GET POS\n" if "get_var" in call else b"")


def test_the_number_of_open_sockets_is_limited():
    robot = a_robot()
    far = Far(robot)
    start(robot, "i = 0", "while True:", '  socket_open("h", 1, to_str(i))', "  i = i + 1", "end")
    for number in range(1, 17):
        robot.tick(2)
        far.tell("opened", number=number)
    finish(robot)
    assert "16 open sockets" in failure(robot).why
    assert len(far.of(Close)) == 16


def test_the_end_of_a_program_closes_its_sockets():
    robot, far = opened("socket_read_line(timeout=0)")
    robot.tick(5)
    robot.send(ProgramStop)
    assert far.of(Close) == [Close(1)]
    waits, ended = ({order.wait for order in far.of(kind)} for kind in (Wait, Waited))
    assert waits == ended
    far.tell("received", b"late\n")
    robot.tick()


MOVES = (
    "q = [-1.60, -1.727, -2.203, -0.808, 1.595, -0.031]",
    "i = 0",
    "while i < 3:",
    "  q[0] = q[0] + 0.2 * socket_read_binary_integer(1, timeout=1)[1]",
    "  movej(q, r=0.02)",
    "  socket_send_int(i)",
    "  i = i + 1",
    "end",
    "movej(q)",
)


def test_received_moves_are_one_path_and_sends_between_them_wait_for_the_blends():
    robot, far = opened(*MOVES)
    far.tell("received", ints(1, 1, 1))
    robot.tick(5)
    assert not far.sent
    finish(robot)
    assert robot.kinds().count("motion_started") == 1
    assert far.sent == ints(0, 1, 2)


STEPS = st.lists(
    st.one_of(
        st.tuples(st.just("tick"), st.integers(1, 30)),
        st.tuples(st.just("received"), st.binary(min_size=1, max_size=12)),
        st.tuples(st.sampled_from(["opened", "closed", "failed", "expired"]), st.integers(1, 6)),
        st.tuples(st.just("stop"), st.none()),
    ),
    max_size=40,
)
CALLS = st.lists(
    st.sampled_from([
        OPENS, 'socket_open("h", 1, "b")', "socket_close()", 'socket_close("b")', "socket_send_int(1)", "sync()",
        "socket_read_binary_integer(2, timeout=0.01)", 'socket_read_line("b", timeout=0.004)', "run beside()",
        'socket_send_line("x", "b")', 'socket_get_var("x")',
    ]),
    min_size=1, max_size=12,
)  # fmt: skip


@settings(max_examples=60, deadline=None)
@given(CALLS, CALLS, STEPS)
def test_socket_orders_are_consistent_for_random_programs(calls, beside, steps):
    robot = a_robot()
    far = Far(robot)
    start(robot, "thread beside():", *beside, "end", "while True:", *calls, "sync()", "end")
    for what, value in steps:
        if what == "tick":
            robot.tick(value)
        elif what == "stop":
            robot.send(ProgramStop)
        elif what == "received":
            far.tell("received", value, 1)
            far.tell("received", value, 2)
        else:
            far.tell(what, number=value)
    robot.send(ProgramStop)
    far.take()
    live, waits = left_open(far.orders)
    assert not live
    assert not waits


def left_open(orders):
    """Return the sockets and waits that remain after consistent orders."""
    live, waits = set(), set()
    for order in orders:
        match order:
            case Open():
                assert order.socket not in live
                live.add(order.socket)
            case Close():
                live.remove(order.socket)
            case Send() | Taken():
                assert order.socket in live
            case Wait():
                waits.add(order.wait)
            case Waited():
                waits.remove(order.wait)
            case Expire():
                assert order.wait in waits
    return live, waits
