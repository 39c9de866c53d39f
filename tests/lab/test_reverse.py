"""What `tvist bench --reverse` counts: messages, time-outs and gaps, of a robot's program and of a bare process."""

from hypothesis import given
from hypothesis import strategies as st
from tests.examples import examples

from tvist_lab.benchmark.bare_robot import BareRobot
from tvist_lab.benchmark.reverse import alone
from tvist_lab.benchmark.reverse_client import MESSAGE, SAMPLE, Exchange

TIMEOUT = 0.02
STEPS = st.lists(
    st.tuples(st.floats(0.001, 0.1), st.integers(0, 3), st.integers(0, 3)), min_size=1, max_size=40
)
"""Time since the sample before, and how many time-outs and messages it tells of."""


def message(number, timeout=TIMEOUT):
    return MESSAGE.pack(round(1000 * timeout), *range(6), number)


@examples(100)
@given(STEPS, STEPS)
def test_what_was_before_the_counting_does_not_count(before, steps):
    exchange, now, timeouts, last = Exchange(), 100.0, 0, 1
    exchange.take(now, timeouts, last)
    new, gaps = now, []
    for number, (passed, more_timeouts, more) in enumerate([*before, *steps]):
        if number == len(before):
            exchange.begin()
        now, timeouts, last = now + passed, timeouts + more_timeouts, last + more
        exchange.take(now, timeouts, last)
        if more:
            gaps += [now - new] if number >= len(before) else []
            new = now
    assert exchange.messages == sum(more for _, _, more in steps)
    assert len(exchange.timeouts) == sum(more for _, more, _ in steps)
    assert exchange.longest_gap == max(gaps, default=0.0)


def test_nothing_counts_before_the_first_message_was_read():
    exchange = Exchange()
    exchange.begin()
    exchange.take(1.0, 0, 0)
    assert exchange.samples == 0
    assert exchange.said() == {"messages": 0, "timeouts": [], "longest_gap_s": 0.0}


@examples(100)
@given(st.lists(st.floats(0.001, 0.1), min_size=1, max_size=30))
def test_a_bare_process_counts_a_time_out_for_each_whole_wait_without_a_message(waits):
    robot, now, expected = BareRobot(), 100.0, 0
    robot.take(now, message(1))
    for number, wait in enumerate(waits):
        now += wait
        whole = wait / TIMEOUT
        if abs(whole - round(whole)) < 1e-6:
            return
        expected += int(whole)
        robot.take(now, message(number + 2))
    assert robot.timeouts == expected


@examples(100)
@given(st.lists(st.integers(1, 40), max_size=10))
def test_a_bare_process_reads_the_same_however_the_bytes_are_cut(lengths):
    data = b"".join(message(number + 1) for number in range(3))
    robot, pieces = BareRobot(), []
    for length in lengths:
        pieces.append(data[:length])
        data = data[length:]
    for piece in (*pieces, data):
        robot.take(1.0, piece)
    time, *q, timeouts, last = SAMPLE.unpack(robot.sample(1.5))
    assert (time, q, timeouts, last) == (1.5, list(range(6)), 0, 3)


def test_a_bare_process_has_no_time_out_before_the_first_message():
    robot = BareRobot()
    robot.look(1e6)
    assert robot.timeouts == 0


@examples(100)
@given(st.lists(st.floats(0.0, 10.0), max_size=10), st.lists(st.floats(0.0, 10.0), max_size=10))
def test_time_outs_are_alone_where_the_others_have_none(times, others):
    assert alone(times, []) == len(times)
    assert alone(times, times) == 0
    assert alone(times, [*others, 100.0]) == alone(times, others)
    assert alone(times, others) >= alone(times, [*others, *times[:1]])
    assert alone([*times, 20.0], others) == alone(times, others) + 1
