"""Leases."""

import math

import pytest

from tvist_controller.dispatch.rights import Authority, NoControlError, check_token


def authority(*, realtime=True, instance=""):
    return Authority(lambda _: None, lambda *_, **__: None, realtime=realtime, instance=instance)


@pytest.fixture
def session():
    return authority()


def refusal(action, *arguments):
    with pytest.raises(NoControlError) as caught:
        action(*arguments)
    return caught.value.reply


@pytest.mark.parametrize("token", ["", "a", "a#2", "b#1", "a#1 "])
def test_any_other_token_is_stale_and_renews_nothing(session, token):
    session.take("a", 2.0, 0.0)
    error = refusal(session.renew, token, 1.0)
    assert error.code == "stale_token"
    assert "'a'" in error.why
    assert session.ends == 2.0


def test_without_timeouts_nothing_runs_out():
    session = authority(realtime=False)
    session.take("a", 0.1, 0.0)
    assert session.ends == math.inf


@pytest.mark.parametrize("gone", [("a", "2f"), ("b", "1f"), ("a", "")])
def test_the_going_of_another_one_ends_nothing(session, gone):
    lease = session.take("a", 30.0, 0.0, "1f")
    session.end_rights(*gone)
    assert session.lease is lease


def test_a_client_of_which_no_session_is_known_is_not_missed(session):
    lease = session.take("a", 30.0, 0.0)
    session.end_rights("a", "")
    assert session.lease is lease


def test_a_token_of_before_a_restart_is_never_valid_again():
    before, after = (authority(instance=instance) for instance in ("1f", "2e"))
    old = before.take("a", 30.0, 0.0).token
    new = after.take("a", 30.0, 0.0).token
    assert (old, new) == ("a#1f.1", "a#2e.1")
    with pytest.raises(NoControlError, match="not that of the current lease"):
        check_token(after.lease, old)
