"""Programs with a node External Control, which get a part of their text from the client that plays them."""

from collections.abc import Callable
from contextlib import suppress
from typing import Final

from tvist_plant.user_file import UserFileError
from tvist_protocol.programs import MAX_SCRIPT
from tvist_server.polyscope import program, with_external_control
from tvist_server.polyscope_nodes import EXTERNAL_CONTROL
from tvist_server.program_folder import ProgramFolder

FILE: Final = "external_control.urp"
"""Program that consists of the node alone, which exists without a file."""
ALONE: Final = program("external_control", EXTERNAL_CONTROL)

Fetch = Callable[[str, Callable[[str | None], None]], None]
"""Asks a machine for its part of the program, and calls back with it; with None if it does not answer."""


class ExternalControl:
    """Completes such programs.

    Args:
        folder: Programs that clients load by their names; None if there is no such folder.
        fetch: Asks a machine for its part.
    """

    def __init__(self, folder: ProgramFolder | None, fetch: Fetch) -> None:
        self._folder, self._fetch = folder, fetch

    def text(self, name: str) -> str | None:
        """Return the text of a program that has to be completed; None if there is no such program of this name."""
        text = None
        if self._folder is not None:
            with suppress(UserFileError):  # loading it says what is wrong
                text = self._folder.read(name)
        if text is None and name == FILE:
            return ALONE
        return text if text is not None and EXTERNAL_CONTROL in text else None

    def complete(self, text: str, host: str, then: Callable[[str | None], None]) -> None:
        """Complete the text of a program.

        Args:
            text: Its text.
            host: Address of the machine that plays it.
            then: Called once with the complete text; with None if the machine does not answer, or if it is too long.
        """

        def fetched(sent: str | None) -> None:
            whole = None if sent is None else with_external_control(text, sent)
            then(None if whole is None or len(whole) > MAX_SCRIPT else whole)

        self._fetch(host, fetched)
