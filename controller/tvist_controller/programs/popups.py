"""Messages that programs show to people until somebody closes them."""

from tvist_controller.command_row import Call, Row
from tvist_controller.events import Emit
from tvist_protocol.programs import ProgramClosePopup
from tvist_protocol.stream import PopupKind


class Popups:
    """The popup of one robot; a newer one replaces it.

    Args:
        emit: Emits events.
    """

    def __init__(self, emit: Emit) -> None:
        self._emit = emit
        self.shown = False
        """Whether there is a popup that nobody has closed."""
        self.rows = (Row(ProgramClosePopup, self._close, lease="none"),)

    def show(self, text: str, title: str, kind: PopupKind, *, blocking: bool) -> None:
        """Show a popup.

        Args:
            text: What it says.
            title: Its title.
            kind: `message`, `warning` or `error`.
            blocking: Whether the program waits until it is closed.
        """
        self.shown = True
        self._emit("popup", why=text, title=title, level=kind, blocking=blocking)

    def close(self) -> None:
        """Close the popup, if there is one."""
        self.shown = False

    def _close(self, _: Call[ProgramClosePopup]) -> None:
        self.close()
