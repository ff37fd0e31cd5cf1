"""What turns messages of one type from CDR to protobuf and back: bytes to bytes, and bytes to objects.

The work is done by methods of the native module, which `_core.pyi` describes; the classes here make their plans.
"""

from __future__ import annotations

from typing import Any, NoReturn, TypeVar

from google.protobuf.descriptor import Descriptor
from google.protobuf.message import Message

from rosidl_adapter_proto.errors import wrong_message
from rosidl_adapter_proto.interfaces.description import TypeDescription
from rosidl_adapter_proto.transcode import _core
from rosidl_adapter_proto.transcode.plan import build_plan

MessageT = TypeVar("MessageT", bound=Message)

MAXIMUM_SIZE = 2**31 - 1
"""The largest protobuf message in bytes (https://protobuf.dev/programming-guides/encoding/#size-limit)."""


class Transcoder(_core.Transcoder):
    """Transcodes the messages of one type, from bytes to bytes.

    Its methods come from the native module. They take any contiguous buffer, raise `TranscodeError` for bytes that are
    not a valid message of the type, and may be called from many threads at once:

    - `cdr_to_proto(data)` reads plain CDR of either byte order and returns a serialized protobuf message.
    - `proto_to_cdr(data)` reads a protobuf message and returns little-endian plain CDR, as rclpy publishes it.
    - `cdr_to_proto_batch(messages, threads=1)` and `proto_to_cdr_batch(messages, threads=1)` do the same for a sequence
      of messages and return a list; other Python threads run meanwhile.

    Fields that are unknown to the type are skipped. An array that is absent in protobuf is an array of zeros.

    Args:
        type_description: The ROS type and everything that it refers to (REP-2011).
        descriptor: The protobuf message, with hashed or any other field numbers.
        size_limit: The largest result in bytes; a larger one is an error before memory is taken for it.
        omit_empty_messages: Leave out single nested messages that have no bytes; by default they are present.

    Raises:
        SchemaError: The description and the descriptor do not fit together.
    """

    def __init__(
        self,
        type_description: TypeDescription,
        descriptor: Descriptor,
        *,
        size_limit: int = MAXIMUM_SIZE,
        omit_empty_messages: bool = False,
    ) -> None:
        plan = build_plan(type_description, descriptor, omit_empty_messages=omit_empty_messages)
        super().__init__(plan.pack(), plan.type_name, size_limit)


class Codec(_core.Codec[MessageT]):
    """Turns protobuf messages of one type into serialized ROS messages and back.

    Its methods come from the native module and may be called from many threads at once:

    - `to_cdr(message)` returns a protobuf message as ROS sends it: little-endian CDR with its encapsulation header.
    - `from_cdr(data)` returns the protobuf message of a serialized ROS message: plain CDR of either byte order.

    Both raise `ConversionError` for what is not a valid message of the type; mostly it is a `TranscodeError`, which has
    the place in the bytes as well.

    Attributes:
        transcoder: Does the same from bytes to bytes.
        message_class: The class of the protobuf messages.

    Args:
        type_description: The ROS type and everything that it refers to (REP-2011).
        message_class: The class of the protobuf messages.

    Raises:
        SchemaError: The description and the class do not fit together.
    """

    def __init__(self, type_description: TypeDescription, message_class: type[MessageT]) -> None:
        descriptor: Any = message_class.DESCRIPTOR
        self.transcoder = Transcoder(type_description, descriptor)
        self.message_class = message_class
        super().__init__(self.transcoder, message_class)

    def _refuse(self, message: object) -> NoReturn:
        """Refuse a message of another class."""
        raise wrong_message(self.transcoder.type_name, self.message_class.DESCRIPTOR.full_name, message)
