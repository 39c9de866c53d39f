"""The judge of ring-downs: right on sines whose truth is known, and made-up stops are as they say."""

import json

import numpy as np
import pytest
from proof.__main__ import main
from proof.ringing.made_up import SPEEDS, made_up
from proof.ringing.matrix_pencil import WINDOW, matrix_pencil
from proof.ringing.report import RECORDED, of_made_up, report

from tvist_lab.metrics.motion import motions


def rung(random, modes, rate=266.0):
    time = np.arange(0.0, 1.0, 1.0 / rate)
    alpha = 0.02 * random.standard_normal((len(time), 3))
    for f_d, zeta, amplitude in modes:
        sigma = 2.0 * np.pi * f_d * zeta / np.sqrt(1.0 - zeta**2)
        axis = random.normal(size=3)
        wave = np.exp(-sigma * (time - WINDOW[0])) * np.cos(
            2.0 * np.pi * f_d * time + random.uniform(0.0, 6.0)
        )
        alpha += amplitude * np.outer(wave, axis / np.linalg.norm(axis))
    return time, alpha


@pytest.mark.parametrize("seed", range(10))
def test_matrix_pencils_find_the_modes_of_a_linear_ring(seed):
    random = np.random.default_rng(seed)
    f_d = random.uniform(7.0, 15.0)
    modes = [(f_d, 0.04, 1.0), (f_d + random.uniform(2.0, 4.0), 0.03, 0.6)]
    found = matrix_pencil(*rung(random, modes))
    for (f_d, zeta, amplitude), mode in zip(modes, found[:2], strict=True):
        assert mode.f_d == pytest.approx(f_d, rel=0.01)
        assert mode.zeta == pytest.approx(zeta, abs=0.01)
        assert mode.amplitude == pytest.approx(amplitude, rel=0.2)


def test_matrix_pencils_find_no_mode_in_noise_or_in_too_short_a_rest():
    random = np.random.default_rng(3)
    assert matrix_pencil(*rung(random, [])) == []
    time, alpha = rung(random, [(9.0, 0.04, 1.0)])
    assert matrix_pencil(time[:100], alpha[:100]) == []


@pytest.mark.parametrize("name", SPEEDS)
def test_a_made_up_stop_is_one_motion_with_its_stop_and_like_modes(name):
    for seed in range(10):
        made = made_up(SPEEDS[name], seed)
        (motion,) = motions(made.recording)
        assert made.recording.time[motion.shaped_stop] == pytest.approx(made.stop, abs=0.02)
        f_d = np.sort([mode.f_d for mode in made.modes])
        assert 1 <= len(f_d) <= 4
        assert np.all((np.diff(f_d) > 1.8) & (np.diff(f_d) < 4.2))
        assert all(0.013 < mode.zeta < 0.06 for mode in made.modes)


def test_the_laboratory_finds_the_strongest_mode_of_made_up_stops(measured):
    summary = report(list(of_made_up(10, 400, lambda _: None)))["summary"]
    for kind, figures in summary.items():
        measured(kind, str(figures))
        assert figures["refused"] == 0
        assert figures["one as strong %"] >= 95.0
        assert figures["f_d holds %"] >= 90.0
        assert figures["ζ holds %"] >= 85.0
        assert figures["two %"] >= 95.0


def test_it_judges_the_recorded_stops(capsys, tmp_path):
    assert main(["ringing", "--made-up", "0", "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    for figures in result["summary"].values():
        assert figures["strongest %"] == figures["f_d holds %"] == figures["two %"] == 100.0
    assert len(result["stops"]) == 7
    (tmp_path / "notes.txt").write_text("no log\n")
    (tmp_path / RECORDED.name).write_bytes(RECORDED.read_bytes())
    assert main(["ringing", str(tmp_path), "--made-up", "0"]) == 0
    shown = capsys.readouterr()
    assert "notes.txt: left out" in shown.err
    assert shown.out.count(RECORDED.name) == 2 * 7  # in the table of modes, and in that of how stops go on


def test_a_folder_that_is_not_there_is_refused(capsys, tmp_path):
    with pytest.raises(SystemExit, match="2"):
        main(["ringing", str(tmp_path / "gone")])
    assert "there is no log at" in capsys.readouterr().err
