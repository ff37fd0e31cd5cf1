"""From one serialization format to another, as `rosbag2_cpp::Converter` does it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import repeat
from typing import TYPE_CHECKING, Any, TypeAlias

from rosidl_adapter_proto.converters.cdr import CdrConverter
from rosidl_adapter_proto.converters.interfaces import SerializedBagMessage, with_data
from rosidl_adapter_proto.converters.protobuf import ProtobufConverter
from rosidl_adapter_proto.converters.registry import SUFFIX, ConverterRegistry
from rosidl_adapter_proto.converters.ros1 import Ros1Deserializer
from rosidl_adapter_proto.errors import ConversionError, ConverterError, Error
from rosidl_adapter_proto.transcode.records import Direction

if TYPE_CHECKING:
    from typing_extensions import Buffer

    from rosidl_adapter_proto.converters.interfaces import Result
    from rosidl_adapter_proto.schema.registry import Schema

_TO_PROTOBUF: Mapping[type[Any], tuple[Direction, ...]] = {
    CdrConverter: (Direction.CDR_TO_PROTO,),
    ProtobufConverter: (),
    Ros1Deserializer: (Direction.ROS1_TO_PROTO,),
}
_FROM_PROTOBUF: Mapping[type[Any], tuple[Direction, ...]] = {
    CdrConverter: (Direction.PROTO_TO_CDR,),
    ProtobufConverter: (),
}

Converted: TypeAlias = SerializedBagMessage | Error
"""What becomes of one message of a batch: the new one, or why there is none."""


class Converter:
    """Converts messages from one serialization format to another, through protobuf bytes.

    Between equal formats messages stay as they are, and no plugin is looked for. A converter is used by one thread at
    a time, as plugins are.

    Attributes:
        input_format: The format of the messages, such as `cdr`.
        output_format: What they become, such as `protobuf`.

    Args:
        input_format: The format of the messages, such as `cdr`.
        output_format: What they become, such as `protobuf`.
        registry: Where plugins come from; by default those that are installed.

    Raises:
        ConverterError: There is no converter for a format, the input's being looked for first, or it cannot be used.
    """

    def __init__(
        self, input_format: str, output_format: str, registry: ConverterRegistry | None = None
    ) -> None:
        self.input_format = input_format
        self.output_format = output_format
        self._is_copy = input_format == output_format
        if self._is_copy:
            return
        registry = registry or ConverterRegistry()
        deserializer = registry.load_deserializer(input_format)
        if deserializer is None:
            raise ConverterError(_not_found(registry, input_format, is_input=True))
        serializer = registry.load_serializer(output_format)
        if serializer is None:
            raise ConverterError(_not_found(registry, output_format, is_input=False))
        self._deserializer = deserializer
        self._serializer = serializer

    @property
    def native_directions(self) -> tuple[Direction, ...] | None:
        """The steps in which a `RecordConverter` does the same to whole chunks; None if plugins are needed for it.

        There is one step, two for ROS 1 to CDR (of which the second has the type in ROS 2), and none for equal formats.
        """
        if self._is_copy:
            return ()
        before = _TO_PROTOBUF.get(type(self._deserializer))
        after = _FROM_PROTOBUF.get(type(self._serializer))
        return None if before is None or after is None else before + after

    def convert(
        self,
        message: SerializedBagMessage,
        type_support: Schema,
        output_type_support: Schema | None = None,
    ) -> SerializedBagMessage:
        """Return a message in the other format, with the same topic, times and number.

        Args:
            message: The message.
            type_support: The type of the message.
            output_type_support: What it becomes, if that is another version of the type, of which
                `ros1.check_ros2_type` has found that it reads the same protobuf bytes.

        Raises:
            ConversionError: It is no message of the type, or the other format cannot have it.
        """
        if self._is_copy:
            return message
        read, write = self._deserializer.to_protobuf, self._serializer.from_protobuf
        protobuf = _one(message, self.input_format + SUFFIX, read, type_support)
        return _one(protobuf, self.output_format + SUFFIX, write, output_type_support or type_support)

    def convert_batch(
        self,
        messages: Sequence[SerializedBagMessage],
        type_support: Schema,
        output_type_support: Schema | None = None,
    ) -> list[Converted]:
        """Do `convert` for many messages of one type; one that fails does not fail the others.

        Returns:
            For each message the new one, or the `ConversionError` that `convert` would raise, in their order.

        Raises:
            ConverterError: A plugin fails for the batch as a whole, or leaves out messages.
        """
        if self._is_copy:
            return list(messages)
        read, write = self._deserializer.to_protobuf_batch, self._serializer.from_protobuf_batch
        protobuf = _many(messages, self.input_format + SUFFIX, read, type_support)
        return _many(protobuf, self.output_format + SUFFIX, write, output_type_support or type_support)


def _one(
    message: SerializedBagMessage,
    plugin: str,
    convert: Callable[[SerializedBagMessage, Schema], Buffer],
    type_support: Schema,
) -> SerializedBagMessage:
    """Return a message as a plugin converts it."""
    try:
        result: Result = convert(message, type_support)
    except Exception as error:  # plugins may raise anything
        result = error
    converted = _converted(message, result, plugin, type_support)
    if isinstance(converted, Error):
        raise converted
    return converted


def _many(
    messages: Sequence[Converted],
    plugin: str,
    convert: Callable[[Sequence[SerializedBagMessage], Schema], Sequence[Result]],
    type_support: Schema,
) -> list[Converted]:
    """Return the messages as a plugin converts them; those that have failed before stay as they are."""
    given = [each for each in messages if isinstance(each, SerializedBagMessage)]
    try:
        results = convert(given, type_support)
    except Error:
        raise
    except Exception as error:  # plugins may raise anything
        raise ConverterError(f"{plugin} failed: {type(error).__name__}: {error}") from error
    if len(results) != len(given):
        raise ConverterError(f"{plugin} gave {len(results)} results for {len(given)} messages")
    converted = map(_converted, given, results, repeat(plugin), repeat(type_support))
    return [each if isinstance(each, Error) else next(converted) for each in messages]


def _converted(message: SerializedBagMessage, result: Result, plugin: str, type_support: Schema) -> Converted:
    """Return a message with new bytes, or the error in the terms of this package."""
    if isinstance(result, Error):
        return result
    if not isinstance(result, Exception):
        try:
            memoryview(result)
            return with_data(message, result)
        except TypeError as error:
            result = error
    failed = ConversionError(
        type_support.type_name, "", f"{plugin} failed: {type(result).__name__}: {result}"
    )
    failed.__cause__ = result
    return failed


def _not_found(registry: ConverterRegistry, serialization_format: str, is_input: bool) -> str:
    """Return rosbag2's words for a missing converter, and what there is."""
    name = serialization_format + SUFFIX
    direction, other = ("read", "only writes it") if is_input else ("written", "only reads it")
    plugins = registry.plugins()
    named = [each.plugin for each in plugins if each.plugin.name == name]
    reason = f"{named[0]} {other}" if named else f"no plugin is called {name}"
    usable = [each for each in plugins if (each.deserializes if is_input else each.serializes)]
    known = ", ".join(sorted({each.serialization_format for each in usable}))
    return (
        f"Could not find converter for format {serialization_format}: {reason}; "
        f"formats that can be {direction}: {known}"
    )
