"""The searches themselves: they find what is broken."""

import json
import subprocess
import sys

import numpy as np
import pytest

from tvist_controller.trajectory import PathStop
from tvist_lab.safety import programs, sequences, stops
from tvist_lab.safety.markdown import page
from tvist_lab.safety.report import Counts, broken, search
from tvist_plant.description import load

UR5E = load("ur5e")


@pytest.mark.parametrize("number", range(12))
def test_whatever_is_sent_the_promises_hold(number):
    sequences.Sequence(UR5E, number).run()


@pytest.mark.parametrize("number", range(6))
def test_whatever_programs_do_the_promises_hold(number):
    programs.ProgramSequence(UR5E, number).run()


@pytest.mark.parametrize(
    ("ahead", "late", "share", "says"),
    [
        (
            1e-15,
            0,
            -0.0061,
            ("than 1e-6 nrad (rounding),", "none came to rest later", "stayed at least 0.61 % below"),
        ),
        (2e-6, 3, 0.02, ("than 2e+03 nrad,", "more than 3 ticks later", "was at most 2.00 % above")),
    ],
)
def test_the_page_says_on_which_side_of_a_bound_the_worst_stop_was(ahead, late, share, says):
    stopped = {
        "count": 1, "broken": [], "worst_ahead_rad": ahead, "worst_off_rad": 0.0, "worst_late_ticks": late,
        "worst_torque_share": share, "worst_penetration_of_the_flexible_arm_m": None, "kinds": {},
    }  # fmt: skip
    text = page({"robot": "ur5e", "stops": stopped}, "a command")
    assert all(part in text for part in says), text


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


def test_the_command_prints_one_object_and_refuses_what_it_cannot_do():
    command = [
        sys.executable,
        "-m",
        "tvist_cli",
        "search",
        "--streams",
        "0",
        "--changes",
        "0",
        "--sequences",
        "0",
    ]
    done = subprocess.run([*command, "--stops", "1", "--json"], capture_output=True, text=True, check=True)
    assert json.loads(done.stdout)["stops"]["broken"] == []
    for wrong, words in ((["--stops", "-1"], "stops is -1"), (["--stops", "0"], "nothing to search")):
        refused = subprocess.run([*command, *wrong], capture_output=True, text=True, check=False)
        assert refused.returncode == 2
        assert words in refused.stderr
