"""From one format to another: the path through protobuf bytes, its results, and its errors."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rosidl_adapter_proto import TypeRegistry
from rosidl_adapter_proto.converters import (
    Converter,
    ConverterRegistry,
    SerializationFormatConverter,
    SerializedBagMessage,
)
from rosidl_adapter_proto.converters.cdr import CdrConverter
from rosidl_adapter_proto.converters.protobuf import ProtobufConverter
from rosidl_adapter_proto.errors import ConversionError, ConverterError
from rosidl_adapter_proto.schema.registry import Schema
from rosidl_adapter_proto.transcode.records import Direction
from tests.converters.plugins import Failing, JsonConverter, JsonDeserializer, JsonSerializer

HEADER = b"\0\1\0\0"
TEXT = HEADER + b"\3\0\0\0hi\0"
MESSAGE = SerializedBagMessage(TEXT, "/chatter", 3, 2, 1)


@pytest.fixture(scope="module")
def schema() -> Schema:
    return TypeRegistry.from_texts({"my_msgs/msg/Text": "string<=3 data"})["my_msgs/msg/Text"]


@pytest.fixture
def registry() -> ConverterRegistry:
    registry = ConverterRegistry()
    registry.register("json_converter", JsonConverter)
    return registry


def data(message: Any) -> bytes:
    assert isinstance(message, SerializedBagMessage)
    return bytes(message.serialized_data)


def test_topic_times_and_number_are_kept(schema: Schema, registry: ConverterRegistry) -> None:
    for output_format, expected in {
        "protobuf": schema.message_class(data="hi").SerializeToString(),
        "json": b'{"data": "hi"}',
    }.items():
        converted = Converter("cdr", output_format, registry).convert(MESSAGE, schema)
        assert converted == replace(MESSAGE, serialized_data=expected)
        back = Converter(output_format, "cdr", registry).convert(converted, schema)
        assert back == MESSAGE
    assert MESSAGE.serialized_data is TEXT


def test_equal_formats_are_not_looked_up(schema: Schema) -> None:
    class NoRegistry(ConverterRegistry):
        def load_deserializer(self, serialization_format: str) -> Any:
            pytest.fail("looked for")

        load_serializer = load_deserializer

    for name in ("cdr", "there_is_none"):
        converter = Converter(name, name, NoRegistry())
        assert converter.convert(MESSAGE, schema) is MESSAGE
        assert converter.convert_batch([MESSAGE], schema) == [MESSAGE]


@pytest.mark.parametrize(
    ("formats", "directions"),
    [
        (("cdr", "protobuf"), (Direction.CDR_TO_PROTO,)),
        (("protobuf", "cdr"), (Direction.PROTO_TO_CDR,)),
        (("ros1", "protobuf"), (Direction.ROS1_TO_PROTO,)),
        (("rosbag_v2", "protobuf"), (Direction.ROS1_TO_PROTO,)),
        (("ros1", "cdr"), (Direction.ROS1_TO_PROTO, Direction.PROTO_TO_CDR)),
        (("cdr", "cdr"), ()),
        (("json", "cdr"), None),
        (("protobuf", "json"), None),
    ],
)
def test_what_is_native(
    formats: tuple[str, str], directions: tuple[Direction, ...] | None, registry: ConverterRegistry
) -> None:
    assert Converter(*formats, registry).native_directions == directions


def test_the_input_is_looked_for_first() -> None:
    registry = ConverterRegistry()
    registry.register("read_converter", JsonDeserializer)
    registry.register("written_converter", JsonSerializer)
    read = "formats that can be read: cdr, protobuf, read, ros1, rosbag_v2"
    written = "formats that can be written: cdr, protobuf, written"
    here = "tests.converters.plugins"
    for formats, text in {
        ("x", "y"): f"Could not find converter for format x: no plugin is called x_converter; {read}",
        ("cdr", "y"): f"Could not find converter for format y: no plugin is called y_converter; {written}",
        ("cdr", "read"): "Could not find converter for format read: "
        f"read_converter ({here}:JsonDeserializer, registered) only reads it; {written}",
        ("cdr", "ros1"): "Could not find converter for format ros1: ros1_converter "
        f"(rosidl_adapter_proto.converters.ros1:Ros1Deserializer, built in) only reads it; {written}",
        ("written", "cdr"): "Could not find converter for format written: "
        f"written_converter ({here}:JsonSerializer, registered) only writes it; {read}",
    }.items():
        with pytest.raises(ConverterError) as error:
            Converter(*formats, registry)
        assert str(error.value) == text


def test_a_broken_plugin() -> None:
    registry = ConverterRegistry()
    registry.register("json_converter", Failing)
    with pytest.raises(
        ConverterError, match=r"^json_converter \(.*:Failing, registered\) cannot be used: Value"
    ):
        Converter("json", "cdr", registry)


@pytest.mark.parametrize(
    ("formats", "bad", "text"),
    [
        (
            ("cdr", "protobuf"),
            b"\0\1",
            "my_msgs/msg/Text at byte 0: a CDR message begins with a header of 4 bytes and this one has 2; "
            "give the whole serialized message",
        ),
        (("cdr", "json"), HEADER + b"\x09\0\0\0hi\0", None),
        (("protobuf", "cdr"), b"\xff", None),
        (("protobuf", "json"), b"\xff", None),
        (("json", "cdr"), b"{", None),
        (("json", "cdr"), b'{"data": "longer"}', None),
        (("json", "protobuf"), b'{"data": "longer"}', None),
    ],
)
def test_one_that_fails_does_not_fail_the_others(
    formats: tuple[str, str], bad: bytes, text: str | None, schema: Schema, registry: ConverterRegistry
) -> None:
    good = Converter("cdr", formats[0], registry).convert(MESSAGE, schema)
    converter = Converter(*formats, registry)
    messages = [good, replace(good, serialized_data=bad), good]

    with pytest.raises(ConversionError) as error:
        converter.convert(messages[1], schema)
    first, failed, last = converter.convert_batch(messages, schema)
    assert isinstance(failed, ConversionError)
    assert str(failed) == str(error.value)
    if text is not None:
        assert str(failed) == text
    else:
        assert str(failed).startswith("my_msgs/msg/Text")
    assert first == last == converter.convert(good, schema)


def test_errors_of_plugins_are_ours(schema: Schema, registry: ConverterRegistry) -> None:
    converter = Converter("json", "protobuf", registry)
    with pytest.raises(ConversionError) as error:
        converter.convert(SerializedBagMessage(b'{"other": 1}'), schema)
    assert str(error.value).startswith("my_msgs/msg/Text: json_converter failed: ParseError: ")
    assert isinstance(error.value.__cause__, Exception)


@pytest.mark.parametrize("converter", [CdrConverter(), ProtobufConverter()])
def test_a_message_of_another_class(converter: SerializationFormatConverter, schema: Schema) -> None:
    other = TypeRegistry()["std_msgs/msg/String"].message_class()
    with pytest.raises(ConversionError) as error:
        converter.serialize(other, schema, SerializedBagMessage())
    assert str(error.value) == (
        "my_msgs/msg/Text: expected a protobuf message my_msgs.msg.pb.Text, "
        "not rosidl_proto.std_msgs.msg.String_pb2.String"
    )


def test_results_that_are_no_bytes(schema: Schema) -> None:
    class Text(JsonConverter):
        def to_protobuf(self, serialized_message: SerializedBagMessage, type_support: Schema) -> Any:
            return "text"

    registry = ConverterRegistry()
    registry.register("text_converter", Text)
    with pytest.raises(ConversionError) as error:
        Converter("text", "cdr", registry).convert(MESSAGE, schema)
    assert str(error.value) == (
        "my_msgs/msg/Text: text_converter failed: TypeError: "
        "memoryview: a bytes-like object is required, not 'str'"
    )


@pytest.mark.parametrize(
    ("results", "text"),
    [
        (lambda messages: [], "batch_converter gave 0 results for 1 messages"),
        (lambda messages: messages[7], "batch_converter failed: IndexError: list index out of range"),
    ],
)
def test_a_batch_that_is_wrong_as_a_whole(
    results: Callable[[Sequence[SerializedBagMessage]], Any], text: str, schema: Schema
) -> None:
    class Batch(JsonConverter):
        def to_protobuf_batch(
            self, serialized_messages: Sequence[SerializedBagMessage], type_support: Schema
        ) -> Any:
            return results(serialized_messages)

    registry = ConverterRegistry()
    registry.register("batch_converter", Batch)
    with pytest.raises(ConverterError) as error:
        Converter("batch", "cdr", registry).convert_batch([MESSAGE], schema)
    assert str(error.value) == text


def test_plugins_are_told_topic_and_times(schema: Schema) -> None:
    seen = []

    class Watching(SerializationFormatConverter):
        def deserialize(
            self, serialized_message: SerializedBagMessage, type_support: Schema, ros_message: Any
        ) -> None:
            seen.append(serialized_message)
            ros_message.data = "hi"

        def serialize(
            self, ros_message: Any, type_support: Schema, serialized_message: SerializedBagMessage
        ) -> None:
            seen.append(replace(serialized_message))
            assert ros_message == schema.message_class(data="hi")
            serialized_message.serialized_data = memoryview(b"written")

    registry = ConverterRegistry()
    registry.register("a_converter", Watching)
    registry.register("b_converter", Watching)
    converted = Converter("a", "b", registry).convert(MESSAGE, schema)
    assert seen == [MESSAGE, replace(MESSAGE, serialized_data=b"")]
    assert converted == replace(MESSAGE, serialized_data=b"written")


def test_many_threads(schema: Schema) -> None:
    """One registry for all of them, and a converter for each."""
    registry = ConverterRegistry()
    results: list[bytes] = []

    def convert() -> None:
        there, back = Converter("cdr", "protobuf", registry), Converter("protobuf", "cdr", registry)
        for _ in range(100):
            results.append(data(back.convert(there.convert(MESSAGE, schema), schema)))

    threads = [threading.Thread(target=convert) for _ in range(8)]
    for each in threads:
        each.start()
    for each in threads:
        each.join()
    assert results == [TEXT] * 800


GARBAGE = st.binary(max_size=40)


@pytest.fixture(
    params=[("cdr", "protobuf"), ("protobuf", "cdr"), ("ros1", "cdr"), ("json", "cdr"), ("protobuf", "json")],
    ids="-".join,
)
def converter(request: pytest.FixtureRequest) -> Converter:
    registry = ConverterRegistry()
    registry.register("json_converter", JsonConverter)
    input_format, output_format = request.param
    return Converter(input_format, output_format, registry)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=GARBAGE | GARBAGE.map(HEADER.__add__) | GARBAGE.map(b"\n".__add__))
def test_garbage(converter: Converter, data: bytes, schema: Schema) -> None:
    """Whatever the bytes are, only our errors come out."""
    [converted] = converter.convert_batch([SerializedBagMessage(data)], schema)
    assert isinstance(converted, (SerializedBagMessage, ConversionError))
