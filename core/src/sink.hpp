// What readers drive: a sink takes the fields of a message one after the other, in the order of declaration.
//
// A sink has
//
//   At                        where it is, handed along by value so that it stays in a register
//   failed(at)                whether it stopped; then its `reason` and `detail` say why (`Stop`)
//   failure()                 such a place, for a reader that found something wrong
//   kSizesOnly                it wants to know how large things are and not what numbers are
//   kPlaces                   it can write the fields of a message of fixed size in any order (`CdrWriter`)
//   kAllFields                it needs fields that protobuf does not have, too: zeros
//   number<F>(op, at, raw)    one number of the form F, as its bits in CDR
//   numbers<F>(op, at, numbers)  an array or sequence of them: `count()`, `bytes()` (their bytes if those are
//   the same
//                             in CDR and in protobuf, else nullptr), `absent()` (an array of zeros that was
//                             not there) and `each(visit)`, which is false if `visit` was or if reading
//                             failed
//   elements(op, at, count)   an array or sequence of strings or messages begins
//   string(op, at, element, text), wstring(op, at, element, units)
//   begin(op, at, element)    a submessage begins; returns `Nested`, whose `at` is where its first field goes
//   end(op, at, nested, inner)  it ended, `at` is what `begin` had
//   finish(at)                the whole message is there; false: `reason` says why not
//
// each of which returns where it goes on. `element` is the index in an array or sequence, or `kNoElement`.
#pragma once

#include <cstdint>

#include "rosidl_adapter_proto/error.hpp"

namespace rosidl_proto {

struct Text {
  const uint8_t* data;
  uint64_t size;
};

// Why a sink stopped.
struct Stop {
  Reason reason = Reason::None;
  uint64_t detail = 0;
};

}  // namespace rosidl_proto
