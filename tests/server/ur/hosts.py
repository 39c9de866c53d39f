"""A robot as its interfaces see it, with programs."""

from tvist_server.gateways.ur.external_control import ExternalControl
from tvist_server.gateways.ur.programs import Programs
from tvist_server.gateways.ur.robot import NO_MODE

from .decoders import message


def nobody(host, then):
    """A machine that does not answer."""
    del host
    then(None)


def host(robot):
    """The fixture `robot`, with programs and what else the text interfaces share."""
    robot.programs = Programs(robot, ExternalControl(None, nobody))
    robot.operational_mode = NO_MODE
    return robot


def told(robot):
    """The robot messages that were broadcast."""
    return [message(package) for package in robot.told]
