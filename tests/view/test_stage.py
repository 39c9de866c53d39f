"""The page's door: other sites in a browser on this machine are turned away."""

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
async def test_another_site_is_turned_away(origin):
    async with opened() as url:
        with pytest.raises(websockets.InvalidStatus, match="403"):
            await websockets.connect(url.replace("http", "ws"), origin=origin)


@pytest.mark.parametrize("named", [True, False])
async def test_the_page_itself_and_programs_are_let_in(named):
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
async def test_what_is_asked_for_by_name(path, host, code):
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


async def test_other_machines_are_served_only_if_that_is_asked_for():
    with pytest.raises(StageError, match="--insecure"):
        async with open_stage("", _echo, "0.0.0.0", 0):  # noqa: S104
            pass
    async with open_stage("", _echo, "0.0.0.0", 0, insecure=True) as url:  # noqa: S104
        assert url.startswith("http://0.0.0.0:")


async def test_a_port_in_use_is_said():
    async with opened() as url:
        with pytest.raises(StageError, match="Another port: --port"):
            async with open_stage("", _echo, "127.0.0.1", int(url.rpartition(":")[2])):
                pass


def test_nothing_that_the_page_is_told_ends_its_script():
    assert "</script><b>" not in page({"kind": "</script><b>"})
