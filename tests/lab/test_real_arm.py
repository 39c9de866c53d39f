"""A real UR5 that rings: seven stops of a published recording, see `data/NOTICE`."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tvist_lab.metrics import Measured, NotMeasurableError, predicted
from tvist_lab.metrics.vibration import SENSOR
from tvist_lab.recordings import read

RECORDED = Path(__file__).parent / "data" / "ur5_stops.csv.gz"
A_SLOW, B_SLOW, A_FAST, B_FAST = (13.53, 0.06), (11.88, 0.047), (12.83, 0.044), (8.84, 0.05)
"""f_d [Hz] and ζ by matrix pencils of three orders on three axes, means of the repetitions in several runs."""
STOPS = {
    5.413: B_SLOW,
    8.415: A_SLOW,
    11.406: B_SLOW,
    12.656: A_FAST,
    15.647: B_FAST,
    18.637: A_FAST,
    21.628: B_FAST,
}
"""End of the target's motion [s]."""


def without(folder, *names):
    """The log without columns whose names begin so."""
    log = folder / "log.csv"
    recorded = read(RECORDED)
    kept = [name for name in recorded.columns if not name.startswith(names)]
    columns = {name: np.atleast_2d(recorded[name].T) for name in kept if name != "tick"}
    header = [
        f"{name}_{i}" if len(rows) > 1 else name for name, rows in columns.items() for i in range(len(rows))
    ]
    rows = np.vstack(list(columns.values())).T
    np.savetxt(log, rows, "%.7g", ",", header=",".join(header), comments="")
    return log


@pytest.fixture(scope="module")
def found():
    return Measured.of(read(RECORDED))


@pytest.mark.parametrize(
    "missing", [(), ("target_qd",), ("target_",)], ids=["whole", "no speeds", "no target"]
)
def test_a_real_arms_frequencies_are_right_whatever_the_log_lacks(tmp_path, missing):
    results = Measured.of(read(without(tmp_path, *missing) if missing else RECORDED)).results
    assert len(results) == len(STOPS)
    for result, (stop, (f_d, zeta)) in zip(results, STOPS.items(), strict=True):
        assert result.stop_s == pytest.approx(stop, abs=0.03)
        low, high = result.f_d_interval_hz
        assert result.f_d_hz == pytest.approx(f_d, rel=0.03)
        assert low * 0.99 <= f_d <= high * 1.01  # the repetitions differ by 1 %
        assert result.zeta == pytest.approx(zeta, abs=0.02)


def test_several_modes_are_named_the_strongest_first_and_none_twice(found):
    for result in found.results:
        assert result.modes[0]["f_d_hz"] == result.f_d_hz
        assert 2 <= len(result.modes) <= 3
        f_d = np.sort([mode["f_d_hz"] for mode in result.modes])
        assert np.all(np.diff(f_d) > 1.0)


def test_repetitions_of_a_stop_agree_within_their_intervals(found):
    for stop in (A_FAST, B_FAST, B_SLOW):
        again = [one for one, known in zip(found.results, STOPS.values(), strict=True) if known == stop]
        assert max(one.f_d_interval_hz[0] for one in again) < min(one.f_d_interval_hz[1] for one in again)


def test_two_modes_of_other_repetitions_predict_that_a_sixth_of_a_real_arms_ringing_is_left(found, measured):
    """Each stop by the modes of the other one at its pose; what one mode leaves is twice that."""
    places = [place for place, stop in enumerate(STOPS.values()) if stop != A_SLOW]
    left = [[each.left_percent for each in predicted(found, place)] for place in places]
    one, two = np.array(left).T
    measured("one mode leaves [%]", np.median(one))
    measured("two modes leave [%]", np.median(two))
    assert np.all((one > 22.0) & (one < 50.0))
    assert np.median(two) <= 20.0


def test_a_stop_without_repetition_is_not_predicted(found):
    with pytest.raises(NotMeasurableError, match="no repetition of this motion"):
        predicted(found, list(STOPS.values()).index(A_SLOW))


def test_a_stop_at_which_the_accelerometer_is_frozen_is_not_predicted(found):
    felt = found.recording[SENSOR].copy()
    rows = slice(found.motions[3].start, found.motions[3].end)
    felt[rows] = (0.0, 0.0, 9.75)
    frozen = replace(found.recording, columns={**found.recording.columns, SENSOR: felt})
    with pytest.raises(NotMeasurableError, match="felt nothing"):
        predicted(replace(found, recording=frozen), 3)
