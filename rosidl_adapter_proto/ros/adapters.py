"""What a user gives to say which type is meant: an adapter, a protobuf class that has one, or a ROS type."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from operator import attrgetter
from pathlib import PurePosixPath
from types import ModuleType
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from google.protobuf.message import Message

from rosidl_adapter_proto.adapter import ActionAdapter, ServiceAdapter, TypeAdapter
from rosidl_adapter_proto.errors import Error
from rosidl_adapter_proto.interfaces.model import TypeName
from rosidl_adapter_proto.ros.type_hash import check_type_hash
from rosidl_adapter_proto.schema.generated import generated_module, import_if_there
from rosidl_adapter_proto.schema.typemap import DEFAULT_PYTHON_ROOT

if TYPE_CHECKING:
    from rclpy.impl.rcutils_logger import RcutilsLogger


class RosMessage(Protocol):
    """A ROS message, for type checkers: what rosidl generates has this method, and a protobuf class does not."""

    @classmethod
    def get_fields_and_field_types(cls) -> dict[str, str]:
        """Return the type of each field."""
        ...


class RosService(Protocol):
    """A ROS service, for type checkers: what rosidl generates has classes of ROS messages, and an adapter does not."""

    @property
    def Request(self) -> type[RosMessage]: ...

    @property
    def Response(self) -> type[RosMessage]: ...


class RosAction(Protocol):
    """A ROS action, for type checkers: what rosidl generates has classes of ROS messages, and an adapter does not."""

    @property
    def Goal(self) -> type[RosMessage]: ...

    @property
    def Result(self) -> type[RosMessage]: ...

    @property
    def Feedback(self) -> type[RosMessage]: ...


class Kind(NamedTuple):
    """A kind of type.

    Attributes:
        adapter: The base class of its adapters.
        custom_type: Returns the protobuf class that stands for an adapter.
        ros_type: Returns the ROS class that an adapter is for.
        examples: What to give, for people.
    """

    adapter: type[Any]
    custom_type: Callable[[Any], Any]
    ros_type: Callable[[Any], Any]
    examples: str


MESSAGE = Kind(
    TypeAdapter,
    attrgetter("custom_type"),
    attrgetter("ros_message_type"),
    "a message, such as StringAdapter or String",
)
SERVICE = Kind(
    ServiceAdapter,
    attrgetter("request.custom_type"),
    attrgetter("ros_service_type"),
    "a service, such as SetBoolAdapter or SetBool_Request",
)
ACTION = Kind(
    ActionAdapter,
    attrgetter("goal.custom_type"),
    attrgetter("ros_action_type"),
    "an action, such as FibonacciAdapter or Fibonacci_Goal",
)
ANY_ADAPTER = tuple(kind.adapter for kind in (MESSAGE, SERVICE, ACTION))


class AdapterNotFoundError(Error, TypeError):
    """A protobuf class has no adapter of the kind that is needed, or more than one."""


def resolve(kind: Kind, given: object, logger: RcutilsLogger) -> tuple[Any, Any]:
    """Return the ROS type that a user means, and the adapter of what is sent with it.

    Args:
        kind: What is needed.
        given: An adapter, a protobuf class that has one, or anything else, such as a ROS type.
        logger: Of the node, to warn of an adapter that cannot be checked.

    Returns:
        The ROS type and the adapter, or what was given and None if it has no adapter.

    Raises:
        AdapterNotFoundError: A protobuf class has no adapter, or an adapter is of another kind.
        RosNotFoundError: The ROS class cannot be imported.
        TypeHashError: The adapter was generated for another version of the type than the installed one.
    """
    adapter = find_adapter(kind, given)
    if adapter is None:
        return given, None
    ros_type = kind.ros_type(adapter)
    check_type_hash(adapter, ros_type, logger)
    return ros_type, adapter


_found: dict[tuple[Kind, type], Any] = {}


def find_adapter(kind: Kind, given: object) -> Any:
    """Return the adapter of what a user gave to create something with.

    Args:
        kind: What is needed.
        given: An adapter or a protobuf class (of a service its request, of an action its goal), or anything else.

    Returns:
        The adapter; None if `given` is neither, such as a ROS type.

    Raises:
        AdapterNotFoundError: It has none, or is one of another kind.
    """
    if not isinstance(given, type):
        return None
    if issubclass(given, kind.adapter):
        return given
    if issubclass(given, ANY_ADAPTER):
        raise AdapterNotFoundError(f"{given.__name__} is not the adapter of {kind.examples}")
    if not issubclass(given, Message):
        return None
    if (kind, given) not in _found:
        _found[kind, given] = _search(kind, given)
    return _found[kind, given]


def _search(kind: Kind, custom_type: type[Message]) -> Any:
    for module in _adapter_modules(custom_type):
        for adapter in vars(module).values():
            if (
                isinstance(adapter, type)
                and issubclass(adapter, kind.adapter)
                and _is_for(kind, adapter, custom_type)
            ):
                return adapter
    imported = [adapter for adapter in _subclasses(kind.adapter) if _is_for(kind, adapter, custom_type)]
    if len(imported) == 1:
        return imported[0]
    name = f"{custom_type.__module__}.{custom_type.__qualname__}"
    if imported:
        found = " and ".join(f"{adapter.__module__}.{adapter.__qualname__}" for adapter in imported)
        raise AdapterNotFoundError(f"{name} has more than one adapter: {found}; pass the one to use")
    raise AdapterNotFoundError(
        f"{name} has no adapter for {kind.examples}; pass the adapter, or import it first, "
        "or generate one with rosidl-proto generate"
    )


def _adapter_modules(custom_type: type[Message]) -> Iterator[ModuleType]:
    """Yield where an adapter was generated: beside the protobuf class, or where its `.proto` file belongs."""
    path = PurePosixPath(custom_type.DESCRIPTOR.file.name).with_suffix("")
    modules = [str(custom_type.__module__).removesuffix("_pb2")]
    if len(path.parts) == 3:  # package/namespace/Name, as all that is generated
        modules.append(generated_module(TypeName(*path.parts), DEFAULT_PYTHON_ROOT))
    for module in modules:
        if (found := import_if_there(f"{module}_adapter")) is not None:
            yield found


def _subclasses(base: type) -> Iterator[Any]:
    subclasses: list[type] = base.__subclasses__()
    for subclass in subclasses:
        yield subclass
        yield from _subclasses(subclass)


def _is_for(kind: Kind, adapter: Any, custom_type: type[Message]) -> bool:
    try:
        return kind.custom_type(adapter) is custom_type
    except AttributeError:  # a base class of adapters, which has no types yet
        return False
