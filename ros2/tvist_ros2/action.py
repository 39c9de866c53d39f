"""The action FollowJointTrajectory: three services and two topics, as every ROS 2 client library expects them."""

import asyncio
import math
from bisect import bisect
from typing import Any

from tvist_client.command import TICK
from tvist_client.errors import MisuseError
from tvist_client.motion import Motion
from tvist_protocol import RuntimeState, State, TvistError
from tvist_ros2.messages import FEEDBACK, JAZZY_FEEDBACK, TYPES, ros, seconds
from tvist_ros2.mover import Mover, Warn
from tvist_ros2.node import Node
from tvist_ros2.outputs import LATCHED, Outputs
from tvist_ros2.trajectory import GoalError, Tolerances

UNKNOWN, EXECUTING, CANCELING, SUCCEEDED, CANCELED, ABORTED = 0, 2, 3, 4, 5, 6
"""States of a goal, with the numbers of action_msgs/msg/GoalStatus."""
SUCCESSFUL, INVALID_GOAL, PATH_TOLERANCE_VIOLATED, GOAL_TOLERANCE_VIOLATED = 0, -1, -4, -5
"""Values of `error_code` in a goal's result."""
NONE, UNKNOWN_GOAL, TERMINATED = 0, 2, 3
"""Answers to a request to cancel, with the numbers of action_msgs/srv/CancelGoal."""
FEEDBACK_TICKS = 25  # ticks between two messages of feedback: 20 Hz, as ROS 2's controller has it
REMEMBERED = 32  # number of goals whose results can be asked for

Ending = tuple[int, int, str]  # status and error code of a goal's result, and the reason


class Goal:
    """A trajectory that the robot carries out; GoalError if it is none for this robot."""

    motion: Motion
    ending: Ending | None = None
    """What it ends with once the arm rests, because it was stopped; None if it was not."""
    time = 0.0
    """Time in the trajectory [s], which the speed slider slows down."""

    def __init__(self, wanted: Any, outputs: Outputs, info: Any) -> None:
        if wanted.multi_dof_trajectory.joint_names:
            raise GoalError("the arm has only revolute joints")
        self.on_path = Tolerances(wanted.path_tolerance, outputs.joints)
        self.at_end = Tolerances(wanted.goal_tolerance, outputs.joints)
        self.patience = seconds(wanted.goal_time_tolerance) or math.inf  # as ROS 2's controller reads 0
        self.info = info  # identifier and time; None for a trajectory of the topic
        self.status = EXECUTING
        self.result: asyncio.Future[Any] = asyncio.get_running_loop().create_future()
        self._trajectory = wanted.trajectory
        self.read(outputs)

    def read(self, outputs: Outputs) -> None:
        """Compute the points for a start now."""
        self.points = outputs.points_of(self._trajectory)

    def rested(self, state: State) -> int | None:
        """Return the ticks from the end of the motion to a state; None if it is not done by then."""
        done = self.motion.done
        return None if done is None or state.tick < done else state.tick - done

    def take(self, state: State) -> Ending | None:
        """Take the state of a tick; return what the goal ends with, if it ends now."""
        motion, stopped = self.motion, self.motion.stopped
        if motion.started is not None and state.runtime_state == RuntimeState.PLAYING:
            self.time += state.speed_scaling * TICK
        rested = self.rested(state)
        if rested is not None:
            return self.ending or self._judge(state, rested)
        if stopped is None or state.tick < stopped.tick or state.runtime_state != RuntimeState.STOPPED:
            return None
        return self.ending or (ABORTED, INVALID_GOAL, f"the motion was stopped: {stopped.why}")

    def _judge(self, state: State, rested: int) -> Ending | None:
        """Return what the goal ends with after its motion; None while the arm may still reach its tolerances."""
        deviation = self.at_end.violation(state)
        if deviation is None:
            return SUCCEEDED, SUCCESSFUL, ""
        if rested * TICK >= self.patience:
            return ABORTED, GOAL_TOLERANCE_VIOLATED, deviation
        return None


class TrajectoryAction:
    """Carries out one trajectory at a time, of the action or of the topic; the newest replaces the one before."""

    def __init__(self, node: Node, name: str, mover: Mover, outputs: Outputs, warn: Warn) -> None:
        self._mover, self._outputs, self._warn = mover, outputs, warn
        self._goals: dict[bytes, Goal] = {}
        self._active: Goal | None = None
        self._newest: Goal | None = None
        self._replacing = asyncio.Lock()
        self._feedback = node.publisher(f"{name}/_action/feedback", FEEDBACK)
        self._jazzy_feedback = node.publisher(f"{name}/_action/feedback", JAZZY_FEEDBACK)
        statuses = TYPES["action_msgs/msg/GoalStatusArray"]
        self._status = node.publisher(f"{name}/_action/status", statuses, LATCHED)
        action = "control_msgs/action/FollowJointTrajectory"
        node.serve(f"{name}/_action/send_goal", TYPES[f"{action}_SendGoal"], self._send_goal)
        node.serve(f"{name}/_action/cancel_goal", TYPES["action_msgs/srv/CancelGoal"], self._cancel_goal)
        node.serve(f"{name}/_action/get_result", TYPES[f"{action}_GetResult"], self._get_result)

    async def start(self, wanted: Any, info: Any = None) -> Goal | None:
        """Start a trajectory once the one before rests; return its goal, or None if it was refused."""
        try:
            if info is not None and info.goal_id.uuid in self._goals:
                raise MisuseError("a goal had its identifier before")
            goal = self._newest = Goal(wanted, self._outputs, info)
            async with self._replacing:
                if self._active is not None:
                    self._stop(self._active, (ABORTED, INVALID_GOAL, "a newer trajectory replaced it"))
                    await asyncio.shield(self._active.result)
                    goal.read(self._outputs)
                if self._newest is not goal:
                    raise MisuseError("it was stopped, or a newer one replaced it")
                goal.motion = await self._mover.begin(goal.points)
                self._active = goal
        except TvistError as error:
            self._warn(f"a trajectory was rejected: {error}")
            return None
        return goal

    def take(self, state: State) -> None:
        """Take the state of a tick: give feedback, check the tolerances, and end a goal that has ended."""
        goal = self._active
        if goal is None:
            return
        ending = goal.take(state)
        if goal.info is not None and state.tick % FEEDBACK_TICKS == 0:
            self._give_feedback(goal, state)
        if ending is not None:
            self._end(goal, ending)
        elif goal.rested(state) is None and (deviation := goal.on_path.violation(state)) is not None:
            self._stop(goal, (ABORTED, PATH_TOLERANCE_VIOLATED, deviation))

    def drop_waiting(self) -> None:
        """Reject the trajectory that waits for the one before to rest."""
        self._newest = None

    def close(self) -> None:
        """End the active goal, because the gateway ends."""
        if self._active is not None:
            self._end(self._active, (ABORTED, INVALID_GOAL, "the robot left ROS 2"))

    def _stop(self, goal: Goal, ending: Ending) -> None:
        """Bring the arm to rest on the path of a goal, which then ends; the first reason counts."""
        if goal.ending is None:
            goal.ending = ending
            if not goal.motion.ended:
                self._mover.stop()

    def _end(self, goal: Goal, ending: Ending) -> None:
        goal.status, code, why = ending
        self._active = None
        result = ros.FollowJointTrajectory_Result(code, why)
        goal.result.set_result(ros.FollowJointTrajectory_GetResult_Response(goal.status, result))
        if goal.status == ABORTED:
            self._warn(f"a trajectory was aborted: {why}")
        self._tell_status()

    async def _send_goal(self, request: Any) -> Any:
        now = self._outputs.now()
        goal = await self.start(request.goal, ros.GoalInfo(request.goal_id, now))
        if goal is not None:
            self._goals[request.goal_id.uuid] = goal
            if len(self._goals) > REMEMBERED:
                del self._goals[next(iter(self._goals))]
            self._tell_status()
        return ros.FollowJointTrajectory_SendGoal_Response(goal is not None, now)

    async def _cancel_goal(self, request: Any) -> Any:
        wanted, goal = request.goal_info, self._active
        if not any(wanted.goal_id.uuid):
            self.drop_waiting()
        if goal is not None and goal.info is not None and _concerns(wanted, goal.info):
            self._stop(goal, (CANCELED, SUCCESSFUL, ""))
            goal.status = CANCELING
            self._tell_status()
            return ros.CancelGoal_Response(NONE, [goal.info])
        if not any(wanted.goal_id.uuid):
            return ros.CancelGoal_Response(NONE)
        return ros.CancelGoal_Response(TERMINATED if wanted.goal_id.uuid in self._goals else UNKNOWN_GOAL)

    async def _get_result(self, request: Any) -> Any:
        goal = self._goals.get(request.goal_id.uuid)
        if goal is None:
            return ros.FollowJointTrajectory_GetResult_Response(UNKNOWN)
        return await asyncio.shield(goal.result)

    def _give_feedback(self, goal: Goal, state: State) -> None:
        time = ros.Duration(*divmod(round(1e9 * goal.time), 1_000_000_000))
        desired, actual = (state.target_q, state.target_qd), (state.actual_q, state.actual_qd)
        error = [[a - b for a, b in zip(*pair, strict=True)] for pair in zip(desired, actual, strict=True)]
        points = [ros.JointTrajectoryPoint(*one, time_from_start=time) for one in (desired, actual, error)]
        content = (ros.Header(self._outputs.now()), self._outputs.joints, *points)
        index = min(bisect(goal.points, goal.time, key=lambda point: point.time), len(goal.points) - 1)
        identifier, newer = goal.info.goal_id, ros.FollowJointTrajectory_Feedback(*content, index=index)
        self._feedback(ros.FollowJointTrajectory_FeedbackMessage(identifier, newer))
        self._jazzy_feedback(ros.JazzyFeedbackMessage(identifier, ros.JazzyFeedback(*content)))

    def _tell_status(self) -> None:
        self._status(
            ros.GoalStatusArray([ros.GoalStatus(goal.info, goal.status) for goal in self._goals.values()])
        )


def _concerns(wanted: Any, goal: Any) -> bool:
    """Return whether a request to cancel concerns a goal: its identifier or time does, or the request has neither."""
    if wanted.goal_id == goal.goal_id:
        return True
    until = seconds(wanted.stamp)
    return seconds(goal.stamp) <= until if until else not any(wanted.goal_id.uuid)
