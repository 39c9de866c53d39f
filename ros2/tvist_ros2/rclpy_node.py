"""A ROS 2 node of an installed ROS 2, whichever middleware that uses."""

import asyncio
import threading
from collections.abc import Callable
from concurrent.futures import Future
from functools import partial
from importlib import import_module
from typing import Any

from msgspec import Struct

from tvist_client.errors import MisuseError
from tvist_client.transports.inbox import wake
from tvist_ros2.cdr import CdrError, decode, encode
from tvist_ros2.messages import RosType
from tvist_ros2.names import DEFAULT, Qos, absolute
from tvist_ros2.node import Answer, Node


class RclpyNode(Node):
    """A node of rclpy, with a thread of its own; messages pass in encoded form. MisuseError without rclpy."""

    def __init__(self, domain: int, namespace: str, name: str) -> None:
        try:
            self._rclpy = import_module("rclpy")
        except ImportError as error:
            raise MisuseError(f"--rclpy needs a sourced ROS 2 installation: {error}") from error
        for module in ("callback_groups", "executors", "qos", "serialization", "task"):
            import_module(f"rclpy.{module}")
        self._loop, self._namespace = asyncio.get_running_loop(), namespace
        context = self._rclpy.Context()
        self._rclpy.init(args=[], context=context, domain_id=domain)
        self._node = self._rclpy.create_node(
            name, context=context, namespace=namespace, enable_rosout=False, start_parameter_services=False
        )
        # Answers may take long, and other requests must not wait for them.
        self._group = self._rclpy.callback_groups.ReentrantCallbackGroup()
        self._executor = self._rclpy.executors.SingleThreadedExecutor(context=context)
        self._executor.add_node(self._node)
        self._thread = threading.Thread(target=self._executor.spin, name="ros2", daemon=True)
        self._thread.start()

    def publisher(self, name: str, of: RosType, qos: Qos = DEFAULT) -> Callable[[Any], None]:
        kind = _class(of)
        if not _same(of.request(), kind()):  # the feedback of another release of ROS 2
            return lambda _: None
        policies = self._rclpy.qos
        reliability, durability = policies.ReliabilityPolicy, policies.DurabilityPolicy
        profile = policies.QoSProfile(
            depth=qos.depth,
            reliability=reliability.RELIABLE if qos.reliable else reliability.BEST_EFFORT,
            durability=durability.TRANSIENT_LOCAL if qos.latched else durability.VOLATILE,
        )
        publisher = self._node.create_publisher(kind, absolute(self._namespace, name), profile)
        return lambda message: publisher.publish(encode(message))

    def subscribe(self, name: str, of: RosType, callback: Callable[[Any], None]) -> None:
        def receive(data: bytes) -> None:
            wake(self._loop, partial(self.deliver, name, of, callback, data))

        topic = absolute(self._namespace, name)
        self._node.create_subscription(_class(of), topic, receive, DEFAULT.depth, raw=True)

    def serve(self, name: str, of: RosType, answer: Answer) -> None:
        serialization = self._rclpy.serialization

        async def respond(request: Any, response: Any) -> Any:
            try:
                asked = decode(of.request, serialization.serialize_message(request))
            except CdrError as error:
                wake(self._loop, partial(self.warn, f"an invalid request to {name}: {error}"))
                return response  # its default says no
            done = self._rclpy.task.Future(executor=self._executor)

            def finish(running: Future[Any]) -> None:
                if not running.cancelled():
                    done.set_result(running.result())
                    self._executor.wake()  # it does not notice by itself

            asyncio.run_coroutine_threadsafe(answer(asked), self._loop).add_done_callback(finish)
            return serialization.deserialize_message(encode(await done), type(response))

        service = absolute(self._namespace, name)
        self._node.create_service(_class(of), service, respond, callback_group=self._group)

    async def close(self) -> None:
        await asyncio.to_thread(self._end)

    def _end(self) -> None:
        self._executor.shutdown()
        self._thread.join()
        self._node.destroy_node()
        self._node.context.try_shutdown()


def _class(of: RosType) -> Any:
    """Return the class of a type in the installed ROS 2; MisuseError if its package is not installed."""
    package, group, name = of.name.split("/")
    try:
        module = import_module(f"{package}.{group}")
    except ImportError as error:
        raise MisuseError(f"the ROS 2 package {package} is missing: install it") from error
    if group != "action":
        return getattr(module, name)
    action, _, part = name.partition("_")
    return getattr(getattr(module, action).Impl, part if part == "FeedbackMessage" else f"{part}Service")


def _same(ours: Any, theirs: Any) -> bool:
    """Return whether two messages have the same fields."""
    if not isinstance(ours, Struct):
        return True
    names = ours.__struct_fields__
    return tuple(theirs.get_fields_and_field_types()) == names and all(
        _same(getattr(ours, name), getattr(theirs, name)) for name in names
    )
