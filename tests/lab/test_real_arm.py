"""A real UR5 that rings: twenty seconds of a published recording, see `data/NOTICE`."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tvist_lab.metrics import Measured, NotMeasurableError, predicted
from tvist_lab.metrics.vibration import SENSOR
from tvist_lab.recordings import read

RECORDED = Path(__file__).parent / "data" / "ur5_that_rings.csv.gz"
STOPS = {11.406: 11.88, 12.656: 12.83, 15.647: 8.84}
"""End of the target's motion [s], and f_d there [Hz]: by matrix pencils of three orders on three axes, mean of the
repetitions."""


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


@pytest.mark.parametrize(
    "missing", [(), ("target_qd",), ("target_",)], ids=["whole", "no speeds", "no target"]
)
def test_a_real_arms_frequencies_are_right_or_refused_whatever_the_log_lacks(tmp_path, missing):
    results = Measured.of(read(without(tmp_path, *missing) if missing else RECORDED)).results
    assert len(results) == len(STOPS)
    for result, (stop, f_d) in zip(results, STOPS.items(), strict=True):
        assert result.stop_s == pytest.approx(stop, abs=0.03)
        if result.f_d_hz is None:
            assert missing
            assert "f_d_hz" in result.notes
            continue
        low, high = result.f_d_interval_hz
        assert result.f_d_hz == pytest.approx(f_d, rel=0.05)
        assert low * 0.98 <= f_d <= high * 1.02  # the repetitions differ by 1 to 2 %
        assert result.zeta == pytest.approx(0.047, abs=0.015)


def test_its_modes_are_listed_the_strongest_first():
    for result in Measured.of(read(RECORDED)).results:
        assert 1 <= len(result.modes) <= 3
        assert result.modes[0]["f_d_hz"] == result.f_d_hz


def test_two_modes_of_other_repetitions_predict_that_a_fifth_of_a_real_arms_ringing_is_left(measured):
    """Each stop by the modes of the other one at its pose; what one mode leaves is twice that."""
    found = Measured.of(read(RECORDED.with_name("ur5_that_stops_again.csv.gz")))
    one, two = np.array([[each.left_percent for each in predicted(found, place)] for place in range(4)]).T
    measured("one mode leaves [%]", np.median(one))
    measured("two modes leave [%]", np.median(two))
    assert np.all((one > 22.0) & (one < 50.0))
    assert np.median(two) <= 20.0


def test_a_stop_without_repetition_is_not_predicted():
    with pytest.raises(NotMeasurableError, match="no repetition of this motion"):
        predicted(Measured.of(read(RECORDED)), 0)


def test_a_stop_at_which_the_accelerometer_is_frozen_is_not_predicted():
    found = Measured.of(read(RECORDED.with_name("ur5_that_stops_again.csv.gz")))
    felt = found.recording[SENSOR].copy()
    rows = slice(found.motions[0].start, found.motions[0].end)
    felt[rows] = (0.0, 0.0, 9.75)
    frozen = replace(found.recording, columns={**found.recording.columns, SENSOR: felt})
    with pytest.raises(NotMeasurableError, match="felt nothing"):
        predicted(replace(found, recording=frozen), 0)
