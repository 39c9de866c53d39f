"""`tvist evaluate`, `paths` and `shaperbench` from a shell: seconds, one JSON object, one sentence if it goes wrong."""

import json

import pytest
from tests.system.test_command_line import tvist

MOVES = [
    {"start": [0.0, -2.2, 1.9, -1.3, 0.0, 0.0], "target": [1.2, -1.4, 1.5, -1.6, 0.0, 0.0]},
    {"start": [1.2, -1.4, 1.5, -1.6, 0.0, 0.0], "target": [0.0, -2.2, 1.9, -1.3, 0.0, 0.0], "payload": 1.5},
]
PEEKS = """
past = []


class Memory:
    def reset(self, q):
        past.append([])

    def step(self, q_ref, info):
        past[-1].append(q_ref.copy())
        return past[0][min(len(past[-1]) + 5, len(past[0]) - 1)]
"""


@pytest.fixture
def moves(tmp_path):
    path = tmp_path / "moves.json"
    path.write_text(json.dumps(MOVES), encoding="utf-8")
    return path


class TestEvaluate:
    def test_moves_of_a_file_have_the_keys_that_are_promised(self, moves):
        told = (
            tvist("evaluate", "--moves", moves, "--payload", 5, "--shaper", "zv", "--json").assert_done().json
        )
        assert list(told["baselines"]) == [
            "waiting", "equal_duration_double_s", "double_s_of_one_period", "zv_frozen_at_end",
            "mzv_for_payload", "ei_for_payload", "ei3_for_payload", "fixed_mzv", "fixed_ei2", "fixed_ei3",
        ]  # fmt: skip
        assert told["disturbances"] == ["friction", "gear", "noise"]
        assert len(told["moves"]) == 2
        for move in told["moves"]:
            assert {
                "unshaped_peak_m_s2", "shaped_peak_m_s2", "reduction_percent", "delay_ms", "still_after_ms",
                "peak_acceleration_ratio", "peak_velocity_ratio",
            } <= set(move)  # fmt: skip
            assert set(move["still_after_ms"]) == {"unshaped", "shaped"}
            assert 0.0 <= move["shaped_peak_m_s2"] < move["unshaped_peak_m_s2"]
        assert [move["payload_kg"] for move in told["moves"]] == [5.0, 1.5]
        assert set(told["reduction_percent"]) == {"median", "p5", "min"}
        assert set(told["delay_ms"]) == {"median", "max"}
        assert set(told["peak_acceleration_ratio"]) == {"median", "p90", "max"}

    def test_random_moves_can_be_kept_and_made_again(self, tmp_path):
        saved = tmp_path / "drawn.json"
        first = tvist(
            "evaluate", "--random", 2, "--seed", 5, "--payload", "uniform", "--clean", "--shaper", "auto",
            "--no-baselines", "--save-moves", saved, "--figures", tmp_path / "figures", "--json",
        ).assert_done().json  # fmt: skip
        again = tvist(
            "evaluate", "--moves", saved, "--disturbances", "none", "--shaper", "auto", "--no-baselines", "--json"
        ).assert_done().json  # fmt: skip
        assert first["moves"] == again["moves"]
        assert first["baselines"] == {}
        assert (
            (first["plant"], first["disturbances"])
            == (again["plant"], again["disturbances"])
            == ("clean", [])
        )
        assert 0.0 < first["free_of_collision"] <= 1.0
        assert {path.name for path in (tmp_path / "figures").iterdir()} == {"moves.png", "one_move.png"}

    def test_words_are_for_people(self, moves):
        moves.write_text(json.dumps(MOVES[1:]), encoding="utf-8")
        said = tvist("evaluate", "--moves", moves, "--payload", 5).assert_done()
        assert "unshaped m/s²" in said.out
        assert "fixed_ei3" in said.out
        assert "carry something else" in said.err

    def test_disturbances_act_one_by_one_and_the_targets_knower_is_a_shaper_like_any(self, moves):
        told = {
            name: tvist(
                "evaluate", "--moves", moves, "--shaper", "auto-target", "--disturbances", name, "--no-baselines",
                "--json",
            ).assert_done().json
            for name in ("none", "noise", "friction,gear")
        }  # fmt: skip
        assert [one["plant"] for one in told.values()] == [
            "clean", "with noise alone", "with friction and gear alone"
        ]  # fmt: skip
        assert told["noise"]["moves"] == told["none"]["moves"]  # the truth has no noise
        assert told["friction,gear"]["peak_m_s2"]["median"] > told["none"]["peak_m_s2"]["median"]
        assert told["none"]["reduction_percent"]["min"] > 95.0

    def test_a_move_beyond_a_limit_is_named(self, tmp_path):
        path = tmp_path / "moves.json"
        path.write_text(json.dumps([MOVES[0], {**MOVES[0], "target": [0, 0, 7, 0, 0, 0]}]), encoding="utf-8")
        tvist("evaluate", "--moves", path).assert_failed(2, "move 2", "joint 3", "elbow", "6.28319")


class TestPaths:
    def test_a_path_has_the_keys_that_are_promised(self, tmp_path):
        told = tvist(
            "study", "paths", "--random", 1, "--kind", "arc", "--shapers", "zv", "auto", "--seed", 3,
            "--payload", 5, "--clean", "--markdown", tmp_path / "page.md", "--json",
        ).assert_done().json  # fmt: skip
        (path,) = told["paths"]
        assert (path["kind"], path["payload_kg"], told["plant"]) == ("arc", 5.0, "clean")
        assert list(path["shaped"]) == ["zv", "auto"]
        for ways in path["shaped"].values():
            assert list(ways) == ["along", "joints", "joints_unslowed"]
            assert ways["along"]["off_mm"] < ways["joints"]["off_mm"]
            for one in ways.values():
                assert one["peak_m_s2"] < path["unshaped_peak_m_s2"]
                assert one["delay_ms"] > 0.0
        assert set(told["summary"]) == {"all", "arc"}
        assert {"refused", "stopping", "circle", "seed", "calibration"} <= set(told)
        page = (tmp_path / "page.md").read_text(encoding="utf-8")
        typed = "tvist study paths --random 1 --kind arc --shapers zv auto --seed 3 --payload 5 --clean --markdown"
        assert page.startswith(f"```sh\n{typed} ")

    def test_words_and_figures_are_for_people(self, tmp_path):
        said = tvist(
            "study", "paths", "--random", 3, "--shapers", "auto", "--figures", tmp_path / "figures"
        ).assert_done()  # fmt: skip
        for words in ("paths with blends", "joint by joint", "in motion", "circle"):
            assert words in said.out
        assert "refused by the planner" in said.err
        assert {path.name for path in (tmp_path / "figures").iterdir()} == {
            "path_shaping.png", "path_corner.png"
        }  # fmt: skip


class TestShaperBench:
    def test_a_cheat_is_named_and_not_ranked(self, tmp_path):
        path, board = tmp_path / "peeks.py", tmp_path / "board.json"
        path.write_text(PEEKS, encoding="utf-8")
        given = ("--quick", "--moves", 1, "--against", "zv", "--shaper", path, "--output", board, "--json")
        ended = tvist("shaperbench", *given).assert_failed(1, "not ranked", "peeks at the future")
        rows = {row["name"]: row for row in ended.json["shapers"]}
        assert [rows[name]["ranked"] for name in ("none", "zv", "peeks")] == [True, True, False]
        assert "peeks at the future" in rows["peeks"]["fault"]
        assert json.loads(board.read_text(encoding="utf-8")) == ended.json
        assert set(rows["zv"]["by_arm"]) == set(ended.json["arms"])
        assert len(ended.json["arms"]) == 10


class TestTracking:
    def test_each_shaper_has_errors_at_each_speed_and_the_page_the_same(self, tmp_path):
        made = tmp_path / "page.md"
        told = tvist(
            "study", "tracking", "--shapers", "auto", "--speeds", 1, 0.5, "--markdown", made, "--json"
        ).assert_done().json  # fmt: skip
        assert told["speeds_rad_s"] == [0.5, 1.0]
        assert [(one["name"], one["shaped"]) for one in told["shapers"]] == [("none", False), ("auto", True)]
        for one in told["shapers"]:
            assert {"error_rad", "within", "speed_at_tolerance_rad_s", "lag_ms"} <= set(one["ramp"])
            assert one["ramp"]["within"] == one["jump"]["within"] == [True, True]
            assert one["ramp"]["error_rad"][1] > one["ramp"]["error_rad"][0] > 0.0
        page = made.read_text(encoding="utf-8")
        assert told["command"] in page
        assert all(f"{error:.3f}" in page for one in told["shapers"] for error in one["jump"]["error_rad"])
