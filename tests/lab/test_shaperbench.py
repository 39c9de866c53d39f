"""Shapers on the bench: honest ones are measured, dishonest and broken ones are named; the arms are what they say."""

import sys
import textwrap
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from tools.tables.pages import page_of

from tvist_lab.metrics import best_tool_acceleration
from tvist_lab.studies.bench import bend, path_error, study
from tvist_lab.studies.causality import check_causal, inspect
from tvist_lab.study.arms import ARMS
from tvist_lab.study.case import Case
from tvist_lab.study.catalogue import some
from tvist_lab.study.foreign import CandidateError, FromFile, load_shaper
from tvist_lab.study.line import PAPER, ControlLine, point_to_point
from tvist_lab.study.method import Named, SampleMethod, Task
from tvist_lab.study.method_list import names
from tvist_lab.study.moves import Move, draw_moves
from tvist_lab.study.recipes import Recipe
from tvist_lab.study.request import StudyRequest
from tvist_lab.study.shaping import ShaperFaultError
from tvist_lab.study.work import Job, measure, measure_each
from tvist_plant.plant import PERIOD

HONEST = """
    import numpy as np

    class Mean:
        delay = 0.04

        def reset(self, q):
            self.past = [q] * 21

        def step(self, q_ref, info):
            self.past = [q_ref, *self.past[:20]]
            return np.mean(self.past, axis=0)
"""


@pytest.fixture(scope="module")
def task(ur5e):
    start, target = (np.array(ur5e.poses[name]) for name in ("Q1", "Q3"))
    move = Move(tuple(start), tuple(start + 0.1 * (target - start)), 5.0)
    return Task(ur5e, move, point_to_point(np.array(move.start), np.array(move.target)))


@pytest.fixture
def own(tmp_path, modal, request):
    def make(text):
        path = tmp_path / f"{request.node.name[:20].replace('[', '_')}.py"
        path.write_text(textwrap.dedent(text), encoding="utf-8")
        return FromFile(str(path), Recipe("zv", modal), "file", str(path))

    return make


class TestFromFile:
    def test_valid_shaper_ends_at_its_declared_delay(self, own, task):
        candidate = own(HONEST)
        check_causal(candidate, task)
        shaped = candidate.shaped(task)
        np.testing.assert_allclose(shaped.q[-1], task.move.target, atol=1e-9)
        assert 0.03 < shaped.delay <= 0.04
        assert shaped.cost is not None

    def test_shaper_may_be_a_function_that_changes_its_arguments(self, own, task):
        candidate = own("def step(q_ref, info):\n    out = q_ref.copy()\n    q_ref[:] = 9.0\n    return out")
        check_causal(candidate, task)
        shaped = candidate.shaped(task)
        assert shaped.delay == 0.0
        np.testing.assert_array_equal(shaped.q[len(task.reference) - 1], task.reference[-1])

    def test_shaper_gets_the_permitted_information(self, own, task, ur5e):
        candidate = own(
            """
            seen = []

            class Curious:
                def step(self, q_ref, info):
                    seen.append(info)
                    return q_ref
            """
        )
        candidate.shaped(task)
        info = sys.modules[f"tvist_shaper_{Path(candidate.path).stem}"].seen[5]
        assert (info.period, info.joints, info.robot) == (PERIOD, 6, ur5e.robot.model)
        assert info.limits == PAPER
        assert info.payload.mass == 5.0
        assert info.f_d.shape == info.zeta.shape == (4,)
        assert 6.0 < info.f_d[0] < 8.0  # at Q1 with 5 kg

    @pytest.mark.parametrize(
        ("body", "words"),
        [
            ("self.n += 1\n        return q_ref if self.n < 8 else {}['gain']", ["KeyError", "tick 7"]),
            (
                "self.n += 1\n        return q_ref if self.n < 8 else q_ref * float('nan')",
                ["tick 7", "finite"],
            ),
            ("return q_ref[:5]", ["tick 0", "(5,)", "(6,)"]),
            ("return 'left'", ["tick 0", "str"]),
            ("return q_ref + 1e300", ["tick 0", "1e+300", "joint 1"]),
            ("return 0.999 * q_ref", ["does not end", "rad from the target"]),
            ("self.y = self.y + 0.001 * (q_ref - self.y)\n        return self.y", ["does not end"]),
        ],
    )
    def test_faulty_shaper_is_reported_with_the_tick(self, own, task, body, words):
        candidate = own(
            "class Broken:\n"
            "    def reset(self, q):\n        self.n, self.y = 0, q\n"
            f"    def step(self, q_ref, info):\n        {body}\n"
        )
        with pytest.raises(ShaperFaultError) as fault:
            candidate.shaped(task)
        assert all(word in str(fault.value) for word in words), fault.value

    @pytest.mark.parametrize(
        ("text", "words"),
        [
            ("import nowhere_to_be_found", "ModuleNotFoundError"),
            ("x = 1", "neither a class"),
            ("class A:\n    def step(self, q, info): ...\nclass B(A):\n    ...", "A, B"),
            (
                "class A:\n    def __init__(self, x): ...\n    def step(self, q, info): ...",
                "no arguments",
            ),
        ],
    )
    def test_file_without_a_shaper_is_refused(self, own, text, words):
        with pytest.raises(CandidateError, match=words):
            load_shaper(Path(own(text).path))


PEEKING = {
    "remembers the last run": """
        past = []

        class Memory:
            def reset(self, q):
                past.append([])

            def step(self, q_ref, info):
                past[-1].append(q_ref.copy())
                tick = len(past[-1]) - 1
                if len(past) > 1 and len(past[0]) > tick + 5 and (past[0][tick] == q_ref).all():
                    return past[0][tick + 5]
                return q_ref
    """,
    "looks where the target is kept": """
        import sys
        import numpy as np

        class Spy:
            def reset(self, q):
                self.q = q

            def step(self, q_ref, info):
                frame = sys._getframe()
                for _ in range(5):
                    for value in list(frame.f_locals.values()):
                        move = getattr(value, "move", None)
                        if move is not None:
                            return q_ref + 1e-9 * np.array(move.target)
                    frame = frame.f_back
                return q_ref
    """,
}


class TestDishonesty:
    @pytest.mark.parametrize("text", PEEKING.values(), ids=PEEKING)
    def test_shaper_that_uses_future_samples_is_rejected(self, own, task, text):
        candidate = own(text)
        with pytest.raises(ShaperFaultError, match="uses future samples"):
            check_causal(candidate, task)

    def test_shaper_with_random_output_is_rejected(self, own, task, ur5e):
        candidate = own("import random\ndef step(q_ref, info):\n    return q_ref + 1e-12 * random.random()")
        assert "uses future samples" in inspect(candidate, ur5e, [task.move])

    def test_delay_longer_than_declared_is_rejected(self, own, task):
        with pytest.raises(ShaperFaultError, match="declares a delay of 20 ms, and ends 3"):
            own(HONEST.replace("0.04", "0.02")).shaped(task)

    def test_drift_after_the_end_is_rejected(self, own, task):
        text = """
            class Drifts:
                def reset(self, q):
                    self.last, self.ticks = q, 0

                def step(self, q_ref, info):
                    self.ticks = self.ticks + 1 if (q_ref == self.last).all() else 0
                    self.last = q_ref
                    return q_ref + 1e-4 * min(max((self.ticks - 50) / 100, 0.0), 1.0)
        """
        with pytest.raises(ShaperFaultError, match="moves after its"):
            own(text).shaped(task)

    @pytest.mark.parametrize("every", [False, pytest.param(True, marks=pytest.mark.nightly)])
    def test_listed_methods_pass_the_checks(self, ur5e, modal, task, every):
        listed = some(["none", *names("bench")], ur5e, modal)
        for candidate in listed if every else {type(one): one for one in listed}.values():
            assert inspect(candidate, ur5e, [task.move]) is None, candidate.name
            candidate.shaped(task)

    def test_method_that_gets_the_target_is_marked(self, ur5e, modal, task):
        told = {one.name for one in some(names("bench"), ur5e, modal) if one.needs_target}
        frozen = {"zv_frozen_at_end", "zv_3_modes_frozen_at_end"}
        assert told == {"auto-target", *frozen, "double_s_as_zv", "double_s_as_auto"}

        class Untold(Named):
            needs_target = False

        aimed = Recipe("auto-target", modal)
        check_causal(Named(aimed, "auto-target", ""), task)
        with pytest.raises(ShaperFaultError, match=r"up to tick .* from tick"):
            check_causal(Untold(aimed, "auto-target", ""), task)


class TestElastic:
    def test_elastic_feed_forward_reaches_the_drives_at_its_tick(self, ur5e, modal, task):
        class Bare(Named):
            driven = SampleMethod.driven

        def made(kind, *arms):
            case = Case(ur5e, task.move, arms=tuple(ARMS[place] for place in arms))
            method = kind(Recipe("elastic", modal), "elastic", "")
            rows = measure(Job(case, (method,), ("declared_delay_ms", "residual_m_s2"), as_served=False))
            return list(rows)

        whole = made(Named, 0, 7)
        for ours, theirs in zip(whole, made(Bare, 0, 7), strict=True):
            assert ours["declared_delay_ms"] == pytest.approx(theirs["declared_delay_ms"] + 1e3 * PERIOD)
            assert ours["residual_m_s2"] < 0.5 * theirs["residual_m_s2"]
        assert made(Named, 7) == whole[1:]  # nothing stays of the arm before


class TestOwn:
    def test_product_of_constant_delay_keeps_the_limits(self, ur5e, modal):
        (product,) = some(["product"], ur5e, modal)
        (move,) = draw_moves(ur5e, 1, 5, (0.0, 5.0)).moves
        reference = point_to_point(np.array(move.start), np.array(move.target))
        # With a tenth more declared than is rated: the most that the bench does.
        shaped = product.shaped(Task(ur5e, replace(move, mass=1.1 * ur5e.limits.payload), reference))
        qd, qdd = (np.abs(np.diff(shaped.q, order, axis=0)).max() / PERIOD**order for order in (1, 2))
        assert qd <= (1.0 + 1e-6) * PAPER.velocity
        assert qdd <= 1.005 * PAPER.acceleration
        assert 0.08 < shaped.delay < 0.15


class TestArms:
    @pytest.mark.parametrize("arm", ARMS, ids=lambda arm: arm.name)
    def test_every_arm_rests_at_its_start(self, ur5e, arm):
        start = np.array(ur5e.poses["Q3"])
        at_rest = np.tile(start, (10, 1))
        made = arm.make(ur5e, ur5e.payload, 1)
        line = ControlLine(ur5e, start, ur5e.payload)
        alpha = best_tool_acceleration(line.follow(at_rest, at_rest).simulate(made, 1))
        assert np.abs(alpha).max() < 1e-6

    def test_every_seed_scatters_stiffness_and_gains(self, ur5e):
        (scattered,) = (arm for arm in ARMS if arm.name == "scattered")
        first, again, other = (scattered.make(ur5e, ur5e.payload, seed).description for seed in (1, 1, 2))
        assert first == again != other
        for name in ("gear_stiffness", "velocity_gain", "position_gain"):
            ratio = np.divide(getattr(first.drives, name), getattr(ur5e.drives, name))
            np.testing.assert_allclose(np.abs(ratio - 1.0), 0.15)


class TestScores:
    def test_distance_from_a_path_does_not_depend_on_time(self):
        path = np.column_stack([np.linspace(0.0, 1.0, 50), np.zeros(50)])
        assert path_error(path, path[::3] + 1e-3 * np.array([0.3, 0.0])) < 1e-12 + 1e-3
        assert path_error(path, np.array([[0.5, 0.02], [0.2, -0.01]])) == pytest.approx(0.02)

    def test_leaderboard_ranks_or_gives_the_reason(self, ur5e, modal, own):
        """One is found out before it moves, and one when it does."""
        early = replace(own("def step(q_ref, info):\n    return q_ref[:5]"), name="early")
        standing = [*some(["none", "zv", "double_s_as_zv"], ur5e, modal), early]
        moves = draw_moves(ur5e, 1, 0, (0.0, 5.0)).moves
        facts = {"moves_made": 1, "seed": 0, "robot": "UR5e", "calibration": "", "command": ""}
        asked = StudyRequest(description=ur5e, moves=moves, methods=standing, quick=True, facts=facts)
        made = study(asked)
        made = replace(made, cases=[replace(case, arms=ARMS[:1]) for case in made.cases])
        done = made.frame([row for job in made.jobs() for row in measure_each(job)])
        spoilt = done.with_columns(
            error=pl.when(pl.col("shaper") == "double_s_as_zv").then(pl.lit("the shaper gives NaN at tick 7"))
        )
        board = made.result(done, {"date": "2026-11-23"}).values
        assert [row["shaper"] for row in board["summary"] if not row["ranked"]] == ["early"]
        found = {row["shaper"]: row for row in board["summary"]}
        assert "tick 0" in found["early"]["fault"]
        assert found["none"]["less_percent_median"] in {None, 0.0}
        assert found["zv"]["residual_m_s2_median"] < found["none"]["residual_m_s2_median"]
        assert [row["place"] for row in board["summary"][:3]] == [1, 2, 3]
        assert any(row["pareto"] for row in board["summary"][:3])
        assert found["double_s_as_zv"]["path_error_mrad"] is None
        written = page_of("shaperbench", board)
        assert all(row["shaper"] in written for row in board["summary"])
        assert "Measured on 2026-11-23" in written
        lost = {row["shaper"]: row for row in made.result(spoilt, {}).values["summary"] if not row["ranked"]}
        assert lost["double_s_as_zv"]["fault"] == "gives NaN at tick 7 (payload error +0 %)"

    def test_all_shapers_of_references_run_curved_paths(self, ur5e, modal):
        none, zv, planned = some(["none", "zv", "double_s_as_zv"], ur5e, modal)
        moves = draw_moves(ur5e, 2, 0, (0.0, 5.0)).moves
        assert bend(none, ur5e, moves) == pytest.approx(0.0, abs=1e-3)
        assert 0.5 < bend(zv, ur5e, moves) < 10.0
        assert bend(planned, ur5e, moves) is None
