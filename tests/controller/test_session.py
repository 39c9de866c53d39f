"""Leases."""

import pytest

from tvist_controller.session import NoControlError, Session, check_token


@pytest.fixture
def session():
    return Session(timeouts=True)


def refusal(action, *arguments):
    with pytest.raises(NoControlError) as caught:
        action(*arguments)
    return caught.value


def test_one_client_takes_control(session):
    lease = session.take("a", 30.0, 1.0)
    assert session.lease == lease
    assert (lease.client, lease.seconds, lease.ends) == ("a", 30.0, 31.0)
    assert lease.token


def test_another_is_refused_with_the_holder_in_the_sentence(session):
    lease = session.take("alice", 30.0, 0.0)
    error = refusal(session.take, "bob", 30.0, 1.0)
    assert error.code == "no_control"
    assert "'alice'" in error.why
    assert session.lease == lease


def test_the_same_client_gets_a_new_lease_and_its_old_token_is_stale(session):
    first = session.take("a", 30.0, 0.0)
    second = session.take("a", 5.0, 2.0)
    assert second.token != first.token
    assert second.ends == 7.0
    assert refusal(session.renew, first.token, 3.0).code == "stale_token"
    assert session.renew(second.token, 3.0).ends == 8.0


def test_a_token_renews(session):
    lease = session.take("a", 2.0, 0.0)
    assert session.renew(lease.token, 1.5).ends == 3.5
    assert not session.expired(3.4)


@pytest.mark.parametrize("token", ["", "a", "a#2", "b#1", "a#1 "])
def test_any_other_token_is_stale_and_renews_nothing(session, token):
    session.take("a", 2.0, 0.0)
    error = refusal(session.renew, token, 1.0)
    assert error.code == "stale_token"
    assert "'a'" in error.why
    assert session.lease.ends == 2.0


def test_without_a_lease_every_token_is_without_control(session):
    assert refusal(session.renew, "", 0.0).code == "no_control"
    lease = session.take("a", 2.0, 0.0)
    session.release()
    assert refusal(session.renew, lease.token, 0.0).code == "no_control"


def test_tokens_never_come_back(session):
    tokens = []
    for client in ("a", "b", "a", "a"):
        tokens.append(session.take(client, 1.0, 0.0).token)
        session.release()
    assert len(set(tokens)) == 4


def test_it_runs_out_at_the_exact_time(session):
    session.take("a", 2.0, 1.0)
    assert not session.expired(2.999999)
    assert session.expired(3.0)


def test_without_timeouts_nothing_runs_out():
    session = Session(timeouts=False)
    session.take("a", 0.1, 0.0)
    assert not session.expired(1e9)


def test_without_a_lease_nothing_runs_out(session):
    assert not session.expired(1e9)


def test_the_going_of_its_session_ends_a_lease(session):
    assert session.take("a", 30.0, 0.0, "1f").session == "1f"
    assert session.client_gone("a", "1f")


@pytest.mark.parametrize("gone", [("a", "2f"), ("b", "1f"), ("a", "")])
def test_the_going_of_another_one_ends_nothing(session, gone):
    session.take("a", 30.0, 0.0, "1f")
    assert not session.client_gone(*gone)


def test_a_client_of_which_no_session_is_known_is_not_missed(session):
    session.take("a", 30.0, 0.0)
    assert not session.client_gone("a", "")


def test_renewal_keeps_watching(session):
    session.renew(session.take("a", 30.0, 0.0, "").token, 1.0)
    assert session.client_gone("a", "")


def test_control_that_was_handed_over_is_not_the_giver_s_any_more(session):
    session.take("a", 30.0, 0.0, "1f")
    session.hand_over("b", 1.0)
    assert not session.client_gone("a", "1f")
    assert (session.lease.client, session.lease.session) == ("b", None)


def test_a_token_of_before_a_restart_is_never_valid_again():
    before, after = (Session(timeouts=True, instance=instance) for instance in ("1f", "2e"))
    old = before.take("a", 30.0, 0.0).token
    new = after.take("a", 30.0, 0.0).token
    assert (old, new) == ("a#1f.1", "a#2e.1")
    with pytest.raises(NoControlError, match="not that of the current lease"):
        check_token(after.lease, old)
