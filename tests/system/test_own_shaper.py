"""A user's own shaper is listed, served and evaluated; when it fails, the arm stops."""

import pytest
from tests.conformance.served import Served
from tests.conformance.wire import Q1, Wire
from tests.system.shell import tvist

MINE = '''
from pathlib import Path

import numpy as np

from tvist_shaping import FirShaper, zv


def mine(f_d, zeta):
    """Zero vibration, as long as there is no file called stop."""
    if Path(__file__).with_name("stop").exists():
        raise RuntimeError("there is a file called stop")
    return zv(f_d, zeta)


MEAN = FirShaper("mean", "the mean of 40 ms", lambda f_d, zeta: np.full(20, 0.05), taps=20)
'''


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "mine.py").write_text(MINE, encoding="utf-8")
    return tmp_path


def test_command_shapers_lists_an_own_shaper(folder, called):
    places = ("--shaper", "mine.py:mine", "--shaper", "mine.py:MEAN")
    listed = called("shapers", "--json", *places).assert_done().json["shapers"]
    zv, mine, mean = (next(one for one in listed if one["name"] == name) for name in ("zv", "mine", "mean"))
    same = {"name", "description"}
    assert {k: v for k, v in mine.items() if k not in same} == {k: v for k, v in zv.items() if k not in same}
    assert mine["description"] == "Zero vibration, as long as there is no file called stop."
    assert (len(mean["amplitudes"]), mean["mean_delay_ms"]) == (20, pytest.approx(19.0))


@pytest.mark.nightly
def test_processes_of_a_study_load_an_own_shaper_from_its_file(folder):
    """A study of this size uses several processes."""
    options = ("--robot", "one-joint", "--payload", 1, "--moves", 10, "--clean", "--json")
    study = tvist("study", "moves", "--shapers", "mine.py:mine", "zv", *options, cwd=folder)
    found = study.assert_done().json
    assert [one["name"] for one in found["methods"]] == ["mine", "zv", "waiting"]
    rows = [(one["shaper"], one | {"shaper": ""}) for one in found["moves"]]
    mine, zv = ([row for name, row in rows if name == wanted] for wanted in ("mine", "zv"))
    assert mine == zv
    assert mine


@pytest.mark.realtime
def test_failing_own_shaper_stops_the_arm_but_not_the_server(folder, monkeypatch):
    monkeypatch.chdir(folder)
    with Served("--shaper", "mine.py:mine", "--record", "mine.mcap") as served, Wire(served.endpoint) as wire:
        wire.listen("event")
        token = wire.command("take_control", client="mover", lease_s=600.0)["token"]

        def move(angle):
            motion = wire.command("move_j", token=token, q=[angle, *Q1[1:]])["id"]
            wire.wait("event", lambda event: event["kind"] == "motion_done" and event["id"] == motion)

        move(0.05)
        (folder / "stop").touch()
        served.wait_until_said("there is a file called stop in line 12 of mine.py for f_d = ")
        assert wire.command("move_j", token=token, q=Q1)["code"] == "wrong_mode"
        assert wire.command("set_shaper", token=token, name="zv") == {"type": "done"}
        assert wire.command("unlock_protective_stop", token=token) == {"type": "done"}
        move(0.0)
