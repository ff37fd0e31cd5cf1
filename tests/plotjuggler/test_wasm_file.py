"""WebAssembly files are read from their sections, whatever types they have."""

from __future__ import annotations

import random

import pytest

from rosidl_adapter_proto.errors import Error, PluginError
from rosidl_adapter_proto.plotjuggler.check import check_plugin
from rosidl_adapter_proto.plotjuggler.host import Limits, open_plugin
from rosidl_adapter_proto.plotjuggler.values import BuiltinType
from rosidl_adapter_proto.plotjuggler.wasm_file import (
    Import,
    Signature,
    WasmFile,
    custom_sections,
    read_wasm_file,
)
from tests.plotjuggler import outputs, wat

EVERYTHING = """
(module
  (import "a" "function" (func $f (param v128 funcref) (result i32 externref)))
  (import "a" "table" (table 1 2 funcref))
  (import "b" "memory" (memory 1 5))
  (import "b" "global" (global i64))
  (memory 2 300)
  (table 3 externref)
  (func $g (param f32 f64) (result i64) (i64.const 0))
  (func $s)
  (start $s)
  (export "g" (func $g))
  (export "f" (func $f))
  (export "memory" (memory 1))
  (export "table" (table 1))
  (export "ä" (global 0)))
"""


def test_what_a_file_has() -> None:
    function = Signature(("v128", "funcref"), ("i32", "externref"))
    assert read_wasm_file(wat.wasm(EVERYTHING)) == WasmFile(
        functions={"g": Signature(("f32", "f64"), ("i64",)), "f": function},
        other_exports=("table", "ä"),
        imports=(
            Import("a.function", function),
            Import("a.table", None),
            Import("b.memory", None),
            Import("b.global", None),
        ),
        has_memory=True,
        memories=2,
        memory_maximum=300 << 16,
        has_start=True,
    )
    assert read_wasm_file(wat.wasm("(module)")) == WasmFile({}, (), (), False, 0, None, False)
    assert str(function) == "(v128, funcref) -> i32, externref"


def test_custom_sections() -> None:
    data = wat.wasm("(module)") + wat.section("a", b"1") + wat.section("b", b"2") + wat.section("a", b"3")
    assert custom_sections(data, "a") == [b"1", b"3"]


def test_what_is_not_valid() -> None:
    head = b"\0asm\1\0\0\0"
    wrong = {
        b"\1\5\0": "byte 10: 5 bytes do not fit into the 1 that are left",
        b"\1" + b"\xff" * 6: "byte 9: a number does not end",
        b"\1\2\1\x5f": "byte 11: a type that is none of functions",
        b"\3\2\1\7": "there is no type, function or memory 7",
        b"\2\6\1\1a\1b\7": "byte 15: an import of the kind 7, which there is not",
    }
    for data, reason in wrong.items():
        with pytest.raises(PluginError) as caught:
            read_wasm_file(head + data)
        assert str(caught.value) == reason


@pytest.mark.parametrize("kind", ["v128", "exnref", "externref", "funcref"])
def test_types_that_plugins_do_not_have(kind: str) -> None:
    source = f'(module (memory (export "memory") 1) (func (export "pj_parser_parse") (param {kind})))'
    with pytest.raises(PluginError, match=r"pj_parser_parse is \(.*\) -> nothing instead of"):
        open_plugin(wat.wasm(source))
    wasi = wat.plugin(more=f'(import "wasi_unstable" "f" (func (param {kind})))')
    with pytest.raises(PluginError, match=r"plugin: imports wasi_unstable\.f, which a plugin does not get"):
        open_plugin(wasi)


def test_damaged_plugins_give_our_errors_alone() -> None:
    chance = random.Random(3)
    good = [wat.plugin(), wat.module(), wat.plugin(function="pj_parser_parse", malloc="")]
    message = outputs.released(("/x", BuiltinType.FLOAT64, bytes(8)))
    run = 0
    for _ in range(500):
        damaged = bytearray(chance.choice(good))
        damaged[chance.randrange(8, len(damaged))] = chance.choice(
            [chance.randrange(256), 0, 1, 0x70, 0x7B, 0xFF]
        )
        try:
            check_plugin(bytes(damaged))
            plugin = open_plugin(bytes(damaged), limits=Limits(memory=16 << 20, instructions=200_000))
            with plugin.parser("/t", "a/T", b"schema") as parser:
                run += 1
                parser.parse(message)
        except Error:
            continue
    assert run > 50
