"""Lines on the console: one a second, and none is lost without being counted."""

import asyncio

import pytest

from tvist_server.gateways.ur.notices import EVERY, Notices


@pytest.fixture
async def later(monkeypatch):
    """Lets the loop's clock jump, and what is due then happen."""
    loop = asyncio.get_running_loop()
    real, jumped = loop.time, [0.0]
    monkeypatch.setattr(loop, "time", lambda: real() + sum(jumped))

    async def jump(seconds):
        jumped.append(seconds)
        await asyncio.sleep(0)
        await asyncio.sleep(0)

    return jump


async def test_a_flood_is_a_line_a_second_with_the_number_of_those_left_out(later):
    said = []
    notices = Notices(said.append)
    for number in range(1000):
        notices.tell(f"line {number}")
    assert said == ["line 0"]
    await later(EVERY)
    assert said[1:] == ["line 999 (not shown since the last line: 998)"]
    notices.tell("one more")
    assert len(said) == 2  # the line before it was said just now
    await later(EVERY)
    assert said[2:] == ["one more"]
    await later(EVERY)
    notices.tell("at once")
    assert said[3:] == ["at once"]


async def test_what_waits_at_the_end_is_said():
    said = []
    notices = Notices(said.append)
    for number in range(3):
        notices.tell(str(number))
    notices.flush()
    notices.flush()
    assert said == ["0", "2 (not shown since the last line: 1)"]
