"""Every private part of rclpy that is used here, and all that rclpy is relied on for though it does not promise it.

No other module touches a private part of rclpy. `tests/ros/test_rclpy_internals.py` has a test for each of these, by
name, so that a version of rclpy where one is not so fails there first:

- `entities_may_change_their_class`: what a node creates is a plain object, which nodes and executors know by identity.
- `names_are_free`: no attribute of rclpy has a name that ours have.
- `callbacks_are_known_by_their_signature`: that which `inspect.signature` finds behind `__wrapped__` tells whether a
  callback takes a MessageInfo, and `inspect.iscoroutinefunction` whether it is awaited.
- `publishers_send_bytes`: `Publisher.publish` sends `bytes` as they are.
- `raw_subscriptions_hand_over_bytes`: the executor reads `raw` and `callback` of a subscription for each message.
- `subscription_callback_is_a_property`: its setter keeps what the executor calls.
- `service_callback_is_an_attribute`: the executor reads it for each request.
- `services_send_what_the_callback_returns`: the executor passes it to `send_response` of the service, whatever it is.
- `clients_call_through_call_async`: `Client.call` returns the result of the future that `call_async` returns.
- `futures_keep_result_and_exception`: in `_result` and `_exception`, where `result`, `exception` and `await` find them.
- `lifecycle_publishers_know_whether_they_are_active`: `is_activated`.
- `action_servers_register_their_callbacks`: those that they are made with too; without any there are defaults.
- `goal_handles_may_change_their_class`: an action server makes a plain object for each goal, with a property `request`.
- `goal_handles_execute_through_their_server`: `notify_execute` gets the callback, or None for the registered one.
- `goals_are_sent_through_send_goal_async`: `ActionClient.send_goal` passes on what it is given.
- `results_come_through_get_result_async`: all ways to ask for a result end up in `_get_result_async` of the client.
- `stamps_are_read_by_from_msg`: a class method of `Time` and `Duration`, which takes nothing but ROS's own message.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import cache, wraps
from typing import TYPE_CHECKING, Any, TypeVar

import builtin_interfaces.msg  # type: ignore[import-untyped, unused-ignore]
import rclpy.action.client
import rclpy.duration
import rclpy.task
import rclpy.time
from google.protobuf.message import Message

from rosidl_adapter_proto.errors import ConversionError
from rosidl_adapter_proto.time import to_message

if TYPE_CHECKING:
    from rosidl_adapter_proto.adapter import ActionAdapter, TypeAdapter

    EntityT = TypeVar("EntityT")

# rclpy's classes are generic in newer versions only, and then in the ROS type.
# mypy: disable-error-code="type-arg, unused-ignore"


def convert_in(entity: Any, entity_class: type[EntityT], **attributes: Any) -> EntityT:
    """Make an object of rclpy one that converts: give it a subclass of its class, and attributes.

    Nodes name the classes of what they create, and executors know these objects by what rclpy put into them. So rclpy
    makes them, whole and registered, and afterwards they learn to convert.

    Args:
        entity: What rclpy made.
        entity_class: The class that converts: a subclass of rclpy's.
        attributes: What that class needs to know.

    Returns:
        The entity.
    """
    vars(entity).update(attributes)
    rclpy_class: type = type(entity)
    # mypy takes classes for unhashable
    entity.__class__ = combined(entity_class, rclpy_class)  # type: ignore[arg-type]
    converting: EntityT = entity
    return converting


@cache
def combined(entity_class: type, rclpy_class: type) -> type:
    """Return a class of rclpy that converts: `entity_class`, unless rclpy's is a subclass of what that builds on."""
    if issubclass(entity_class, rclpy_class):
        return entity_class
    return type(rclpy_class.__name__, (entity_class, rclpy_class), {"__module__": entity_class.__module__})


def callback_of_service(service: Any) -> Callable[..., Any]:
    """Return the callback that the executor calls, of a service whose class hides it behind a property."""
    callback: Callable[..., Any] = vars(service)["callback"]
    return callback


def set_callback_of_service(service: Any, callback: Callable[..., Any]) -> None:
    """Set the callback that the executor calls."""
    vars(service)["callback"] = callback


class ConvertedFuture(rclpy.task.Future):
    """A future whose result is converted when it is first asked for, in the thread that asks."""

    _adapter: type[TypeAdapter[Any, Any]] | None
    _conversion_lock: threading.Lock

    def result(self) -> Any:
        """Return the protobuf message, None while there is none, or raise what went wrong."""
        self._convert()
        return super().result()

    def exception(self) -> Exception | None:
        """Return what went wrong, if anything."""
        self._convert()
        return super().exception()

    def _convert(self) -> None:
        with self._conversion_lock:
            if self._adapter is None or self._result is None:
                return
            try:
                self._result = self._adapter.convert_to_custom(self._result)
            except ConversionError as error:
                self._exception = error
            self._adapter = None


def convert_result(future: rclpy.task.Future[Any], adapter: type[TypeAdapter[Any, Any]]) -> None:
    """Make the result of a future a protobuf message; it may be done already."""
    convert_in(future, ConvertedFuture, _adapter=adapter, _conversion_lock=threading.Lock())


class ConvertingActionClient(rclpy.action.client.ActionClient):
    """An action client whose results are protobuf messages, however its goal handles are asked for them."""

    adapter: type[ActionAdapter[Any, Any, Any]] | None

    def _get_result_async(self, goal_handle: Any) -> rclpy.task.Future[Any]:
        future: rclpy.task.Future[Any] = super()._get_result_async(goal_handle)
        if self.adapter is not None:
            convert_result(future, self.adapter.get_result.response)
        return future


def accept_protobuf_stamps() -> None:
    """Make `from_msg` of rclpy's `Time` and `Duration` take protobuf messages too, in the whole process.

    Libraries that read the stamps of messages call it, message_filters above all, and know nothing of us. What it took
    before, it takes as before; what would be a TypeError otherwise is converted.
    """
    classes: tuple[tuple[Any, Any], ...] = (
        (rclpy.time.Time, builtin_interfaces.msg.Time),
        (rclpy.duration.Duration, builtin_interfaces.msg.Duration),
    )
    for rclpy_class, ros_class in classes:
        of_rclpy = vars(rclpy_class)["from_msg"].__func__
        rclpy_class.from_msg = classmethod(_accepting_protobuf(of_rclpy, ros_class))


def _accepting_protobuf(of_rclpy: Callable[..., Any], ros_class: Any) -> Callable[..., Any]:
    @wraps(of_rclpy)
    def from_msg(cls: Any, msg: Any, *others: Any, **options: Any) -> Any:
        is_protobuf = isinstance(msg, Message)
        return of_rclpy(cls, to_message(msg, ros_class) if is_protobuf else msg, *others, **options)

    return from_msg
