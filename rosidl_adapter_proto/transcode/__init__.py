"""CDR bytes to protobuf bytes and back, without a message object in between."""

from __future__ import annotations

from typing import NoReturn

from google.protobuf.descriptor import Descriptor
from google.protobuf.message import Message

from rosidl_adapter_proto.errors import wrong_message
from rosidl_adapter_proto.interfaces.description import TypeDescription
from rosidl_adapter_proto.transcode import _core
from rosidl_adapter_proto.transcode.error import TranscodeError
from rosidl_adapter_proto.transcode.plan import build_plan

__all__ = ["MAXIMUM_SIZE", "TranscodeError", "Transcoder"]

MAXIMUM_SIZE = 2**31 - 1
"""The largest protobuf message in bytes (https://protobuf.dev/programming-guides/encoding/#size-limit)."""


class Transcoder(_core.Transcoder):
    """Transcodes the messages of one type.

    Its methods come from the native module. They take any contiguous buffer, raise `TranscodeError` for bytes that are
    not a valid message of the type, and may be called from many threads at once:

    - `cdr_to_proto(data)` reads plain CDR of either byte order and returns a serialized protobuf message.
    - `proto_to_cdr(data)` reads a protobuf message and returns little-endian plain CDR, as rclpy publishes it.
    - `cdr_to_proto_batch(messages, threads=1)` and `proto_to_cdr_batch(messages, threads=1)` do the same for a sequence
      of messages and return a list; other Python threads run meanwhile.

    - `message_to_cdr(message)` and `cdr_to_message(data)` do the same from and to objects of `message_class`.

    Fields that are unknown to the type are skipped. An array that is absent in protobuf is an array of zeros.

    Args:
        type_description: The ROS type and everything that it refers to (REP-2011).
        descriptor: The protobuf message, with hashed or any other field numbers.
        message_class: The class of protobuf messages, for the methods that take and return these.
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
        message_class: type[Message] | None = None,
        size_limit: int = MAXIMUM_SIZE,
        omit_empty_messages: bool = False,
    ) -> None:
        plan = build_plan(type_description, descriptor, omit_empty_messages=omit_empty_messages)
        super().__init__(plan.pack(), plan.type_name, size_limit, message_class)
        self._message_name = descriptor.full_name

    def refuse(self, message: object) -> NoReturn:
        """Refuse a message of another class.

        Raises:
            ConversionError: Always.
        """
        raise wrong_message(self.type_name, self._message_name, message)
