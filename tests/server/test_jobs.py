"""What waits for the controller's thread: in order, and within a step others' before the stepping client's own."""

from hypothesis import given
from hypothesis import strategies as st

from tvist_server.jobs import Jobs

CLIENTS = st.sampled_from(["stepper", "other", None])


def test_what_comes_while_jobs_are_done_waits_for_the_next_time():
    jobs, done = Jobs(), []
    jobs.post(lambda: (done.append(1), jobs.post(lambda: done.append(2))))
    jobs.do_waiting()
    assert done == [1]
    jobs.do_waiting()
    assert done == [1, 2]


def test_nothing_to_do_is_said():
    assert not Jobs().do_next(timeout=0.0)


@given(st.lists(st.lists(CLIENTS, max_size=5), max_size=8), st.lists(CLIENTS, max_size=5))
def test_within_a_step_others_are_served_at_once_and_every_client_in_its_order(ticks, later):
    """A step, before whose ticks these clients each send something; and what they send after it."""
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
