// What readers drive: a sink takes the fields of a message one after the other, in the order of declaration.
//
// A sink derives from `Stop` and has
//
//   At            where it is; handed along by value, so that it stays in a register
//   failed(at)    whether it stopped: then `reason` says why
//   failure()     such a place, for a reader that found something wrong
//   kSizesOnly    it wants to know how large things are, and not what numbers are; then it has `defaults` and
//                 `within_limit`, as `CdrSize` does
//   kPlaces       the fields of a message of fixed size can be written in any order; then it has `zeros` and
//                 `position`, as `CdrWriter` does
//   kMakesCdr     it makes CDR: it wants zeros for fields that protobuf does not have, and no string with NUL
//                 inside
//   kAnyText      it takes strings that are no UTF-8, which else are errors; only sinks that do say so
//
// and what a reader calls, each of which returns where it goes on:
//
//   number<F>(op, at, raw)       one number of the form F, as its bits in CDR
//   numbers<F>(op, at, numbers)  an array or sequence of them: `CdrNumbers` or `ProtobufNumbers`
//   elements(op, at, count)      an array or sequence of strings or messages begins
//   string(op, at, element, text), wstring(op, at, element, units), bytes(op, at, element, text)
//   begin(op, at, element)       a submessage begins; returns a `Nested`, whose `at` is where its first field
//   goes end(op, at, nested, inner)   it ended at `inner`; `at` and `nested` are what `begin` had and gave
//   finish(at)                   the whole message was there; false if it stops even so
//
// `element` is the index in an array or sequence, or `kNoElement`. Numbers that are many have
//
//   count()       how many
//   bytes()       their bytes if these are the same in CDR and in protobuf, else nullptr
//   absent()      whether they are zeros that were not there
//   each(visit)   calls `visit(raw)` for each; false if `visit` was, or if reading failed
//
// Readers and sinks have internal linkage: the compiler then puts what is used once where it is used.
#pragma once

#include <cstdint>

#include "rosidl_adapter_proto/error.hpp"

namespace rosidl_proto {

// Text as UTF-8, or any bytes.
struct Text {
  const uint8_t* data;
  uint64_t size;
};

// Why a sink stopped, and the number in the text of the reason.
struct Stop {
  static constexpr bool kAnyText = false;

  Reason reason = Reason::None;
  uint64_t detail = 0;
};

}  // namespace rosidl_proto
