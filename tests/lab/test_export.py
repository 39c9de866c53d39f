"""Recordings leave as CSV and Parquet, and come back with equal arrays."""

import csv
import json
import resource

import msgspec
import numpy as np
import polars as pl
import pytest
from tests.lab.golden import INFO, STATE, TRUTH, changed, record
from tests.lab.made_logs import SyntheticLog

from tvist_cli.commands.log.analyze import analyze
from tvist_cli.commands.log.export import export as export_command
from tvist_cli.failure import Failure
from tvist_lab.recordings import RecordingError, read
from tvist_lab.recordings.description import KEY, meaning_of, sidecar
from tvist_lab.recordings.export import FORMATS, ExportError, export
from tvist_lab.recordings.messages import recording_of_messages
from tvist_protocol import Event, Io, State, Truth

HARD_FLOATS = [5e-324, -0.0, 0.1 + 0.2, 1e-300, np.nan, 1e6 - 2.0**-33]


def recording(rows=40):
    """Random states and truth, with every kind of float that is easily spoilt."""
    random = np.random.default_rng(rows)
    states = [
        changed(
            STATE,
            tick=tick,
            timestamp=tick * 0.002,
            setpoint_sequence=None if tick % 3 else tick,
            actual_q=random.standard_normal(6).tolist(),
            target_moment=HARD_FLOATS,
            estimated_f_d=[random.random()],
        )
        for tick in range(7, 7 + 2 * rows, 2)
    ]
    truths = [changed(TRUTH, tick=state.tick) for state in states[3:]]
    events = [Event(tick=9, kind="motion_started", id=1), Event(tick=11, kind="warning", why="“N m²”, \n2")]
    return recording_of_messages(states, events, truths, INFO)


@pytest.mark.parametrize("kind", FORMATS)
class TestRoundTrip:
    def test_values_and_shapes_survive_export(self, kind, tmp_path):
        path, expected = tmp_path / f"run.{kind}", recording()
        export(expected, path, kind)
        found = read(path)
        assert set(found.columns) == set(expected.columns)
        for name, values in expected.columns.items():
            assert (found[name].shape, found[name].tobytes()) == (values.shape, values.tobytes()), name
        assert (found.events, found.info) == (expected.events, expected.info)
        assert (found.notes, found.foreign) == (expected.notes, expected.foreign)

    def test_foreign_log_survives_export(self, kind, tmp_path):
        expected = read(SyntheticLog(motions=1, rate=100.0).csv(tmp_path / "log.csv"))
        assert expected.foreign
        export(expected, path := tmp_path / f"run.{kind}", kind)
        found = read(path)
        assert all(np.array_equal(found[name], expected[name], equal_nan=True) for name in expected.columns)

    def test_full_disk_is_reported_and_keeps_the_old_file(self, kind, tmp_path):
        path = tmp_path / f"run.{kind}"
        path.write_bytes(b"old")
        before = resource.getrlimit(resource.RLIMIT_FSIZE)
        resource.setrlimit(resource.RLIMIT_FSIZE, (5000, before[1]))
        try:
            with pytest.raises(ExportError, match=f"{path} cannot be written: File too large"):
                export(recording(), path, kind)
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, before)
        assert path.read_bytes() == b"old"
        assert [place.name for place in tmp_path.iterdir()] == [path.name]


def test_truncated_parquet_is_refused(tmp_path):  # a CSV cut short is a shorter CSV
    path = tmp_path / "run.parquet"
    export(recording(), path, "parquet")
    whole = path.read_bytes()
    for length in (10, len(whole) // 3, len(whole) - 3):
        path.write_bytes(whole[:length])
        with pytest.raises(RecordingError, match=str(path)):
            read(path)


class TestLayout:
    def test_csv_has_a_column_per_entry_empty_cells_and_a_file_of_units(self, tmp_path):
        export(recording(), tmp_path / "run.csv", "csv")
        with (tmp_path / "run.csv").open(newline="") as file:
            header, first, *_ = csv.reader(file)
        row = dict(zip(header, first, strict=True))
        assert header[:2] == ["timestamp", "tick"]
        assert row["tick"] == "7"
        assert row["setpoint_sequence"] == row["target_moment_4"] == row["truth_motor_q_0"] == ""
        assert float(row["target_moment_2"]) == 0.1 + 0.2
        table = json.loads(sidecar(tmp_path / "run.csv").read_text())
        columns = {column["name"]: column for column in table["tableSchema"]["columns"]}
        assert list(columns) == header
        assert columns["actual_TCP_pose_2"]["schema:unitText"] == "m"
        assert columns["actual_TCP_pose_3"]["schema:unitText"] == "rad"
        assert columns["tick"]["datatype"] == "integer"

    def test_parquet_has_types_and_a_description_in_its_metadata(self, tmp_path):
        export(recording(), path := tmp_path / "run.parquet", "parquet")
        assert json.loads(pl.read_parquet_metadata(path)[KEY])["info"]["name"] == INFO.name
        table = pl.read_parquet(path)
        assert table.columns[0] == "timestamp"
        assert (table["tick"].dtype, table["actual_q_5"].dtype) == (pl.Int64, pl.Float64)


@pytest.mark.parametrize(("kind", "prefix"), [(State, ""), (Truth, "truth_"), (Io, "")])
def test_every_number_of_a_message_has_a_meaning_and_every_float_a_unit(kind, prefix):
    for field in msgspec.structs.fields(kind):
        found = meaning_of(prefix + field.name)
        assert found.meaning
        if field.type in (float, list[float], list[float] | None) and "register" not in field.name:
            assert found.units, field.name


class TestCommands:
    @pytest.fixture
    def path(self, tmp_path):
        path = tmp_path / "run.mcap"
        messages = [changed(STATE, tick=tick, timestamp=tick * 0.002) for tick in (4, 5, 8)]
        record(path, [*messages, Event(tick=5, kind="warning")])
        return path

    def test_export_replaces_only_a_file_that_was_named(self, path, capsys):
        export_command(path, to="CSV", json=True)
        written = json.loads(capsys.readouterr().out)["written"]
        assert written == [str(path.with_name(name)) for name in ("run.csv", "run.csv-metadata.json")]
        with pytest.raises(Failure, match=r"run\.csv exists already: choose .* with --output"):
            export_command(path, to="csv")
        export_command(path, to="csv", output=path.with_name("run.csv"))
        with pytest.raises(Failure, match="is the file to be exported"):
            export_command(path.with_name("run.csv"), to="csv")

    @pytest.mark.parametrize("kind", [None, "csv"])
    def test_analyze_lists_the_content_of_every_kind_of_file(self, kind, path, capsys):
        if kind is not None:
            export(read(path), path.with_suffix(f".{kind}"), kind)
            path = path.with_suffix(f".{kind}")
        analyze(path, json=True)
        found = json.loads(capsys.readouterr().out)
        assert (found["robot"], found["model"], found["version"]) == (INFO.name, INFO.model, INFO.version)
        assert (found["start_s"], found["duration_s"]) == (0.008, 0.008)
        assert (found["rows"], found["missing_ticks"]) == (3, 2)
        assert found["events"] == {"warning": 1}
        assert found["complete"] is (True if kind is None else None)
        (q,) = (column for column in found["columns"] if column["name"] == "actual_q")
        assert (q["shape"], q["unit"]) == ([3, 6], "rad")
        analyze(path)
        said = capsys.readouterr().out
        assert "actual_TCP_pose 6 [m, rad]" in " ".join(said.split())
        assert "It contains no motion." in said

    def test_analyze_reports_a_truncated_file(self, path, capsys):
        path.write_bytes(path.read_bytes()[:-20])
        analyze(path)
        out, err = capsys.readouterr()
        assert "no: cut off or damaged" in out
        assert "was not closed" in err
