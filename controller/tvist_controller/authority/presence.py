"""Presence of clients, by their liveliness tokens."""

from tvist_controller.authority.session import NoControlError


class Presence:
    """Sessions of clients, by client name."""

    def __init__(self) -> None:
        self._sessions: dict[str, set[str]] = {}

    def seen(self, client: str, session: str) -> None:
        """Note that a client's liveliness token has appeared; the session is empty if it names none."""
        self._sessions.setdefault(client, set()).add(session)

    def gone(self, client: str, session: str) -> None:
        """Note that a client's liveliness token has disappeared."""
        there = self._sessions.get(client, set())
        there.discard(session)
        if not there:
            self._sessions.pop(client, None)

    def clients_of(self, session: str) -> list[str]:
        """Names of the clients that a session declares."""
        return [client for client, there in self._sessions.items() if session in there]

    def has(self, client: str, session: str) -> bool:
        """Return whether a client's token is present."""
        return session in self._sessions.get(client, ())

    def session_of(self, client: str) -> str | None:
        """Return the session of a client that requests control; None if it has no token.

        Raises:
            NoControlError: Several sessions use this name, and a command does not say which one sent it.
        """
        there = self._sessions.get(client, set())
        if len(there) > 1:
            why = (
                f"{len(there)} programs are connected as {client!r}, and the server cannot tell which of them sent "
                "this: give each its own name; a program that has lost its connection is forgotten within about 10 s"
            )
            raise NoControlError("no_control", why, "client")
        return next(iter(there), None)
