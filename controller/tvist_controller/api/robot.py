"""A whole controller for studies, with its programs, instruments and clients.

The modules behind it may change.
"""

from tvist_controller.about import info_of
from tvist_controller.controller import Controller
from tvist_controller.dispatch.rights import Presence
from tvist_controller.host import Host
from tvist_controller.instruments.report import truth_of
from tvist_controller.instruments.sink import Sink
from tvist_controller.loopback import LoopbackHost
from tvist_controller.programs.compiling import ScriptCompiler
from tvist_controller.programs.socket_traffic import SocketNews
from tvist_controller.safety.experience import Student, experience_of
from tvist_controller.sources.own_plants import WORLD, OwnPlant, RecordedPlant, load_plant

__all__ = [
    "WORLD",
    "Controller",
    "Host",
    "LoopbackHost",
    "OwnPlant",
    "Presence",
    "RecordedPlant",
    "ScriptCompiler",
    "Sink",
    "SocketNews",
    "Student",
    "experience_of",
    "info_of",
    "load_plant",
    "truth_of",
]
