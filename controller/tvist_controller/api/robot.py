"""A complete controller for studies, with programs, instruments and clients."""

from tvist_controller.about import info_of
from tvist_controller.controller import Controller
from tvist_controller.dispatch.rights import Presence
from tvist_controller.host import Host
from tvist_controller.instruments.report import Sink, truth_of
from tvist_controller.loopback import LoopbackHost
from tvist_controller.motion.setpoints import Unreadable
from tvist_controller.programs.compiling import ScriptCompiler
from tvist_controller.programs.sockets import SocketEvent
from tvist_controller.safety.payload_learning import payload_learning_of
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
    "SocketEvent",
    "Unreadable",
    "info_of",
    "load_plant",
    "payload_learning_of",
    "truth_of",
]
