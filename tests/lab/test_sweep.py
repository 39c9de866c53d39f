"""A sweep's rows depend on their position alone, whatever interrupts it; what is wrong with its file is named."""

import re
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from unittest.mock import patch

import polars as pl
import pytest
from polars.testing import assert_frame_equal

from tvist_controller.sources import calibrations
from tvist_lab.report import study_figures
from tvist_lab.runners import Failed, TaskError, processes
from tvist_lab.studies import sweep
from tvist_lab.studies.sweep import Spec, SpecError, SweptRobot, read_spec, setting_name
from tvist_lab.study.case import Case, arm_seed
from tvist_lab.study.engine import run as run_study
from tvist_lab.study.method import Named
from tvist_lab.study.moves import draw_moves
from tvist_lab.study.recipes import Recipe
from tvist_lab.study.store import Store, StoreError
from tvist_lab.study.study import StudyError, read_study
from tvist_lab.study.work import Job, failed, measure, measure_each
from tvist_plant.description import load
from tvist_plant.variants import scattered

SPEC = """
shapers = ["none", "zv"]
moves = 3
payloads = [1.5, "uniform"]
errors = [{}, {payload = 20, stiffness = 15, frequency = -5}]
seed = 4
"""
HOW_TO = Path(__file__).parents[2] / "docs" / "how-to" / "evaluate-a-shaper.md"


def tasks_of(folder, text=SPEC):
    path = folder / "spec.toml"
    path.write_text(text, encoding="utf-8")
    spec, ur5e = read_spec(path), load("ur5e")
    known = calibrations.load("ur5e_5kg")
    return sweep.study(spec, [SweptRobot("ur5e", ur5e, tuple(Recipe(name, known) for name in spec.shapers))])


class Quick:
    """A runner that makes rows up in any order; some tasks fail, and Control+C is pressed after so many."""

    def __init__(self, order=sorted, stop=10**9, fail=()):
        self.order, self.stop, self.fail, self.asked = order, stop, fail, []

    def __call__(self, _executor, _work, tasks):
        tasks = list(tasks)
        for count, place in enumerate(self.order(range(len(tasks)))):
            if count == self.stop:
                raise KeyboardInterrupt
            position = self.positions[str(tasks[place].case.axes)]
            self.asked.append(position)
            if position in self.fail:
                yield place, Failed(TaskError("it cannot be pickled: a lock"))
            else:
                rows = failed(tasks[place], "measured", "")
                for number, row in enumerate(rows, position * len(rows)):
                    row |= {"error": None, "delay_ms": 0.1 * number, "reduction_percent": 50.0}
                yield place, rows


def run(study, folder, runner):
    runner.positions = {str(case.axes): place for place, case in enumerate(study.cases)}
    with patch("tvist_lab.study.engine.outcomes", runner):
        return run_study(study, folder, nullcontext)


@pytest.fixture
def tasks(tmp_path):
    return tasks_of(tmp_path)


@pytest.fixture
def whole(tmp_path, tasks):
    """The rows of a run that nothing interrupted."""
    return run(tasks, tmp_path / "whole", Quick()).rows


def test_sweep_settings_that_are_left_out_have_defaults(tmp_path):
    spec = tasks_of(tmp_path, "shapers = ['zv']\nmoves = 1\npayloads = [5]").cases.spec
    assert (spec.robots, spec.seed, spec.modes, spec.limits) == (("ur5e",), 0, 1, "gentle")
    assert (spec.stroke, spec.wrists, spec.streams) == ((0.3, 1.0), False, False)


class TestTasks:
    def test_rows_equal_those_of_any_study(self, tasks):
        (task,) = tasks.jobs([11])
        ur5e = load("ur5e")
        move = draw_moves(ur5e, 3, 4, (0.0, ur5e.limits.payload)).moves[2]
        said = [task.case.axes[name] for name in ("payload", "stiffness_error_percent", "move")]
        assert (*said, task.case.move) == ("uniform", 15.0, 3, move)
        none, zv = measure_each(task)
        recipe = Recipe("zv", calibrations.load("ur5e_5kg"), frequency_error=-0.05)
        case = Case(ur5e, move, arm_seed(4, 2), (scattered(0.15),), payload_error=0.2)
        (one,) = measure(Job(case, (Named(recipe, "zv"),), task.measures))
        assert {name: zv[name] for name in one} == one
        assert zv["unshaped_peak_m_s2"] == none["shaped_peak_m_s2"]

    def test_position_does_not_depend_on_earlier_ones(self, tmp_path, tasks):
        again = tasks_of(tmp_path)
        later = [*map(measure_each, again.jobs([5, 2]))]
        assert [*map(measure_each, tasks.jobs([2, 5]))] == later[::-1]

    def test_all_payloads_and_errors_have_the_same_moves_and_arms(self, tasks):
        same = [*tasks.jobs()][1::3]
        assert len({(one.case.move.start, one.case.move.target, one.case.seed) for one in same}) == 1
        assert [one.case.axes["payload"] for one in same] == ["1.5", "1.5", "uniform", "uniform"]

    def test_failed_shaper_loses_only_its_row(self, tasks):
        task = next(tasks.jobs())
        broken = Recipe("zv", None)
        none, zv = measure_each(replace(task, methods=(task.methods[0], Named(broken, "zv"))))
        assert (none["status"], none.get("error")) == ("measured", None)
        assert zv["status"] == "failed"
        assert "needs a calibration" in zv["error"]

    def test_move_beyond_the_torque_is_marked(self, tmp_path):
        text = SPEC.replace("1.5", "60").replace("moves = 3", "moves = 1") + "limits = 'industrial'"
        rows = measure_each(next(tasks_of(tmp_path, text).jobs()))
        assert {row["status"] for row in rows} == {"too weak"}
        assert all("of a drive's torque" in row["error"] for row in rows)


class TestResuming:
    def test_interrupted_run_continues_with_missing_rows(self, tmp_path, tasks, whole):
        first, second = Quick(order=lambda places: list(places)[::-1], stop=5), Quick()
        with pytest.raises(KeyboardInterrupt):
            run(tasks, tmp_path / "x", first)
        study = run(tasks, tmp_path / "x", second)
        assert len(first.asked) == study.resumed == 5
        assert sorted(first.asked + second.asked) == list(range(12))
        assert_frame_equal(study.rows, whole)
        assert_frame_equal(pl.read_parquet(tmp_path / "x" / "rows.parquet"), whole)
        ended = Quick()
        assert run(tasks, tmp_path / "x", ended).resumed == 12
        assert ended.asked == []

    def test_saved_rows_survive_a_kill(self, tmp_path, tasks, whole, monkeypatch):
        monkeypatch.setattr("tvist_lab.study.engine.PART", 2)
        with pytest.raises(KeyboardInterrupt):
            run(tasks, tmp_path / "x", Quick(stop=7))
        (tmp_path / "x" / "parts" / "000004.parquet").unlink()  # written because it was no kill
        second = Quick()
        assert_frame_equal(run(tasks, tmp_path / "x", second).rows, whole)
        assert second.asked == list(range(6, 12))

    def test_failed_rows_are_reported_and_repeated(self, tmp_path, tasks, whole):
        rows = run(tasks, tmp_path / "x", Quick(fail={3})).rows
        bad = rows.filter(pl.col("status") == "failed")
        assert bad["move"].to_list() == [1, 1]
        assert set(bad["error"]) == {"it cannot be pickled: a lock"}
        assert_frame_equal(rows.filter(pl.col("status") != "failed"), whole.filter(pl.col("case") != 3))
        again = Quick()
        assert_frame_equal(run(tasks, tmp_path / "x", again).rows, whole)
        assert again.asked == [3]

    @pytest.mark.parametrize(
        ("old", "new", "what"), [("seed = 4", "seed = 5", "seed"), ('"none", ', "", "shapers")]
    )
    @pytest.mark.usefixtures("whole")
    def test_run_of_another_sweep_is_not_continued(self, tmp_path, old, new, what):
        other = tasks_of(tmp_path, SPEC.replace(old, new))
        words = rf"whole holds a study with other {what}.*: give another --output"
        with pytest.raises(StoreError, match=words):
            run(other, tmp_path / "whole", Quick())

    @pytest.mark.usefixtures("whole")
    def test_run_of_a_changed_robot_is_not_continued(self, tmp_path, tasks):
        robot = tasks.cases.robots[0]
        other = SweptRobot(robot.name, robot.description.clean(), robot.recipes)
        with pytest.raises(StoreError, match="other contents of robots"):
            run(sweep.study(tasks.cases.spec, [other]), tmp_path / "whole", Quick())


class TestFolder:
    def test_other_folder_is_refused(self, tmp_path, tasks):
        (tmp_path / "x").mkdir()
        (tmp_path / "x" / "thesis.tex").touch()
        with pytest.raises(StoreError, match="x exists and is no folder of a study"):
            run(tasks, tmp_path / "x", Quick())
        assert [file.name for file in (tmp_path / "x").iterdir()] == ["thesis.tex"]

    def test_folder_in_use_is_refused(self, tmp_path, tasks):
        with (
            Store(tmp_path / "x", {"moves": 1}, tasks.schema),
            pytest.raises(StoreError, match=r"x is in use by another study"),
        ):
            Store(tmp_path / "x", {"moves": 1}, tasks.schema)
        with Store(tmp_path / "x", {"moves": 2}, tasks.schema) as store:
            assert store.rows().is_empty()

    def test_full_disk_is_reported_and_leaves_whole_files(self, tmp_path, tasks, whole, monkeypatch):
        monkeypatch.setattr("tvist_lab.study.engine.PART", 2)
        room = iter(range(4))  # manifest and three parts

        def fsync(_):
            if next(room, None) is None:
                raise OSError(28, "No space left on device")

        with monkeypatch.context() as patch:
            patch.setattr("os.fsync", fsync)
            with pytest.raises(StoreError, match=r"x cannot be written: No space left on device; what was"):
                run(tasks, tmp_path / "x", Quick())
        files = sorted((tmp_path / "x" / "parts").iterdir())
        assert [file.name for file in files] == [f"{n:06d}.parquet" for n in (1, 2, 3)]
        assert len(pl.read_parquet(tmp_path / "x" / "parts" / "*.parquet")) == 12
        assert_frame_equal(run(tasks, tmp_path / "x", Quick()).rows, whole)

    def test_damaged_file_of_rows_is_refused(self, tmp_path, tasks):
        with Store(tmp_path / "x", {}, tasks.schema) as store:
            store.keep(tasks.frame(failed(next(tasks.jobs()), "failed", "x")))
            (tmp_path / "x" / "parts" / "000001.parquet").write_bytes(b"PAR1")
            with pytest.raises(StoreError, match=r"000001\.parquet has no rows of a study: remove it"):
                store.rows()


class TestFigures:
    def test_summary_has_an_entry_per_setting_and_shaper(self, tasks, whole):
        entries = tasks.summary(whole)
        assert len(entries) == 8
        assert [entry["rows"] for entry in entries] == [3] * 8
        assert {entry["reduction_percent_median"] for entry in entries} == {50.0}
        assert [entries[0][f"delay_ms_{name}"] for name in ("median", "max")] == pytest.approx([0.2, 0.4])
        names = list(dict.fromkeys(map(setting_name, entries)))
        assert names[0] == "ur5e, 1.5 kg"
        assert names[3] == "ur5e, uniform, payload +20 %, stiffness ±15 %, frequency -5 %"


def test_page_has_an_example_and_every_key(tmp_path):
    text = HOW_TO.read_text(encoding="utf-8")
    (example,) = re.findall(r"```toml\n(.*?)```", text, re.DOTALL)
    (tmp_path / "springs.toml").write_text(example, encoding="utf-8")
    assert read_spec(tmp_path / "springs.toml").rows == 3 * 3 * 4 * 20
    (table,) = re.findall(r"^\| key \|.*?\n\n", text, re.MULTILINE | re.DOTALL)
    rows = re.findall(r"^\| (`[^|]*`) \|", table, re.MULTILINE)
    keys = [key for row in rows for key in re.findall(r"`(\w+)`", row)]
    assert sorted(keys) == sorted(Spec.__struct_fields__)


def of_the_page():
    """The study that the page shows."""
    shown = re.findall(r"```python\n(.*?)```", HOW_TO.read_text(encoding="utf-8"), re.DOTALL)
    return next(text for text in shown if "STUDY" in text)


@pytest.mark.parametrize("number", [1, pytest.param(2, marks=pytest.mark.nightly)])
def test_the_example_study_in_the_guide_runs(tmp_path, number):
    text = of_the_page()
    (tmp_path / "speeds.py").write_text(text.replace("20, seed", "1, seed"), encoding="utf-8")
    study = read_study(tmp_path / "speeds.py")
    ran = run_study(study, tmp_path / "x", lambda: processes(number))
    assert run(study, tmp_path / "x", Quick()).resumed == 3
    entries = study.summary(ran.rows)
    assert [(one["speed"], one["shaper"]) for one in entries] == [
        (speed, name) for speed in (0.5, 1.0, 1.5) for name in ("zv", "auto")
    ]
    assert list(ran.rows["speed"]) == [0.5, 0.5, 1.0, 1.0, 1.5, 1.5]
    unshaped = [one["unshaped_peak_m_s2_median"] for one in entries[::2]]
    assert unshaped == sorted(unshaped)
    for one in entries:
        assert one["shaped_peak_m_s2_median"] < one["unshaped_peak_m_s2_median"]
    result = study.result(ran.rows, {})
    assert len(study_figures(result)["study"][0].axes) == 2
    (table,) = study.tables_of(result)
    assert [column.title.split("\n")[1] for column in table.columns[2:4]] == ["least", "most"]


@pytest.mark.parametrize(
    ("file", "change", "words"),
    [
        ("x.toml", ("seed = 4", "shaperz = 1"), ["line 6", "'shaperz'", "did you mean 'shapers'?"]),
        ("x.toml", ("moves = 3\n", ""), ["moves is missing"]),
        ("x.toml", ('["none", "zv"]', "[]"), ["line 2", "shapers has 0 entries", "at least 1 entry"]),
        ("x.toml", ("stiffness = 15", "stiffness = 95"), ["line 5", "errors[1].stiffness is 95", "90"]),
        ("x.toml", ("moves = 3", "moves = 3.5"), ["line 3", "moves is 3.5: must be an integer"]),
        ("x.toml", ('"uniform"', '"heavy"'), ["line 4", "payloads[1] is 'heavy'", "'uniform'"]),
        ("x.toml", ("1.5", "nan"), ["payloads[0]", "NaN"]),
        ("x.toml", ('"none"', '"zv"'), ["line 2", "shapers[1] repeats shapers[0]"]),
        ("x.toml", ("seed = 4", "stroke = [0.5, 0.4]"), ["line 6", "stroke is 0.5 to 0.4", "increase"]),
        ("x.toml", ("seed = 4", "robots = [{robot = 'ur5e'}]"), ["robots[0].calibration is missing"]),
        ("x.toml", ("moves = 3", "moves = 100000\nrobots = ['a', 'b', 'c']"), ["2400000 rows", "1000000"]),
        ("x.toml", ("seed = 4", "x = = 1"), ["not valid TOML", "line 6"]),
        ("x.py", ("STUDY =", "study ="), ["contains no STUDY"]),
        ("x.py", ('by=("speed",)', 'by=("pace",)'), ["'pace' is no axis: there are speed, move"]),
        ("x.py", ('"shaped_peak_m_s2")', '"peak")'), ["'peak' is no measure"]),
        ("x.py", ('"zv", "auto"', '"zvv"'), ["there is no method 'zvv', did you mean 'zv'"]),
        ("x.py", ("0.5, 1.0", "1, 'fast'"), ["TypeError"]),
        ("x.py", ('"move": number', '"status": number'), ["axis 'status' is the name of another column"]),
        ("x.py", ('"move": number', '"move": number or "0"'), ["'move' has values of the types int, str"]),
        ("x.py", ("1.5 * speed", "-1.5 * speed"), ["velocity limit -0.75: must be a positive number"]),
        ("x.py", ('"unshaped_peak_m_s2", "shaped_peak_m_s2"', ""), ["show is empty"]),
        ("x.py", ("show=(", 'columns=(Column("x", median("peek")),), show=('), ["'peek', which is no measure"]),
        ("x.py", ("robot = load", "raise SystemExit(3)\nrobot = load"), ["running it raises SystemExit"]),
    ],
)  # fmt: skip
def test_wrong_sweep_or_study_is_refused(tmp_path, file, change, words):
    study = "from tvist_lab.study.columns import Column, median\n" + of_the_page()
    (tmp_path / file).write_text((SPEC if file == "x.toml" else study).replace(*change), encoding="utf-8")
    kind, read = ("sweep", read_spec) if file == "x.toml" else ("study", read_study)
    with pytest.raises((SpecError, StudyError)) as error:
        read(tmp_path / file)
    assert str(error.value).startswith(f"{kind} {tmp_path / file}")
    assert all(word in str(error.value) for word in words), error.value
