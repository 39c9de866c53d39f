"""Input variables of one robot: who may write which, and what was written."""

from collections.abc import Hashable


class InputOwners:
    """Each variable belongs to the connection that asked for it first, until that is closed."""

    def __init__(self) -> None:
        self._owners: dict[str, object] = {}
        self.ledger = Ledger()
        """What was written, whoever did."""

    def is_free(self, name: str, connection: object) -> bool:
        """Whether nobody else owns the variable."""
        return self._owners.get(name, connection) is connection

    def take(self, names: tuple[str, ...], connection: object) -> None:
        """Make variables belong to a connection; they must be free."""
        for name in names:
            self._owners[name] = connection

    def release(self, connection: object) -> None:
        """Give back everything a connection owns."""
        self._owners = {name: owner for name, owner in self._owners.items() if owner is not connection}


class Ledger:
    """What was asked of the controller, so that nothing is asked twice.

    Clients repeat what they set five hundred times a second, and what the robot tells of its terminals and registers
    comes some ticks after it was set: a value is news where it differs from the last one asked for, and where the
    robot shows another although its answer is there, since somebody else has set it meanwhile.
    """

    def __init__(self) -> None:
        self._asked: dict[Hashable, object] = {}
        self._waiting: dict[Hashable, object] = {}

    def is_news(self, key: Hashable, value: object, present: object) -> bool:
        """Whether to ask for a value.

        Args:
            key: Key of the terminal or register.
            value: Wanted.
            present: What the robot told last; None where it has told nothing.
        """
        if key in self._waiting:
            return self._waiting[key] != value
        return value != present or self._asked.get(key, value) != value

    def ask(self, values: dict[Hashable, object]) -> None:
        """These are on their way."""
        self._asked |= values
        self._waiting |= values

    def answered(self, values: dict[Hashable, object]) -> None:
        """The controller has taken or refused them."""
        for key, value in values.items():
            if self._waiting.get(key) == value:
                del self._waiting[key]
