"""Programs with an External Control node, which fetch part of their text from the client that plays them."""

from collections.abc import Awaitable, Callable
from contextlib import suppress
from functools import partial
from typing import Final

from tvist_plant.user_file import UserFileError
from tvist_protocol.programs import MAX_SCRIPT
from tvist_server.polyscope.contributed import EXTERNAL_CONTROL
from tvist_server.polyscope.script import program_text, with_external_control
from tvist_server.program_folder import ProgramFolder

FILE: Final = "external_control.urp"  # built-in program that consists of the node alone
ALONE: Final = program_text("external_control", EXTERNAL_CONTROL)


class ExternalControl:
    """Inserts clients' parts into programs with an External Control node."""

    def __init__(
        self,
        folder: ProgramFolder,  # programs that clients load by name
        fetch: Callable[[str], Awaitable[str | None]],  # requests a machine's part; None: no answer
        aside: Callable[[Callable[[], str | None]], Awaitable[str | None]],  # runs in another thread
    ) -> None:
        self._folder, self._fetch, self._aside = folder, fetch, aside

    async def find(self, name: str) -> str | None:
        """Return the text of program `name` if it has an External Control node, else None."""
        return await self._aside(partial(self._text, name))

    def _text(self, name: str) -> str | None:
        text = None
        with suppress(UserFileError):  # loading it reports the error
            text = self._folder.read(name)
        if text is None and name == FILE:
            return ALONE
        return text if text is not None and EXTERNAL_CONTROL in text else None

    async def complete(self, text: str, host: str) -> str | None:
        """Return `text` with the part of machine `host`; None if no answer comes or the text is too long."""
        sent = await self._fetch(host)
        whole = None if sent is None else with_external_control(text, sent)
        return None if whole is None or len(whole) > MAX_SCRIPT else whole
