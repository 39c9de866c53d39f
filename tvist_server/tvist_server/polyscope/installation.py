"""The installation of a program saved by PolyScope: TCPs, payload, names of signals, positions of features."""

import re
from dataclasses import dataclass, field
from typing import Self
from xml.etree.ElementTree import Element

_SIGNALS = {
    "DigitalInputNames": "digital_in", "DigitalOutputNames": "digital_out", "ToolDigitalInputNames": "tool_in",
    "ToolDigitalOutputNames": "tool_out", "ToolAnalogInputNames": "tool_analog_in", "AnalogInputNames": "analog_in",
    "AnalogOutputNames": "analog_out", "ConfigurableInputNames": "config_in", "ConfigurableOutputNames": "config_out",
    "GeneralPurposeBooleanRegisterInputNames": "gp_bool_in", "GeneralPurposeBooleanRegisterOutputNames": "gp_bool_out",
    "GeneralPurposeIntRegisterInputNames": "gp_int_in", "GeneralPurposeIntRegisterOutputNames": "gp_int_out",
    "GeneralPurposeFloatRegisterInputNames": "gp_float_in", "GeneralPurposeFloatRegisterOutputNames": "gp_float_out",
}  # fmt: skip
_LARGEST = 1e6  # largest magnitude of a number that is accepted

Pose = tuple[float, ...]


@dataclass(frozen=True)
class Tcp:
    """A tool centre point of the installation."""

    offset: Pose  # in the flange frame [m, rotation vector in rad]
    mass: float | None = None  # payload that PolyScope declares with it [kg]; None if none
    cog: Pose = (0.0, 0.0, 0.0)  # centre of gravity of that payload [m]


@dataclass(frozen=True)
class Installation:
    """What a program needs of its installation; empty if the file is missing."""

    tcps: dict[str, Tcp] = field(default_factory=dict)
    active: Tcp | None = None  # TCP and payload at the start of a program
    pins: dict[str, str] = field(default_factory=dict)  # signals such as `digital_in[0]` by their names
    features: dict[str, Pose] = field(default_factory=dict)  # poses of features in the base frame
    variables: dict[str, str] = field(default_factory=dict)  # initial values as URScript
    home: Pose | None = None  # joint angles of the safe home position [rad]

    @classmethod
    def of(cls, tree: Element, variables: dict[str, str]) -> Self:
        """Return the content of an installation file, with the variables of the file beside it."""
        tcps = {
            tcp.get("name") or "": Tcp(numbers(tcp.get("offset"), 6), *_payload(tcp))
            for tcp in tree.findall("./TCPSettings/availablePoses/tcp")
        }
        settings = tree.find("TCPSettings")
        active = None if settings is None else tcps.get(settings.get("activePose") or "")
        for one in (settings, tree.find("./PayloadSettings/Payload[@defaultPayload='true']")):
            if active is not None and one is not None and _payload(one)[0] is not None:
                active = Tcp(active.offset, *_payload(one))
        pins = {
            name.strip(): f"{kind}[{number}]"
            for list_of, kind in _SIGNALS.items()
            for names in tree.findall(f"./IOs/{list_of}")
            for number, name in enumerate((names.get("value") or "").split(","))
            if name.strip()
        }
        pins |= {one.get("name") or "": f'modbus["{one.get("name")}"]' for one in tree.iter("ModbusSignal")}
        features = {
            one.get("name") or "": numbers(place.get("value"), 3) + numbers(turn.get("value"), 3)
            for one in tree.iterfind(".//GeomPoseNode[@isVariable='true']")
            if (place := one.find("toolPosition")) is not None
            and (turn := one.find("toolAxisAngle")) is not None
        }
        home = tree.find("SafeHomeSettings[@enabled='true']")
        at = None if home is None else numbers(home.get("position"), 6)
        return cls(tcps, active, pins, features, variables, at)

    def start(self) -> list[str]:
        """Return the lines of URScript with which PolyScope begins a program."""
        lines = []
        if self.active is not None:
            lines.append(f"set_tcp({pose(self.active.offset)})")
            if self.active.mass is not None:
                lines.append(f"set_payload({self.active.mass!r}, {list(self.active.cog)})")
        values = {name: pose(at) for name, at in self.features.items() if name} | self.variables
        return lines + [f"global {script_name(name)} = {' '.join(values[name].split())}" for name in values]


def script_name(text: str) -> str:
    """Return a name as PolyScope writes it in scripts: non-ASCII letters become `u` and their code points."""
    plain = "".join(c if re.match(r"\w", c, re.ASCII) else f"u{ord(c)}" if c.isalpha() else "_" for c in text)
    return plain if plain[:1].isalpha() or plain[:1] == "_" else f"_{plain}"


def numbers(text: str | None, count: int) -> Pose:
    """Return the finite numbers of a text, separated by commas; raise ValueError unless there are `count`."""
    found = tuple(float(part) for part in (text or "").split(","))
    found = tuple(number for number in found if abs(number) < _LARGEST)
    if len(found) != count:
        raise ValueError(f"{len(found)} numbers below {_LARGEST:g} instead of {count}")
    return found


def pose(values: Pose) -> str:
    """Return a pose as URScript."""
    return f"p[{', '.join(map(repr, values))}]"


def _payload(element: Element) -> tuple[float | None, Pose]:
    mass, cog = element.get("toolPayload") or element.get("mass"), element.get("centerOfGravity")
    return (None if mass is None else numbers(mass, 1)[0]), (numbers(cog, 3) if cog else (0.0, 0.0, 0.0))
