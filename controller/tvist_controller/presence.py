"""Presence of clients, by their liveliness tokens."""

from tvist_controller.session import NoControlError


class Presence:
    """Sessions by the name of the client that they are of."""

    def __init__(self) -> None:
        self._sessions: dict[str, set[str]] = {}

    def seen(self, client: str, session: str) -> None:
        """A client's liveliness token is there.

        Args:
            client: Its name.
            session: Session that it is of; empty where the token does not say.
        """
        self._sessions.setdefault(client, set()).add(session)

    def gone(self, client: str, session: str) -> None:
        """A client's liveliness token is gone."""
        there = self._sessions.get(client, set())
        there.discard(session)
        if not there:
            self._sessions.pop(client, None)

    def clients_of(self, session: str) -> list[str]:
        """Names under which a session is there."""
        return [client for client, there in self._sessions.items() if session in there]

    def has(self, client: str, session: str) -> bool:
        """Whether a client's token is there."""
        return session in self._sessions.get(client, ())

    def session_of(self, client: str) -> str | None:
        """The session of a client that asks for control; None where no token tells of it.

        Raises:
            NoControlError: Several go by its name: a command does not say from which of them it comes.
        """
        there = self._sessions.get(client, set())
        if len(there) > 1:
            why = (
                f"{len(there)} programs are connected as {client!r}, and the server cannot tell which of them sent "
                "this: give each its own name; a program that has lost its connection is forgotten within about 10 s"
            )
            raise NoControlError("no_control", why, "client")
        return next(iter(there), None)
