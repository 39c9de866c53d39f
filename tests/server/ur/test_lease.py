"""Control for clients that know no lease: one for each host, taken with the first command, given back at the end."""

from tvist_protocol import commands as c
from tvist_protocol.replies import Done
from tvist_server.gateways.ur.lease import ConnectionControl, HostLease

from .desks import ControllerThread
from .hosts import hear


def take(desk, client):
    """Control for a client that reaches the controller directly."""
    return desk.controller.receive(c.TakeControl(client=client))


def lease(desk, host="127.0.0.1"):
    return HostLease(desk, host, lambda action: action())


def slow(fraction):
    return lambda token: c.SetSpeed(token=token, fraction=fraction)


def test_control_is_taken_with_the_first_change_and_given_back_with_the_last_connection():
    desk, replies = ControllerThread(late=True), []
    host = lease(desk)
    first, second, watcher = (ConnectionControl(host) for _ in range(3))
    hear(watcher.ask(c.Stop()), replies)
    desk.answer()
    assert desk.holder() is None
    for connection in (first, first, second):
        hear(connection.change(slow(0.5)), replies)
    desk.answer()
    assert replies == [Done()] * 4
    assert desk.kinds.count("TakeControl") == 1
    assert desk.holder() == "ur-127.0.0.1"
    watcher.leave()
    first.leave()
    desk.answer()
    assert desk.holder() == "ur-127.0.0.1"
    second.leave()
    desk.answer()
    assert desk.holder() is None


def test_commands_sent_while_control_is_being_taken_go_in_their_order():
    desk, replies = ControllerThread(late=True), []
    host = lease(desk)
    connection = ConnectionControl(host)
    for fraction in (0.1, 0.2, 0.3):
        hear(connection.change(slow(fraction)), replies)
    desk.answer()
    assert desk.kinds == ["TakeControl", "SetSpeed", "SetSpeed", "SetSpeed"]
    assert desk.controller.io().target_speed_fraction == 0.3


def test_where_somebody_else_has_control_the_refusal_comes_back_each_time():
    desk, replies = ControllerThread(late=True), []
    connection = ConnectionControl(lease(desk))
    token = take(desk, "anna").token
    assert connection.held_by_other
    for _ in range(2):
        hear(connection.change(slow(0.5)), replies)
        desk.answer()
    assert [(reply.code, "anna" in reply.why) for reply in replies] == [("no_control", True)] * 2
    desk.controller.receive(c.ReleaseControl(token=token))
    assert not connection.held_by_other
    hear(connection.change(slow(0.5)), replies)
    desk.answer()
    assert replies[-1] == Done()


def test_control_that_was_lost_is_taken_again():
    desk, replies = ControllerThread(late=True), []
    connection = ConnectionControl(lease(desk))
    hear(connection.change(slow(0.5)), replies)
    desk.answer()
    desk.controller.session.release()
    hear(connection.change(slow(0.4)), replies)
    desk.answer()
    assert replies == [Done(), Done()]
    assert desk.kinds == ["TakeControl", "SetSpeed", "SetSpeed", "TakeControl", "SetSpeed"]


def test_a_lease_is_kept_alive_while_there_is_one():
    desk = ControllerThread(late=True)
    host = lease(desk)
    host.keep_alive()
    ConnectionControl(host).change(slow(0.5))
    desk.answer()
    host.keep_alive()
    desk.answer()
    assert desk.kinds == ["TakeControl", "SetSpeed", "KeepAlive"]


def test_control_that_somebody_holds_for_a_host_is_shared_and_not_given_back_with_the_last_connection():
    desk, replies = ControllerThread(late=True), []
    token = take(desk, "ur-127.0.0.1").token
    host = lease(desk)
    host.adopt(token, "the program")
    connection = ConnectionControl(host)
    assert not connection.held_by_other
    hear(connection.change(slow(0.5)), replies)
    desk.answer()
    assert replies == [Done()]
    assert "TakeControl" not in desk.kinds
    connection.leave()
    desk.answer()
    assert desk.controller.session.lease.token == token
