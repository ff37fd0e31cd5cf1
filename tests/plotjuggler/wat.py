"""Plugins for tests, written as WebAssembly text. Messages say what they shall do: most write what they are given."""

from __future__ import annotations

import json

import wasmtime

MANIFEST = "plugin_type: MessageParser\nname: Echo\nencoding: echo\n"


def text(data: bytes | str) -> str:
    """Return bytes as a string of WebAssembly text."""
    raw = data.encode() if isinstance(data, str) else data
    return '"' + "".join(f"\\{byte:02x}" for byte in raw) + '"'


def wasm(source: str) -> bytes:
    return bytes(wasmtime.wat2wasm(source))


MALLOC = """
  (global $heap (mut i32) (i32.const 65536))
  (func (export "malloc") (param $size i32) (result i32)
    (local $address i32)
    (local.set $address (global.get $heap))
    (local.set $size (i32.and (i32.add (local.get $size) (i32.const 15)) (i32.const -16)))
    (if (i32.gt_u (i32.add (local.get $address) (local.get $size)) (i32.shl (memory.size) (i32.const 16)))
      (then (if (i32.eq (i32.const -1)
          (memory.grow (i32.add (i32.shr_u (local.get $size) (i32.const 16)) (i32.const 1))))
        (then (return (i32.const 0))))))
    (global.set $heap (i32.add (local.get $address) (local.get $size)))
    (local.get $address))
"""
"""Gives memory, and never takes it back."""

ECHO = """
    (memory.copy (local.get $out) (local.get $raw) (local.get $size))
    (local.get $size)
"""
"""Writes the message."""


def plugin(
    parse: str = ECHO,
    *,
    function: str = "pj_parser_decode",
    manifest: str = MANIFEST,
    create: str = "(i32.const 1)",
    malloc: str = MALLOC,
    more: str = "",
    memory: str = "2",
) -> bytes:
    """Return a plugin in the dialects of PlotJuggler 3.

    Args:
        parse: The body of the function that parses: `$self`, `$raw`, `$size`, `$out`.
        function: What it is called.
        manifest: What the plugin says of itself.
        create: The body of `pj_parser_create`: `$topic`, `$type`, `$schema`.
        malloc: What gives memory.
        more: More of the module.
        memory: How large its memory is: pages, and at most so many.
    """
    return wasm(f"""
(module
  {more}
  (memory (export "memory") {memory})
  (data (i32.const 16) {text(manifest + chr(0))})
  (func (export "pj_plugin_manifest") (result i32) (i32.const 16))
  (func (export "pj_parser_create") (param $topic i32) (param $type i32) (param $schema i32) (result i32) {create})
  (func (export "pj_parser_set_array_policy") (param $self i32) (param $clamp i32) (param $maximum i32))
  (func (export "pj_parser_destroy") (param $self i32))
  (func (export "{function}")
    (param $self i32) (param $raw i32) (param $size i32) (param $out i32) (result i32) {parse})
  {malloc})
""")


MODULE_MANIFEST = {
    "module_abi": 1,
    "id": "org.example.echo",
    "name": "Echo",
    "version": "1.0.0",
    "claims": [
        {"claim_id": "any", "encoding": "json", "type_name": "*", "routes": ["scalar"], "priority": 0},
    ],
}

MODULE_ECHO = """
    (i64.store (i32.wrap_i64 (local.get $address_slot)) (i64.add (local.get $in) (i64.const 24)))
    (i64.store (i32.wrap_i64 (local.get $size_slot)) (i64.sub (local.get $size) (i64.const 24)))
    (i32.const 0)
"""
"""Gives the message, which is behind 24 bytes."""


def module(
    parse: str = MODULE_ECHO,
    *,
    bind: str = "(i32.const 0)",
    create: str = "(i64.const 7)",
    abi: str = "(i32.const 1)",
    last_error: str = "(i64.const 0)",
    manifests: tuple[bytes, ...] = (json.dumps(MODULE_MANIFEST).encode(),),
    more: str = "",
    memory: str = "2 4096",
) -> bytes:
    """Return a plugin in the dialect `module`.

    Args:
        parse: The body of the function that parses: `$self`, `$in`, `$size`, `$address_slot`, `$size_slot`.
        bind: The body of the function that binds: `$self`, `$address`, `$size`.
        create: The body of the function that makes a parser: `$claim`.
        abi: The body of `pj_module_abi`.
        last_error: The body of the function that says what was wrong: `$self`, `$buffer`, `$capacity`.
        manifests: What the sections with manifests have.
        more: More of the module.
        memory: How large its memory is: pages, and at most so many.
    """
    made = wasm(f"""
(module
  {more}
  (memory (export "memory") {memory})
  {MALLOC.replace('(export "malloc")', "$malloc")}
  (func (export "_initialize"))
  (func (export "pj_module_abi") (result i32) {abi})
  (func (export "pj_module_create") (param $claim i32) (result i64) {create})
  (func (export "pj_module_destroy") (param $self i64))
  (func (export "pj_module_bind") (param $self i64) (param $address i64) (param $size i64) (result i32) {bind})
  (func (export "pj_module_parse")
    (param $self i64) (param $in i64) (param $size i64) (param $address_slot i64) (param $size_slot i64) (result i32)
    {parse})
  (func (export "pj_module_last_error")
    (param $self i64) (param $buffer i64) (param $capacity i64) (result i64) {last_error})
  (func (export "pj_module_alloc") (param $size i64) (result i64)
    (i64.extend_i32_u (call $malloc (i32.wrap_i64 (local.get $size)))))
  (func (export "pj_module_free") (param $address i64) (param $size i64)))
""")
    return made + b"".join(section("pj_parser_module_manifest", each) for each in manifests)


def section(name: str, content: bytes) -> bytes:
    """Return a custom section of a WebAssembly file."""
    body = bytes([len(name)]) + name.encode() + content
    size = len(body)
    return bytes([0, size & 0x7F | 0x80, size >> 7 & 0x7F | 0x80, size >> 14]) + body
