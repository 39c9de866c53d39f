"""The deadman: a sender killed or frozen in mid-stream stops the arm, in time and inside the limits, every time.

Time is the robot's own, from the recording: its journal says before which tick the last set-point was taken.
"""

import random
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from tests import forked
from tests.conformance.served import PATIENCE, Served
from tests.conformance.wire import Q1, STOPPED, TICK

from tvist_lab.recordings.mcap_file import read

from .bystander import Bystander

pytestmark = pytest.mark.realtime

CLIENT = Path(__file__).with_name("dying_client.py")
WITHIN = 0.26
"""From the last set-point to the beginning of the stop [s]."""
WAYS = (
    (signal.SIGKILL, ()),
    (signal.SIGSTOP, ()),
    (signal.SIGKILL, ("announced",)),
    (signal.SIGSTOP, ("announced",)),
)
"""How a sender ends, and whether the robot knew of its presence: where it did, a killed one is missed at once."""
STREAM = ("amplitude=0.4", "rate=2.0")
"""Up to 0.8 rad/s and 1.6 rad/s², within the 1.5 and 2 of such a stream."""


@pytest.mark.parametrize(
    "times", [2, pytest.param(20, marks=[pytest.mark.nightly, pytest.mark.timeout(900)])]
)
def test_a_sender_that_dies_or_freezes_is_stopped_within_260_ms_inside_the_limits(times, tmp_path, measured):
    path, rng, ends = tmp_path / "run.mcap", random.Random(0), []
    with Served("--record", str(path)) as served:
        with Bystander(served.endpoint) as bystander:
            limits = bystander.info()["limits"]
            for number in range(times):
                how, options = WAYS[number % len(WAYS)]
                ends.append(stream_and_end(served.endpoint, bystander, how, options, rng.randrange(5, 200)))
            bystander.assert_undisturbed()
        assert served.end() == 0
    content = read(path)
    assert content.complete
    assert not any(content.dropped.values())
    assert len(ends) == times
    silences = [silence(content, end) for end in ends]
    measured(f"silence of {times} before the stop [s of tick time]", (min(silences), max(silences)))
    assert 0.0 < min(silences) <= max(silences) <= WITHIN
    most, torque = (
        np.max([of(content, end) for end in ends], axis=0) for of in (acceleration, target_moment)
    )
    measured("acceleration of q* of each joint [rad per s^2]", most.round(2).tolist())
    measured("torque by inverse dynamics of each joint [N m]", torque.round(1).tolist())
    assert not [event for event in content.events if event.kind == "protective_stop"]
    assert (most <= np.array(limits["acceleration"]) * (1 + 1e-6)).all()
    assert (torque <= np.array(limits["torque"])).all()


def stream_and_end(endpoint, bystander, how, options, setpoints):
    """Have a client stream and end; ticks at which it moved, at which its stream was stopped, and of rest."""
    token = bystander.command("take_control", client="home")["token"]
    assert bystander.command("simulation.reset", token=token, q=Q1, mode="RUNNING")["type"] == "done"
    assert bystander.command("release_control", token=token) == {"type": "done"}
    began = bystander.until_later(5)["tick"]
    client = forked.Popen(
        [sys.executable, CLIENT, endpoint, "stream", "lease_s=1", *options, *STREAM],
        stdout=subprocess.PIPE,
    )
    try:
        assert client.stdout.readline() == b"under way\n"
        bystander.next("state", lambda state: (state["setpoint_sequence"] or 0) > setpoints)
        client.send_signal(how)
        stopped = bystander.wait(
            "event", lambda event: event["kind"] == "stream_stopped" and event["tick"] > began
        )
        rest = bystander.next("state", lambda state: state["runtime_state"] == STOPPED)
    finally:
        client.kill()
        client.wait(PATIENCE)
        client.stdout.close()
    bystander.wait("event", lambda event: event["kind"] == "lease_lost" and event["tick"] > began)
    return began, stopped["tick"], rest["tick"]


def silence(content, end):
    """From the last set-point that was taken to the stop [s]."""
    began, stopped, _ = end
    taken = [
        entry.tick for entry in content.journal if entry.kind == "setpoint" and began < entry.tick <= stopped
    ]
    return (stopped - taken[-1]) * TICK


def acceleration(content, end):
    """Largest of each joint from before the stream to rest, by second differences of q* [rad/s^2], shape (6,)."""
    began, _, rest = end
    target = np.array([state.target_q for state in content.states if began <= state.tick <= rest])
    return np.abs(np.diff(target, 2, axis=0)).max(axis=0) / TICK**2


def target_moment(content, end):
    """Largest τ* of each joint meanwhile [N m], shape (6,)."""
    began, _, rest = end
    return np.abs([state.target_moment for state in content.states if began <= state.tick <= rest]).max(
        axis=0
    )
