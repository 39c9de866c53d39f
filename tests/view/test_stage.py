"""The page's door: other sites in a browser on this machine are turned away."""

import contextlib

import pytest
import viser
import websockets

from tvist_view.stage import close_stage, open_stage

PROTOCOL = websockets.Subprotocol(f"viser-v{viser.__version__}")


@pytest.fixture
def port():
    server = open_stage("127.0.0.1", 0, "test")
    yield server.get_port()
    close_stage(server)


@pytest.mark.parametrize("origin", ["http://evil.example", "http://127.0.0.1:1", "null"])
async def test_another_site_is_turned_away(port, origin):
    async with websockets.connect(
        f"ws://127.0.0.1:{port}", origin=origin, subprotocols=[PROTOCOL], max_size=None
    ) as page:
        with contextlib.suppress(websockets.ConnectionClosed):
            async for _ in page:
                pass
    assert page.close_code == 1008


@pytest.mark.parametrize("named", [True, False])
async def test_the_page_itself_and_programs_are_let_in(port, named):
    origin = f"http://127.0.0.1:{port}" if named else None
    async with websockets.connect(
        f"ws://127.0.0.1:{port}", origin=origin, subprotocols=[PROTOCOL], max_size=None
    ) as page:
        assert await page.recv()
        await page.ping()
        assert page.close_code is None


def test_nobody_can_ask_for_a_public_tunnel(port):
    server = open_stage("127.0.0.1", 0, "test")
    try:
        from viser._messages import ShareUrlRequest

        assert not server._websock_server._incoming_handlers.get(ShareUrlRequest)
    finally:
        close_stage(server)
