"""A sweep's rows depend on their position alone, whatever interrupts it; what is wrong with its file is named."""

import json
import re
import threading
from dataclasses import replace
from pathlib import Path

import polars as pl
import pytest
from polars.testing import assert_frame_equal

from tvist_controller.sources import calibrations
from tvist_lab.figures import study_figure
from tvist_lab.runners import Failed, TaskError, outcomes, processes
from tvist_lab.studies.sweep.spec import Spec, SpecError, read_spec
from tvist_lab.studies.sweep.sweep import COLUMNS, SCHEMA, Axes, SweptRobot, setting_name, summary
from tvist_lab.study.arms import scattered
from tvist_lab.study.case import Case, arm_seed
from tvist_lab.study.columns import frame
from tvist_lab.study.engine import Done, Effort
from tvist_lab.study.engine import run as run_plan
from tvist_lab.study.method import Named
from tvist_lab.study.moves import draw_moves
from tvist_lab.study.recipes import Recipe
from tvist_lab.study.store import Store, StoreError
from tvist_lab.study.study import StudyError, read_study
from tvist_lab.study.work import Job, failed, measure, measure_each
from tvist_plant.description import load

SPEC = """
shapers = ["none", "zv"]
moves = 3
payloads = [1.5, "uniform"]
errors = [{}, {payload = 20, stiffness = 15, frequency = -5}]
seed = 4
"""
HOW_TO = Path(__file__).parents[2] / "docs" / "how-to" / "sweep.md"


def tasks_of(folder, text=SPEC):
    path = folder / "spec.toml"
    path.write_text(text, encoding="utf-8")
    spec, ur5e = read_spec(path), load("ur5e")
    known = calibrations.load("ur5e_5kg")
    return Axes(spec, [SweptRobot("ur5e", ur5e, tuple(Recipe(name, known) for name in spec.shapers))])


class Quick:
    """A runner that makes rows up from the tasks, in any order, and may be stopped.

    Args:
        order: Order of the places.
        stop: Number of tasks after which Control+C is pressed.
        fail: Positions of tasks that fail.
    """

    def __init__(self, order=sorted, stop=10**9, fail=()):
        self.order, self.stop, self.fail, self.asked = order, stop, fail, []

    def __call__(self, _work, tasks):
        for count, place in enumerate(self.order(range(len(tasks)))):
            if count == self.stop:
                raise KeyboardInterrupt
            position = tasks.places[place]
            self.asked.append(position)
            if position in self.fail:
                yield place, Failed(TaskError("it cannot be pickled: a lock"))
            else:
                rows = failed(tasks[place], "measured", "")
                for number, row in enumerate(rows, position * len(rows)):
                    row |= {"error": None, "delay_ms": 0.1 * number, "reduction_percent": 50.0}
                yield place, Done(rows, "a", 0.0, 1.0)


def in_processes(work, tasks):
    with processes(2) as pool:
        yield from outcomes(pool, work, tasks)


def run(axes, *others):
    return run_plan(axes.plan(), *others)


def quietly(_):
    return lambda _: None


@pytest.fixture
def tasks(tmp_path):
    return tasks_of(tmp_path)


@pytest.fixture
def whole(tmp_path, tasks):
    """The rows of a run that nothing interrupted."""
    return run(tasks, tmp_path / "whole", Quick(), quietly).rows


class TestSpec:
    @pytest.mark.parametrize(
        ("text", "words"),
        [
            (SPEC + "shaperz = 1", ["line 7", "'shaperz'", "did you mean 'shapers'?"]),
            (SPEC.replace("moves = 3\n", ""), ["moves is missing"]),
            (SPEC.replace('["none", "zv"]', "[]"), ["line 2", "shapers has 0 entries", "at least 1 entry"]),
            (SPEC.replace("[{},", "[{stifness = 2},"), ["errors[0]", "'stifness'", "did you mean 'stiffness'?"]),
            (SPEC.replace("stiffness = 15", "stiffness = 95"), ["line 5", "errors[1].stiffness is 95", "90"]),
            (SPEC.replace("moves = 3", "moves = 3.5"), ["line 3", "moves must be an integer", "a number"]),
            (SPEC.replace("moves = 3", "moves = 0"), ["line 3", "moves is 0", "at least 1"]),
            (SPEC.replace('"uniform"', '"heavy"'), ["line 4", "payloads[1] is 'heavy'", "'uniform'"]),
            (SPEC.replace("1.5", "-1.5"), ["payloads[0] is -1.5", "at least 0"]),
            (SPEC.replace("1.5", "nan"), ["payloads[0]", "NaN"]),
            (SPEC.replace('"none"', '"zv"'), ["line 2", "shapers[1] repeats shapers[0]"]),
            (SPEC + "limits = 'fast'", ["limits is 'fast'", "'gentle', 'industrial'"]),
            (SPEC + "stroke = [0.5, 0.4]", ["line 7", "stroke is 0.5 to 0.4", "increase"]),
            (SPEC + "robots = [{robot = 'ur5e'}]", ["robots[0].calibration is missing"]),
            (SPEC.replace("moves = 3", "moves = 100000") + "robots = ['a', 'b']", ["1600000 rows", "1000000"]),
            (SPEC + "x = = 1", ["not valid TOML", "line 7"]),
        ],
    )  # fmt: skip
    def test_what_is_wrong_is_named_with_line_or_key(self, tmp_path, text, words):
        with pytest.raises(SpecError) as error:
            tasks_of(tmp_path, text)
        assert str(error.value).startswith(f"sweep {tmp_path / 'spec.toml'}")
        assert all(word in str(error.value) for word in words), error.value

    def test_a_key_that_is_left_out_has_the_default_of_evaluate(self, tmp_path):
        spec = tasks_of(tmp_path, "shapers = ['zv']\nmoves = 1\npayloads = [5]").spec
        assert (spec.robots, spec.seed, spec.modes, spec.limits) == (("ur5e",), 0, 1, "gentle")
        assert (spec.stroke, spec.wrists, spec.streams) == ((0.3, 1.0), False, False)


class TestTasks:
    def test_rows_are_to_the_bit_what_evaluate_measures(self, tasks):
        task = tasks[11]
        ur5e = load("ur5e")
        move = draw_moves(ur5e, 3, 4, (0.0, ur5e.limits.payload)).moves[2]
        said = [task.case.axes[name] for name in ("payload", "stiffness_error_percent", "move")]
        assert (*said, task.case.move) == ("uniform", 15.0, 3, move)
        none, zv = measure_each(task)
        recipe = Recipe("zv", calibrations.load("ur5e_5kg"), frequency_error=-0.05)
        case = Case(ur5e, move, arm_seed(4, 2), (scattered(0.15),), payload_error=0.2)
        (one,) = measure(Job(case, (Named(recipe, "zv"),)))
        assert {name: zv[name] for name in one} == one
        assert zv["unshaped_peak_m_s2"] == none["shaped_peak_m_s2"]

    def test_a_position_has_the_same_bits_whatever_was_done_before(self, tmp_path, tasks):
        again = tasks_of(tmp_path)
        later = [measure_each(again[place]) for place in (5, 2)]
        assert [measure_each(tasks[place]) for place in (2, 5)] == later[::-1]

    def test_moves_and_arms_are_the_same_for_all_payloads_and_errors(self, tasks):
        same = [tasks[place] for place in range(1, len(tasks), 3)]
        assert len({(one.case.move.start, one.case.move.target, one.case.seed) for one in same}) == 1
        assert [one.case.axes["payload"] for one in same] == ["1.5", "1.5", "uniform", "uniform"]

    def test_a_shaper_that_fails_costs_its_own_row(self, tasks):
        task = tasks[0]
        broken = Recipe("zv", None)
        none, zv = measure_each(replace(task, methods=(task.methods[0], Named(broken, "zv"))))
        assert (none["status"], none.get("error")) == ("measured", None)
        assert zv["status"] == "failed"
        assert "needs a calibration" in zv["error"]

    def test_a_move_for_which_the_drives_are_too_weak_says_so(self, tmp_path):
        text = SPEC.replace("1.5", "60").replace("moves = 3", "moves = 1") + "limits = 'industrial'"
        rows = measure_each(tasks_of(tmp_path, text)[0])
        assert {row["status"] for row in rows} == {"too weak"}
        assert all("of a drive's torque" in row["error"] for row in rows)


class TestResuming:
    @pytest.mark.parametrize("stop", [1, 5, 11])
    def test_an_interrupted_run_continues_with_what_is_missing_and_ends_alike(
        self, tmp_path, tasks, whole, stop
    ):
        first, second = Quick(order=lambda places: list(places)[::-1], stop=stop), Quick()
        with pytest.raises(KeyboardInterrupt):
            run(tasks, tmp_path / "x", first, quietly)
        study = run(tasks, tmp_path / "x", second, quietly)
        assert len(first.asked) == study.resumed == stop
        assert sorted(first.asked + second.asked) == list(range(12))
        assert_frame_equal(study.rows, whole)
        assert_frame_equal(pl.read_parquet(tmp_path / "x" / "sweep.parquet"), whole)

    def test_a_part_at_each_so_many_tasks_survives_a_kill(self, tmp_path, tasks, whole, monkeypatch):
        monkeypatch.setattr("tvist_lab.study.engine.PART", 2)
        with pytest.raises(KeyboardInterrupt):
            run(tasks, tmp_path / "x", Quick(stop=7), quietly)
        (tmp_path / "x" / "parts" / "000004.parquet").unlink()  # written because it was no kill
        second = Quick()
        assert_frame_equal(run(tasks, tmp_path / "x", second, quietly).rows, whole)
        assert second.asked == list(range(6, 12))

    def test_a_run_that_ended_has_nothing_left(self, tmp_path, tasks, whole):
        again = Quick()
        study = run(tasks, tmp_path / "whole", again, quietly)
        assert (again.asked, study.resumed) == ([], 12)
        assert_frame_equal(study.rows, whole)

    def test_what_failed_is_named_and_tried_again(self, tmp_path, tasks, whole):
        rows = run(tasks, tmp_path / "x", Quick(fail={3}), quietly).rows
        bad = rows.filter(pl.col("status") == "failed")
        assert bad["move"].to_list() == [1, 1]
        assert set(bad["error"]) == {"it cannot be pickled: a lock"}
        assert_frame_equal(rows.filter(pl.col("status") != "failed"), whole.filter(pl.col("row") // 2 != 3))
        again = Quick()
        assert_frame_equal(run(tasks, tmp_path / "x", again, quietly).rows, whole)
        assert again.asked == [3]

    @pytest.mark.parametrize(
        ("old", "new", "what"),
        [("moves = 3", "moves = 4", "moves"), ("seed = 4", "seed = 5", "seed"), ('"none", ', "", "shapers")],
    )
    @pytest.mark.usefixtures("whole")
    def test_another_spec_does_not_continue(self, tmp_path, old, new, what):
        other = tasks_of(tmp_path, SPEC.replace(old, new))
        with pytest.raises(
            StoreError, match=rf"whole holds a study with other {what}.*: give another --output"
        ):
            run(other, tmp_path / "whole", Quick(), quietly)

    @pytest.mark.usefixtures("whole")
    def test_a_changed_robot_does_not_continue(self, tmp_path, tasks):
        robot = tasks.robots[0]
        other = SweptRobot(robot.name, robot.description.clean(), robot.recipes)
        with pytest.raises(StoreError, match="other contents of robots"):
            run(Axes(tasks.spec, [other]), tmp_path / "whole", Quick(), quietly)


class TestFolder:
    def test_a_folder_with_something_else_is_left_alone(self, tmp_path, tasks):
        (tmp_path / "x").mkdir()
        (tmp_path / "x" / "thesis.tex").touch()
        with pytest.raises(StoreError, match="x exists already and holds no study"):
            run(tasks, tmp_path / "x", Quick(), quietly)
        assert [file.name for file in (tmp_path / "x").iterdir()] == ["thesis.tex"]

    def test_two_sweeps_cannot_write_one_folder(self, tmp_path):
        with (
            Store(tmp_path / "x", {}, SCHEMA),
            pytest.raises(StoreError, match=r"another study is writing .*x"),
        ):
            Store(tmp_path / "x", {}, SCHEMA)
        with Store(tmp_path / "x", {}, SCHEMA) as store:
            assert store.rows().is_empty()

    def test_a_sweep_that_kept_nothing_does_not_reserve_its_folder(self, tmp_path):
        with Store(tmp_path / "x", {"moves": 1}, SCHEMA):
            pass
        with Store(tmp_path / "x", {"moves": 2}, SCHEMA) as store:
            assert store.rows().is_empty()

    def test_a_full_disk_is_a_sentence_and_leaves_whole_files(self, tmp_path, tasks, whole, monkeypatch):
        monkeypatch.setattr("tvist_lab.study.engine.PART", 2)
        room = iter(range(4))  # manifest and three parts

        def fsync(_):
            if next(room, None) is None:
                raise OSError(28, "No space left on device")

        with monkeypatch.context() as patch:
            patch.setattr("os.fsync", fsync)
            with pytest.raises(StoreError, match=r"x cannot be written: No space left on device; what was"):
                run(tasks, tmp_path / "x", Quick(), quietly)
        files = sorted((tmp_path / "x" / "parts").iterdir())
        assert [file.name for file in files] == [f"{n:06d}.parquet" for n in (1, 2, 3)]
        assert len(pl.read_parquet(tmp_path / "x" / "parts" / "*.parquet")) == 12
        assert_frame_equal(run(tasks, tmp_path / "x", Quick(), quietly).rows, whole)

    def test_a_damaged_part_is_named(self, tmp_path, tasks):
        with Store(tmp_path / "x", {}, SCHEMA) as store:
            store.keep(frame(failed(tasks[0], "failed", "x"), SCHEMA))
            (tmp_path / "x" / "parts" / "000001.parquet").write_bytes(b"PAR1")
            with pytest.raises(
                StoreError, match=r"000001\.parquet cannot be read as rows of a study: remove it"
            ):
                store.rows()


class TestFigures:
    def test_the_overhead_is_what_workers_wait_between_their_tasks(self):
        effort = Effort()
        for worker, began, ended in (("a", 1.0, 2.0), ("b", 50.0, 53.0), ("a", 2.5, 3.5)):
            effort.add(Done((), worker, began, ended))
        assert (effort.tasks, effort.workers, effort.task_s) == (3, 2, 5.0)
        assert effort.overhead_percent == pytest.approx(10.0)

    def test_the_summary_has_an_entry_for_each_setting_and_shaper(self, whole):
        entries = summary(whole)
        assert len(entries) == 8
        assert [entry["moves"] for entry in entries] == [3] * 8
        assert {entry["reduction_percent"]["median"] for entry in entries} == {50.0}
        assert entries[0]["delay_ms"] == pytest.approx({"median": 0.2, "max": 0.4})
        names = list(dict.fromkeys(map(setting_name, entries)))
        assert names[0] == "ur5e, 1.5 kg"
        assert names[3] == "ur5e, uniform, payload +20 %, stiffness ±15 %, frequency -5 %"

    def test_rows_that_measure_nothing_have_empty_cells(self, tasks):
        found = frame(failed(tasks[0], "failed", "why"), SCHEMA)
        assert found.schema == pl.Schema(SCHEMA)
        assert found["shaped_peak_m_s2"].to_list() == [None, None]
        (entry, _) = summary(found)
        assert (entry["failed"], entry["measured"], entry["delay_ms"]["median"]) == (1, 0, None)
        json.dumps(entry)

    def test_the_page_explains_every_column_with_its_unit(self):
        _, _, text = HOW_TO.read_text(encoding="utf-8").partition("## Read the rows")
        told = re.findall(r"^\| `(\w+)` \| (.*?) \| (.*) \|$", text, re.MULTILINE)
        assert told == [(column.name, column.unit, column.meaning) for column in COLUMNS]


def test_the_page_has_an_example_and_names_every_key(tmp_path):
    text = HOW_TO.read_text(encoding="utf-8")
    (example,) = re.findall(r"```toml\n(.*?)```", text, re.DOTALL)
    (tmp_path / "springs.toml").write_text(example, encoding="utf-8")
    assert read_spec(tmp_path / "springs.toml").rows == 3 * 3 * 4 * 20
    keys = re.findall(r"^\| `(\w+)` \|", text.partition("## Run it")[0], re.MULTILINE)
    assert sorted(keys) == sorted(Spec.__struct_fields__)


def of_the_page():
    """The study that the page shows."""
    shown = re.findall(r"```python\n(.*?)```", HOW_TO.read_text(encoding="utf-8"), re.DOTALL)
    return next(text for text in shown if "STUDY" in text)


def test_the_study_of_the_page_is_made_kept_and_summarized(tmp_path):
    text = of_the_page()
    (tmp_path / "speeds.py").write_text(text.replace("20, seed", "1, seed"), encoding="utf-8")
    study = read_study(tmp_path / "speeds.py")
    ran = run_plan(study.plan(), tmp_path / "x", in_processes, quietly)
    assert run_plan(study.plan(), tmp_path / "x", Quick(), quietly).resumed == 3
    entries = study.summary(ran.rows)
    assert [(one["speed"], one["shaper"]) for one in entries] == [
        (speed, name) for speed in (0.5, 1.0, 1.5) for name in ("zv", "auto")
    ]
    assert list(ran.rows["speed"]) == [0.5, 0.5, 1.0, 1.0, 1.5, 1.5]
    unshaped = [one["unshaped_peak_m_s2"]["median"] for one in entries[::2]]
    assert unshaped == sorted(unshaped)
    for one in entries:
        assert one["shaped_peak_m_s2"]["median"] < one["unshaped_peak_m_s2"]["median"]
    assert len(study_figure(entries, study.by, study.show).axes) == 2


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("STUDY =", "study ="), "contains no STUDY"),
        (('by=("speed",)', 'by=("pace",)'), "'pace' is no axis: there are speed, move"),
        (('"shaped_peak_m_s2")', '"peak")'), "'peak' is no measure"),
        (('"zv", "auto"', '"zvv"'), "there is no method 'zvv', did you mean 'zv'"),
        (("0.5, 1.0", "1, 'fast'"), "TypeError"),
        (('"move": number', '"status": number'), "axis 'status' has the name of another column"),
        (
            ('"move": number', '"move": number if number else "none"'),
            "axis 'move' has values of the types int, str",
        ),
        (("1.5 * speed", "-1.5 * speed"), "has the velocity limit -0.75: must be a positive number"),
        (
            ('show=("unshaped_peak_m_s2", "shaped_peak_m_s2")', 'show=("delay_ms")'),
            "show is 'delay_ms': must be a tuple",
        ),
        (('"unshaped_peak_m_s2", "shaped_peak_m_s2"', ""), "show is empty"),
        (("robot = load", "raise SystemExit(3)\nrobot = load"), "running it raises SystemExit"),
    ],
)
def test_what_is_wrong_with_a_study_is_a_sentence(tmp_path, change, words):
    text = of_the_page()
    (tmp_path / "speeds.py").write_text(text.replace(*change), encoding="utf-8")
    with pytest.raises(StudyError, match=words):
        read_study(tmp_path / "speeds.py")


class Locked(Axes):
    """Tasks of which one cannot be pickled, and one fails."""

    def __getitem__(self, position):
        task = super().__getitem__(position)
        if position == 1:
            return replace(task, as_served=threading.Lock())
        short = replace(task.case, move=replace(task.case.move, start=()))
        return replace(task, case=short) if position == 2 else task


def test_a_task_that_cannot_be_pickled_and_one_that_fails_name_their_moves_and_the_others_go_on(tmp_path):
    tasks = tasks_of(tmp_path, "shapers = ['none']\nmoves = 4\npayloads = [5]")
    bad = run(Locked(tasks.spec, tasks.robots), tmp_path / "x", in_processes, quietly).rows
    assert bad["status"].to_list() == ["measured", "failed", "failed", "measured"]
    assert bad["move"].to_list() == [1, 2, 3, 4]
    assert "cannot be pickled" in bad["error"][1]
    assert bad["error"][2].startswith(("ValueError", "IndexError"))
    good = run(tasks, tmp_path / "x", in_processes, quietly)
    assert good.resumed == 2
    rows = [{"row": place} | row for place, task in enumerate(tasks) for row in measure_each(task)]
    assert_frame_equal(good.rows, frame(rows, SCHEMA))
