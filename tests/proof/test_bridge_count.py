"""What a robot's rows show of missed set-points is what the program on it has counted, on any link."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from proof.bridge.count import Count
from tests.examples import examples
from tests.server.followed import Alone, late, packages, swings

from tvist_server.moving import registers as r


@examples(15)
@given(seed=st.integers(0, 2**31))
def test_rows_count_as_the_program_does(seed):
    random, count, robot = np.random.default_rng(seed), Count(), Alone()
    sent = packages(swings(400, 0.4), 400)
    for come in late(random, 400, jitter=random.uniform(0.0, 3.0), stalls=0.03, longest=10):
        for place in come:
            robot.write(*sent[place])
        robot.steps()
        numbers = {place: robot.output(place) for place in (r.STATE, r.PLAYED, r.ALONE, r.LEFT_OUT, r.RUN)}
        row = {f"output_int_register_{place}": (number,) for place, number in numbers.items()}
        newest = {f"input_int_register_{r.NUMBER}": (robot.newest,)}
        count.take([{"timestamp": (robot.tick * 0.002,), **newest, **row}])
    assert count.missing == 0
    run = count.runs[robot.output(r.RUN)]
    assert run.equal
    assert run.alone + len(run.played) <= run.periods
    run.said = run.said[0], run.said[1] + 1
    assert not run.equal
