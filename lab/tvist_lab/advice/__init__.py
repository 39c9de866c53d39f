"""Advice on shapers from logs: which modes vibrate, what each shaper leaves of them, and which to use."""

from tvist_lab.advice.advise import Advice, RingingMode, advise
from tvist_lab.advice.in_words import as_dict, command, verdict
from tvist_lab.advice.options import EACH, ONE, ROBOT, Option
from tvist_lab.advice.stops import ResidualVibration, StopWithRest

__all__ = [
    "EACH",
    "ONE",
    "ROBOT",
    "Advice",
    "Option",
    "ResidualVibration",
    "RingingMode",
    "StopWithRest",
    "advise",
    "as_dict",
    "command",
    "verdict",
]
