"""E(t) drawn by hand gives the times and the overshoot it was drawn with."""

import numpy as np
import pytest

from tvist_lab.metrics import NotMeasurableError, attained_position, distance, motions, settling

TICKS = 1500
END = np.array([0.3, -0.2, 0.5])


def along(E, direction=(0.0, 0.0, 1.0)):
    """Positions at signed distances E from the end."""
    return END + np.outer(E, np.array(direction) / np.linalg.norm(direction))


def drawn(points):
    """E over ticks, straight between points (tick, E)."""
    ticks, values = zip(*points, strict=True)
    return np.interp(np.arange(TICKS), ticks, values)


def taken(one_motion, E, **columns):
    recording = one_motion(position=along(E, (1.0, 2.0, -1.0)), **columns)
    return recording, motions(recording)[0]


# Enters the band (0.03 mm) between ticks 550 and 551, leaves it, and stays in it from between 700 and 701 on.
ONE_SWING = [
    (100, 0.5),
    (550, 4e-5),
    (551, 2e-5),
    (600, 1e-5),
    (650, 2e-4),
    (700, 5e-5),
    (701, 1e-5),
    (800, 0.0),
]


def test_times_and_overshoot_of_one_swing_out_of_the_band_are_read_between_ticks(one_motion):
    settled = settling(*taken(one_motion, drawn(ONE_SWING)))
    assert settled.enter == pytest.approx((550.5 - 100) * 0.002, abs=1e-6)
    assert settled.cycle == pytest.approx((700.5 - 100) * 0.002, abs=1e-6)
    assert settled.stabilisation == pytest.approx(150 * 0.002, abs=2e-6)
    assert settled.overshoot == pytest.approx(2e-4)
    np.testing.assert_allclose(settled.attained, END, atol=1e-9)


def test_a_tool_that_stays_in_the_band_needs_no_stabilisation_and_has_no_overshoot(one_motion):
    settled = settling(
        *taken(one_motion, drawn([(100, 0.5), (550, 4e-5), (551, 2e-5), (560, 2.5e-5), (700, 0.0)]))
    )
    assert settled.stabilisation == 0.0
    assert settled.overshoot == 0.0
    assert settled.cycle == settled.enter


def test_a_pass_through_the_end_counts_as_overshoot_on_the_other_side(one_motion):
    E = drawn([(100, -0.5), (540, -1e-4), (548, 3e-4), (600, 0.0)])
    settled = settling(*taken(one_motion, E))
    assert settled.overshoot == pytest.approx(3e-4)
    assert settled.stabilisation > 0.05


def test_times_count_from_the_start_of_the_reference_before_shaping(one_motion):
    plain = settling(*taken(one_motion, drawn(ONE_SWING)))
    delayed = settling(*taken(one_motion, drawn(ONE_SWING), shaped_ticks=37))
    assert delayed.cycle == plain.cycle


def test_the_attained_position_is_the_mean_of_the_last_samples_not_the_last_one(one_motion):
    E = drawn([(100, 0.5), (600, 0.0)]) + 1e-5 * (np.arange(TICKS) % 2 - 0.5)
    recording, motion = taken(one_motion, E)
    np.testing.assert_allclose(attained_position(recording, motion), END, atol=1e-9)
    assert distance(recording, motion)[-1] == pytest.approx(0.5e-5, abs=1e-9)


def test_a_tool_that_still_swings_when_the_rest_ends_is_not_measurable(one_motion):
    E = drawn([(100, 0.5), (600, 0.0)]) + 1e-4 * np.sin(0.1 * np.arange(TICKS))
    with pytest.raises(NotMeasurableError, match=r"not settled within 0\.03 mm"):
        settling(*taken(one_motion, E))


def test_too_little_rest_is_not_measurable(one_motion):
    recording = one_motion(ticks=560)
    with pytest.raises(NotMeasurableError, match="at rest for less than"):
        settling(recording, motions(recording)[0])


def test_a_motion_that_does_not_leave_the_band_is_not_measurable(one_motion):
    with pytest.raises(NotMeasurableError, match="moved by less than"):
        settling(*taken(one_motion, np.zeros(TICKS)))
