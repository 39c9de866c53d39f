"""Messages that programs show to people until somebody closes them."""

from collections.abc import Callable

from tvist_controller.commands.events import Emit
from tvist_protocol.stream import PopupKind


class Popups:
    """The popup of one robot; a newer one replaces it.

    Args:
        emit: Emits events.
        owner: Returns what identifies the program that runs now.
    """

    def __init__(self, emit: Emit, owner: Callable[[], object]) -> None:
        self._emit, self._owner = emit, owner
        self._owners: object | None = None

    def show(self, text: str, title: str, kind: PopupKind, *, blocking: bool) -> None:
        """Show a popup.

        Args:
            text: The message.
            title: Its title.
            kind: `message`, `warning` or `error`.
            blocking: Whether the program waits until it is closed.
        """
        self._owners = self._owner()
        self._emit("popup", why=text, title=title, level=kind, blocking=blocking)

    @property
    def shown(self) -> bool:
        """Whether there is a popup that nobody has closed."""
        return self._owners is not None

    def close(self, owner: object) -> None:
        """Close the popup if it is that of a program, which has ended."""
        if self._owners is owner:
            self._owners = None

    def dismiss(self) -> None:
        """Close the popup, whichever program shows it."""
        self._owners = None
