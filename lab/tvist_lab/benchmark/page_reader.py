"""A client of the page that draws nothing: it counts what `tvist view` sends, as `python -m` with the page's port.

It prints "ready" with the first picture, and at the end of its standard input the messages per second since then.
"""

import asyncio
import json
import sys

import viser
import websockets


async def _read(port: int) -> None:
    loop = asyncio.get_running_loop()
    ended = loop.run_in_executor(None, sys.stdin.read)
    protocol = websockets.Subprotocol(f"viser-v{viser.__version__}")
    url = f"ws://127.0.0.1:{port}"
    async with websockets.connect(url, subprotocols=[protocol], max_size=None) as page:
        await page.recv()
        print("ready", flush=True)  # noqa: T201
        began, count = loop.time(), 0
        while not ended.done():
            try:
                await asyncio.wait_for(page.recv(), 0.1)
            except TimeoutError:
                continue
            count += 1
        print(json.dumps({"per_second": count / (loop.time() - began)}), flush=True)  # noqa: T201


if __name__ == "__main__":
    asyncio.run(_read(int(sys.argv[1])))
