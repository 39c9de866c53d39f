"""Who is who, by liveliness tokens."""

import pytest

from tvist_controller.dispatch.rights import NoControlError, Presence


@pytest.fixture
def presence():
    return Presence()


def test_one_session_under_a_name_is_the_client_s(presence):
    presence.seen("a", "1f")
    presence.seen("b", "2f")
    assert (presence.session_of("a"), presence.session_of("b"), presence.session_of("c")) == (
        "1f",
        "2f",
        None,
    )
    assert presence.has("a", "1f")
    assert not presence.has("a", "2f")


def test_a_token_that_does_not_say_is_of_the_session_without_a_name(presence):
    presence.seen("a", "")
    assert presence.session_of("a") == ""


@pytest.mark.parametrize("second", ["2f", ""])
def test_of_two_under_one_name_nobody_can_tell_who_asks(presence, second):
    presence.seen("a", "1f")
    presence.seen("a", second)
    with pytest.raises(NoControlError) as caught:
        presence.session_of("a")
    assert caught.value.reply.code == "no_control"
    assert "'a'" in caught.value.reply.why
    presence.gone("a", second)
    assert presence.session_of("a") == "1f"


def test_a_session_is_found_under_all_its_names(presence):
    presence.seen("a", "1f")
    presence.seen("b", "1f")
    presence.seen("b", "2f")
    assert presence.clients_of("1f") == ["a", "b"]
    presence.gone("a", "1f")
    assert presence.clients_of("1f") == ["b"]


def test_what_went_and_what_never_came_may_go_again(presence):
    presence.gone("a", "1f")
    presence.seen("a", "1f")
    presence.gone("a", "1f")
    presence.gone("a", "1f")
    assert presence.session_of("a") is None
