"""The client without `await`: the same names, and an event loop in a separate thread.

    with Robot.connect() as robot, robot.control("me") as arm:
        arm.move_j(q)

A call waits for its answer; Ctrl-C ends the wait. Callbacks run in the loop's thread and must not block.
`blocking.pyi`, written by `make schemas`, has the arguments of all methods.
"""

from tvist_client import arm, motion, robot, servo
from tvist_client.waiting import BlockingConnection, Stream, without_await

__all__ = ["Arm", "Motion", "Robot", "Servo", "Stepper", "Stream"]

Motion = without_await(motion.Motion, "on_event", "fail", "wait_event")
Servo = without_await(servo.Servo, "check")
Stepper = without_await(robot.Stepper, "robot")
Arm = without_await(arm.Arm, "robot", "keep_alive_every")
Robot = without_await(
    robot.Robot,
    *("arm", "stepper", "pass_time", "put_setpoint", "until", "watch"),
    base=BlockingConnection,
)
