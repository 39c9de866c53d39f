"""The page's server refuses other sites that a browser on this machine has open."""

import asyncio
import urllib.error
import urllib.request

import pytest
import websockets

from tvist_view.stage import StageError, open_stage, page


async def _echo(tab):
    async for text in tab:
        await tab.send("echo", {"text": text})


def opened(**options):
    return open_stage(page({"kind": "none"}), _echo, "127.0.0.1", 0, **options)


@pytest.mark.parametrize("origin", ["http://evil.example", "http://127.0.0.1:1", "null"])
async def test_websocket_of_another_site_is_refused(origin):
    async with opened() as url:
        with pytest.raises(websockets.InvalidStatus, match="403"):
            await websockets.connect(url.replace("http", "ws"), origin=origin)


@pytest.mark.parametrize("named", [True, False])
async def test_websocket_of_the_page_or_a_program_is_accepted(named):
    async with (
        opened() as url,
        websockets.connect(url.replace("http", "ws"), origin=url if named else None) as tab,
    ):
        await tab.send("hello")
        assert await tab.recv() == '{"type":"echo","text":"hello"}'


@pytest.mark.parametrize(
    ("path", "host", "code"),
    [
        ("/", None, 200),
        ("/", "evil.example", 403),  # whose name leads to this machine
        ("/nothing", None, 404),
        ("/mesh/0.stl", None, 200),
        ("/../../etc/passwd", None, 404),
    ],
)
async def test_http_status_by_path_and_host(path, host, code):
    async with opened(parts={"/mesh/0.stl": b"solid"}.get) as url:
        request = urllib.request.Request(url + path, headers={"Host": host} if host else {})  # noqa: S310
        assert await asyncio.to_thread(_code, request) == code


def _code(request):
    try:
        with urllib.request.urlopen(request) as answer:  # noqa: S310
            assert answer.headers["Content-Security-Policy"] == "frame-ancestors 'none'"
            return answer.status
    except urllib.error.HTTPError as error:
        with error:
            return error.code


async def test_other_machines_are_served_only_with_insecure():
    with pytest.raises(StageError, match="--insecure"):
        async with open_stage("", _echo, "0.0.0.0", 0):  # noqa: S104
            pass
    async with open_stage("", _echo, "0.0.0.0", 0, insecure=True) as url:  # noqa: S104
        assert url.startswith("http://0.0.0.0:")


async def test_port_in_use_is_refused_with_advice():
    async with opened() as url:
        with pytest.raises(StageError, match="Give another port, such as --port"):
            async with open_stage("", _echo, "127.0.0.1", int(url.rpartition(":")[2])):
                pass


def test_page_escapes_markup_in_its_data():
    assert "</script><b>" not in page({"kind": "</script><b>"})
