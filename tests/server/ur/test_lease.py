"""Control for clients without leases: one lease for each host, from its first command to its last connection."""

import pytest

from tvist_protocol import commands as c
from tvist_protocol.replies import Done
from tvist_server.gateways.ur.lease import ConnectionControl, HostLease

from .hosts import hear
from .served_controller import ControllerThread


class Host:
    """Connections of one host to a controller, whose replies come with `answer`."""

    def __init__(self):
        self.served, self.replies = ControllerThread(late=True), []
        self.answer, self.kinds = self.served.answer, self.served.kinds
        self.lease = HostLease(self.served, "127.0.0.1", lambda action: action())
        self.connection, self.other = ConnectionControl(self.lease), ConnectionControl(self.lease)

    def slow(self, fraction, connection=None):
        control = connection or self.connection
        hear(control.change(lambda token: c.SetSpeed(token=token, fraction=fraction)), self.replies)

    def taken_by(self, client):
        """Take control for a client outside the interfaces; return its token."""
        return self.served.controller.receive(c.TakeControl(client=client)).token


@pytest.fixture
def host():
    return Host()


def test_control_lasts_from_the_first_change_to_the_last_connection(host):
    watcher = ConnectionControl(host.lease)
    hear(watcher.ask(c.Stop()), host.replies)
    host.answer()
    assert host.served.holder() is None
    for connection in (host.connection, host.connection, host.other):
        host.slow(0.5, connection)
    host.answer()
    assert host.replies == [Done()] * 4
    assert host.kinds.count("TakeControl") == 1
    for leaving, holder in ((watcher, "ur-127.0.0.1"), (host.connection, "ur-127.0.0.1"), (host.other, None)):
        assert host.served.holder() == "ur-127.0.0.1"
        leaving.leave()
        host.answer()
        assert host.served.holder() == holder


def test_commands_sent_while_control_is_taken_keep_their_order(host):
    for fraction in (0.1, 0.2, 0.3):
        host.slow(fraction)
    host.answer()
    assert host.kinds == ["TakeControl", "SetSpeed", "SetSpeed", "SetSpeed"]
    assert host.served.controller.io().target_speed_fraction == 0.3


def test_commands_are_refused_while_another_client_has_control(host):
    token = host.taken_by("anna")
    assert host.connection.held_by_other
    for _ in range(2):
        host.slow(0.5)
        host.answer()
    assert [(reply.code, "anna" in reply.why) for reply in host.replies] == [("no_control", True)] * 2
    host.served.controller.receive(c.ReleaseControl(token=token))
    assert not host.connection.held_by_other
    host.slow(0.5)
    host.answer()
    assert host.replies[-1] == Done()


def test_lost_control_is_taken_again(host):
    for fraction in (0.5, 0.4):
        host.slow(fraction)
        host.answer()
        host.served.controller.session.release()
    assert host.replies == [Done(), Done()]
    assert host.kinds == ["TakeControl", "SetSpeed", "SetSpeed", "TakeControl", "SetSpeed"]


def test_only_a_held_lease_is_renewed(host):
    host.lease.keep_alive()
    host.slow(0.5)
    host.answer()
    host.lease.keep_alive()
    host.answer()
    assert host.kinds == ["TakeControl", "SetSpeed", "KeepAlive"]


def test_an_adopted_lease_is_shared_and_not_released(host):
    token = host.taken_by("ur-127.0.0.1")
    host.lease.adopt(token, "the program")
    assert not host.connection.held_by_other
    host.slow(0.5)
    host.answer()
    assert host.replies == [Done()]
    assert "TakeControl" not in host.kinds
    host.connection.leave()
    host.answer()
    assert host.served.controller.session.lease.token == token
