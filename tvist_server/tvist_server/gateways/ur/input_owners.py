"""Input variables of one robot: which connection may write each, and what was written."""

from collections.abc import Hashable, Sequence


class InputOwners:
    """Each variable belongs to the first connection that asked for it, until that connection is closed."""

    def __init__(self) -> None:
        self._owners: dict[str, object] = {}
        self.ledger = Ledger()
        """Values that were written, by any connection."""

    def is_free(self, name: str, connection: object) -> bool:
        """Return whether no other connection owns the variable."""
        return self._owners.get(name, connection) is connection

    def take(self, names: Sequence[str], connection: object) -> None:
        """Make a connection the owner of variables, which must be free."""
        for name in names:
            self._owners[name] = connection

    def release(self, connection: object) -> None:
        """Release all variables that a connection owns."""
        self._owners = {name: owner for name, owner in self._owners.items() if owner is not connection}


class Ledger:
    """Values requested from the controller, so that no value is requested twice.

    Clients repeat their values five hundred times a second, and the robot publishes its terminals and registers some
    ticks after they were set. A value is therefore news if it differs from the last one requested, or if that request
    has been answered and the robot shows another value, because another client has set it since.
    """

    def __init__(self) -> None:
        self._asked: dict[Hashable, object] = {}
        self._waiting: dict[Hashable, object] = {}

    def is_news(self, key: Hashable, value: object, present: object) -> bool:
        """Return whether to request a value.

        Args:
            key: Key of the terminal or register.
            value: Requested value.
            present: Value that the robot published last; None if it has published none.
        """
        if key in self._waiting:
            return self._waiting[key] != value
        return value != present or self._asked.get(key, value) != value

    def ask(self, values: dict[Hashable, object]) -> None:
        """Note that these values were requested."""
        self._asked |= values
        self._waiting |= values

    def answered(self, values: dict[Hashable, object]) -> None:
        """Note that the controller has accepted or refused these values."""
        for key, value in values.items():
            if self._waiting.get(key) == value:
                del self._waiting[key]
