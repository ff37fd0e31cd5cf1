;; Messages and schemas with bytes that were changed at random, given to a plugin without leaving WebAssembly.
(module
  (import "plugin" "memory" (memory 1))
  (import "plugin" "decode" (func $decode (param i32 i32 i32 i32) (result i32)))
  (import "plugin" "create" (func $create (param i32 i32 i32) (result i32)))
  (import "plugin" "destroy" (func $destroy (param i32)))
  (global $random (mut i32) (i32.const 1))

  ;; xorshift32
  (func $next (param $below i32) (result i32)
    (global.set $random (i32.xor (global.get $random) (i32.shl (global.get $random) (i32.const 13))))
    (global.set $random (i32.xor (global.get $random) (i32.shr_u (global.get $random) (i32.const 17))))
    (global.set $random (i32.xor (global.get $random) (i32.shl (global.get $random) (i32.const 5))))
    (i32.rem_u (global.get $random) (local.get $below)))

  ;; Copies `size` bytes and a NUL to `to`, and changes up to four of them.
  (func $mutate (param $from i32) (param $size i32) (param $to i32)
    (local $left i32)
    (memory.copy (local.get $to) (local.get $from) (local.get $size))
    (i32.store8 (i32.add (local.get $to) (local.get $size)) (i32.const 0))
    (local.set $left (i32.add (call $next (i32.const 4)) (i32.const 1)))
    (loop $again
      (i32.store8
        (i32.add (local.get $to) (call $next (local.get $size)))
        (call $next (i32.const 256)))
      (local.set $left (i32.sub (local.get $left) (i32.const 1)))
      (br_if $again (local.get $left))))

  ;; Returns how many of `count` messages gave something. More than a mebibyte is a trap.
  (func (export "messages")
    (param $count i32) (param $parser i32) (param $from i32) (param $size i32) (param $to i32) (param $output i32)
    (result i32)
    (local $good i32) (local $written i32)
    (loop $again
      (call $mutate (local.get $from) (local.get $size) (local.get $to))
      (local.set $written
        (call $decode
          (local.get $parser)
          (local.get $to)
          ;; One of eight is cut off.
          (if (result i32) (call $next (i32.const 8))
            (then (local.get $size))
            (else (call $next (local.get $size))))
          (local.get $output)))
      (if (i32.gt_u (local.get $written) (i32.const 1048576)) (then unreachable))
      (local.set $good (i32.add (local.get $good) (i32.ne (local.get $written) (i32.const 0))))
      (local.set $count (i32.sub (local.get $count) (i32.const 1)))
      (br_if $again (local.get $count)))
    (local.get $good))

  ;; Returns how many of `count` schemas were read. What parsers make of a message must not trap either.
  (func (export "schemas")
    (param $count i32) (param $type i32) (param $from i32) (param $size i32) (param $to i32)
    (param $message i32) (param $message_size i32) (param $output i32)
    (result i32)
    (local $good i32) (local $parser i32)
    (loop $again
      (call $mutate (local.get $from) (local.get $size) (local.get $to))
      (local.set $parser (call $create (i32.const 0) (local.get $type) (local.get $to)))
      (drop (call $decode
        (local.get $parser) (local.get $message) (local.get $message_size) (local.get $output)))
      (call $destroy (local.get $parser))
      (local.set $good (i32.add (local.get $good) (i32.ne (local.get $parser) (i32.const 0))))
      (local.set $count (i32.sub (local.get $count) (i32.const 1)))
      (br_if $again (local.get $count)))
    (local.get $good)))
