"""The functions of a controller that the scripts of these tests call, without a controller."""

from tvist_urscript import Fault, Signature, parameters, signature, to_str
from tvist_urscript.values import short

STEP = 0.002  # duration of a tick [s]


class DryFunctions:
    """The functions, each with its signature; `said` has the texts of `textmsg`."""

    def __init__(self):
        self.said, outputs = [], {}
        given = {
            "textmsg": lambda s1, s2="": self.said.append(short(to_str(s1) + to_str(s2))),
            "sync": sync,
            "sleep": _sleep,
            "get_digital_in": lambda n: False,  # noqa: ARG005  no input is set
            "get_digital_out": lambda n: outputs.get(n, False),
            "set_digital_out": lambda n, b: outputs.update({n: b}),
        }
        self.signatures = {name: signature(function) for name, function in given.items()}
        self.signatures["movej"] = Signature(parameters("q", a=1.4, v=1.05, t=0, r=0), blocks=True)
        self.functions = {**given, "movej": lambda *_: sync()}


def sync():
    yield


def _sleep(t):
    if t < 0:
        raise Fault(f"sleep takes a time from 0 s, not {t:g}")
    for _ in range(round(t / STEP)):
        yield
