"""A secured robot, and sessions with its clients' keys."""

import pytest
from tests.conformance.served import Served
from tests.conformance.wire import Wire
from tests.system.keyring import free_tls_endpoint, made, shown

STREAMS = ("state", "event", "telemetry", "truth")


@pytest.fixture(scope="module")
def ring(tmp_path_factory):
    """Keys of a robot for two operators, a viewer, and a client whose rights were revoked."""
    people = ("--operator", "anna", "--operator", "otto", "--viewer", "wall", "--viewer", "gone")
    folder = made(tmp_path_factory.mktemp("keys") / "ring", *people)
    clients = folder / "clients.toml"
    lines = clients.read_text().splitlines(keepends=True)
    clients.write_text("".join(line for line in lines if '"gone"' not in line))
    return folder


@pytest.fixture(scope="module")
def served(ring):
    endpoint = free_tls_endpoint()
    with Served("--security", str(ring), "--truth", endpoint=endpoint) as served:
        yield served


@pytest.fixture
def session(served, ring):
    """Return a function that opens a session with a client's keys; each file can be replaced."""
    opened = []

    def open_as(name, mode="client", endpoint=served.endpoint, **files):
        wire = Wire(endpoint, settings={"mode": mode, **shown(ring / name, **files)})
        opened.append(wire)
        return wire

    yield open_as
    for wire in opened:
        wire.session.close()


@pytest.fixture
def operator(session):
    return session("anna").listen(*STREAMS)
