"""A shaper of one's own from a shell: served, evaluated, refused in a sentence, and stopped when it fails."""

import pytest
from tests.conformance.served import Served
from tests.conformance.wire import Wire
from tests.system.shell import tvist

MINE = '''
from pathlib import Path

import numpy as np

from tvist_shaping import FirShaper, Impulses, custom, zv


def mine(f_d, zeta):
    """Zero vibration, as long as there is no file called stop."""
    if Path(__file__).with_name("stop").exists():
        raise RuntimeError("there is a file called stop")
    return zv(f_d, zeta)


def unequal(f_d, zeta):
    return Impulses(np.array([0.5, 0.4]), np.array([0.0, 0.5 / f_d]))


LONG = custom("long", [0.5, 0.5], [0.0, 9.0])
MEAN = FirShaper("mean", "the mean of 40 ms", lambda f_d, zeta: np.full(20, 0.05), taps=20)
'''


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "mine.py").write_text(MINE, encoding="utf-8")
    return tmp_path


def test_it_stands_in_the_table_and_the_json_of_shapers(folder):
    places = ("--shaper", "mine.py:mine", "--shaper", "mine.py:MEAN")
    listed = tvist("shapers", "--json", *places, cwd=folder).assert_done().json["shapers"]
    zv, mine, mean = (next(one for one in listed if one["name"] == name) for name in ("zv", "mine", "mean"))
    same = {"name", "description"}
    assert {k: v for k, v in mine.items() if k not in same} == {k: v for k, v in zv.items() if k not in same}
    assert mine["description"] == "Zero vibration, as long as there is no file called stop."
    assert (len(mean["amplitudes"]), mean["mean_delay_ms"]) == (20, pytest.approx(19.0))


def test_processes_that_share_the_work_load_it_again(folder):
    """Ten motions and more are shared among processes; the shaper travels there as its file."""
    same = ("--robot", "one-joint", "--payload", 1, "--moves", 10, "--clean", "--json")
    mine = tvist("study", "moves", "--shapers", "mine.py:mine", *same, cwd=folder).assert_done().json
    assert [one["name"] for one in mine["methods"]] == ["mine", "waiting"]
    theirs = tvist("study", "moves", "--shapers", "zv", *same).assert_done().json
    for one, other in zip(mine["moves"], theirs["moves"], strict=True):
        assert one | {"shaper": ""} == other | {"shaper": ""}


class TestServed:
    @pytest.mark.realtime
    def test_one_that_fails_stops_the_arm_and_leaves_the_server(self, folder, monkeypatch):
        monkeypatch.chdir(folder)
        with Served("--shaper", "mine.py:mine", "--record", "mine.mcap") as served:
            at = ("--endpoint", served.endpoint)
            assert "moved to Q2" in tvist("move", "Q2", *at).assert_done().out
            (folder / "stop").touch()
            served.wait_until_said("there is a file called stop in line 12 of mine.py for f_d = ")
            tvist("move", "Q1", *at).assert_failed(1, "PROTECTIVE_STOP")
            with Wire(served.endpoint) as wire, wire.control() as token:
                assert wire.command("set_shaper", token=token, name="zv")["type"] == "done"
            tvist("unlock", *at).assert_done()
            assert "moved to Q2" in tvist("move", "Q2", *at).assert_done().out
