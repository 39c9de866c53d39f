"""Start of a program on a robot whose time has not begun, so that equal programs run alike to the last bit."""

import re
from collections.abc import Callable, Sequence
from typing import Final

from tvist_protocol.commands import Command, TakeControl
from tvist_protocol.errors import RefusedError
from tvist_protocol.io import SetRegisters, SimulationSetInputs
from tvist_protocol.programs import ProgramRun
from tvist_protocol.replies import Accepted, Refused, Reply

CLIENT: Final = "tvist run"
"""Name under which a run has control."""
LEASE: Final = 3600.0
"""Time without renewal after which it loses control [s]."""

LEAST, MOST = -(2**31), 2**31 - 1
"""Range of an integer register."""
Request = Callable[[Command], Reply]
"""Has a command carried out at once."""
_INPUT = re.compile(r"(?P<name>digital_input|input_(?P<kind>bit|int|double)_register)_(?P<number>\d{1,3})")
_BITS = {"0": False, "false": False, "off": False, "1": True, "true": True, "on": True}


class InputError(ValueError):
    """An input is not given as NAME=VALUE; the message says what is wrong."""


def input_command(text: str, token: str) -> SetRegisters | SimulationSetInputs:
    """Return the command that sets an input.

    Args:
        text: NAME=VALUE, where NAME is `digital_input_N`, `input_bit_register_N`, `input_int_register_N` or
            `input_double_register_N`.
        token: Token of the lease.

    Raises:
        InputError: There is no such input, or the value is not of its kind.
    """
    name, equals, value = (part.strip() for part in text.partition("="))
    found = _INPUT.fullmatch(name)
    if found is None or not equals:
        raise InputError(
            f"input is {text!r}: must be NAME=VALUE, where NAME is digital_input_N, input_bit_register_N, "
            "input_int_register_N or input_double_register_N"
        )
    number = int(found["number"])
    match found["kind"]:
        case None:
            if number > 17:
                raise InputError(f"input is {text!r}: there are digital inputs 0 to 17")
            bit = 1 << number
            return SimulationSetInputs(
                token=token, digital_input_mask=bit, digital_inputs=bit if _bit(text, value) else 0
            )
        case "bit":
            return SetRegisters(token=token, bank="input_bit", values=(_bit(text, value),), first=number)
        case "int":
            return SetRegisters(token=token, bank="input_int", values=(_whole(text, value),), first=number)
    return SetRegisters(token=token, bank="input_double", values=(_number(text, value),), first=number)


def start(request: Request, text: str, inputs: Sequence[str], client: str = CLIENT) -> str:
    """Take control, set inputs and start a program; return the token of the lease.

    Args:
        request: Has a command carried out.
        text: Text of the program.
        inputs: Inputs to set before, each as NAME=VALUE.
        client: Name under which the run has control.

    Raises:
        InputError: See `input_command`; or the robot refuses an input.
        RefusedError: The robot refuses the program, for example because it cannot be compiled.
    """
    reply = request(TakeControl(client=client, lease_s=LEASE))
    assert isinstance(reply, Accepted)
    assert reply.token is not None
    for one in inputs:
        answer = request(input_command(one, reply.token))
        if isinstance(answer, Refused):
            raise InputError(f"input is {one!r}: {answer.why}")
    answer = request(ProgramRun(token=reply.token, text=text))
    if isinstance(answer, Refused):
        raise RefusedError(answer)
    return reply.token


def _bit(text: str, value: str) -> bool:
    found = _BITS.get(value.lower())
    if found is None:
        raise InputError(f"input is {text!r}: the value must be 0 or 1")
    return found


def _whole(text: str, value: str) -> int:
    try:
        number = int(value)
    except ValueError:
        raise InputError(f"input is {text!r}: the value must be a whole number") from None
    if not LEAST <= number <= MOST:
        raise InputError(f"input is {text!r}: the value must be from {LEAST} to {MOST}")
    return number


def _number(text: str, value: str) -> float:
    try:
        return float(value)
    except ValueError:
        raise InputError(f"input is {text!r}: the value must be a number") from None
