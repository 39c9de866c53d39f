"""Leases."""

import pytest

from tvist_controller.authority.session import NoControlError, Session, check_token


@pytest.fixture
def session():
    return Session(timeouts=True)


def refusal(action, *arguments):
    with pytest.raises(NoControlError) as caught:
        action(*arguments)
    return caught.value


@pytest.mark.parametrize("token", ["", "a", "a#2", "b#1", "a#1 "])
def test_any_other_token_is_stale_and_renews_nothing(session, token):
    session.take("a", 2.0, 0.0)
    error = refusal(session.renew, token, 1.0)
    assert error.code == "stale_token"
    assert "'a'" in error.why
    assert session.ends == 2.0


def test_without_timeouts_nothing_runs_out():
    session = Session(timeouts=False)
    session.take("a", 0.1, 0.0)
    assert not session.expired(1e9)


@pytest.mark.parametrize("gone", [("a", "2f"), ("b", "1f"), ("a", "")])
def test_the_going_of_another_one_ends_nothing(session, gone):
    session.take("a", 30.0, 0.0, "1f")
    assert not session.client_gone(*gone)


def test_a_client_of_which_no_session_is_known_is_not_missed(session):
    session.take("a", 30.0, 0.0)
    assert not session.client_gone("a", "")


def test_a_token_of_before_a_restart_is_never_valid_again():
    before, after = (Session(timeouts=True, instance=instance) for instance in ("1f", "2e"))
    old = before.take("a", 30.0, 0.0).token
    new = after.take("a", 30.0, 0.0).token
    assert (old, new) == ("a#1f.1", "a#2e.1")
    with pytest.raises(NoControlError, match="not that of the current lease"):
        check_token(after.lease, old)
