"""Loops in WebAssembly that hand a batch of messages to a plugin: a call from Python costs as much as ten messages.

A loop imports the plugin's memory and its function. It has a table in a memory of its own, out of the plugin's reach:
16 bytes for each message, where it is in the plugin's memory (address, size), and where its output is and what the
function returned.
"""

from __future__ import annotations

import atexit
import enum
import functools
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import wasmtime

TABLE_ROWS = 4096
ROW_SIZE = 16
TABLE_SIZE = TABLE_ROWS * ROW_SIZE
NEXT = TABLE_SIZE
"""Where in the loop's own memory the index of the next message is: 32 bits."""
OUTPUTS = TABLE_SIZE + 8
"""Where in it the outputs of modules begin."""
GUARD = b"\xa5\x5a\xc3\x3c\x96\x69\xf0\x0f"
"""What stands behind the room that an output has, and must still stand there when it is written."""
BAD_TOKEN = -2
"""What a module returns if it does not know the parser that it is given."""
ERROR_SIZE = 512
"""How many bytes the text of an error of a module has at most."""


class Stop(enum.IntEnum):
    """Why a loop has ended."""

    DONE = 0
    FULL = 1
    GUARD_OVERWRITTEN = 2
    TOO_LARGE = 3
    BAD_RESULT = 4
    BAD_DESCRIPTOR = 5


_FUNCTIONS = f"""
(module
  (import "plugin" "memory" (memory $plugin 0))
  (import "plugin" "function" (func $parse (param i32 i32 i32 i32) (result i32)))
  (memory $own (export "memory") {(TABLE_SIZE >> 16) + 1})
  (func (export "run")
    (param $self i32) (param $count i32) (param $out i32) (param $end i32) (param $capacity i32) (result i32)
    (local $next i32) (local $row i32) (local $size i32)
    (local.set $next (i32.load $own (i32.const {NEXT})))
    (local.set $row (i32.mul (local.get $next) (i32.const {ROW_SIZE})))
    (loop $messages
      (if (i32.eq (local.get $next) (local.get $count)) (then (return (i32.const {Stop.DONE:d}))))
      (if (i32.gt_u (local.get $capacity) (i32.sub (local.get $end) (local.get $out)))
        (then (return (i32.const {Stop.FULL:d}))))
      (i64.store $plugin
        (i32.add (local.get $out) (local.get $capacity)) (i64.const {int.from_bytes(GUARD, "little")}))
      (local.set $size (call $parse
        (local.get $self)
        (i32.load $own (local.get $row))
        (i32.load $own offset=4 (local.get $row))
        (local.get $out)))
      (i32.store $own offset=8 (local.get $row) (local.get $out))
      (i32.store $own offset=12 (local.get $row) (local.get $size))
      (if (i64.ne
          (i64.load $plugin (i32.add (local.get $out) (local.get $capacity)))
          (i64.const {int.from_bytes(GUARD, "little")}))
        (then (return (i32.const {Stop.GUARD_OVERWRITTEN:d}))))
      (if (i32.gt_s (local.get $size) (local.get $capacity)) (then (return (i32.const {Stop.TOO_LARGE:d}))))
      (if (i32.gt_s (local.get $size) (i32.const 0))
        (then (local.set $out
          (i32.add (local.get $out) (i32.and (i32.add (local.get $size) (i32.const 7)) (i32.const -8))))))
      (local.set $row (i32.add (local.get $row) (i32.const {ROW_SIZE})))
      (local.set $next (i32.add (local.get $next) (i32.const 1)))
      (i32.store $own (i32.const {NEXT}) (local.get $next))
      (br $messages))
    (unreachable)))
"""

# The output of a module is its own, and valid until its next call: it is copied into the memory of the loop.
_MODULE = f"""
(module
  (import "plugin" "memory" (memory $plugin 0))
  (import "plugin" "function" (func $parse (param i64 i64 i64 i64 i64) (result i32)))
  (import "plugin" "pj_module_last_error" (func $last_error (param i64 i64 i64) (result i64)))
  (memory $own (export "memory") {(TABLE_SIZE >> 16) + 1})
  (func (export "run")
    (param $self i64) (param $count i32) (param $out i32) (param $end i32) (param $capacity i32) (param $slots i32)
    (result i32)
    (local $next i32) (local $row i32) (local $code i32) (local $address i64) (local $size i64) (local $memory_size i64)
    (local.set $next (i32.load $own (i32.const {NEXT})))
    (local.set $row (i32.mul (local.get $next) (i32.const {ROW_SIZE})))
    (loop $messages
      (if (i32.eq (local.get $next) (local.get $count)) (then (return (i32.const {Stop.DONE:d}))))
      (if (i32.gt_u (local.get $capacity) (i32.sub (local.get $end) (local.get $out)))
        (then (return (i32.const {Stop.FULL:d}))))
      (i64.store $plugin (local.get $slots) (i64.const 0))
      (i64.store $plugin offset=8 (local.get $slots) (i64.const 0))
      (local.set $code (call $parse
        (local.get $self)
        (i64.load32_u $own (local.get $row))
        (i64.load32_u $own offset=4 (local.get $row))
        (i64.extend_i32_u (local.get $slots))
        (i64.extend_i32_u (i32.add (local.get $slots) (i32.const 8)))))
      (i32.store $own offset=12 (local.get $row) (local.get $code))
      (if (i32.or (i32.gt_s (local.get $code) (i32.const 0)) (i32.eq (local.get $code) (i32.const {BAD_TOKEN})))
        (then (return (i32.const {Stop.BAD_RESULT:d}))))
      (local.set $address (i64.load $plugin (local.get $slots)))
      (local.set $size (i64.load $plugin offset=8 (local.get $slots)))
      (if (i32.lt_s (local.get $code) (i32.const 0))
        (then
          (local.set $address (i64.extend_i32_u (i32.add (local.get $slots) (i32.const 16))))
          (local.set $size
            (call $last_error (local.get $self) (local.get $address) (i64.const {ERROR_SIZE})))
          (if (i64.gt_u (local.get $size) (i64.const {ERROR_SIZE}))
            (then (return (i32.const {Stop.BAD_RESULT:d})))))
        (else (if (i64.eqz (local.get $size)) (then (return (i32.const {Stop.BAD_DESCRIPTOR:d}))))))
      (local.set $memory_size (i64.shl (i64.extend_i32_u (memory.size $plugin)) (i64.const 16)))
      (if (i32.or
          (i32.or (i64.eqz (local.get $address)) (i64.gt_u (local.get $address) (local.get $memory_size)))
          (i64.gt_u (local.get $size) (i64.sub (local.get $memory_size) (local.get $address))))
        (then (return (i32.const {Stop.BAD_DESCRIPTOR:d}))))
      (if (i64.gt_u (local.get $size) (i64.extend_i32_u (local.get $capacity)))
        (then (return (i32.const {Stop.TOO_LARGE:d}))))
      (memory.copy $own $plugin
        (local.get $out) (i32.wrap_i64 (local.get $address)) (i32.wrap_i64 (local.get $size)))
      (i32.store $own offset=8 (local.get $row) (local.get $out))
      (if (i32.eqz (local.get $code))
        (then (i32.store $own offset=12 (local.get $row) (i32.wrap_i64 (local.get $size))))
        (else (i32.store $own offset=4 (local.get $row) (i32.wrap_i64 (local.get $size)))))
      (local.set $out
        (i32.add (local.get $out)
          (i32.and (i32.add (i32.wrap_i64 (local.get $size)) (i32.const 7)) (i32.const -8))))
      (local.set $row (i32.add (local.get $row) (i32.const {ROW_SIZE})))
      (local.set $next (i32.add (local.get $next) (i32.const 1)))
      (i32.store $own (i32.const {NEXT}) (local.get $next))
      (br $messages))
    (unreachable)))
"""


@functools.lru_cache(maxsize=2)
def loop(module: bool) -> wasmtime.Module:
    """Return the loop for modules of version 4, or the one for `pj_parser_decode` and `pj_parser_parse`."""
    import wasmtime

    from rosidl_adapter_proto.plotjuggler.engine import engine

    atexit.register(loop.cache_clear)
    return wasmtime.Module(engine(), bytes(wasmtime.wat2wasm(_MODULE if module else _FUNCTIONS)))
