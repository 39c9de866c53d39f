"""Motions are found with and without events."""

import numpy as np
import pytest

from tvist_lab.metrics import MotionRows, motions

TICKS = 1500


def steps(*spans):
    """A joint that moves by 1 rad in each span of ticks, at constant speed."""
    tick = np.arange(TICKS)
    return sum(np.clip((tick - start) / (stop - start), 0.0, 1.0) for start, stop in spans)


def test_a_motion_shows_in_the_reference_from_its_last_tick_at_rest_to_its_last_tick_that_moves(one_motion):
    assert motions(one_motion()) == [MotionRows(100, 500, 501, 1500)]


def test_durations_are_those_of_each_signal_and_the_published_tick_is_no_delay(one_motion):
    recording = one_motion(shaped_ticks=37)
    (motion,) = motions(recording)
    assert motion.duration(recording) == pytest.approx(0.8)
    assert motion.shaped_duration(recording) == pytest.approx(0.8 + 0.074)
    assert motion.delay(recording) == pytest.approx(0.074)


def test_an_unshaped_motion_has_no_delay(one_motion):
    recording = one_motion()
    assert motions(recording)[0].delay(recording) == 0.0


def test_the_stop_is_where_the_reference_moves_by_more_than_a_tenth_of_a_microradian(make_recording):
    reference = steps((100, 500))
    reference[501:] += 2e-7
    reference[502:] += 0.5e-7
    (motion,) = motions(make_recording(reference, reference))
    assert motion.reference_stop == 501


def test_events_tell_motions_apart_that_follow_each_other_at_once(make_recording, event):
    reference = steps((100, 500), (501, 900))
    recording = make_recording(
        reference,
        np.roll(reference, 1),
        events=[
            event(101, "motion_started", 1),
            event(501, "motion_done", 1),
            event(502, "motion_started", 2),
            event(901, "motion_done", 2),
        ],
    )
    first, second = motions(recording)
    assert (first.start, first.reference_stop, first.id) == (100, 500, 1)
    assert (second.start, second.reference_stop, second.id) == (501, 900, 2)
    assert first.end == second.start + 1


@pytest.mark.parametrize("early", [0, 1])
def test_with_and_without_events_the_same_motion_is_found(one_motion, event, early):
    plain = one_motion(shaped_ticks=30)
    told = one_motion(
        shaped_ticks=30, events=[event(101 - early, "motion_started", 7), event(531, "motion_done", 7)]
    )
    (a,), (b,) = motions(plain), motions(told)
    assert (a.start, a.reference_stop, a.shaped_stop, a.end) == (
        b.start,
        b.reference_stop,
        b.shaped_stop,
        b.end,
    )


def test_a_stopped_motion_says_so_and_one_that_goes_nowhere_is_none(one_motion, event):
    events = [event(50, "motion_started", 1), event(51, "motion_done", 1)]
    events += [event(101, "motion_started", 2), event(505, "motion_stopped", 2)]
    (motion,) = motions(one_motion(events=events))
    assert motion.id == 2
    assert motion.stopped


def test_a_moment_of_rest_as_in_a_reversal_does_not_split_a_motion(make_recording):
    reference = steps((100, 300)) - steps((303, 500))
    assert len(motions(make_recording(reference, reference))) == 1


def test_motions_with_rest_between_them_are_apart(make_recording):
    reference = steps((100, 300), (400, 500))
    found = motions(make_recording(reference, reference))
    assert [(motion.start, motion.reference_stop, motion.end) for motion in found] == [
        (100, 300, 401),
        (400, 500, 1500),
    ]


def test_a_simulation_put_elsewhere_is_no_motion_and_ends_the_one_before(make_recording):
    reference = steps((100, 500))
    reference[1000:] -= 0.7
    (motion,) = motions(make_recording(reference, np.roll(reference, 1)))
    assert motion == MotionRows(100, 500, 501, 1000)


def test_times_hold_where_ticks_are_missing(one_motion):
    recording = one_motion(shaped_ticks=20)
    kept = np.delete(np.arange(TICKS), np.arange(200, 260))
    thinned = type(recording)({name: column[kept] for name, column in recording.columns.items()})
    (motion,) = motions(thinned)
    assert motion.duration(thinned) == pytest.approx(0.8)
    assert motion.delay(thinned) == pytest.approx(0.040)


def test_a_robot_at_rest_has_no_motions(make_recording):
    assert motions(make_recording()) == []
    assert motions(make_recording(ticks=1)) == []
