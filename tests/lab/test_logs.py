"""Logs of other robots are measured whatever their format, and refused with the cause and the line."""

import gzip
import re
from functools import cache

import numpy as np
import polars as pl
import pytest
from tests.lab.made_logs import SyntheticLog, text

from tvist_lab.metrics import MeasuredRecording, MotionResult, analyze, compare, grouped_notes, motions
from tvist_lab.recordings import RecordingError, read, table

MODE = (9.0, 0.12, 1.0)


def within(result, f_d=MODE[0], zeta=MODE[1]):
    """Whether frequency and damping are close to the truth; intervals are tested on many draws elsewhere."""
    assert result.f_d_hz == pytest.approx(f_d, rel=0.03), result.notes
    assert result.zeta == pytest.approx(zeta, rel=0.15), result.notes
    assert result.f_d_interval_hz[0] < result.f_d_hz < result.f_d_interval_hz[1]
    assert result.zeta_interval[0] < result.zeta < result.zeta_interval[1]
    return True


def commented(path):
    path.write_text(f"# written by hand\n# {path.read_text()}")
    return path


FORMATS = {
    "commas": lambda log, path: log.csv(path / "log.csv"),
    "a header of NumPy": lambda log, path: commented(log.csv(path / "log.csv", " ", "{:.18e}".format)),
    "six digits": lambda log, path: log.csv(path / "log.csv", ",", "{:.6f}".format),
    "packets of 1116 bytes": lambda log, path: log.dump(path / "dump"),
    "packets of 1220 bytes begun midway": lambda log, path: log.dump(path / "dump", 1220, skip=777, lost=99),
}


@pytest.mark.parametrize(("form", "lag"), [(form, 0.025 * (form != "commas")) for form in FORMATS])
def test_motions_and_modes_are_found_in_every_format(tmp_path, form, lag):
    log = SyntheticLog(lag=lag, motions=1)
    (result,) = analyze(read(FORMATS[form](log, tmp_path)))
    assert [result.start_s, result.stop_s] == pytest.approx([*log.starts, *log.stops], abs=0.012)
    assert within(result)
    assert result.servo_lag_ms == pytest.approx(1e3 * lag, abs=2.0)
    assert result.residual_vibration_m_s2 == pytest.approx(1.0, rel=0.15)


def test_slow_log_is_measured(tmp_path):
    log = SyntheticLog(rate=100.0, lag=0.025, motions=1)
    assert [within(result) for result in analyze(read(log.csv(tmp_path / "log.csv")))] == [True]


def test_rosbag_may_have_any_joint_order_and_slow_joint_states(tmp_path):
    log = SyntheticLog(lag=0.025, motions=1)
    recording = read(log.rosbag(tmp_path / "bag", every=4, order=(5, 0, 3, 1, 4, 2)))
    seen = np.isfinite(recording["actual_q"]).all(axis=1)
    assert recording["actual_q"][seen] == pytest.approx(log.columns["actual_q"][seen], abs=2e-3)
    (result,) = analyze(recording)
    assert within(result)
    assert result.stop_s == pytest.approx(log.stops[0] + 0.025, abs=0.02)


@pytest.fixture(scope="module")
def of_two_motions(tmp_path_factory):
    """Measure a log of two motions without some columns; each is measured once."""

    @cache
    def measured(*without):
        log = SyntheticLog(rate=250.0).without(*without)
        return log, MeasuredRecording.of(read(log.csv(tmp_path_factory.mktemp("log") / "log.csv")))

    return measured


def test_motions_without_a_target_come_from_measured_angles(of_two_motions):
    log, measured = of_two_motions("target_q")
    results = measured.results
    assert [result.stop_s for result in results] == pytest.approx(log.stops, abs=0.03)
    assert all(within(result) for result in results)
    assert "actual_q" in results[0].notes["stop_s"]
    assert results[0].servo_lag_ms is None
    assert "servo_lag_ms" in results[0].notes


def test_missing_columns_give_null_with_a_reason(tmp_path):
    log = SyntheticLog(joints=7, motions=1).without("actual_TCP_pose")
    results = analyze(read(log.csv(tmp_path / "log.csv")))
    assert all(within(result) for result in results)
    for field in ("overshoot_m", "stabilisation_ms", "cycle_ms"):
        assert getattr(results[0], field) is None
        assert "actual_TCP_pose" in results[0].notes[field]
    log = SyntheticLog(motions=1).without("actual_tool_accelerometer")
    (blind,) = analyze(read(log.csv(tmp_path / "blind.csv")))
    for field in ("f_d_hz", "zeta", "residual_vibration_m_s2", "still_after_ms", "peak_m_s2"):
        assert getattr(blind, field) is None
        assert "actual_tool_accelerometer" in blind.notes[field]
    assert blind.cycle_ms is not None


@pytest.mark.parametrize(("lag", "mode"), [(0.0, MODE), (0.04, (7.0, 0.3, 1.5))])
def test_lag_without_measured_angles_comes_from_the_accelerometer(tmp_path, lag, mode):
    log = SyntheticLog(lag=lag, modes=(mode,), motions=1).without("actual_q")
    (result,) = analyze(read(log.csv(tmp_path / "log.csv")))
    assert within(result, *mode[:2])
    assert result.servo_lag_ms == pytest.approx(1e3 * lag, abs=4.0)


def test_rotated_tool_changes_no_result(tmp_path):
    log = SyntheticLog(motions=1)
    before = analyze(read(log.csv(tmp_path / "log.csv")))
    log.columns["actual_TCP_pose"][:, 3:] = [0.3, -1.0, 2.0]
    after = analyze(read(log.csv(tmp_path / "other.csv")))
    assert [result.as_dict() for result in before] == [result.as_dict() for result in after]


def test_missing_rows_do_not_bias_the_fit(tmp_path):
    log = SyntheticLog(lag=0.025, motions=1)
    random = np.random.default_rng(0)
    kept = random.random(len(log.columns["timestamp"])) > 0.2
    kept[1100:1110] = False
    log.columns = {name: column[kept] for name, column in log.columns.items()}
    recording = read(log.csv(tmp_path / "log.csv"))
    assert recording.missing_ticks > 250
    assert any("rows are missing" in note for note in recording.notes)
    assert all(within(result) for result in analyze(recording))


GOOD = SyntheticLog(motions=1).columns


def with_cell(lines, cell, row=300, column=4):
    cells = lines[row].split(",")
    cells[column] = cell
    return [*lines[:row], ",".join(cells), *lines[row + 1 :]]


def test_empty_cell_is_missing_and_not_zero(tmp_path):
    path, lines = tmp_path / "log.csv", text(GOOD)
    place = lines[0].split(",").index("actual_tool_accelerometer_1")
    path.write_text("\n".join(with_cell(lines, "", 700, place)) + "\n")
    recording = read(path)
    assert np.isnan(recording["actual_tool_accelerometer"][699, 1])
    assert all(within(result) for result in analyze(recording))


EDITED = {
    "repeated": (lambda lines: lines[:500] + [lines[499]] * 3 + lines[500:], "3 rows .* line 501"),
    "torn": (lambda lines: [*lines[:800], lines[800][:40], *lines[801:]], "1 torn line .* line 801"),
    "swapped": (
        lambda lines: [*lines[:400], *lines[401:399:-1], *lines[402:900], *lines[901:899:-1], *lines[902:]],
        "2 rows out of order sorted by timestamp, the first in line 402",
    ),
    "cut off": (lambda lines: [*lines[:-1], lines[-1][:-5]], "line 1501 has no end and was left out"),
}  # changes of the lines of a good log without its last line break, and the note on them


@pytest.mark.parametrize("kind", EDITED)
def test_damaged_lines_are_omitted_or_sorted_with_a_note(tmp_path, kind):
    change, words = EDITED[kind]
    path = tmp_path / "log.csv"
    path.write_text("\n".join(change(text(GOOD))))
    recording = read(path)
    assert any(re.search(words, note) for note in recording.notes)
    assert np.all(np.diff(recording.time) > 0)
    rows = np.searchsorted(GOOD["timestamp"], recording.time)
    assert len(rows) >= len(GOOD["timestamp"]) - 1
    assert all(np.array_equal(recording[name], column[rows]) for name, column in GOOD.items())


REFUSED = {
    "goes back": (
        lambda lines: lines + lines[1:300],
        r"line 1502.*goes back from 102.998000 to 100.000000 s",
    ),
    "a word": (lambda lines: with_cell(lines, "north"), r"line 301, column target_q_3: 'north'"),
    "no time": (lambda lines: [line.split(",", 1)[1] for line in lines], "no column timestamp"),
    "a name twice": (lambda lines: [",".join(line.split(",")[:1] * 2) for line in lines], "twice"),
    "no header": (lambda lines: lines[1:], "line 1.*header.*counted from 1: --columns time=1,q=2-7"),
    "only a header": (lambda lines: lines[:1], "no rows"),
    "one row": (lambda lines: lines[:2], "1 row"),
    "time in days": (
        lambda lines: lines[:1] + [f"{5e9 * n},{line.split(',', 1)[1]}" for n, line in enumerate(lines[1:])],
        "it must be in seconds",
    ),
    "no number of a robot": (
        lambda lines: with_cell(lines, "1e308"),
        r"line 301, column target_q_3: 1e\+308",
    ),
    "decimal commas": (lambda lines: [line.replace(".", ",") for line in lines], "decimal comma"),
}  # changes of a good log, and what is said of it then


@pytest.mark.parametrize("kind", REFUSED)
def test_unusable_log_is_refused_with_file_and_line(tmp_path, kind):
    change, words = REFUSED[kind]
    path = tmp_path / "log.csv"
    path.write_text("\n".join(change(text(GOOD))) + "\n")
    with pytest.raises(RecordingError, match=words) as refused:
        read(path)
    assert "log.csv" in str(refused.value)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "is empty"),
        (b"\x89PNG\r\n\x1a\n" + bytes(500), "is no log that tvist reads: "),
        (b"\xff\xfe\xfa\xfb hello", "no text"),
        (
            b"root:x:0:0:Super User:/root:/bin/sh\nmail:x:8:8:mail it:/var/mail:/bin/sh\n",
            "no log.*: its line 1",
        ),
        (b"Dear diary, nothing moved today.\n", "is no log that tvist reads: its line 1"),
    ],
)
def test_files_of_other_kinds_are_refused(tmp_path, content, words):
    path = tmp_path / "other"
    path.write_bytes(content)
    with pytest.raises(RecordingError, match=words):
        read(path)


def test_missing_files_and_folders_without_a_rosbag_are_refused(tmp_path):
    with pytest.raises(RecordingError, match="No such file"):
        read(tmp_path / "none.csv")
    with pytest.raises(RecordingError, match="no MCAP file is there"):
        read(tmp_path)


def test_corresponding_motions_are_compared_and_others_listed(of_two_motions, tmp_path):
    _, loud = of_two_motions()
    log = SyntheticLog(modes=((9.0, 0.12, 0.25),), seed=2, rate=250.0)
    both = compare(loud, MeasuredRecording.of(read(log.csv(tmp_path / "log.csv"))))
    assert [(motion.a, motion.b) for motion in both.motions] == [(1, 1), (2, 2)]
    for motion in both.motions:
        assert motion.impact_percent["residual_vibration"] == pytest.approx(-75.0, abs=8.0)
    short = compare(loud, MeasuredRecording(loud.recording, loud.motions[:1], loud.results[:1]))
    assert [(motion.a, motion.b) for motion in short.motions] == [(1, 1)]
    assert (short.only_in_a, short.only_in_b) == ((2,), ())
    other = read(SyntheticLog(joints=7, motions=1).csv(tmp_path / "seven.csv"))
    seven = compare(loud, MeasuredRecording(other, motions(other), []))
    assert (seven.motions, seven.only_in_a, seven.only_in_b) == ((), (1, 2), (1,))


def test_log_at_rest_has_no_motion(tmp_path):
    assert motions(read(SyntheticLog(motions=0, rest=2.0).csv(tmp_path / "log.csv"))) == []
    assert motions(read(SyntheticLog(motions=0).without("target_q").csv(tmp_path / "log.csv"))) == []


def test_damaged_packet_is_omitted_and_later_ones_are_read(tmp_path):
    path = SyntheticLog(motions=1).dump(tmp_path / "dump")
    data = path.read_bytes()
    path.write_bytes(data[:600_000] + data[600_037:])
    recording = read(path)
    assert len(recording) == len(data) // 1116 - 1
    assert all(within(result) for result in analyze(recording))


def test_csv_may_be_gzipped_but_not_a_decompression_bomb(tmp_path):
    plain = SyntheticLog(motions=1).csv(tmp_path / "log.csv")
    packed = tmp_path / "log.csv.gz"
    packed.write_bytes(gzip.compress(plain.read_bytes()))
    assert np.array_equal(read(packed)["actual_q"], read(plain)["actual_q"])
    packed.write_bytes(gzip.compress(bytes(20 << 20), 9))
    with pytest.raises(RecordingError, match=r"log\.csv\.gz grows beyond 100 times its size"):
        read(packed)
    packed.write_bytes(gzip.compress(plain.read_bytes())[:100_000])
    assert 10 < len(read(packed)) < len(read(plain))


def test_any_names_units_and_separators_are_read(tmp_path):
    log = SyntheticLog(lag=0.025, motions=1)
    expected = read(log.csv(tmp_path / "log.csv"))
    log.columns = {
        "t": 1e3 * log.columns["timestamp"],
        "joint": np.degrees(log.columns["actual_q"]),
        "plan": np.degrees(log.columns["target_q"]),
        "acc": log.columns["actual_tool_accelerometer"] / 9.80665,
    }
    path = log.csv(tmp_path / "other.csv", ";", lambda value: repr(value).replace(".", ","))
    given = "time=t:ms,q=joint_{}:deg,target_q=plan_{}:deg,accelerometer=acc_{}:g"
    for columns in (given, "time=t,q=joint_{}:deg,target_q=plan_{}:deg,accelerometer=acc_{}"):
        recording = read(path, columns)
        assert {"timestamp", "actual_q", "target_q", "actual_tool_accelerometer"} <= recording.columns.keys()
        for name in recording.columns:
            assert recording[name] == pytest.approx(expected[name], abs=1e-9), name
        said = [note for note in recording.notes if "taken as" in note]
        assert len(said) == (0 if columns is given else 2)
    for columns, words in (
        ("time=t,q=axis_{}", r"no column 'axis_\{\}' for q; its columns are t, joint_0"),
        ("time=t:weeks", "write NAME=COLUMN"),
        (None, "--columns time="),
    ):
        with pytest.raises(RecordingError, match=words):
            read(path, columns)


def test_vibration_at_the_end_is_not_called_noise(tmp_path):
    ringing = analyze(read(SyntheticLog(modes=((9.0, 0.01, 2.0),), motions=1).csv(tmp_path / "a.csv")))[0]
    noisy = analyze(read(SyntheticLog(noise=0.2, motions=1).csv(tmp_path / "b.csv")))[0]
    assert "still rang" in ringing.notes["still_after_ms"]
    assert "noise" in noisy.notes["still_after_ms"]


def test_equal_notes_are_merged_with_the_number_of_motions():
    results = [MotionResult(0.0, 1.0, notes={"f_d_hz": f"only 0.{n} s"} if n < 8 else {}) for n in range(10)]
    assert grouped_notes(results) == ["8 of 10 motions, frequency: as only 0.0 s"]


DEGREES = 180.0 / np.pi
TORQUES = [f"state.tau_J[{i}]" for i in range(2)]
VENDORS = {
    "libfranka": (
        ["time", "success_rate", *(f"state.{what}[{i}]" for what in ("q", "q_d", "dq") for i in range(2)), *TORQUES],
        lambda t, q, qd: [1e3 * t, 1.0 + 0 * t, *q, *q, *qd, *q],
    ),
    "abb_libegm": (
        ["TIMESTAMP", *(f"R_{what}_RJ{i}" for what in ("FB_POS", "FB_VEL", "PL_POS") for i in (1, 2))],
        lambda t, q, qd: [1e3 * t, *(DEGREES * q), *(DEGREES * qd), *(DEGREES * q)],
    ),
    "abb_motion_program_exec": (["timestamp", "cmdnum", "J1", "J2"], lambda t, q, _: [t, 0 * t, *(DEGREES * q)]),
    "FRI": (["index", "time", "mp1", "mp2", "ip1", "ip2"], lambda t, q, _: [0 * t, t, *q, *q]),
    "RSI": (["IPOC", "AIPos.A1", "AIPos.A2"], lambda t, q, _: [1e3 * t, *(DEGREES * q)]),
    "RSIPI": (["Receive.IPOC", "Receive.AIPos.A1", "Receive.AIPos.A2"], lambda t, q, _: [1e3 * t, *(DEGREES * q)]),
    "Doosan": (
        ["time_stamp", *(f"actual_joint_{what}_{i}" for what in ("position", "velocity") for i in (0, 1))],
        lambda t, q, qd: [t, *(DEGREES * q), *(DEGREES * qd)],
    ),
    "Doosan's": (
        ["time_stamp", "actual_joint_position[0]", "actual_joint_position[1]"], lambda t, q, _: [t, *(DEGREES * q)],
    ),
}  # fmt: skip
"""A header as each program writes it, and rows; angles are too small for their unit to show in the numbers."""


@pytest.mark.parametrize("vendor", VENDORS)
def test_names_and_units_of_other_vendors_are_recognized(tmp_path, vendor):
    header, rows = VENDORS[vendor]
    t = 10.0 + 0.004 * np.arange(500)
    q, qd = np.array([np.sin(t), 0.1 * np.cos(t)]), np.array([np.cos(t), -0.1 * np.sin(t)])
    path = tmp_path / "log.csv"
    np.savetxt(path, np.array(rows(t, q, qd)).T, "%.12g", ",", header=",".join(header), comments="")
    found = read(path)
    assert any("the names of" in note and vendor.split("'")[0] in note for note in found.notes)
    assert found.time == pytest.approx(t)
    assert found["actual_q"] == pytest.approx(q.T)
    if "target_q" in found:
        assert found["target_q"] == pytest.approx(q.T)
    if "actual_qd" in found:
        assert found["actual_qd"] == pytest.approx(qd.T)


@pytest.mark.parametrize(
    ("separator", "comma"), [(",", False), (";", True), (" ", False), ("\t", True), (",", True)]
)
def test_file_without_header_is_read_by_column_numbers(tmp_path, separator, comma):
    t = 0.01 * np.arange(300)
    table = np.column_stack([np.arange(300), t, np.sin(t), np.cos(t), 20 * t, 9 * t])
    lines = [separator.join(f"{value:.6f}" for value in row) for row in table]
    path = tmp_path / "log.txt"
    path.write_text("\n".join(line.replace(".", ",") if comma else line for line in lines) + "\n")
    if (separator, comma) == (",", True):
        with pytest.raises(RecordingError, match="row"):  # nobody can tell these commas apart
            read(path, "time=2,q=3-4:rad,target_q=5-6:deg")
        return
    found = read(path, "time=2,q=3-4:rad,target_q=5-6:deg")
    assert found.time == pytest.approx(t, abs=1e-6)
    assert found["actual_q"] == pytest.approx(table[:, 2:4], abs=1e-6)
    assert found["target_q"] == pytest.approx(np.radians(table[:, 4:]), abs=1e-6)


@pytest.mark.parametrize("columns", ["time=1,q=2-9", "time=0,q=2-3", "time=1,q=3-2"])
def test_missing_column_numbers_are_refused(tmp_path, columns):
    path = tmp_path / "log.txt"
    path.write_text("".join(f"{0.01 * n},1,{n}\n" for n in range(50)))
    with pytest.raises(RecordingError, match=r"1 to 3, as in .*=2-7"):
        read(path, columns)


@pytest.mark.parametrize("kind", ["lists", "arrays", "npz"])
def test_vectors_of_a_table_may_have_any_name(tmp_path, kind):
    t = 0.002 * np.arange(100)
    q = np.column_stack([np.sin(t), np.cos(t)])
    path = tmp_path / ("log.npz" if kind == "npz" else "log.parquet")
    if kind == "npz":
        np.savez(path, stamp=t, **{"observation.state": q})
    else:
        lists = pl.Series("observation.state", q, dtype=pl.Array(pl.Float64, 2))
        lists = lists if kind == "arrays" else lists.arr.to_list()
        pl.DataFrame([pl.Series("stamp", t), lists]).write_parquet(path)
    if kind == "npz":
        with pytest.raises(RecordingError, match=r"are stamp, observation\.state_0, observation\.state_1"):
            read(path)
    found = read(path, "time=stamp,q=observation.state_{}:rad")
    assert found.foreign
    assert found["actual_q"] == pytest.approx(q)


def test_user_format_is_a_function(tmp_path, monkeypatch):
    """A made-up program writes one number after another as text, in ms and degrees."""

    def read_numbers(path):
        values = np.array(path.read_text().split(), np.float64).reshape(-1, 3)
        return table.LogTable(
            path, ["time", "q_actual_0", "q_actual_1"], values, np.arange(1.0, len(values) + 1.0)
        )

    monkeypatch.setitem(table.READERS, ".numbers", read_numbers)  # as @reader(".numbers") does
    t = 0.004 * np.delete(np.arange(500), slice(200, 260))
    rows = np.column_stack([1e3 * t, 57.3 * np.sin(t), 57.3 * np.cos(t)])
    (path := tmp_path / "log.numbers").write_text(" ".join(map(repr, rows.ravel().tolist())))
    found = read(path)
    assert found.time == pytest.approx(t)
    assert found["actual_q"] == pytest.approx(np.radians(rows[:, 1:]))
    assert found.missing_ticks == 60
    for words in ("taken as ms", "taken as deg", "rows are missing"):
        assert any(words in note for note in found.notes)


@pytest.mark.parametrize("without", [(), ("target_q",)])
def test_pause_of_any_length_changes_no_result_and_takes_no_memory(without, of_two_motions, tmp_path):
    log, pause = SyntheticLog(rate=250.0).without(*without), 7e8
    expected = of_two_motions(*without)[1].results
    middle = len(log.columns["timestamp"]) // 2
    log.columns["timestamp"][middle:] += pause
    found = analyze(read(log.csv(tmp_path / "log.csv")))
    assert [one.f_d_hz for one in found] == pytest.approx([one.f_d_hz for one in expected], rel=0.01)
    stops = [expected[0].stop_s, expected[1].stop_s + pause]
    assert [one.stop_s for one in found] == pytest.approx(stops, abs=0.005)


def test_text_column_is_omitted_or_refused_if_needed(tmp_path):
    t = 0.012 * np.arange(60)
    rows = [f"2024-01-02 03:04:05,{1e3 * s + 5e8:.0f},ä,{57.3 * np.sin(s):.4f},{s}" for s in t]
    header = "Timestamp,IPOC,state,AIPos.A1,AIPos.A2"
    (path := tmp_path / "rsi.csv").write_text("\n".join([header, *rows, ""]))
    for columns in (None, "time=IPOC:ms,q=AIPos.A{}:deg"):
        found = read(path, columns)
        assert found.time == pytest.approx(5e5 + t, abs=1e-3)
        assert any("Timestamp" in note and "state" in note for note in found.notes)
    with pytest.raises(RecordingError, match=r"line 2, column Timestamp.*is no number; .*IPOC"):
        read(path, "time=Timestamp,q=AIPos.A{}:deg")
    with pytest.raises(RecordingError, match=r"no column timestamp.*are Timestamp, IPOC, .*AIPos.A2"):
        read(path, "q=AIPos.A{}:deg")
