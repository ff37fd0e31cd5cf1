"""The base classes of adapters."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any, ClassVar, Generic, NamedTuple, TypeVar

from google.protobuf.message import Message

from rosidl_adapter_proto.adapter.lazy import (
    LazyAttributes,
    find_ros_class,
    import_of_ros,
    lazy,
    make_codec,
    name_of,
    take_transcoder,
)
from rosidl_adapter_proto.errors import ConversionError

if TYPE_CHECKING:
    from typing_extensions import Buffer

    from rosidl_adapter_proto.interfaces.description import IndividualTypeDescription, TypeDescription
    from rosidl_adapter_proto.transcode.codec import Codec, Transcoder

CustomT = TypeVar("CustomT", bound=Message)
RosT = TypeVar("RosT")
RequestT = TypeVar("RequestT", bound=Message)
ResponseT = TypeVar("ResponseT", bound=Message)
GoalT = TypeVar("GoalT", bound=Message)
ResultT = TypeVar("ResultT", bound=Message)
FeedbackT = TypeVar("FeedbackT", bound=Message)


if TYPE_CHECKING:

    class like_constructor:
        """A class method that, to type checkers, takes what the constructor of the protobuf class takes."""

        def __init__(self, method: Callable[..., Any]) -> None: ...

        def __get__(self, instance: object, adapter: type[TypeAdapter[CustomT, Any]]) -> type[CustomT]: ...

else:
    like_constructor = classmethod


class FieldInfo(NamedTuple):
    """The type of a field, as `type_description_interfaces/msg/FieldType` has it (REP-2011).

    Attributes:
        name: The field's name.
        type_id: The type, a `FIELD_TYPE_*` constant.
        capacity: Length of an array, bound of a bounded sequence, else 0.
        string_capacity: Bound of a bounded string, else 0.
        nested: Adapter of the message type, if it is one.
    """

    name: str
    type_id: int
    capacity: int = 0
    string_capacity: int = 0
    nested: type[TypeAdapter[Any, Any]] | None = None


class TypeAdapter(LazyAttributes, Generic[CustomT, RosT]):
    """Converts between a protobuf message and a ROS message (REP-2007, for Python).

    Generated classes derive from it; none is ever instantiated.

    Attributes:
        custom_type: The protobuf message class.
        ros_message_type: The ROS message class, imported when it is first asked for.
        type_name: The ROS name of the type, such as `std_msgs/msg/String`.
        type_hash: The RIHS01 hash of the type (REP-2011).
        fields: The fields of the ROS message, in order.
        defaults: Default values other than zero, in terms of protobuf.
        has_defaults: Whether the type or one inside it has any.
        codec: Turns protobuf messages into serialized ROS messages and back, without a ROS message in between. It is
            made when it is first asked for, and is None if any conversion of the class was written by hand.
        transcoder: That of the codec, for messages that are serialized on both sides; None without a codec.
        ros_class: Where the ROS message class is: `module:Class`.
    """

    custom_type: type[CustomT]
    ros_message_type: Any = lazy(find_ros_class)
    type_name: ClassVar[str]
    type_hash: ClassVar[str]
    fields: ClassVar[tuple[FieldInfo, ...]]
    defaults: ClassVar[Mapping[str, Any]] = {}
    has_defaults: ClassVar[bool] = False
    codec: ClassVar[Codec[Any] | None] = lazy(make_codec)
    transcoder: ClassVar[Transcoder | None] = lazy(take_transcoder)
    ros_class: ClassVar[str]

    @staticmethod
    def convert_to_ros_message(source: CustomT, destination: RosT | None = None) -> RosT:
        """Convert a protobuf message to a ROS message.

        Args:
            source: The protobuf message. Fields that its class does not know are ignored.
            destination: A ROS message to overwrite; a new one is made if it is None.

        Returns:
            The destination, or the new ROS message.

        Raises:
            ConversionError: A value does not fit; the destination is left as it was.
            RosNotFoundError: The ROS message class cannot be imported.
        """
        raise NotImplementedError

    @staticmethod
    def convert_to_custom(source: RosT, destination: CustomT | None = None) -> CustomT:
        """Convert a ROS message to a protobuf message.

        Args:
            source: The ROS message, or any object with the same fields.
            destination: A protobuf message to overwrite; a new one is made if it is None.

        Returns:
            The destination, or the new protobuf message.

        Raises:
            ConversionError: A value does not fit; the destination is left as it was.
        """
        raise NotImplementedError

    @staticmethod
    def fill_ros_message(source: CustomT, message: RosT) -> None:
        """Fill a newly made ROS message; it is left half filled on an error."""
        raise NotImplementedError

    @staticmethod
    def fill_custom(source: RosT, message: CustomT) -> None:
        """Fill an empty protobuf message; it is left half filled on an error."""
        raise NotImplementedError

    @classmethod
    def to_cdr(cls, source: CustomT) -> bytes:
        """Return a protobuf message as ROS sends it: little-endian CDR with its encapsulation header.

        No ROS message is made on the way, and ROS need not be installed; unless there is no codec.

        Raises:
            ConversionError: A value does not fit; with a codec it is a `TranscodeError`, which has the place in the
                bytes as well.
            RosNotFoundError: There is no codec, and the ROS message class or rclpy cannot be imported.
        """
        codec = cls.codec
        if codec is None:
            serialization = import_of_ros("rclpy.serialization", cls)
            data: bytes = serialization.serialize_message(cls.convert_to_ros_message(source))
            return data
        return codec.to_cdr(source)

    @classmethod
    def from_cdr(cls, data: Buffer, fields: Iterable[str] | None = None) -> CustomT:
        """Return the protobuf message of a serialized ROS message: plain CDR of either byte order.

        Args:
            data: The serialized message.
            fields: Which fields to read, such as `["header.stamp", "width"]`; the others are skipped and not even
                looked at. By default all are read.

        Raises:
            ConversionError: The bytes are not a valid message of the type; with a codec it is a `TranscodeError`.
            RosNotFoundError: There is no codec, and the ROS message class or rclpy cannot be imported.
            SchemaError: The type has no such field.
            TypeError: There is no codec, and only some fields are asked for.
        """
        codec = cls.codec
        if codec is not None:
            message: CustomT = codec.from_cdr(data) if fields is None else codec.from_cdr(data, fields)
            return message
        if fields is not None:
            raise TypeError(
                f"{name_of(cls)}: conversions that were written by hand take whole messages; leave `fields` out"
            )
        deserialize, ros_class = (
            import_of_ros("rclpy.serialization", cls).deserialize_message,
            cls.ros_message_type,
        )
        serialized = bytes(data)
        try:
            ros_message = deserialize(serialized, ros_class)
        except Exception as error:  # rclpy raises errors of several kinds
            reason = f"{len(serialized)} bytes are not a serialized message of this type: {error}"
            raise ConversionError(name_of(cls), "", reason) from error
        return cls.convert_to_custom(ros_message)

    @like_constructor
    def new(cls, /, **fields: Any) -> CustomT:
        """Make a protobuf message with the default values of the ROS definition, which proto3 cannot carry.

        Args:
            fields: Values of fields, as the protobuf class takes them; they come before default values.
        """
        message = cls.custom_type(**{**cls.defaults, **fields})
        for info in cls.fields:
            nested = info.nested
            if nested is None or not nested.has_defaults or info.name in fields:
                continue
            if info.type_id == _NESTED:
                copy_message(nested.new(), getattr(message, info.name))
            elif info.type_id == _NESTED_ARRAY:
                getattr(message, info.name).extend(nested.new() for _ in range(info.capacity))
        return message

    @classmethod
    def type_description(cls) -> TypeDescription:
        """Return the type description (REP-2011), in the form of the `.json` files of ROS, without default values."""
        found: dict[str, type[TypeAdapter[Any, Any]]] = {}
        waiting: list[type[TypeAdapter[Any, Any]]] = [cls]
        while waiting:
            for info in waiting.pop().fields:
                if info.nested is not None and info.nested.type_name not in found:
                    found[info.nested.type_name] = info.nested
                    waiting.append(info.nested)
        return {
            "type_description": _individual_description(cls),
            "referenced_type_descriptions": [_individual_description(found[name]) for name in sorted(found)],
        }


def copy_message(source: Message, destination: Message) -> None:
    """Overwrite a protobuf message with another, which may have fields called like its methods.

    `CopyFrom` of protobuf before 4.22 is written in Python, and calls the other two on the message.
    """
    if destination is not source:
        type(destination).Clear(destination)
        type(destination).MergeFrom(destination, source)


# type_description_interfaces/msg/FieldType
_NESTED, _NESTED_ARRAY = 1, 49


def _individual_description(adapter: type[TypeAdapter[Any, Any]]) -> IndividualTypeDescription:
    return {
        "type_name": adapter.type_name,
        "fields": [
            {
                "name": info.name,
                "type": {
                    "type_id": info.type_id,
                    "capacity": info.capacity,
                    "string_capacity": info.string_capacity,
                    "nested_type_name": info.nested.type_name if info.nested else "",
                },
                "default_value": "",
            }
            for info in adapter.fields
        ],
    }


class ServiceAdapter(LazyAttributes, Generic[RequestT, ResponseT]):
    """The adapters of a service.

    Those that are generated or made at run time also have the protobuf classes as `Request` and `Response`, as the ROS
    class has its messages, and generated ones go by the name of the service alone as well.

    Attributes:
        request: Adapter of the request.
        response: Adapter of the response.
        type_name: The ROS name of the service, such as `std_srvs/srv/SetBool`.
        type_hash: The RIHS01 hash of the service.
        ros_service_type: The ROS service class, imported when it is first asked for.
        ros_class: Where the ROS service class is: `module:Class`.
    """

    request: type[TypeAdapter[RequestT, Any]]
    response: type[TypeAdapter[ResponseT, Any]]
    type_name: ClassVar[str]
    type_hash: ClassVar[str]
    ros_service_type: Any = lazy(find_ros_class)
    ros_class: ClassVar[str]


class ActionAdapter(LazyAttributes, Generic[GoalT, ResultT, FeedbackT]):
    """The adapters of an action.

    Those that are generated or made at run time also have the protobuf classes as `Goal`, `Result` and `Feedback`, as
    the ROS class has its messages, and generated ones go by the name of the action alone as well.

    Attributes:
        goal: Adapter of the goal.
        result: Adapter of the result.
        feedback: Adapter of the feedback.
        send_goal: Adapters of the service that sends a goal.
        get_result: Adapters of the service that waits for a result.
        feedback_message: Adapter of what travels on the feedback topic.
        type_name: The ROS name of the action, such as `example_interfaces/action/Fibonacci`.
        type_hash: The RIHS01 hash of the action.
        ros_action_type: The ROS action class, imported when it is first asked for.
        ros_class: Where the ROS action class is: `module:Class`.
    """

    goal: type[TypeAdapter[GoalT, Any]]
    result: type[TypeAdapter[ResultT, Any]]
    feedback: type[TypeAdapter[FeedbackT, Any]]
    send_goal: type[ServiceAdapter[Any, Any]]
    get_result: type[ServiceAdapter[Any, Any]]
    feedback_message: type[TypeAdapter[Any, Any]]
    type_name: ClassVar[str]
    type_hash: ClassVar[str]
    ros_action_type: Any = lazy(find_ros_class)
    ros_class: ClassVar[str]
