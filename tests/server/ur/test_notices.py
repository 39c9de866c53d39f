"""Lines on the console: one a second, and none is lost without being counted."""

import asyncio

from tvist_server.gateways.ur.throttled_log import LINE_INTERVAL, ThrottledLog


async def test_a_flood_is_a_line_a_second_with_the_number_of_those_left_out(later):
    async def passed():
        later(LINE_INTERVAL)
        await asyncio.sleep(0)
        await asyncio.sleep(0)

    said = []
    notices = ThrottledLog(said.append)
    for number in range(1000):
        notices.tell(f"line {number}")
    assert said == ["line 0"]
    await passed()
    assert said[1:] == ["line 999 (not shown since the last line: 998)"]
    notices.tell("one more")
    assert len(said) == 2  # the line before it was said just now
    await passed()
    assert said[2:] == ["one more"]
    await passed()
    for line in ("at once", "not shown", "at the end"):
        notices.tell(line)
    notices.flush()
    notices.flush()
    assert said[3:] == ["at once", "at the end (not shown since the last line: 1)"]
