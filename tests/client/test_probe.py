"""Why no session could be opened, as a handshake of the client's own finds out, where the peer misbehaves."""

import gc
import socket
import struct

import pytest

from tvist_client.transports import certificates


@pytest.fixture
def reset(monkeypatch):
    """Address of a peer that has reset each connection before its client can say a word."""
    connect = socket.create_connection
    with socket.create_server(("127.0.0.1", 0)) as server:

        def connected(*args):
            made = connect(*args)
            peer, _ = server.accept()
            peer.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            peer.close()
            return made

        monkeypatch.setattr(socket, "create_connection", connected)
        yield f"127.0.0.1:{server.getsockname()[1]}"


@pytest.mark.filterwarnings("error::pytest.PytestUnraisableExceptionWarning")
def test_a_connection_that_was_reset_gives_no_reason_and_is_closed(reset):
    assert certificates.why_refused(f"tls/{reset}", None) is None
    gc.collect()
