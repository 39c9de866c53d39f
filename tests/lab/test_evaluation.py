"""Moves by the hundred: what comes in, what is made of it, and that the answers are those of the line itself."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from tvist_controller.foresight.collision import CollisionModel
from tvist_controller.refusal import RefusalError
from tvist_controller.setup import body, paper_payload
from tvist_controller.sources import calibrations
from tvist_lab.studies.moves import study
from tvist_lab.study.catalogue import baselines, some
from tvist_lab.study.held_out import interval
from tvist_lab.study.line import PAPER, lengthened, point_to_point
from tvist_lab.study.measures import WORTH
from tvist_lab.study.moves import Move, MovesError, draw_moves, is_free, read_moves
from tvist_lab.study.recipes import FrequencyError, Recipe, RecipeError
from tvist_lab.study.request import StudyRequest
from tvist_lab.study.shaping import shape
from tvist_lab.study.work import measure
from tvist_lab.workspace import WORKSPACE
from tvist_plant.plant import PERIOD
from tvist_shaping.estimators.fixed import Fixed

KNOWN = calibrations.load("ur5e_5kg")


@pytest.fixture
def written(tmp_path, ur5e):
    def read(content):
        path = tmp_path / "moves.json"
        path.write_text(content if isinstance(content, str) else json.dumps(content), encoding="utf-8")
        return read_moves(path, ur5e, lambda: 5.0)

    return read


HOME = [0.0, -1.0, 1.0, -1.0, 0.0, 0.0]


def but(joint, angle):
    return [angle if number == joint else home for number, home in enumerate(HOME)]


class TestFiles:
    def test_move_has_start_and_target_and_optional_payload(self, written):
        first, second = written(
            [{"start": HOME, "target": but(0, 1.0), "payload": 0}, {"start": HOME, "target": but(1, 0.0)}]
        )
        assert first == Move(tuple(HOME), tuple(but(0, 1.0)), 0.0)
        assert second == Move(tuple(HOME), tuple(but(1, 0.0)), 5.0)

    @pytest.mark.parametrize(
        ("content", "words"),
        [
            ("[{", ["moves.json"]),
            ("{}", ["moves.json", "must be a list"]),
            ([], ["moves.json", "at least 1 entry"]),
            ([{"start": HOME}], ["move 1", "target"]),
            ([{"start": HOME, "target": but(0, 1.0), "payload": -1}], ["move 1", "payload", "0"]),
            (
                [{"start": HOME, "target": but(0, 1.0)}, {"start": HOME, "target": HOME}],
                ["move 2", "too short"],
            ),
            ([{"start": HOME, "target": HOME[:5]}], ["move 1", "target", "5 angles", "must be 6"]),
            ([{"start": HOME, "target": but(2, 9.0)}], ["move 1", "target", "joint 3", "elbow", "±6.28319"]),
            ([{"start": but(4, "x"), "target": HOME}], ["move 1", "start", "joint 5"]),
        ],
    )
    def test_wrong_moves_are_refused(self, written, content, words):
        with pytest.raises(MovesError) as error:
            written(content)
        assert all(word in str(error.value) for word in words), error.value


class TestDraws:
    def test_seed_draws_the_same_moves_for_any_number(self, ur5e):
        few, many = draw_moves(ur5e, 5, 3, (0.0, 5.0)), draw_moves(ur5e, 20, 3, (0.0, 5.0))
        assert few.moves == many.moves[:5]
        assert few.moves != draw_moves(ur5e, 5, 4, (0.0, 5.0)).moves

    def test_drawn_moves_are_in_the_workspace_and_free_of_collisions(self, ur5e):
        drawn = draw_moves(ur5e, 30, 7, (1.0, 4.0))
        collision = CollisionModel(ur5e, body(paper_payload(ur5e, 5.0)))
        for move in drawn.moves:
            start, target = np.array(move.start), np.array(move.target)
            for q in (start, target):
                assert (np.array(WORKSPACE.low) <= q[:4]).all()
                assert (q[:4] <= np.array(WORKSPACE.high)).all()
                assert not q[4:].any()
            assert 1.0 <= move.mass <= 4.0
            collision.declare(body(paper_payload(ur5e, move.mass)))
            assert is_free(collision, move)
            for share in np.linspace(0.0, 1.0, 50):
                assert collision.meeting(start + share * (target - start)) is None
        assert 0.0 < drawn.share <= 1.0

    def test_wrists_turn_only_if_permitted(self, ur5e):
        moves = draw_moves(ur5e, 20, 7, (0.0, 0.0), wrists=True).moves
        assert np.abs([move.target[4:] for move in moves]).max() > 1.5


class TestLine:
    def test_double_S_of_given_duration_takes_that_time(self, ur5e):
        start, target = np.array(ur5e.poses["Q1"]), np.array(ur5e.poses["Q3"])
        for ticks in (len(point_to_point(start, target)) + extra for extra in (0, 7, 40, 150)):
            longer = lengthened(start, target, ticks)
            assert abs(len(longer) - ticks) <= 1
            np.testing.assert_array_equal(longer[-1], target)
            assert np.abs(np.diff(longer, 2, axis=0)).max() <= (1.0 + 1e-9) * PAPER.acceleration * PERIOD**2

    def test_output_that_never_reaches_the_target_is_reported(self):
        short = SimpleNamespace(delay=0.0, step=lambda q: 0.999 * q)
        assert not shape(short, point_to_point(np.zeros(2), np.ones(2)), watched=False).ended


class TestRecipes:
    def test_frequency_error_scales_the_frequencies(self):
        wrong = FrequencyError(Fixed([10.0, 20.0], [0.1, 0.2]), -0.2)
        f_d, zeta = wrong.estimate(np.zeros(6))
        np.testing.assert_allclose(f_d, [8.0, 16.0])
        np.testing.assert_allclose(zeta, [0.1, 0.2])
        assert (wrong.modes, wrong.f_d_min, wrong.zeta_max) == (2, 8.0, 0.2)

    def test_several_modes_of_a_polynomial_and_an_unknown_shaper_are_refused(self, ur5e):
        with pytest.raises(RecipeError, match="tvist identify"):
            Recipe("zv", KNOWN, modes=3).make(ur5e, 5.0)
        with pytest.raises(RefusalError, match="zz"):
            Recipe("zz", KNOWN).make(ur5e, 5.0)


@pytest.fixture
def report(ur5e):
    """Make the report of moves with these unshaped and shaped peaks."""
    drawn = draw_moves(ur5e, 1, 0, (0.0, 5.0)).moves
    made = study(StudyRequest(description=ur5e, moves=drawn, methods=some(["zv"], ur5e, KNOWN), named=1))

    def of(*peaks):
        rows = [
            {
                "shaper": shaper, "arm": "calibrated", "status": "measured", "move": place, "payload_kg": 5.0,
                "unshaped_peak_m_s2": unshaped, "shaped_peak_m_s2": shaped, "delay_ms": 100.0,
                "reduction_percent": 100.0 * (1.0 - shaped / unshaped) if unshaped >= WORTH else None,
                "unshaped_still_after_ms": 1200.0, "peak_acceleration_ratio": 1.01,
            }
            for place, (unshaped, shaped) in enumerate(peaks, 1)
            for shaper in ("zv", "waiting")
        ]  # fmt: skip
        return made.result(made.frame(rows), {})

    return of


class TestReport:
    def test_percentages_omit_moves_without_vibration_with_a_note(self, report):
        result = report((1.0, 0.1), (2.0, 0.5), (0.5 * WORTH, 0.1 * WORTH))
        told = result.values["summary"][0]
        moves = result.study.tables_of(result)[0].entries
        assert [row["reduction_percent"] for row in moves] == [pytest.approx(90.0), pytest.approx(75.0), None]
        assert (told["counted"], told["rows"], told["never_still"]) == (2, 3, 3)
        less = [told[f"reduction_percent_{name}"] for name in ("median", "p5", "min")]
        assert less == pytest.approx([82.5, 75.75, 75.0])
        assert (told["delay_ms_median"], told["delay_ms_max"]) == (100.0, 100.0)
        peaks = [told[f"shaped_peak_m_s2_{name}"] for name in ("median", "p95")]
        assert peaks == pytest.approx([0.3, 0.48])
        assert any("1 of 3 moves have an unshaped peak below 0.2" in note for note in result.values["notes"])

    def test_moves_without_vibration_give_no_percentage(self, report):
        values = report((0.1, 0.05)).values
        assert values["summary"][0]["reduction_percent_median"] is None
        assert values["verdict"] == ["No move vibrates enough unshaped to show what zv does."]

    def test_interval_contains_the_percentile_of_a_known_distribution(self):
        random = np.random.default_rng(5)
        drawn = [interval(random.standard_normal(200), 50) for _ in range(60)]
        assert np.mean([low <= 0.0 <= high for low, high in drawn]) >= 0.85


class TestMoves:
    def test_results_of_the_papers_motion_equal_the_published_ones(self, ur5e):
        move = Move(ur5e.poses["Q1"], ur5e.poses["Q3"], 5.0)
        methods = (*some(["zv"], ur5e, KNOWN), *baselines(KNOWN, ur5e, (5.0, 5.0)))
        (job,) = study(StudyRequest(description=ur5e, moves=[move], methods=methods, named=1)).jobs()
        shaped, waiting, longer, *_ = measure(job)
        assert shaped["reduction_percent"] > 80.0
        assert 28.0 <= shaped["delay_ms"] <= 38.0  # half a period at Q3, where the mode is at 15 Hz
        assert waiting["reduction_percent"] == waiting["delay_ms"] == 0.0
        assert longer["shaper"] == "equal_duration_double_s"
        assert longer["delay_ms"] == pytest.approx(shaped["delay_ms"], abs=1.5e3 * PERIOD)
        assert longer["peak_acceleration_ratio"] <= 1.0 + 1e-9
