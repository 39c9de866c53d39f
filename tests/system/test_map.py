"""`tvist study map` and `tvist shapers --sensitivity`: what they write for people, for programs and for papers."""

import json

import pytest

from .test_command_line import tvist


def test_a_map_is_one_object_and_a_figure_of_each_quantity(tmp_path):
    board = tmp_path / "map.json"
    ended = tvist(
        "study", "map", "--points", 5, "--payload", 1, "--calibration", "ur5e_modal", "--shaper", "zvd",
        "--figures", tmp_path, "--format", "svg", "--columns", 1, "--output", board, "--json",
    ).assert_done()  # fmt: skip
    assert (ended.json["robot"], ended.json["payload_kg"], ended.json["shaper"]) == ("ur5e", 1.0, "zvd")
    assert json.loads(board.read_text(encoding="utf-8")) == ended.json
    for key, maps in ended.json["maps"].items():
        assert [len(maps[kind]) for kind in ("identified", "true", "error_percent")] == [5, 5, 5]
        assert ended.json["errors"][key]["median_percent"] < 10.0
    assert {path.name for path in tmp_path.glob("*.svg")} == {"map_f_d.svg", "map_zeta.svg", "map_delay.svg"}


def test_sensitivity_has_a_curve_of_each_shaper_and_its_band(tmp_path):
    drawn = ("--figures", tmp_path, "--format", "pdf", "--json")
    ended = tvist("shapers", "--sensitivity", "zv", "ei", "--errors", -20, 20, *drawn).assert_done()
    curves = {curve["name"]: curve for curve in ended.json["shapers"]}
    assert list(curves) == ["zv", "ei"]
    for curve in curves.values():
        low, high = curve["error_of_5_percent"]
        for error, left in zip(ended.json["error_percent"], curve["residual_percent"], strict=True):
            assert left < 5.01 or not low < error < high
    assert curves["zv"]["residual_percent"][200] == pytest.approx(0.0, abs=1e-9)
    assert (tmp_path / "sensitivity.pdf").read_bytes().startswith(b"%PDF")


def test_people_get_tables():
    assert "5 % from" in tvist("shapers", "--sensitivity").assert_done().out
    said = tvist("study", "map", "--points", 3, "--robot", "one-joint").assert_done().out
    assert "f_d Hz" in said
    assert "error % median" in said
