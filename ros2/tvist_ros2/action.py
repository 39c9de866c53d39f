"""The action FollowJointTrajectory: three services and two topics, as every ROS 2 client library expects them."""

import asyncio
from bisect import bisect
from typing import Any

from tvist_client.command import TICK
from tvist_client.motion import Motion
from tvist_protocol import RuntimeState, State, TvistError
from tvist_ros2 import trajectory
from tvist_ros2.messages import FEEDBACK, JAZZY_FEEDBACK, TYPES, ros, seconds
from tvist_ros2.mover import Mover, Warn
from tvist_ros2.node import Node
from tvist_ros2.outputs import LATCHED, Outputs

UNKNOWN, EXECUTING, CANCELING, SUCCEEDED, CANCELED, ABORTED = 0, 2, 3, 4, 5, 6
"""States of a goal, with the numbers of action_msgs/msg/GoalStatus."""
NONE, UNKNOWN_GOAL, TERMINATED = 0, 2, 3
"""Answers to a request to cancel, with the numbers of action_msgs/srv/CancelGoal."""
FEEDBACK_TICKS = 25  # ticks between two messages of feedback: 20 Hz, as ROS 2's controller has it
REMEMBERED = 32  # number of ended goals whose results can still be asked for


class Goal:
    """A goal that was accepted or rejected."""

    motion: Motion

    def __init__(self, request: Any, now: Any) -> None:
        self.info, self.wanted = ros.GoalInfo(request.goal_id, now), request.goal
        self.status = UNKNOWN
        self.result: asyncio.Future[Any] = asyncio.get_running_loop().create_future()
        self.violated: str | None = None  # the path tolerance because of which the arm comes to rest

    async def begin(self, mover: Mover, outputs: Outputs) -> None:
        """Start the motion; TvistError if that is impossible."""
        if self.wanted.multi_dof_trajectory.joint_names:
            raise trajectory.GoalError(trajectory.INVALID_JOINTS, "the arm has only revolute joints")
        self.on_path = trajectory.Tolerances(self.wanted.path_tolerance, outputs.joints)
        self.at_end = trajectory.Tolerances(self.wanted.goal_tolerance, outputs.joints)
        points = outputs.points_of(self.wanted.trajectory)
        self.times = [point.time for point in points]
        self.motion = await mover.begin(points)

    def end(self, status: int, code: int = trajectory.SUCCESSFUL, why: str = "") -> None:
        """Set the result."""
        self.status = status
        result = ros.FollowJointTrajectory_Result(code, why)
        self.result.set_result(ros.FollowJointTrajectory_GetResult_Response(status, result))


class TrajectoryAction:
    """Carries out one goal at a time."""

    def __init__(self, node: Node, name: str, mover: Mover, outputs: Outputs, warn: Warn) -> None:
        self._mover, self._outputs, self._warn = mover, outputs, warn
        self._goals: dict[bytes, Goal] = {}
        self._active: Goal | None = None
        self._stopping: asyncio.Task[None] | None = None
        self._feedback = node.publisher(f"{name}/_action/feedback", FEEDBACK)
        self._jazzy_feedback = node.publisher(f"{name}/_action/feedback", JAZZY_FEEDBACK)
        statuses = TYPES["action_msgs/msg/GoalStatusArray"]
        self._status = node.publisher(f"{name}/_action/status", statuses, LATCHED)
        action = "control_msgs/action/FollowJointTrajectory"
        node.serve(f"{name}/_action/send_goal", TYPES[f"{action}_SendGoal"], self._send_goal)
        node.serve(f"{name}/_action/cancel_goal", TYPES["action_msgs/srv/CancelGoal"], self._cancel_goal)
        node.serve(f"{name}/_action/get_result", TYPES[f"{action}_GetResult"], self._get_result)

    def take(self, state: State) -> None:
        """Take the state of a tick: give feedback, check the tolerances, and end a goal whose motion has ended."""
        goal = self._active
        if goal is None:
            return
        if state.tick % FEEDBACK_TICKS == 0:
            self._give_feedback(goal, state)
        if goal.motion.ended:
            # After a stop, the next goal is accepted once the arm rests.
            if goal.motion.done is not None or state.runtime_state == RuntimeState.STOPPED:
                self._judge(goal, state)
        elif goal.violated is None:
            goal.violated = goal.on_path.violation(state)
            if goal.violated is not None:
                self._stopping = asyncio.create_task(self._mover.stop())

    async def _send_goal(self, request: Any) -> Any:
        now, identifier = self._outputs.now(), request.goal_id.uuid
        accepted = identifier not in self._goals
        if accepted:
            goal = self._goals[identifier] = Goal(request, now)
            if len(self._goals) > REMEMBERED:
                del self._goals[next(iter(self._goals))]
            try:
                await goal.begin(self._mover, self._outputs)
            except TvistError as error:
                # A client that asks for the result of a rejected goal gets the reason.
                accepted = False
                goal.end(UNKNOWN, getattr(error, "error_code", trajectory.INVALID_GOAL), str(error))
                self._warn(f"a trajectory was rejected: {error}")
            else:
                self._active, goal.status = goal, EXECUTING
                self._tell_status()
        return ros.FollowJointTrajectory_SendGoal_Response(accepted, now)

    async def _cancel_goal(self, request: Any) -> Any:
        """Cancel the goal of an identifier or, without one, any goal, if it was accepted until the given time."""
        wanted, until = request.goal_info.goal_id.uuid, seconds(request.goal_info.stamp)
        goal, anyone = self._active, not any(wanted)
        if goal is None or not (
            wanted == goal.info.goal_id.uuid or (anyone and (not until or seconds(goal.info.stamp) <= until))
        ):
            other = TERMINATED if wanted in self._goals else UNKNOWN_GOAL
            return ros.CancelGoal_Response(NONE if anyone else other)
        goal.status = CANCELING
        self._tell_status()
        await self._mover.stop()
        return ros.CancelGoal_Response(NONE, [goal.info])

    async def _get_result(self, request: Any) -> Any:
        goal = self._goals.get(request.goal_id.uuid)
        if goal is None:
            return ros.FollowJointTrajectory_GetResult_Response(UNKNOWN)
        return await asyncio.shield(goal.result)

    def _judge(self, goal: Goal, state: State) -> None:
        """End a goal, unless the arm still has time to reach its tolerances."""
        motion = goal.motion
        if motion.done is None and goal.violated is not None:
            goal.end(ABORTED, trajectory.PATH_TOLERANCE_VIOLATED, goal.violated)
        elif motion.done is None and goal.status == CANCELING:
            goal.end(CANCELED)
        elif motion.done is None:
            why = "the connection was lost" if motion.stopped is None else motion.stopped.why
            goal.end(ABORTED, trajectory.INVALID_GOAL, f"the motion was stopped: {why}")
        elif (deviation := goal.at_end.violation(state)) is None:
            goal.end(SUCCEEDED)
        elif (state.tick - motion.done) * TICK >= seconds(goal.wanted.goal_time_tolerance):
            goal.end(ABORTED, trajectory.GOAL_TOLERANCE_VIOLATED, deviation)
        else:
            return
        self._active = None
        self._tell_status()

    def _give_feedback(self, goal: Goal, state: State) -> None:
        ticks = 0 if goal.motion.started is None else state.tick - goal.motion.started
        time = ros.Duration(*divmod(ticks * 2_000_000, 1_000_000_000))
        desired, actual = (state.target_q, state.target_qd), (state.actual_q, state.actual_qd)
        error = [[a - b for a, b in zip(*pair, strict=True)] for pair in zip(desired, actual, strict=True)]
        points = [ros.JointTrajectoryPoint(*one, time_from_start=time) for one in (desired, actual, error)]
        content = (ros.Header(self._outputs.now()), self._outputs.joints, *points)
        index = min(bisect(goal.times, ticks * TICK), len(goal.times) - 1)
        identifier, newer = goal.info.goal_id, ros.FollowJointTrajectory_Feedback(*content, index=index)
        self._feedback(ros.FollowJointTrajectory_FeedbackMessage(identifier, newer))
        self._jazzy_feedback(ros.JazzyFeedbackMessage(identifier, ros.JazzyFeedback(*content)))

    def _tell_status(self) -> None:
        goals = [goal for goal in self._goals.values() if goal.status != UNKNOWN]
        self._status(ros.GoalStatusArray([ros.GoalStatus(goal.info, goal.status) for goal in goals]))
