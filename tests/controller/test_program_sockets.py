"""Sockets of programs: nothing that arrives is lost, and a time-out needs robot time and wall time."""

from struct import pack

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tvist_controller.programs.sockets import (
    Close,
    Expire,
    Open,
    Send,
    SocketNews,
    Taken,
    Wait,
    Waited,
)
from tvist_protocol.programs import ProgramLoad, ProgramPlay, ProgramRun, ProgramStop

from .scripts import a_robot, failure, finish, playing, run, said, script, start

OPENS = 'socket_open("10.0.0.2", 50001)'


class Far:
    """The other end of a program's sockets: `orders` are those so far, `tell` brings news before the next tick."""

    def __init__(self, robot):
        self._robot, self.orders = robot, []

    @property
    def _sockets(self):
        return self._robot.controller.programs.sockets

    def take(self):
        """Orders since the last call."""
        new = list(self._sockets.orders)
        self._sockets.orders.clear()
        self.orders += new
        return new

    def tell(self, change, data=b"", number=1):
        self._sockets.hear(SocketNews(number, change, data))

    def of(self, kind):
        self.take()
        return [order for order in self.orders if isinstance(order, kind)]

    @property
    def sent(self):
        return b"".join(order.data for order in self.of(Send))

    def expire(self):
        """Let the wall time of the waits pass that ask for it."""
        for order in self.of(Expire):
            self.tell("expired", number=order.wait)


def opened(*lines):
    """A robot whose program has an open socket, and goes on with these lines."""
    robot = a_robot()
    far = Far(robot)
    start(robot, OPENS, *lines)
    robot.tick()
    far.tell("opened")
    return robot, far


def ints(*values):
    return pack(f">{len(values)}i", *values)


def test_a_program_connects_to_where_it_says_and_gets_the_answer():
    robot = a_robot()
    far = Far(robot)
    text = script('textmsg(socket_open("host.local", 30, "one"))', 'textmsg(socket_open("h", 7, "two"))')
    robot.controller.receive(ProgramRun(token=robot.token, text=text), origin="10.0.0.9")
    robot.tick(20)
    assert far.of(Open) == [Open(1, "10.0.0.9", "host.local", 30)]
    far.tell("opened")
    robot.tick()
    far.tell("failed", number=2)
    finish(robot)
    assert said(robot) == ["True", "False"]
    assert [event.why for event in robot.events if event.kind == "warning"] == [
        'socket_open: "two" has no connection to h port 7'
    ]
    assert {order.socket for order in far.of(Close)} == {1, 2}


def test_who_plays_the_program_of_another_machine_does_not_lend_it_an_address():
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


@settings(max_examples=30, deadline=None)
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
def test_however_the_bytes_are_cut_each_message_is_read_whole_and_once(messages, data):
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
    finish(robot)
    assert said(robot) == expected
    assert sum(order.amount for order in far.of(Taken)) == size_of_all


def test_a_read_ends_only_after_its_robot_time_and_its_wall_time():
    robot, far = opened("textmsg(socket_read_binary_integer(2, timeout=0.02))")
    robot.tick(10)
    assert not far.of(Expire)  # the first tick opened the socket
    robot.tick()
    (expire,) = far.of(Expire)
    assert expire.seconds == 0.02
    robot.tick(500)
    assert playing(robot)
    far.expire()
    finish(robot)
    assert said(robot) == ["[0, -1, -1]"]


def test_what_arrives_before_the_wall_time_is_over_counts_and_a_part_stays_for_the_next_read():
    robot, far = opened(*["textmsg(socket_read_binary_integer(2, timeout=0.02))"] * 3)
    robot.tick(20)
    far.tell("received", ints(7, 8) + b"\0\0")
    robot.tick(20)
    far.expire()
    robot.tick(1)
    far.tell("received", b"\0\5" + ints(6))
    finish(robot)
    assert said(robot) == ["[2, 7, 8]", "[0, -1, -1]", "[2, 5, 6]"]


def test_the_end_of_an_earlier_wait_does_not_end_a_later_one():
    robot, far = opened(
        "textmsg(socket_read_binary_integer(1, timeout=0.02))",
        "textmsg(socket_read_binary_integer(1, timeout=9))",
    )
    robot.tick(30)
    (expire,) = far.of(Expire)
    far.tell("received", ints(1))
    robot.tick()
    far.tell("expired", number=expire.wait)
    robot.tick(300)
    assert playing(robot)
    far.tell("received", ints(2))
    finish(robot)
    assert said(robot) == ["[1, 1]", "[1, 2]"]


@pytest.mark.parametrize("timeout", [0, -1])
def test_without_a_time_out_a_read_waits_for_ever(timeout):
    robot, far = opened(f"textmsg(socket_read_byte_list(1, timeout={timeout}))")
    robot.tick(3000)
    assert playing(robot)
    assert not far.of(Expire)
    far.tell("received", b"\x80")
    finish(robot)
    assert said(robot) == ["[1, 128]"]


def test_a_socket_that_is_closed_from_outside_gives_what_it_has_received_and_then_failures_that_take_time():
    robot, far = opened(
        "textmsg(socket_read_binary_integer(1, timeout=0))",
        "i = 0",
        "while i < 100:",
        "  if socket_read_binary_integer(1, timeout=0)[0] <= 0:",
        "    i = i + 1",
        "  end",
        "end",
        'textmsg(socket_send_string("x"))',
    )
    far.tell("received", ints(4) + b"\1")
    far.tell("closed")
    robot.tick(90)
    assert playing(robot)
    finish(robot, 40)
    assert said(robot) == ["[1, 4]", "False"]
    assert not far.sent
    assert failure(robot) is None


def test_a_socket_that_was_never_opened_reads_nothing_and_sends_nothing():
    robot = run(a_robot(), 'textmsg(socket_read_string("other"))', 'textmsg(socket_send_int(1, "other"))')
    assert said(robot) == ["", "False"]


def test_a_client_that_sends_more_than_a_program_reads_in_a_tick_is_no_endless_loop():
    robot, far = opened("while True:", "  socket_read_binary_integer(1, timeout=0)", "end")
    for _ in range(200):
        far.tell("received", bytes(4000))
        robot.tick()
    assert playing(robot)
    far.take()
    read = sum(order.amount for order in far.orders if isinstance(order, Taken))
    assert 200 * 4 * 20 < read < 200 * 4000


@pytest.mark.parametrize(
    ("call", "sent"),
    [
        ("socket_send_int(-2)", b"\xff\xff\xff\xfe"),
        ("socket_send_byte(200)", b"\xc8"),
        ("socket_send_byte(-1)", b"\xff"),
        ('socket_send_line("a")', b"a\n"),
        ("socket_send_string([1, 2.5])", b"[1, 2.5]"),
        ('socket_set_var("POS", 7)', b"SET POS 7\n"),
    ],
)
def test_what_is_sent(call, sent):
    robot, far = opened(call)
    finish(robot)
    assert far.sent == sent


@pytest.mark.parametrize(
    ("call", "received", "value"),
    [
        ("socket_read_ascii_float(2)", b"( 1.5 , -2e-1 )", "[2, 1.5, -0.2]"),
        ("socket_read_ascii_float(2)", b"(1.5)", "[0, nan, nan]"),
        ("socket_read_ascii_float(1)", b"(1.5", None),
        pytest.param(
            "socket_read_ascii_float(1)", b"(" + b"1" * 60_000 + b"x)", "[0, nan]", id="a long number"
        ),
        ("socket_read_line()", b"one\r\ntwo\n", "one"),
        ("socket_read_string()", b"a\nb", "a\nb"),
        ('socket_read_string(prefix=" >", suffix="<")', b"xx>hello<>world<", "hello"),
        (r'socket_read_string(suffix="\n", interpret_escape=True)', b"a b\nc", "a b"),
        ('socket_get_var("POS")', b"POS 12\n", "12"),
        ('socket_get_var("POS")', b"VEL 12\n", "0"),
        ('socket_get_var("POS")', b"\r\n\nPOS 12\n", "12"),
    ],
)
def test_what_is_read(call, received, value):
    robot, far = opened(f"textmsg({call})")
    far.tell("received", received)
    robot.tick(3)
    assert said(robot) == ([] if value is None else [value])
    if "get_var" in call:
        assert far.sent == b"GET POS\n"


@pytest.mark.parametrize(
    "parts", [[b"(1, 2)\nPOS 3\nabc\n"], [b"(1, 2)\r\nPOS 3\nabc\n"], [b"(1, 2)", b"\nPOS 3\nabc\n"]]
)
def test_the_end_of_a_line_of_numbers_is_no_answer_to_what_is_asked_next(parts):
    robot, far = opened(
        "textmsg(socket_read_ascii_float(2))", 'textmsg(socket_get_var("POS"))', "textmsg(socket_read_line())"
    )
    for part in parts:
        far.tell("received", part)
        robot.tick(3)
    assert said(robot) == ["[2, 1, 2]", "3", "abc"]


def test_a_number_names_the_same_socket_as_its_text_and_another_value_names_none():
    robot = a_robot()
    far = Far(robot)
    start(robot, 'socket_open("h", 7, 3)', 'socket_set_var("ACT", 1, "3")', "socket_send_int(5, 3)", "socket_close(4)",
          'textmsg(socket_get_var("POS", 3))', "socket_close(True)")  # fmt: skip
    robot.tick()
    far.tell("opened")
    robot.tick(2)
    far.tell("received", b"POS 8\n")
    finish(robot)
    assert (far.sent, said(robot)) == (b"SET ACT 1\n" + ints(5) + b"GET POS\n", ["8"])
    assert "socket_name is True: it must be a text" in failure(robot).why


def test_a_name_that_is_not_utf_8_can_be_told():
    robot, far = opened("x = socket_read_string()", "socket_open(x, 5, x)")
    far.tell("received", b"\xff\xfe")
    robot.tick(2)
    far.tell("failed", number=2)
    finish(robot)
    assert all(event.why is None or event.why.encode() for event in robot.events)


def test_text_that_follows_a_suffix_stays():
    robot, far = opened(*['textmsg(socket_read_string(prefix=">", suffix="<"))'] * 2)
    far.tell("received", b">hello<>world<")
    finish(robot)
    assert said(robot) == ["hello", "world"]


@pytest.mark.parametrize(
    ("call", "why"),
    [
        ('socket_open("h", 70000)', "port is 70000"),
        ("socket_open(1, 1)", "address is 1"),
        ("socket_read_binary_integer(31)", "number is 31"),
        ("socket_send_int(2147483648)", "value is"),
        ("socket_read_line(timeout=[])", "timeout"),
    ],
)
def test_what_cannot_be_called_is_an_error_at_its_place(call, why):
    robot = run(a_robot(), call)
    assert why in failure(robot).why
    assert failure(robot).line == 2


def test_a_program_has_so_many_sockets_and_no_more():
    robot = a_robot()
    far = Far(robot)
    start(robot, "i = 0", "while True:", '  socket_open("h", 1, to_str(i))', "  i = i + 1", "end")
    for number in range(1, 17):
        robot.tick(2)
        far.tell("opened", number=number)
    finish(robot)
    assert "16 open sockets" in failure(robot).why
    assert len(far.of(Close)) == 16


def test_the_end_of_a_program_closes_its_sockets_at_once():
    robot, far = opened("socket_read_line(timeout=0)")
    robot.tick(5)
    robot.send(ProgramStop)
    assert far.of(Close) == [Close(1)]
    waits, ended = ({order.wait for order in far.of(kind)} for kind in (Wait, Waited))
    assert waits == ended
    far.tell("received", b"late\n")
    robot.tick()


def test_two_threads_share_a_socket_and_a_killed_one_waits_no_more():
    robot, far = opened(
        "global got = 0",
        "thread one():",
        "  got = socket_read_binary_integer(1, timeout=0)",
        "end",
        "h = run one()",
        "sleep(0.1)",
        "kill h",
        "textmsg(socket_read_binary_integer(1, timeout=0))",
        "textmsg(got)",
    )
    robot.tick(80)
    far.tell("received", ints(9))
    finish(robot)
    assert said(robot) == ["[1, 9]", "0"]


def test_a_socket_that_one_thread_closes_ends_the_read_of_another():
    robot, far = opened(
        "thread one():",
        "  sleep(0.05)",
        "  socket_close()",
        "end",
        "run one()",
        "textmsg(socket_read_binary_integer(1, timeout=0))",
    )
    far.tell("received", b"\0")
    finish(robot, 60)
    assert said(robot) == ["[0, -1]"]
    assert far.of(Close) == [Close(1)]


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


def motions(robot):
    return robot.kinds().count("motion_started")


def test_moves_whose_targets_have_arrived_are_one_path_and_what_is_sent_between_waits_for_the_blends():
    robot, far = opened(*MOVES)
    far.tell("received", ints(1, 1, 1))
    robot.tick(5)
    assert not far.sent
    finish(robot)
    assert motions(robot) == 1
    assert far.sent == ints(0, 1, 2)


def test_a_target_that_comes_soon_is_waited_for_and_one_that_comes_on_the_way_is_blended_too():
    robot, far = opened(*MOVES)
    far.tell("received", ints(1))
    robot.tick(20)
    far.tell("received", ints(1))
    robot.tick(20)
    assert motions(robot) == 0
    robot.tick(60)
    assert motions(robot) == 1
    far.tell("received", ints(1))
    finish(robot)
    assert motions(robot) == 1
    assert far.sent == ints(0, 1, 2)


def test_a_target_that_comes_when_the_arm_has_stopped_begins_another_motion():
    robot, far = opened(*MOVES)
    far.tell("received", ints(1))
    robot.tick(600)
    assert motions(robot) == 1
    assert far.sent == ints(0)
    far.tell("received", ints(1, 1))
    finish(robot)
    assert motions(robot) == 2
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
    st.sampled_from(
        [
            OPENS,
            'socket_open("h", 1, "b")',
            "socket_close()",
            'socket_close("b")',
            "socket_read_binary_integer(2, timeout=0.01)",
            'socket_read_line("b", timeout=0.004)',
            "socket_send_int(1)",
            'socket_send_line("x", "b")',
            "run beside()",
            "sync()",
            'socket_get_var("x")',
        ]
    ),
    min_size=1,
    max_size=12,
)


@settings(max_examples=60, deadline=None)
@given(CALLS, CALLS, STEPS)
def test_whatever_happens_the_network_is_asked_only_for_what_it_can_do(calls, beside, steps):
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
    """Sockets and waits that orders leave behind, which fit each other."""
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


def test_numbers_that_did_not_come_equal_nothing():
    robot, far = opened("x = socket_read_ascii_float(2)", "textmsg(x[1] == x[1])")
    far.tell("received", b"()")
    finish(robot)
    assert said(robot) == ["False"]
