"""A robot as its doors see it, with programs."""

from tvist_server.gateways.ur.programs import Programs

from .decoders import message


def host(robot):
    """The fixture `robot`, with programs and what else the text doors share."""
    robot.programs = Programs(robot)
    robot.operational_mode = "NONE"
    return robot


def told(robot):
    """The robot messages that were broadcast."""
    return [message(package) for package in robot.told]
