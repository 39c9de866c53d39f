"""Inputs, outputs and registers of a robot under control."""

from collections.abc import Iterable

from tvist_client.leased import Leased
from tvist_client.values import entries, whole
from tvist_client.values import number as number_of
from tvist_protocol.io import Bank, SetIo, SetRegisters, SimulationSetInputs

LAST_DIGITAL = 17
LAST_ANALOG = 1


class Terminals(Leased):
    """The part of `Arm` that deals with inputs, outputs and registers."""

    async def set_digital_output(self, number: int, on: bool) -> None:
        """Switch a digital output: 0–7 standard, 8–15 configurable, 16–17 tool."""
        bit = 1 << whole(number, "number", 0, LAST_DIGITAL)
        await self.robot.request(
            SetIo(token=self.token, digital_output_mask=bit, digital_outputs=bit if on else 0)
        )

    async def set_analog_output(self, number: int, share: float, *, voltage: bool = False) -> None:
        """Set an analogue output.

        Args:
            number: 0 or 1.
            share: Value as a share of the output's range [-].
            voltage: Whether the range is 0 to 10 V; otherwise it is 4 to 20 mA.
        """
        bit = 1 << whole(number, "number", 0, LAST_ANALOG)
        ratio = number_of(share, "share")
        await self.robot.request(
            SetIo(
                token=self.token,
                standard_analog_output_mask=bit,
                standard_analog_output_type=bit if voltage else 0,
                standard_analog_output_0=ratio,
                standard_analog_output_1=ratio,
            )
        )

    async def set_registers(self, bank: Bank, values: Iterable[float], first: int = 0) -> None:
        """Write consecutive registers.

        Args:
            bank: Bank of registers: `input_int`, `output_double` …
            values: Booleans, integers or numbers, depending on the bank.
            first: Number of the first register.
        """
        written = entries(values, "values")
        await self.robot.request(SetRegisters(token=self.token, bank=bank, values=written, first=first))

    async def set_digital_input(self, number: int, on: bool) -> None:
        """Switch a digital input, as a device connected to it would: 0–7 standard, 8–15 configurable, 16–17 tool."""
        bit = 1 << whole(number, "number", 0, LAST_DIGITAL)
        await self.robot.request(
            SimulationSetInputs(token=self.token, digital_input_mask=bit, digital_inputs=bit if on else 0)
        )
