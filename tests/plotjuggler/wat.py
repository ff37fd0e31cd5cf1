"""Plugins for tests, written as WebAssembly text. Messages say what they shall do: most write what they are given."""

from __future__ import annotations

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
    (global.set $heap (i32.and (i32.add (i32.add (global.get $heap) (local.get $size)) (i32.const 15)) (i32.const -16)))
    (if (i32.gt_u (global.get $heap) (i32.shl (memory.size) (i32.const 16)))
      (then (if (i32.eq (i32.const -1) (memory.grow
          (i32.add (i32.shr_u (local.get $size) (i32.const 16)) (i32.const 2)))) (then (return (i32.const 0))))))
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
