"""Dead-man's switch: the arm stops in time and within its limits when a streaming client is killed or suspended.

Times are those of the recording, whose journal has the tick of the last set-point.
"""

import random
import signal
from pathlib import Path

import numpy as np
import pytest
from tests.conformance.served import SLOWER, Served
from tests.conformance.wire import Q1, STOPPED, TICK

from tvist_lab.recordings.mcap_file import read

from .bystander import Bystander

pytestmark = pytest.mark.realtime

CLIENT = Path(__file__).with_name("dying_client.py")
WITHIN = 0.26  # longest time from the last set-point to the start of the stop [s]
WAYS = [(how, options) for options in ((), ("announced",)) for how in (signal.SIGKILL, signal.SIGSTOP)]
"""How a client ends, and whether it had a liveliness token, without which a killed one is noticed later."""
STREAM = ("amplitude=0.4", "rate=2.0")  # up to 0.8 rad/s and 1.6 rad/s²; the limits are 1.5 and 2


@pytest.mark.parametrize(
    ("times", "most"), [(1, 60), pytest.param(20, 200, marks=[pytest.mark.nightly, pytest.mark.timeout(900)])]
)
def test_arm_stops_within_260_ms_and_its_limits_after_a_client_dies(times, most, start, tmp_path, measured):
    """Each client ends after a random number of set-points; nightly some are suspended or have a token."""
    path, rng, ends = tmp_path / "run.mcap", random.Random(0), []
    with Served("--record", str(path), *SLOWER) as served:
        with Bystander(served.endpoint) as bystander:
            limits = bystander.info()["limits"]
            for number in range(times):
                how, options = WAYS[number % len(WAYS)]
                setpoints = rng.randrange(5, most)
                ends.append(stream_and_end(start, served.endpoint, bystander, how, options, setpoints))
            bystander.assert_undisturbed()
        assert served.end() == 0
    content = read(path)
    assert content.complete
    assert not any(content.dropped.values())
    silences = [silence(content, end) for end in ends]
    measured(f"silence of {times} before the stop [s of tick time]", (min(silences), max(silences)))
    assert 0.0 < min(silences) <= max(silences) <= WITHIN
    hardest, torque = (np.max([of(content, end) for end in ends], axis=0) for of in (acceleration, moment))
    measured("acceleration of q* of each joint [rad per s^2]", hardest.round(2).tolist())
    measured("torque by inverse dynamics of each joint [N m]", torque.round(1).tolist())
    assert not [event for event in content.events if event.kind == "protective_stop"]
    assert (hardest <= np.array(limits["acceleration"]) * (1 + 1e-6)).all()
    assert (torque <= np.array(limits["torque"])).all()


def stream_and_end(start, endpoint, bystander, how, options, setpoints):
    """Let a client stream and end; return the ticks of its start, of the stop and of rest."""
    token = bystander.command("take_control", client="home")["token"]
    assert bystander.command("simulation.reset", token=token, q=Q1, mode="RUNNING")["type"] == "done"
    assert bystander.command("release_control", token=token) == {"type": "done"}
    began = bystander.until_later(5)["tick"]
    client = start(CLIENT, endpoint, "stream", "lease_s=1", *options, *STREAM)
    bystander.next("state", lambda state: (state["setpoint_sequence"] or 0) > setpoints)
    client.send_signal(how)
    stopped = bystander.event("stream_stopped", began)
    rest = bystander.next("state", lambda state: state["runtime_state"] == STOPPED)
    client.kill()
    bystander.event("lease_lost", began)
    return began, stopped["tick"], rest["tick"]


def silence(content, end):
    """Return the time from the last accepted set-point to the stop [s]."""
    began, stopped, _ = end
    setpoints = [entry.tick for entry in content.journal if entry.kind == "setpoint"]
    taken = [tick for tick in setpoints if began < tick <= stopped]
    return (stopped - taken[-1]) * TICK


def acceleration(content, end):
    """Return each joint's largest |q̈*| until rest, by second differences [rad/s^2], shape (6,)."""
    began, _, rest = end
    target = np.array([state.target_q for state in content.states if began <= state.tick <= rest])
    return np.abs(np.diff(target, 2, axis=0)).max(axis=0) / TICK**2


def moment(content, end):
    """Return each joint's largest |τ*| until rest [N m], shape (6,)."""
    began, _, rest = end
    moments = [state.target_moment for state in content.states if began <= state.tick <= rest]
    return np.abs(moments).max(axis=0)
