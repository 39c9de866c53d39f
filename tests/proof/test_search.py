"""The searches themselves: they find what is broken."""

import json
from pathlib import Path

import numpy as np
import pytest
from proof.__main__ import main
from proof.search import draws, programs, sequences, stops
from proof.search.report import Counts, broken, search, tables
from proof.search.subject import Subject, own_calibration, speeds

from tvist_controller.api.line import paper_payload
from tvist_controller.trajectory import PathStop
from tvist_plant.description import load
from tvist_plant.plant import PERIOD
from tvist_protocol.commands import MoveJ
from tvist_shaping import BUILT_IN

UR5E = load("ur5e")
SEVEN = str(Path(__file__).parents[1] / "plant" / "urdf" / "seven.urdf")


@pytest.mark.parametrize("number", range(2))  # `python -m proof search` tries them by the hundred
def test_whatever_is_sent_the_promises_hold(number):
    sequences.Sequence(UR5E, number).run()


@pytest.mark.parametrize("number", range(2))
def test_whatever_programs_do_the_promises_hold(number):
    programs.ProgramSequence(UR5E, number).run()


def test_equal_numbers_are_equal_cases():
    one, other = (stops.draw(UR5E, 3) for _ in range(2))
    assert repr(one) == repr(other)
    first, second = sequences.Sequence(UR5E, 5), sequences.Sequence(UR5E, 5)
    first.run(10)
    second.run(10)
    assert first.done == second.done
    assert np.array_equal(first.robot.references, second.robot.references)


def test_a_stop_that_overshoots_is_found(monkeypatch):
    """A stop that goes on at its first velocity for ten ticks breaks the promise, and every search says so."""
    honest = PathStop.next

    def late(self):
        self._wasted = getattr(self, "_wasted", 0) + 1
        if self._wasted <= 10:
            q, qd, _ = self.states(np.array([0.002]))
            return q[0] + 0.002 * self._wasted * qd[0] * 1.5
        return honest(self)

    monkeypatch.setattr(PathStop, "next", late)
    found = [stops.judge(UR5E, stops.draw(UR5E, number, ("plain", "power off"))) for number in range(8)]
    assert any(not outcome.kept for outcome in found)


def test_a_search_counts_what_it_tried_and_gives_a_sentence_for_what_it_found():
    result = search(Counts(stops=2, streams=1, changes=2, sequences=1), 9)
    assert [result[name]["count"] for name in ("stops", "streams", "changes", "sequences")] == [2, 1, 2, 1]
    assert broken(result) == []
    assert result["stops"]["worst_penetration_of_the_flexible_arm_m"] is None


def test_robots_take_turns_each_with_its_own_calibration_and_every_shaper_is_tried():
    tried = [SEVEN, "ur3e"]
    result = search(Counts(stops=2, streams=2), 3, robots=tried)
    assert result["robots"] == tried
    assert result["stops"]["count"] == 2
    for columns, rows in tables(result):
        assert {len(row) for row in rows} == {len(columns)}
    names = [draws.SHAPERS[0], "um_zvd", "ei3_exact", "elastic-auto"]
    for arm in map(load, [*tried, "ur30"]):
        known = own_calibration(arm)
        assert known.robot == arm.robot.model
        q = np.array(next(iter(arm.poses.values())))
        for name in names:
            robot = Subject(arm, q, paper_payload(arm), shaper=name)
            assert robot.controller.cycle.line.filter.tvist.name == name
    assert set(names) < set(draws.SHAPERS) == set(BUILT_IN.names())


def test_a_joint_above_its_own_limit_is_found_whatever_the_others_may():
    arm = load("ur3e")  # whose wrist may turn twice as fast as its base
    time = np.arange(50)[:, np.newaxis] * PERIOD
    for joint, share in ((0, 2.0), (5, 1.0)):
        references = np.where(np.arange(6) == joint, 2.0 * arm.limits.velocity[0] * time, 0.0)
        assert speeds(arm, references)[0] == pytest.approx(share, rel=1e-4)


def test_an_arm_of_two_joints_is_searched_too():
    assert broken(search(Counts(streams=2, sequences=1), 1, robots=["one-joint"])) == []


@pytest.mark.parametrize("name", ["ur3e", "ur30", SEVEN])
def test_limits_are_drawn_at_the_arm_s_own_and_above_which_it_refuses(name):
    arm, random = load(name), np.random.default_rng(1)
    drawn = [draws.limits(arm, random) for _ in range(100)]
    robot = Subject(arm, np.array(next(iter(arm.poses.values()))), paper_payload(arm, 0.0))
    for key, most in draws.own_limits(arm).items():
        values = [one[key] for one in drawn]
        assert max(values) == most
        assert min(values) < 0.5 * most
    for _ in range(20):
        key, value = draws.above(arm, random)
        reply = robot.send(MoveJ, q=tuple(robot.references[0]), **{key: value})
        assert (reply.code, reply.where) == (draws.CODES[key], key)


def test_the_command_prints_one_object_and_refuses_what_it_cannot_do(capsys):
    nothing = ["search", "--streams", "0", "--changes", "0", "--sequences", "0"]
    assert main([*nothing, "--stops", "1", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["stops"]["broken"] == []
    for wrong, words in (
        (["--stops", "-1"], "is -1"),
        (["--stops", "0"], "nothing to search"),
        (["--stops", "1", "--robot", "none.toml"], "none.toml"),
    ):
        with pytest.raises(SystemExit) as ended:
            main([*nothing, *wrong])
        assert ended.value.code == 2
        assert words in capsys.readouterr().err


def test_the_command_fails_with_a_sentence_for_each_broken_promise(capsys, monkeypatch):
    monkeypatch.setattr(stops, "ROUNDING", -1.0)  # no stop is so far behind
    assert main(["search", "--stops", "2", "--streams", "0", "--changes", "0", "--sequences", "0"]) == 1
    said = capsys.readouterr()
    assert "ur5e, stops 0: " in said.err
    assert "2 of 2 cases broke a promise" in said.err
    assert "| broken | 2 |" in said.out
