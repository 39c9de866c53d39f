"""The state that text interfaces share, and a client of them."""

from tvist_server.gateways.ur.deferred import begin
from tvist_server.gateways.ur.external_control import ExternalControl
from tvist_server.gateways.ur.programs import Programs
from tvist_server.gateways.ur.robot import NO_MODE
from tvist_server.program_folder import ProgramFolder

from .decoders import message


async def nobody(_host):
    """Return None, as if the machine did not answer."""


async def here(read):
    return read()


def external(folder=None, fetch=nobody):
    return ExternalControl(folder or ProgramFolder(), fetch, here)


def hear(request, answers):
    """Begin a request; its answer is appended when it comes."""

    async def hearing():
        answers.append(await request)

    begin(hearing())


def host(robot):
    """Add programs and an operational mode to the fixture `robot`."""
    robot.programs = Programs(robot, external())
    robot.operational_mode = NO_MODE
    return robot


def told(robot):
    """Return the robot messages that all clients got."""
    return [message(package) for package in robot.told]


class LineClient:
    """One client of a text interface: sends text, and reads lines."""

    def __init__(self, kind, robot, control):
        self.sent = []
        self.session = kind(robot, control, self.sent.append)
        self.session.opened()
        self.heard()

    def heard(self):
        """The lines since the last call."""
        text, self.sent[:] = b"".join(self.sent).decode(), []
        assert not text or text.endswith("\n")
        return text.split("\n")[:-1]

    def send(self, text):
        self.session.receive(text.encode())
        return self.heard()

    def ask(self, text):
        (line,) = self.send(text + "\n")
        return line
