"""Action servers and clients with protobuf goals, feedback and results."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from typing import TYPE_CHECKING, Any, Generic, overload

import rclpy.action.client
import rclpy.action.server
import rclpy.node
from rclpy.action.server import CancelResponse, GoalResponse

from rosidl_adapter_proto.adapter import ActionAdapter, FeedbackT, GoalT, ResultT
from rosidl_adapter_proto.ros.adapters import ACTION, RosAction, RosMessage, resolve
from rosidl_adapter_proto.ros.inbound import OnConversionError, Reception, converting_callback
from rosidl_adapter_proto.ros.outbound import to_ros_message
from rosidl_adapter_proto.ros.rclpy_internals import ConvertingActionClient, convert_in

if TYPE_CHECKING:
    import rclpy.task

# rclpy's classes are generic in newer versions only, and then in the ROS type.
# mypy: disable-error-code="type-arg, unused-ignore"


class ServerGoalHandle(rclpy.action.server.ServerGoalHandle, Generic[GoalT, ResultT, FeedbackT]):
    """The server's handle of a goal, with protobuf messages.

    Attributes:
        adapter: Converts the messages.
    """

    adapter: type[ActionAdapter[GoalT, ResultT, FeedbackT]]
    _custom_request: GoalT | None = None

    @property
    def request(self) -> GoalT:
        """The goal."""
        if self._custom_request is None:
            self._custom_request = self.adapter.goal.convert_to_custom(super().request)
        return self._custom_request

    def publish_feedback(self, feedback: FeedbackT | RosMessage) -> None:  # type: ignore[override]  # rclpy errs
        """Send feedback to the clients of the goal.

        Raises:
            ConversionError: A value does not fit the ROS type; nothing is sent.
            TypeError: It is neither a protobuf message nor a ROS message of this action.
        """
        super().publish_feedback(to_ros_message(self.adapter.feedback, feedback, "publish_feedback"))


if TYPE_CHECKING:
    ExecuteCallback = Callable[
        [ServerGoalHandle[GoalT, ResultT, FeedbackT]],
        ResultT | RosMessage | Coroutine[Any, Any, ResultT | RosMessage],
    ]
    """Takes the handle of a goal and returns the result; or is a coroutine function that does."""

    GoalCallback = Callable[[GoalT], GoalResponse | Coroutine[Any, Any, GoalResponse]]
    HandleAcceptedCallback = Callable[[ServerGoalHandle[GoalT, ResultT, FeedbackT]], object]
    CancelCallback = Callable[
        [ServerGoalHandle[GoalT, ResultT, FeedbackT]], CancelResponse | Coroutine[Any, Any, CancelResponse]
    ]


class ActionServer(rclpy.action.server.ActionServer, Generic[GoalT, ResultT, FeedbackT]):
    """An action server with protobuf messages.

    A goal that cannot be converted is rejected.

    Attributes:
        adapter: Converts the messages; None if the server was made for a ROS action, and then works as that of rclpy.
    """

    adapter: type[ActionAdapter[GoalT, ResultT, FeedbackT]] | None
    _reception: Reception[GoalT]

    @overload
    def __init__(
        self,
        node: rclpy.node.Node,
        action_type: type[ActionAdapter[GoalT, ResultT, FeedbackT]] | type[GoalT],
        action_name: str,
        execute_callback: ExecuteCallback[GoalT, ResultT, FeedbackT],
        *,
        goal_callback: GoalCallback[GoalT] = ...,
        handle_accepted_callback: HandleAcceptedCallback[GoalT, ResultT, FeedbackT] = ...,
        cancel_callback: CancelCallback[GoalT, ResultT, FeedbackT] = ...,
        on_conversion_error: OnConversionError | None = None,
        **options: Any,
    ) -> None: ...

    @overload
    def __init__(
        self: ActionServer[Any, Any, Any],
        node: rclpy.node.Node,
        action_type: type[RosAction],
        action_name: str,
        execute_callback: Callable[[Any], Any],
        **options: Any,
    ) -> None: ...

    def __init__(
        self,
        node: rclpy.node.Node,
        action_type: Any,
        action_name: str,
        execute_callback: Callable[[Any], Any],
        *,
        on_conversion_error: OnConversionError | None = None,
        **options: Any,
    ) -> None:
        """Create an action server.

        Args:
            node: The node to create it on.
            action_type: An adapter, the protobuf class of the goal, or a ROS action class.
            action_name: The name of the action.
            execute_callback: Is called with the handle of a goal, and returns the result.
            on_conversion_error: Is called for a goal that cannot be converted, with the ConversionError and the ROS
                goal. Without it an error is logged, at most every five seconds.
            options: As of `rclpy.action.ActionServer`.

        Raises:
            AdapterNotFoundError: The protobuf class has no adapter.
            RosNotFoundError: The ROS action class cannot be imported.
            TypeHashError: The adapter was generated for another version of the type than the installed one.
        """
        ros_type, self.adapter = resolve(ACTION, action_type, node.get_logger())
        if self.adapter is not None:
            convert = self.adapter.goal.convert_to_custom
            source = f"a client of action {action_name}"
            self._reception = Reception(node.get_logger(), source, convert, on_conversion_error)
        super().__init__(node, ros_type, action_name, execute_callback, **options)

    @property
    def conversion_errors(self) -> int:
        """How many goals were rejected, since they could not be converted."""
        return self._reception.conversion_errors if self.adapter else 0

    def register_goal_callback(self, goal_callback: Callable[[Any], Any] | None) -> None:
        """Set what decides on goals, as `rclpy.action.ActionServer.register_goal_callback` does."""
        if self.adapter:
            goal_callback = self._goal_callback_of_rclpy(
                goal_callback or rclpy.action.server.default_goal_callback
            )
        super().register_goal_callback(goal_callback)

    def register_handle_accepted_callback(self, handle_accepted_callback: Callable[..., Any] | None) -> None:
        """Set what is told of accepted goals, as `register_handle_accepted_callback` of rclpy does."""
        if self.adapter:
            handle_accepted_callback = self._handle_callback_of_rclpy(
                handle_accepted_callback or rclpy.action.server.default_handle_accepted_callback
            )
        super().register_handle_accepted_callback(handle_accepted_callback)

    def register_cancel_callback(self, cancel_callback: Callable[..., Any] | None) -> None:
        """Set what decides on cancellation, as `register_cancel_callback` of rclpy does."""
        if self.adapter and cancel_callback is not None:
            cancel_callback = self._handle_callback_of_rclpy(cancel_callback)
        super().register_cancel_callback(cancel_callback)

    def register_execute_callback(self, execute_callback: Callable[..., Any]) -> None:
        """Set what executes goals, as `rclpy.action.ActionServer.register_execute_callback` does."""
        if self.adapter and callable(execute_callback):
            execute_callback = self._execute_callback_of_rclpy(execute_callback)
        super().register_execute_callback(execute_callback)

    def notify_execute(self, goal_handle: Any, execute_callback: Callable[..., Any] | None) -> None:
        """Execute a goal, as `rclpy.action.ActionServer.notify_execute` does."""
        if self.adapter and execute_callback is not None:
            execute_callback = self._execute_callback_of_rclpy(execute_callback)
        super().notify_execute(goal_handle, execute_callback)

    def _goal_callback_of_rclpy(self, callback: Callable[[Any], Any]) -> Callable[..., Any]:
        def accept(ros_goal: Any) -> tuple[GoalT] | None:
            goal = self._reception(ros_goal)
            return None if goal is None else (goal,)

        return converting_callback(callback, accept, dropped=GoalResponse.REJECT)

    def _handle_callback_of_rclpy(self, callback: Callable[..., Any]) -> Callable[..., Any]:
        return converting_callback(callback, self._converting)

    def _execute_callback_of_rclpy(self, callback: Callable[..., Any]) -> Callable[..., Any]:
        def finish(result: Any) -> Any:
            assert self.adapter is not None
            return to_ros_message(self.adapter.result, result, "the result of an execute callback")

        return converting_callback(callback, self._converting, finish)

    def _converting(self, goal_handle: Any) -> tuple[ServerGoalHandle[GoalT, ResultT, FeedbackT]]:
        """Return the goal handle, which rclpy made, with protobuf messages, as the argument of a callback."""
        if not isinstance(goal_handle, ServerGoalHandle):
            convert_in(goal_handle, ServerGoalHandle, adapter=self.adapter)
        return (goal_handle,)


ClientGoalHandle = rclpy.action.client.ClientGoalHandle
"""The client's handle of a goal is that of rclpy; what it returns has protobuf messages."""


class ActionClient(ConvertingActionClient, Generic[GoalT, ResultT, FeedbackT]):
    """An action client with protobuf messages.

    Feedback that cannot be converted is dropped; a result that cannot is the ConversionError of its future.

    Attributes:
        adapter: Converts the messages; None if the client was made for a ROS action, and then works as that of rclpy.
    """

    adapter: type[ActionAdapter[GoalT, ResultT, FeedbackT]] | None
    _reception: Reception[Any]

    @overload
    def __init__(
        self,
        node: rclpy.node.Node,
        action_type: type[ActionAdapter[GoalT, ResultT, FeedbackT]],
        action_name: str,
        *,
        on_conversion_error: OnConversionError | None = None,
        **options: Any,
    ) -> None: ...

    @overload
    def __init__(
        self: ActionClient[GoalT, Any, Any],
        node: rclpy.node.Node,
        action_type: type[GoalT],
        action_name: str,
        *,
        on_conversion_error: OnConversionError | None = None,
        **options: Any,
    ) -> None: ...

    @overload
    def __init__(
        self: ActionClient[Any, Any, Any],
        node: rclpy.node.Node,
        action_type: type[RosAction],
        action_name: str,
        **options: Any,
    ) -> None: ...

    def __init__(
        self,
        node: rclpy.node.Node,
        action_type: Any,
        action_name: str,
        *,
        on_conversion_error: OnConversionError | None = None,
        **options: Any,
    ) -> None:
        """Create an action client.

        Args:
            node: The node to create it on.
            action_type: An adapter, the protobuf class of the goal, or a ROS action class.
            action_name: The name of the action.
            on_conversion_error: Is called for feedback that cannot be converted, with the ConversionError and the ROS
                message. Without it an error is logged, at most every five seconds.
            options: As of `rclpy.action.ActionClient`.

        Raises:
            AdapterNotFoundError: The protobuf class has no adapter.
            RosNotFoundError: The ROS action class cannot be imported.
            TypeHashError: The adapter was generated for another version of the type than the installed one.
        """
        ros_type, self.adapter = resolve(ACTION, action_type, node.get_logger())
        if self.adapter is not None:
            convert = self.adapter.feedback_message.convert_to_custom
            source = f"the server of action {action_name}"
            self._reception = Reception(node.get_logger(), source, convert, on_conversion_error)
        self._sender = f"the client of action {action_name}"
        super().__init__(node, ros_type, action_name, **options)

    @property
    def conversion_errors(self) -> int:
        """How many feedback messages were dropped, since they could not be converted."""
        return self._reception.conversion_errors if self.adapter else 0

    def send_goal(self, goal: GoalT | RosMessage, **options: Any) -> Any:
        """Send a goal and wait for its result, as `rclpy.action.ActionClient.send_goal` does.

        Returns:
            The protobuf message of the response: its `status` and `result`.

        Raises:
            ConversionError: A value does not fit on the other side.
            TypeError: The goal is neither a protobuf message nor a ROS message of this action.
        """
        return super().send_goal(self._ros_goal(goal), **options)

    def send_goal_async(
        self,
        goal: GoalT | RosMessage,
        feedback_callback: Callable[..., Any] | None = None,
        goal_uuid: Any = None,
    ) -> rclpy.task.Future[ClientGoalHandle[GoalT, ResultT, FeedbackT]]:
        """Send a goal, as `rclpy.action.ActionClient.send_goal_async` does.

        Args:
            goal: A protobuf message, or a ROS message.
            feedback_callback: Is called with a protobuf message that has `goal_id` and `feedback`.
            goal_uuid: Identifies the goal; if None, it is made up.

        Returns:
            A future of the goal's handle. The result that its `get_result_async` promises has the result as protobuf.

        Raises:
            ConversionError: A value of the goal does not fit the ROS type; nothing is sent.
            TypeError: It is neither a protobuf message nor a ROS message of this action.
        """
        if self.adapter is not None and feedback_callback is not None:
            feedback_callback = self._reception.callback(feedback_callback)
        future: rclpy.task.Future[Any] = super().send_goal_async(
            self._ros_goal(goal), feedback_callback, goal_uuid
        )
        return future

    def _ros_goal(self, goal: Any) -> Any:
        if self.adapter is None:
            return goal
        return to_ros_message(self.adapter.goal, goal, self._sender)
