"""Functions for registers and flags."""

from tvist_controller.instruments.peripherals import MAX_INTEGER, MIN_INTEGER
from tvist_controller.programs.access import Access
from tvist_controller.programs.arguments import flag, integer, number
from tvist_controller.programs.arm import ProgramArm
from tvist_protocol.io import BITS, NUMBERS
from tvist_urscript import costs

FLAGS = 32
"""Number of flags, which only programs have."""


class RegisterFunctions:
    """Reads and writes the registers of one robot.

    Args:
        access: The robot.
        arm: Its arm: what is written after a move that is blended is written where the blend begins.
    """

    def __init__(self, access: Access, arm: ProgramArm) -> None:
        self._registers, self._arm = access.peripherals, arm
        self._flags = [False] * FLAGS

    def read_input_boolean_register(self, address: object) -> bool:
        """Read an input bit, which clients write."""
        return self._registers.bit("input_bit", integer("address", address, 0, BITS - 1))

    def read_input_integer_register(self, address: object) -> int:
        """Read an input integer, which clients write."""
        return self._registers.integers("input_int")[integer("address", address, 0, NUMBERS - 1)]

    def read_input_float_register(self, address: object) -> float:
        """Read an input number, which clients write."""
        return self._registers.doubles("input_double")[integer("address", address, 0, NUMBERS - 1)]

    def read_output_boolean_register(self, address: object) -> bool:
        """Read an output bit, which programs write."""
        return self._registers.bit("output_bit", integer("address", address, 0, BITS - 1))

    def read_output_integer_register(self, address: object) -> int:
        """Read an output integer, which programs write."""
        return self._registers.integers("output_int")[integer("address", address, 0, NUMBERS - 1)]

    def read_output_float_register(self, address: object) -> float:
        """Read an output number, which programs write."""
        return self._registers.doubles("output_double")[integer("address", address, 0, NUMBERS - 1)]

    @costs(8)
    def write_output_boolean_register(self, address: object, value: object) -> None:
        """Write an output bit, which clients read."""
        place, bit = integer("address", address, 0, BITS - 1), flag("value", value)
        self._arm.then(lambda: self._registers.write("output_bit", place, bit))

    @costs(8)
    def write_output_integer_register(self, address: object, value: object) -> None:
        """Write an output integer of 32 bits, which clients read."""
        place, wanted = integer("address", address, 0, NUMBERS - 1), integer("value", value, MIN_INTEGER, MAX_INTEGER)
        self._arm.then(lambda: self._registers.write("output_int", place, wanted))

    @costs(8)
    def write_output_float_register(self, address: object, value: object) -> None:
        """Write an output number, which clients read."""
        place, wanted = integer("address", address, 0, NUMBERS - 1), number("value", value)
        self._arm.then(lambda: self._registers.write("output_double", place, wanted))

    def get_flag(self, n: object) -> bool:
        """Return one of 32 flags, which only programs can read and set."""
        return self._flags[integer("n", n, 0, FLAGS - 1)]

    @costs(3)
    def set_flag(self, n: object, value: object) -> None:
        """Set one of the flags."""
        place, wanted = integer("n", n, 0, FLAGS - 1), flag("value", value)

        def write() -> None:
            self._flags[place] = wanted

        self._arm.then(write)
