"""Which plugin parses the messages of a topic, and what it is told of their type."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy

from rosidl_adapter_proto.bags.model import CDR, PROTOBUF, ROS1, Topic
from rosidl_adapter_proto.bags.types import BagTypes, protobuf_definition
from rosidl_adapter_proto.errors import BagError, DefinitionError, PluginError, RequestError
from rosidl_adapter_proto.interfaces.model import TypeName
from rosidl_adapter_proto.interfaces.recorded import ORIGIN, ROS2MSG, described_text
from rosidl_adapter_proto.plotjuggler.columns import Column
from rosidl_adapter_proto.plotjuggler.host import ArrayPolicy, Parser, Plugin, open_plugin
from rosidl_adapter_proto.plotjuggler.plugins import plugin_path
from rosidl_adapter_proto.transcode.codec import Transcoder
from rosidl_adapter_proto.transcode.error import TranscodeError

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True)
class ParserInput:
    """What the parser of a topic is made of, and gets.

    Attributes:
        encoding: What plugins call the encoding of the messages, such as `ros2msg`.
        type_name: The type, as the encoding has it.
        schema: Its definition, as the encoding has it.
        transcode: Makes of a message of the bag one of the encoding; None if it is one. It raises `TranscodeError`.
    """

    encoding: str
    type_name: str
    schema: bytes = field(repr=False)
    transcode: Callable[[bytes], bytes] | None = field(repr=False, default=None)


def parser_input(topic: Topic, types: BagTypes) -> ParserInput:
    """Return what the parser of a topic is made of.

    Raises:
        BagError: Nothing is known of its type, or no parser could be told of it.
    """
    known = _FORMATS.get(topic.serialization_format)
    if known is not None:
        return known[1](topic, types)
    type_name = topic.schema_name or topic.type_name
    return ParserInput(topic.serialization_format, type_name, topic.definition.data)


def _of_protobuf(topic: Topic, types: BagTypes) -> ParserInput:
    if topic.definition.encoding == PROTOBUF and topic.definition.data:
        return ParserInput(PROTOBUF, topic.schema_name, topic.definition.data)
    schema = types.schema(topic)
    return ParserInput(PROTOBUF, schema.descriptor.full_name, protobuf_definition(schema).data)


def _of_cdr(topic: Topic, types: BagTypes) -> ParserInput:
    schema = types.schema(topic)
    recorded = types.ros_definition(topic)
    is_whole = recorded.encoding == ROS2MSG and types.origin(topic) == ORIGIN
    if is_whole and TypeName.parse(schema.type_name).namespace == "msg":
        return ParserInput(ROS2MSG, topic.type_name, recorded.data)
    try:
        return ParserInput(ROS2MSG, schema.type_name, described_text(schema.type_description))
    except DefinitionError as error:
        raise BagError(f"topic {topic.name} ({topic.type_name}): {error}") from None


def _of_ros1(topic: Topic, types: BagTypes) -> ParserInput:
    schema = types.schema(topic)
    transcoder = Transcoder(schema.type_description, schema.descriptor)
    return ParserInput(
        PROTOBUF, schema.descriptor.full_name, protobuf_definition(schema).data, transcoder.ros1_to_proto
    )


# What plugins call the encoding of messages of a format, and what makes the input of their parser.
_FORMATS: dict[str, tuple[str, Callable[[Topic, BagTypes], ParserInput]]] = {
    CDR: (ROS2MSG, _of_cdr),
    PROTOBUF: (PROTOBUF, _of_protobuf),
    ROS1: (PROTOBUF, _of_ros1),
}


class TopicParser:
    """Parses the messages of a topic.

    Args:
        found: What the parser is made of, and gets.
        parser: The parser.
    """

    def __init__(self, found: ParserInput, parser: Parser) -> None:
        self._transcode = found.transcode
        self._parser = parser

    def parse(
        self, data: memoryview, ranges: NDArray[numpy.uint64]
    ) -> tuple[tuple[Column, ...], dict[int, str]]:
        """Return the values of messages by their keys, and why some messages could not be parsed, by their index.

        Args:
            data: What the messages are in.
            ranges: The first byte of each, and the one after the last.

        Raises:
            PluginError: The plugin was stopped, or broke its contract.
        """
        if self._transcode is None:
            batch = self._parser.parse_batch(data, ranges.data)
            return batch.columns, batch.refused
        messages: dict[int, bytes] = {}
        refused: dict[int, str] = {}
        for index, (first, last) in enumerate(ranges.tolist()):
            try:
                messages[index] = self._transcode(bytes(data[first:last]))
            except TranscodeError as error:
                refused[index] = str(error)
        ends = numpy.cumsum([len(each) for each in messages.values()], dtype=numpy.uint64)
        begins = numpy.concatenate([numpy.zeros(1, numpy.uint64), ends])[: len(ends)]
        places = numpy.stack([begins, ends], axis=1).data
        batch = self._parser.parse_batch(b"".join(messages.values()), places)
        kept = numpy.fromiter(messages, numpy.int64)
        refused |= {int(kept[index]): reason for index, reason in batch.refused.items()}
        return tuple(replace(each, messages=kept[each.messages]) for each in batch.columns), refused


class TopicParsers:
    """Gives the parser of each topic.

    Args:
        types: The types of the bag.
        plugin: What parses all of them; by default our plugins.
        array_policy: What becomes of long arrays; by default what the plugin does by itself.
    """

    def __init__(
        self, types: BagTypes, plugin: Plugin | None = None, array_policy: ArrayPolicy | None = None
    ) -> None:
        self._types = types
        self._plugin = plugin
        self._array_policy = array_policy
        self._ours: dict[str, Plugin] = {}
        self._made: dict[tuple[str, str, str, bytes], TopicParser] = {}

    def parser(self, topic: Topic) -> TopicParser:
        """Return the parser of a topic.

        Raises:
            BagError: Nothing is known of its type, there is no plugin for its encoding, or the plugin does not take
                the type.
            PluginError: Our plugin cannot be found or built.
        """
        found = parser_input(topic, self._types)
        key = (topic.name, found.encoding, found.type_name, found.schema)
        if key not in self._made:
            plugin = self._plugin or self._our_plugin(topic, found.encoding)
            try:
                made = plugin.parser(
                    topic.name, found.type_name, found.schema, array_policy=self._array_policy
                )
            except (PluginError, RequestError) as error:
                raise BagError(f"topic {topic.name}: {error}") from None
            self._made[key] = TopicParser(found, made)
        return self._made[key]

    def _our_plugin(self, topic: Topic, encoding: str) -> Plugin:
        if encoding not in (known for known, _ in _FORMATS.values()):
            raise BagError(
                f"topic {topic.name}: its messages are {encoding}, for which there is no plugin here; give one to "
                "`plotjuggler run`"
            )
        if encoding not in self._ours:
            self._ours[encoding] = open_plugin(plugin_path(encoding))
        return self._ours[encoding]


def encodings(topic: Topic) -> tuple[str, ...]:
    """Return the encodings that a plugin for a topic may name: that of its messages, or that of its schema."""
    known = _FORMATS.get(topic.serialization_format)
    return (known[0],) if known else (topic.serialization_format, topic.definition.encoding)


def is_for(plugin: Plugin, topic: Topic) -> bool:
    """Tell whether a plugin is for the encoding of a topic; it may name several."""
    return any(each in plugin.encodings for each in encodings(topic) if each)
