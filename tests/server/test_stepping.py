"""The right to step the clock has one holder, and during a step other clients are served."""

import msgpack
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.controller.robots import UR5E, setup
from tests.examples import examples

from tvist_controller.controller import Controller
from tvist_controller.dispatch.admission import Admitted, admit
from tvist_controller.dispatch.rights import Lease
from tvist_controller.host import Host
from tvist_controller.instruments.report import Sink
from tvist_controller.loopback import LoopbackHost
from tvist_lab.in_process import free_setup
from tvist_protocol import commands as c
from tvist_protocol.codec import decode_reply, encode
from tvist_protocol.explain import EXPLAINED_BYTES
from tvist_protocol.replies import Accepted, Refused
from tvist_protocol.simulation import SimulationStep, StepSetpoint
from tvist_server.intake import RobotIntake
from tvist_server.jobs import Jobs

LEASE = Lease("anna", "anna#1", 30.0, None)
HOLD = Lease("bert", "bert#clock1", None)
Q2 = UR5E.poses["Q2"]
LONG = tuple(StepSetpoint(sequence=n, q=(3.0,) * 6) for n in range(1000))


def test_a_long_step_is_decoded_only_for_the_holder_of_the_clock():
    def long(token, motion_token):
        return encode(SimulationStep(token=token, ticks=1000, setpoints=LONG, motion_token=motion_token))

    data = long(HOLD.token, LEASE.token)
    assert len(data) > EXPLAINED_BYTES
    admitted = admit(data, LEASE, HOLD)
    assert isinstance(admitted, Admitted)
    assert admitted.client == "bert"
    refused = admit(long(LEASE.token, None), LEASE, HOLD)
    assert (refused.code, refused.where) == ("no_control", "token")
    refused = admit(long(HOLD.token, "anna#0"), LEASE, HOLD)
    assert (refused.code, refused.where) == ("stale_token", "motion_token")
    stranger = msgpack.packb({"type": "simulation.step", "token": "x", "setpoints": [{}] * 100_000})
    assert admit(stranger, LEASE, HOLD).code == "stale_token"


@pytest.mark.parametrize(
    ("command", "client"),
    [
        (c.TakeClock(client="bert"), "bert"),
        (c.ReleaseClock(token=HOLD.token), "bert"),
        (SimulationStep(token=HOLD.token, ticks=1), "bert"),
        (c.TakeControl(client="anna"), "anna"),
        (c.MoveJ(token=LEASE.token, q=Q2), "anna"),
        (c.Stop(), None),
    ],
)
def test_the_client_of_a_command_is_known_by_token_or_name(command, client):
    assert admit(encode(command), LEASE, HOLD).client == client


def test_control_and_clock_end_with_the_session():
    host, jobs, replies = Host(Controller(setup(clock="lockstep")), Sink()), Jobs(), []
    intake = RobotIntake(host, jobs.post, lambda admitted, reply: reply(host.carry_out(admitted)))
    intake.client_seen("bert", "1f")
    for command in (c.TakeClock(client="bert"), c.TakeControl(client="bert")):
        intake.request(encode(command), replies.append)
    assert [type(reply) for reply in replies] == [Accepted, Accepted]
    intake.client_gone("bert", "2f")
    intake.client_gone("anna", "1f")
    jobs.do_waiting()
    assert host.standing.clock.client == "bert"
    intake.session_gone("1f")
    jobs.do_waiting()
    assert (host.standing.clock, host.standing.lease) == (None, None)


def test_a_nested_step_is_refused_but_a_stop_is_carried_out():
    host, said = LoopbackHost(free_setup()), []
    token = decode_reply(host.request("", encode(c.TakeControl(client="me")))).token
    step = encode(SimulationStep(token=token, ticks=2))
    host.subscribe("event", lambda _: said.append(decode_reply(host.request("", encode(c.Stop())))))
    host.request("", encode(c.MoveJ(token=token, q=Q2)))
    host.subscribe("state", lambda _: said.append(decode_reply(host.request("", step))) if said else None)
    assert decode_reply(host.request("", step)).tick == 2
    refused = [reply for reply in said if isinstance(reply, Refused)]
    assert {reply.code for reply in refused} == {"busy"}
    assert len(refused) == 2
    stops = [entry.tick for entry in host.entries if entry.message["type"] == "stop"]
    assert stops == [2, 3], "the motion begins at tick 1 and has stopped at tick 2"


def test_jobs_posted_by_a_job_wait_for_the_next_turn():
    jobs, done = Jobs(), []
    jobs.post(lambda: (done.append(1), jobs.post(lambda: done.append(2))))
    for expected in ([1], [1, 2]):
        jobs.do_waiting()
        assert done == expected
    assert not jobs.do_next(timeout=0.0)


CLIENTS = st.sampled_from(["stepper", "other", None])


@examples(40)
@given(st.lists(st.lists(CLIENTS, max_size=5), max_size=8), st.lists(CLIENTS, max_size=5))
def test_during_a_step_jobs_of_other_clients_are_done_in_order(ticks, later):
    """Clients post jobs before each tick of a step and after it."""
    jobs, done, sent = Jobs(), [], []

    def post(client):
        number = len(sent)
        sent.append((number, client))
        jobs.post(lambda: done.append((number, client)), client)

    def step():
        for clients in ticks:
            for client in clients:
                post(client)
            jobs.do_others("stepper")
            assert done == [job for job in sent if job[1] != "stepper"]

    jobs.post(step, "stepper")
    assert jobs.do_next(timeout=0.0)
    for client in later:
        post(client)
    while jobs.do_next(timeout=0.0):
        pass
    assert sorted(done) == sent
    for client in ("stepper", "other", None):
        own = [job for job in done if job[1] == client]
        assert own == sorted(own)
