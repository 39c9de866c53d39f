"""Landings on a surface: what the page about shaping and contact says of an arm that touches."""

import numpy as np
import pytest
from proof.impact.landing import landed
from proof.impact.report import HARD, SOFT, draw, report, tables


@pytest.fixture(scope="module")
def made():
    return {
        (program, stiffness, shaper): landed("ur5-light", program, stiffness, shaper, 3)
        for program, stiffness in (("moves", HARD), ("moves", SOFT), ("guarded", HARD), ("force", SOFT))
        for shaper in ("none", "auto")
    }


def test_a_shaped_move_meets_a_surface_more_slowly_and_softly(made):
    plain, shaped = (made["moves", HARD, shaper].impact() for shaper in ("none", "auto"))
    assert shaped["meets_at"] < 0.6 * plain["meets_at"]
    assert shaped["peak"] < plain["peak"]
    assert shaped["bounces"] == 0


def test_a_tool_in_contact_rings_faster_than_in_the_air(made):
    for stiffness in (SOFT, HARD):
        one = made["moves", stiffness, "none"]
        (air, free), (touching, held) = one.ring("near", "up"), one.ring("pressed", None)
        assert held > 2.5 * free
        assert touching < 0.3 * air
        assert made["moves", stiffness, "auto"].ring("near", "up")[0] < 0.1 * air


def test_force_mode_settles_at_its_force_and_the_surface_pushes_as_deep_as_it_is_pressed(made):
    one = made["force", SOFT, "auto"]
    assert one.impact()["last"] == pytest.approx(20.0, abs=0.5)
    np.testing.assert_allclose(one.force[-100:], -SOFT * one.height[-100:], rtol=0.03)


def test_all_rows_have_figures_and_a_picture(made, tmp_path):
    result = report(made)
    assert [len(rows) for _, rows in tables(result)] == [4, 2, 2, 4]
    draw(made, tmp_path / "impact.png")
    assert (tmp_path / "impact.png").stat().st_size > 20_000
