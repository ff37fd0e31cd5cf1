"""Plugins that break their contract: an error that says how, and never a crash."""

from __future__ import annotations

import itertools
import sys
import time
from array import array
from pathlib import Path

import pytest
import wasmtime

from rosidl_adapter_proto.errors import PluginError, RequestError
from rosidl_adapter_proto.plotjuggler import engine
from rosidl_adapter_proto.plotjuggler.host import BatchError, Limits, open_plugin
from rosidl_adapter_proto.plotjuggler.values import BuiltinType
from tests.plotjuggler import outputs, wat

ENDLESS = "(loop $again (br $again)) (unreachable)"
QUICK = Limits(instructions=3_000_000)
GOOD = outputs.released(("/x", BuiltinType.UINT8, b"\1"))
WHERE = "plugin: /topic (a/Type): "


def failure(plugin: bytes, message: bytes = GOOD) -> str:
    """Return the error of a message, alone and in a batch, which are the same."""
    with pytest.raises(PluginError) as alone:
        open_plugin(plugin, limits=QUICK).parser("/topic", "a/Type", b"").parse(message)
    with pytest.raises(BatchError) as batch:
        ranges = array("Q", [0, len(message)])
        open_plugin(plugin, limits=QUICK).parser("/topic", "a/Type", b"").parse_batch(message, ranges)
    assert str(alone.value) == str(batch.value)
    assert batch.value.batch.count == 0
    return str(alone.value)


STOPPED = {
    "endless": (ENDLESS, "it took too many instructions"),
    "unreachable": ("(unreachable)", "wasm `unreachable` instruction executed"),
    "memory": ("(i32.load (i32.const -4))", "out of bounds memory access"),
    "division": ("(i32.div_u (i32.const 1) (i32.const 0))", "integer divide by zero"),
}


@pytest.mark.parametrize("name", STOPPED)
def test_what_stops_a_plugin(name: str) -> None:
    body, reason = STOPPED[name]
    assert failure(wat.plugin(body)) == f"{WHERE}message 0: it was stopped: {reason}"
    assert failure(wat.module(body)) == f"{WHERE}message 0: it was stopped: {reason}"


def test_a_recursion_without_end() -> None:
    plugin = wat.plugin(
        "(call $f (i32.const 0))",
        more="",
        malloc=wat.MALLOC + """
      (func $f (param i32) (result i32) (i32.add (call $f (local.get 0)) (call $f (local.get 0))))""",
    )
    with pytest.raises(PluginError, match="message 0: it was stopped: call stack exhausted"):
        open_plugin(plugin).parser("/topic", "a/Type", b"").parse(GOOD)


def test_after_a_trap_the_plugin_begins_anew() -> None:
    """It counts messages in a global, and stops at the message with no bytes."""
    count = "(global.set $count (i32.add (global.get $count) (i32.const 1)))"
    parse = f"""
      (if (i32.eqz (local.get $size)) (then (unreachable))) {count}
      {wat.ECHO} drop (i32.store8 offset=11 (local.get $out) (global.get $count)) (local.get $size)"""
    plugin = open_plugin(
        wat.plugin(parse, more=""" """, malloc=wat.MALLOC + "(global $count (mut i32) (i32.const 0))")
    )
    parser, other = (plugin.parser(topic, "a/Type", b"") for topic in ("/topic", "/other"))
    assert [parser.parse(GOOD).pairs[0].value, other.parse(GOOD).pairs[0].value] == [1, 2]
    with pytest.raises(PluginError, match=r"plugin: /topic \(a/Type\): message 0: it was stopped"):
        parser.parse(b"")
    assert [other.parse(GOOD).pairs[0].value, parser.parse(GOOD).pairs[0].value] == [1, 2]
    size = len(GOOD)
    ranges = array("Q", [0, size] * 3 + [0, 0] + [0, size])
    with pytest.raises(BatchError, match="message 3: it was stopped") as caught:
        parser.parse_batch(GOOD, ranges)
    assert caught.value.batch.count == 3
    assert caught.value.batch.columns[0].values.tolist() == [3, 4, 5]  # type: ignore[union-attr]
    assert parser.parse_batch(GOOD, ranges[8:]).columns[0].values.tolist() == [1]  # type: ignore[union-attr]


def test_many_messages_may_take_more_instructions_than_one() -> None:
    """Each message takes most of what a call has, so that a batch is several calls."""
    spin = "(local $n i32) (loop $again (br_if $again (i32.lt_u (local.tee $n (i32.add (local.get $n)"
    parse = f"{spin} (i32.const 1))) (i32.const 300000)))) {wat.ECHO}"
    parser = open_plugin(wat.plugin(parse), limits=QUICK).parser("/topic", "a/Type", b"")
    batch = parser.parse_batch(GOOD, array("Q", [0, len(GOOD)] * 20))
    assert batch.columns[0].messages.tolist() == list(range(20))


def test_an_endless_plugin_ends_soon() -> None:
    parser = open_plugin(wat.plugin(ENDLESS)).parser("/topic", "a/Type", b"")
    begin = time.monotonic()
    with pytest.raises(PluginError, match="too many instructions"):
        parser.parse_batch(GOOD, array("Q", [0, len(GOOD)] * 1000))
    assert time.monotonic() - begin < 60


def test_a_module_that_is_stopped_three_times_is_not_run_again() -> None:
    plugin = open_plugin(wat.module("(unreachable)"))
    parser = plugin.parser("/topic", "a/Type", b"")
    for _ in range(3):
        with pytest.raises(PluginError, match="message 0: it was stopped"):
            parser.parse(b"")
    for action in (lambda: parser.parse(b""), lambda: plugin.parser("/b", "T", b"")):
        with pytest.raises(PluginError) as caught:
            action()
        assert str(caught.value) == "plugin: broke its contract 3 times, and is not run again"


LIES = {
    "more than it has room for": (
        wat.plugin("(i32.const 1048577)"),
        "it says that it wrote 1048577 bytes, but an output has at most 1048576",
    ),
    "past the room": (
        wat.plugin("(i32.store8 offset=1048576 (local.get $out) (i32.const 1)) (i32.const 4)"),
        "it wrote past the 1048576 bytes that an output has",
    ),
    "past the room, and says so": (
        wat.plugin("(memory.fill (local.get $out) (i32.const 1) (i32.const 1048580)) (i32.const 1048580)"),
        "it wrote past the 1048576 bytes that an output has",
    ),
    "more than it wrote": (
        wat.plugin(wat.ECHO + "(i32.add (i32.const 1))"),
        f"byte {len(GOOD)}: 1 bytes follow the last pair",
    ),
    "less than it wrote": (
        wat.plugin(wat.ECHO + "(i32.sub (i32.const 1))"),
        "byte 11: the value of /x has 1 bytes, but 0 are left",
    ),
    "a positive code": (wat.module("(i32.const 1)"), "pj_module_parse returned 1, which means nothing"),
    "no output": (
        wat.module("(i32.const 0)"),
        "it says that its output is 0 bytes at 0, but its memory has 262144",
    ),
    "an output behind the memory": (
        wat.module(
            "(i64.store (i32.wrap_i64 (local.get $address_slot)) (i64.const 99))"
            "(i64.store (i32.wrap_i64 (local.get $size_slot)) (i64.const -1)) (i32.const 0)"
        ),
        "it says that its output is 18446744073709551615 bytes at 99, but its memory has 262144",
    ),
    "an output without end": (
        wat.module(
            "(i64.store (i32.wrap_i64 (local.get $address_slot)) (i64.const 1))"
            "(i64.store (i32.wrap_i64 (local.get $size_slot)) (i64.const 16777217)) (i32.const 0)",
            memory="300 4096",
        ),
        "its output has 16777217 bytes; here it may have 16777216",
    ),
    "a token that it does not know": (
        wat.module("(i32.const -2)"),
        "pj_module_parse does not know the token that it gave (-2)",
    ),
    "an error without end": (
        wat.module("(i32.const -1)", last_error="(i64.const 513)"),
        "pj_module_last_error wrote more than the 512 bytes that it may write",
    ),
}


@pytest.mark.parametrize("name", LIES)
def test_lies(name: str) -> None:
    plugin, reason = LIES[name]
    assert failure(plugin) == f"{WHERE}message 0: {reason}"


def test_memory_that_is_not_there() -> None:
    for address in ("0", "-16"):
        malloc = f'(func (export "malloc") (param i32) (result i32) (i32.const {address}))'
        with pytest.raises(PluginError) as caught:
            open_plugin(wat.plugin(malloc=malloc)).parser("/t", "a/T", b"")
        assert str(caught.value) == "plugin: it has no memory for outputs (1048576 bytes)"
    with pytest.raises(PluginError) as caught:
        open_plugin(wat.plugin(malloc=""), limits=Limits(memory=4 << 20)).parser("/t", "a/T", bytes(4 << 20))
    assert str(caught.value) == "plugin: /t (a/T): plugin: it has no memory for a text (4194305 bytes)"
    with pytest.raises(PluginError) as caught:
        open_plugin(wat.plugin(memory="2 40")).parser("/t", "a/T", b"").parse(bytes(4 << 20))
    assert str(caught.value) == "plugin: it has no memory for messages (4194304 bytes)"


REFUSED = {
    b"": "plugin: not a WebAssembly file",
    b"(module)": "plugin: not a WebAssembly file",
    b"\0asm\1\0\0\0\1\1": "plugin: not valid WebAssembly: failed to parse WebAssembly module Caused by:"
    " unexpected end-of-file (at offset 0xa)",
    wat.wasm("(module)"): "plugin: no parser plugin of PlotJuggler: it exports none of pj_parser_decode,"
    " pj_parser_parse, pj_module_parse",
    wat.wasm(
        '(module (func (export "pj_parser_decode")))'
    ): "plugin: no parser plugin that can be run: as released:"
    " it does not export pj_plugin_manifest, it does not export pj_parser_create,"
    " pj_parser_decode is () -> nothing instead of (i32, i32, i32, i32) -> i32, it does not export its memory",
    wat.plugin(
        more='(import "env" "f" (func)) (import "env" "g" (func))'
    ): "plugin: imports env.f, env.g, which a"
    " plugin does not get; build it without imports",
    wat.plugin(
        malloc="(func $f (unreachable)) (start $f)"
    ): "plugin: it was stopped while it began: wasm `unreachable`"
    " instruction executed",
    wat.plugin(
        memory="5000"
    ): "plugin: cannot be started: memory minimum size of 5000 pages exceeds memory limits",
    wat.plugin(more="(memory 1) (memory 1)"): "plugin: it has 3 memories; a plugin has one",
    wat.plugin(manifest="name: x\nencoding: y"): "manifest: the released PlotJuggler sees no plugin_type",
    wat.plugin(manifest="\xff").replace(b"\xc3\xbf", b"\xff\xff"): "manifest: byte 0 is not UTF-8",
    wat.plugin(manifest="a" * 65_536): "no text of at most 65536 bytes and a NUL byte at address 16",
    wat.module(manifests=()): "pj_parser_module_manifest: there are 0 such custom sections instead of one",
    wat.module(
        manifests=(b"{}", b"{}")
    ): "pj_parser_module_manifest: there are 2 such custom sections instead of one",
}


@pytest.mark.parametrize("plugin", REFUSED, ids=range(len(REFUSED)))
def test_what_is_no_plugin(plugin: bytes) -> None:
    with pytest.raises(PluginError) as caught:
        open_plugin(plugin)
    assert str(caught.value) == REFUSED[plugin]


def test_parsers_that_are_not_made() -> None:
    made = {
        wat.plugin(
            create="(i32.const 0)"
        ): "pj_parser_create returned 0: it does not take the type or the schema",
        wat.plugin(
            create="(unreachable)"
        ): "it was stopped while the parser was made: wasm `unreachable` instruction"
        " executed",
        wat.module(create="(i64.const 0)"): "pj_module_create failed: it says no reason",
        wat.module(bind="(i32.const 1)"): "pj_module_bind declined: it says no reason",
        wat.module(bind="(i32.const -3)"): "pj_module_bind returned -3: it says no reason",
    }
    for plugin, reason in made.items():
        with pytest.raises(PluginError) as caught:
            open_plugin(plugin).parser("/topic", "a/Type", b"")
        assert str(caught.value) == WHERE + reason
    with pytest.raises(PluginError) as caught:
        open_plugin(wat.module(abi="(i32.const 2)")).parser("/topic", "a/Type", b"")
    assert str(caught.value) == "plugin: pj_module_abi returned 2; 1 is the only one there is"


def test_wasi_functions_are_there_and_do_nothing() -> None:
    more = '(import "wasi_snapshot_preview1" "fd_write" (func $write (param i32 i32 i32 i32) (result i32)))'
    call = "(drop (call $write (i32.const 1) (i32.const 0) (i32.const 0) (i32.const 0)))"
    parser = open_plugin(wat.plugin(call + wat.ECHO, more=more)).parser("/topic", "a/Type", b"")
    assert parser.parse(GOOD).pairs[0].value == 1


def test_dialects_that_a_plugin_does_not_serve() -> None:
    with pytest.raises(PluginError, match="plugin: does not serve the dialect page, but released"):
        open_plugin(wat.plugin(), dialect="page")
    with pytest.raises(RequestError, match="there is no dialect old; there are released, page, module"):
        open_plugin(wat.plugin(), dialect="old")


def test_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "echo.wasm"
    file.write_bytes(wat.plugin())
    assert open_plugin(file).name == "echo.wasm"
    monkeypatch.setattr(engine, "MAXIMUM_FILE_SIZE", 100)
    with pytest.raises(PluginError, match=r"echo\.wasm: more than 100 bytes, which no plugin has"):
        open_plugin(str(file))
    with pytest.raises(PluginError, match=f"{tmp_path}: cannot be read: Is a directory"):
        open_plugin(tmp_path)


def test_the_messages_before_a_broken_one_are_not_lost() -> None:
    """Outputs are read by their size, so that the second broken one is found first, and what is behind it after it."""
    long = outputs.released(("/long", BuiltinType.UINT16, b"\1\0"))
    broken, broken_long = (each[:4] + b"\xff" * 4 + each[8:] for each in (GOOD, long))
    messages = [GOOD, long, b"", long, broken_long, GOOD, broken, long]
    ends = list(itertools.accumulate(map(len, messages)))
    ranges = array("Q", [each for pair in zip([0, *ends], ends, strict=False) for each in pair])
    parser = open_plugin(wat.plugin()).parser("/topic", "a/Type", b"")
    times = array("q", range(len(messages)))
    with pytest.raises(BatchError, match="message 4: byte 8: ") as caught:
        parser.parse_batch(b"".join(messages), ranges, times)
    batch = caught.value.batch
    assert (batch.count, batch.refused) == (4, {2: "pj_parser_decode returned 0"})
    assert batch.times is not None and batch.times.tolist() == [0, 1, 2, 3]
    assert [(each.key, each.messages.tolist()) for each in batch.columns] == [("/x", [0]), ("/long", [1, 3])]


def test_reasons_that_are_empty() -> None:
    assert engine._trap(wasmtime.Trap("")).reason == "it says no reason"


def test_ranges_and_texts_that_are_wrong() -> None:
    parser = open_plugin(wat.plugin()).parser("/topic", "a/Type", b"")
    for ranges in ([0, 4], [3, 2], [2**64 - 1, 2**64 - 1]):
        with pytest.raises(RequestError, match="a range of a message is not within the 3 bytes of data"):
            parser.parse_batch(b"abc", array("Q", ranges))
    with pytest.raises(RequestError, match="the ranges have 24 bytes; a range has 16"):
        parser.parse_batch(b"abc", array("Q", [0, 3, 3]))
    with pytest.raises(RequestError, match="the times have 4 bytes; a time has 8"):
        parser.parse_batch(b"abc", array("Q", [0, 3]), b"1234")
    with pytest.raises(RequestError, match="there are 1 messages and 2 times"):
        parser.parse_batch(b"abc", array("Q", [0, 3]), array("q", [1, 2]))
    with pytest.raises(RequestError, match="a topic and a type have no NUL byte"):
        open_plugin(wat.plugin()).parser("/a\0b", "a/Type", b"")


def test_without_an_engine(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "wasmtime", None)
    with pytest.raises(
        PluginError, match=r"pip install 'rosidl-adapter-proto\[plotjuggler\]' brings what runs plugins"
    ):
        open_plugin(b"")
