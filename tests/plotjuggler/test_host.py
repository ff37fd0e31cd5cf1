"""Plugins are run, message by message and in batches, in every dialect."""

from __future__ import annotations

import struct
import tracemalloc
from array import array
from collections.abc import Callable, Iterable
from typing import Any

import pytest

from rosidl_adapter_proto.plotjuggler.host import Limits, Parser, open_plugin
from rosidl_adapter_proto.plotjuggler.values import ArrayPolicy, Blob, BuiltinType, Pair
from tests.plotjuggler import outputs, wat

Write = Callable[..., bytes]

DIALECTS: dict[str, tuple[bytes, Write]] = {
    "released": (wat.plugin(), outputs.released),
    "page": (wat.plugin(function="pj_parser_parse"), outputs.page),
    "module": (wat.module(), outputs.module),
}
NUMBERS: dict[BuiltinType, tuple[str, Any]] = {
    BuiltinType.UINT8: ("<B", 255),
    BuiltinType.UINT16: ("<H", 65535),
    BuiltinType.UINT32: ("<I", 2**32 - 1),
    BuiltinType.UINT64: ("<Q", 2**64 - 1),
    BuiltinType.INT8: ("<b", -128),
    BuiltinType.INT16: ("<h", -(2**15)),
    BuiltinType.INT32: ("<i", -(2**31)),
    BuiltinType.INT64: ("<q", -(2**63)),
    BuiltinType.FLOAT32: ("<f", 0.5),
    BuiltinType.FLOAT64: ("<d", -0.1),
    BuiltinType.BOOL: ("<?", True),
}


def echo(dialect: str, **arguments: Any) -> Parser:
    return open_plugin(DIALECTS[dialect][0]).parser("/topic", "a/Type", b"", **arguments)


def joined(messages: Iterable[bytes]) -> tuple[bytes, array[int]]:
    """Return messages as a batch has them."""
    data = b""
    ranges = array("Q")
    for each in messages:
        ranges.extend((len(data), len(data) + len(each)))
        data += each
    return data, ranges


def number(key: str, kind: BuiltinType, value: Any) -> outputs.Written:
    return key, kind, struct.pack(NUMBERS[kind][0], value)


@pytest.mark.parametrize("kind", BuiltinType, ids=lambda kind: kind.name)
@pytest.mark.parametrize("dialect", DIALECTS)
def test_each_type_of_a_value(dialect: str, kind: BuiltinType) -> None:
    if kind == BuiltinType.STRING:
        written, value = ("/a", BuiltinType(kind), "Straße".encode()), "Straße"
    elif kind == BuiltinType.BLOB:
        written, value = ("/a", kind, struct.pack("<II", 3, 8)), Blob(3, 8)  # type: ignore[assignment]
    elif kind in NUMBERS:
        written, value = number("/a", kind, NUMBERS[kind][1]), NUMBERS[kind][1]
    else:
        return
    if (dialect == "module" and kind not in outputs.MODULE_NUMBERS) or (dialect, kind) == (
        "page",
        BuiltinType.BOOL,
    ):
        return
    parser = echo(dialect)
    message = DIALECTS[dialect][1](written)
    parsed = parser.parse(message)
    assert parsed.pairs == (Pair("/a", kind, value),)
    assert type(parsed.pairs[0].value) is type(value)
    batch = parser.parse_batch(*joined([message] * 3))
    (column,) = batch.columns
    assert (column.key, column.kind, list(column.values)) == ("/a", kind, [value] * 3)
    assert column.messages.tolist() == [0, 1, 2]


@pytest.mark.parametrize("dialect", DIALECTS)
def test_batches_are_as_single_messages(dialect: str) -> None:
    write = DIALECTS[dialect][1]
    messages = []
    for index in range(10_000):  # more than a table of the loop has
        pairs = [number("/x", BuiltinType.FLOAT64, index), ("/name", BuiltinType.STRING, b"n" * (index % 7))]
        pairs += [number(f"/list[{at}]", BuiltinType.INT64, index - at) for at in range(index % 3)]
        messages.append(write(*pairs))
    parser = echo(dialect)
    batch = parser.parse_batch(*joined(messages))
    assert (batch.count, batch.refused, batch.times) == (10_000, {}, None)
    columns = {column.key: column for column in batch.columns}
    assert list(columns) == ["/x", "/name", "/list[0]", "/list[1]"]
    assert columns["/x"].values.tolist() == list(range(10_000))  # type: ignore[union-attr]
    assert columns["/name"].values == ["n" * (index % 7) for index in range(10_000)]
    assert columns["/list[1]"].messages.tolist() == [index for index in range(10_000) if index % 3 > 1]
    for index in (0, 1, 2, 4999, 9999):
        expected = {
            column.key: _value_of(column, index) for column in batch.columns if index in column.messages
        }
        assert {pair.key: pair.value for pair in parser.parse(messages[index]).pairs} == expected


def _value_of(column: Any, index: int) -> Any:
    return column.values[column.messages.tolist().index(index)]


@pytest.mark.parametrize("dialect", DIALECTS)
def test_a_large_batch_is_drained_in_parts(dialect: str) -> None:
    long = DIALECTS[dialect][1](("/text", BuiltinType.STRING, b"t" * 60_000))
    batch = echo(dialect).parse_batch(*joined([long] * 300))  # 18 MB: more than the room of outputs
    assert batch.columns[0].values == ["t" * 60_000] * 300


def test_messages_may_be_anywhere() -> None:
    messages = [outputs.released(number("/x", BuiltinType.INT32, index)) for index in range(100)]
    data, ranges = joined(messages)
    parser = echo("released")
    backwards = array("Q")
    for index in reversed(range(100)):
        backwards.extend(ranges[2 * index : 2 * index + 2])
    assert parser.parse_batch(data, backwards).columns[0].values.tolist() == list(range(99, -1, -1))  # type: ignore[union-attr]
    apart = array("Q", [0, 15, len(data) + 10_000, len(data) + 10_015])
    far = data + bytes(10_000) + messages[7]
    assert parser.parse_batch(far, apart).columns[0].values.tolist() == [0, 7]  # type: ignore[union-attr]
    assert parser.parse_batch(b"", array("Q")).columns == ()


def test_messages_that_are_refused_are_told() -> None:
    good = outputs.released(number("/x", BuiltinType.INT32, 1))
    parser = echo("released")
    assert parser.parse(b"", 5).refused == "pj_parser_decode returned 0"
    batch = parser.parse_batch(*joined([good, b"", good]))
    assert batch.refused == {1: "pj_parser_decode returned 0"}
    assert batch.columns[0].messages.tolist() == [0, 2]


def test_modules_say_why_they_refuse() -> None:
    plugin = wat.module(
        "(i32.const -3)",
        last_error="(i64.store (i32.wrap_i64 (local.get $buffer)) (i64.const 0x21656c6f68)) (i64.const 8)",
    )
    parser = open_plugin(plugin).parser("/t", "a/T", b"")
    assert parser.parse(b"x").refused == "pj_module_parse returned -3: hole!"
    batch = parser.parse_batch(*joined([b"x", b"y"]))
    assert batch.refused == dict.fromkeys((0, 1), "pj_module_parse returned -3: hole!")


def test_what_a_module_is_given() -> None:
    """The echo of the whole input: flags, padding, time, size; and the binding."""
    parse = wat.MODULE_ECHO.replace("24", "0")
    parser = open_plugin(wat.module(parse)).parser("/t", "a/T", b"")
    with pytest.raises(Exception, match="version 1 and route 0"):
        parser.parse(b"", 5)
    # The size of the binding and its head are what the parser returns as its code.
    plugin = wat.module(bind="(i32.sub (i32.const 0) (i32.wrap_i64 (local.get $size)))")
    with pytest.raises(Exception, match="pj_module_bind returned -77: it says no reason"):
        open_plugin(plugin).parser("/t", "a/T", b"abc")


@pytest.mark.parametrize("dialect", ["released", "page"])
def test_times_in_messages(dialect: str) -> None:
    write = DIALECTS[dialect][1]
    data, ranges = joined(
        write(number("__timestamp", BuiltinType.FLOAT64, index), number("/x", BuiltinType.INT8, index))
        for index in range(3)
    )
    given = array("q", [7, 8, 9])
    plain = echo(dialect).parse_batch(data, ranges, given)
    assert [column.key for column in plain.columns] == ["__timestamp", "/x"]
    assert plain.times is not None and plain.times.tolist() == [7, 8, 9]
    parser = echo(dialect, embedded_time=True)
    batch = parser.parse_batch(data, ranges, given)
    assert [column.key for column in batch.columns] == ["/x"]
    assert batch.times is not None and batch.times.tolist() == [0, 10**9, 2 * 10**9]
    assert given.tolist() == [7, 8, 9]
    assert parser.parse(data[ranges[2] : ranges[3]], 8).time == 10**9


def test_times_of_modules() -> None:
    messages = [outputs.module(number("/x", BuiltinType.INT64, 1), time=time) for time in (5, None)]
    batch = echo("module", embedded_time=True).parse_batch(*joined(messages), array("q", [1, 2]))
    assert batch.times is not None and batch.times.tolist() == [5, 2]
    assert echo("module").parse(messages[0], 9).time == 9


def test_what_is_given_to_create() -> None:
    """The function returns the first byte of a text as the parser, and the parser writes it as a UINT8."""
    parse = """
      (i64.store (local.get $out) (i64.const 0x0000_0001_0000_0001))
      (i32.store8 offset=8 (local.get $out) (i32.const 0x78))
      (i32.store8 offset=9 (local.get $out) (i32.const 0))
      (i32.store8 offset=10 (local.get $out) (local.get $self))
      (i32.const 11)"""
    for what, expected in (("schema", "s"), ("type", "a")):
        plugin = open_plugin(wat.plugin(parse, create=f"(i32.load8_u (local.get ${what}))"))
        parsed = plugin.parser("/topic", "a/Type", b"s\0chema").parse(b"message")
        assert parsed.pairs == (Pair("x", BuiltinType.UINT8, ord(expected)),)
    page = wat.plugin(function="pj_parser_parse", create="(i32.load8_u (local.get $topic))")
    open_plugin(page).parser("/topic", "a/Type", b"")
    released = open_plugin(wat.plugin(create="(i32.load8_u (local.get $topic))"))
    with pytest.raises(Exception, match="pj_parser_create returned 0"):  # its topic is always ""
        released.parser("/topic", "a/Type", b"")


def test_policies_for_arrays() -> None:
    policy = ArrayPolicy(clamp=True, maximum=3)
    echo("released", array_policy=policy).parse(outputs.released())
    with pytest.raises(Exception, match="modules have no policy for arrays"):
        echo("module", array_policy=policy)


def test_plugins_without_malloc() -> None:
    parser = open_plugin(wat.plugin(malloc="", function="pj_parser_parse")).parser("/t", "a/T", b"")
    message = outputs.page(("/text", BuiltinType.STRING, b"t" * 60_000))
    assert parser.parse_batch(*joined([message] * 200)).columns[0].values == ["t" * 60_000] * 200


def test_memory_that_grows_at_every_call() -> None:
    parse = "(drop (memory.grow (i32.const 1)))" + wat.ECHO
    messages = [outputs.released(number("/x", BuiltinType.INT32, index)) for index in range(500)]
    parser = open_plugin(wat.plugin(parse)).parser("/t", "a/T", b"")
    for _ in range(3):
        assert parser.parse_batch(*joined(messages)).columns[0].values.tolist() == list(range(500))  # type: ignore[union-attr]


def test_several_parsers_and_dialects_of_one_plugin() -> None:
    both = wat.plugin(
        more="",
        malloc=wat.MALLOC + """
      (func (export "pj_parser_parse") (param i32 i32 i32 i32) (result i32) (i32.const 0))""",
    )
    plugin = open_plugin(both)
    assert plugin.dialects == ("released", "page")
    assert (plugin.dialect, plugin.encodings) == ("released", ("echo",))
    assert open_plugin(both, dialect="page").dialect == "page"
    message = outputs.released(number("/x", BuiltinType.INT32, 1))
    with plugin.parser("/a", "T", b"") as first, plugin.parser("/b", "T", b"") as second:
        assert first.parse(message) == second.parse(message)


def test_a_module_sees_each_message_once() -> None:
    """It answers all with the first message, counting in /x: outputs have more bytes than there is room for at once."""
    parse = """
      (if (i64.eqz (global.get $kept)) (then
        (global.set $kept (i64.add (local.get $in) (i64.const 24)))
        (global.set $kept_size (i64.sub (local.get $size) (i64.const 24)))))
      (global.set $count (i64.add (global.get $count) (i64.const 1)))
      (i64.store offset=33 (i32.wrap_i64 (global.get $kept)) (global.get $count))
      (i64.store (i32.wrap_i64 (local.get $address_slot)) (global.get $kept))
      (i64.store (i32.wrap_i64 (local.get $size_slot)) (global.get $kept_size))
      (i32.const 0)"""
    names = ("kept", "kept_size", "count")
    plugin = wat.module(parse, more="".join(f"(global ${name} (mut i64) (i64.const 0))" for name in names))
    text = "/text", BuiltinType.STRING, b"t" * 200_000
    first = outputs.module(number("/x", BuiltinType.INT64, 0), text)
    batch = open_plugin(plugin).parser("/t", "a/T", b"").parse_batch(*joined([first, *[b""] * 200]))
    assert batch.columns[0].values.tolist() == list(range(1, 202))  # type: ignore[union-attr]


def test_a_larger_message_takes_no_more_than_it_needs_where_memory_is_short() -> None:
    parser = open_plugin(wat.plugin("(i32.const 0)"), limits=Limits(memory=7 << 20)).parser("/t", "a/T", b"")
    for size in (1 << 20, (1 << 20) + 1):
        assert parser.parse(bytes(size)).refused


def test_texts_are_given_back_with_the_parser() -> None:
    """Each is larger than the plugin's memory would be for three; the plugin frees what was allocated last."""
    free = """
      (func (export "free") (param $address i32)
        (if (i32.lt_u (local.get $address) (global.get $heap)) (then (global.set $heap (local.get $address)))))"""
    plugin = open_plugin(wat.plugin(malloc=wat.MALLOC + free), limits=Limits(memory=8 << 20))
    refused = open_plugin(
        wat.plugin(malloc=wat.MALLOC + free, create="(i32.const 0)"), limits=Limits(memory=8 << 20)
    )
    for _ in range(5):
        plugin.parser("/t", "a/T", bytes(1 << 20)).close()
        with pytest.raises(Exception, match="pj_parser_create returned 0"):
            refused.parser("/t", "a/T", bytes(1 << 20))


def test_layouts_that_are_kept_take_little_memory() -> None:
    parser = echo("released")
    messages = [
        outputs.released(*[number("/x", BuiltinType.UINT8, 0)] * count) for count in range(20_000, 20_012)
    ]
    tracemalloc.start()
    for message in messages:
        parser.parse_batch(message, array("Q", [0, len(message)]))
    kept, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert kept < 20 << 20
