"""A robot as its interfaces see it, with programs."""

from tvist_server.gateways.ur.deferred import begin
from tvist_server.gateways.ur.external_control import ExternalControl
from tvist_server.gateways.ur.programs import Programs
from tvist_server.gateways.ur.robot import NO_MODE
from tvist_server.program_folder import ProgramFolder

from .decoders import message


async def nobody(_host):
    """A machine that does not answer."""


async def here(read):
    """A file that is read at once."""
    return read()


def external(folder=None, fetch=nobody):
    return ExternalControl(folder or ProgramFolder(), fetch, here)


def hear(request, answers):
    """Begin a request, whose answer is added when it has come."""

    async def hearing():
        answers.append(await request)

    begin(hearing())


def host(robot):
    """The fixture `robot`, with programs and what else the text interfaces share."""
    robot.programs = Programs(robot, external())
    robot.operational_mode = NO_MODE
    return robot


def told(robot):
    """The robot messages that were broadcast."""
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
