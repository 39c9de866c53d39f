"""An event loop in a thread, which other threads use by blocking calls."""

import asyncio
import contextlib
import inspect
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractAsyncContextManager
from functools import partial
from typing import Any, TypeVar

from tvist_client.errors import MisuseError, NotConnectedError
from tvist_protocol.errors import TvistError

T = TypeVar("T")


class Portal:
    """Runs an event loop in a daemon thread, so that a program that forgets to close it still ends."""

    def __init__(self) -> None:
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, name="tvist-client", daemon=True)
        self._thread.start()
        self.closed = False

    def call(self, function: Callable[[], Any]) -> Any:
        """Run a function on the loop and wait for its result, or that of its coroutine.

        Ctrl-C cancels the coroutine. An error of the client or protocol is raised without the distracting
        part of its traceback within the loop. Raise NotConnectedError if the portal is closed; MisuseError
        in a callback, because the call would never return.
        """
        if self.closed:
            raise NotConnectedError("the connection is closed: open another one")
        if threading.current_thread() is self._thread:
            raise MisuseError("a callback may not wait for the robot: pass the work to another thread")

        async def awaited() -> Any:
            result = function()
            return await result if inspect.iscoroutine(result) else result

        future = asyncio.run_coroutine_threadsafe(awaited(), self._loop)
        try:
            return future.result()
        except TvistError as error:
            told = error
        except BaseException:
            future.cancel()
            raise
        raise told.with_traceback(None) from None

    @contextlib.contextmanager
    def enter(self, context: AbstractAsyncContextManager[T]) -> Iterator[T]:
        """Enter an asynchronous context manager; leave it with the error of the block, if any."""
        value = self.call(context.__aenter__)
        try:
            yield value
        except BaseException as error:
            if sys.is_finalizing():
                # At exit the interpreter discards a generator never left, after the loop's thread has ended.
                raise
            if not self.call(partial(context.__aexit__, type(error), error, error.__traceback__)):
                raise
        else:
            self.call(lambda: context.__aexit__(None, None, None))

    def close(self) -> None:
        """End the loop and its thread; a second call does nothing."""
        if self.closed:
            return
        self.call(self._cancel_others)
        self.closed = True
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.run_until_complete(self._loop.shutdown_default_executor())
        self._loop.close()

    @staticmethod
    async def _cancel_others() -> None:
        others = asyncio.all_tasks() - {asyncio.current_task()}
        for task in others:
            task.cancel()
        await asyncio.gather(*others, return_exceptions=True)
