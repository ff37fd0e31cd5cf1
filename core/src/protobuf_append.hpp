// Messages to protobuf in one step, for both layouts of the CDR reader.
#pragma once

#include <algorithm>

#include "cdr_reader.hpp"
#include "protobuf_sinks.hpp"

namespace rosidl_proto {
namespace {

template <bool kSwap, class Layout>
bool append_protobuf(const Plan& plan, Input message, Output room, uint64_t* size, Error& error) {
  Lengths none;
  uint8_t nothing;
  if (room.size == 0) room.data = &nothing;  // a sink that is nowhere has stopped
  ProtobufAppender sink(room, none, 0);
  uint8_t* out = room.data;
  if (!CdrReader<kSwap, true, ProtobufAppender, Layout>(plan, message, sink, error).run(&out)) return false;
  *size = static_cast<uint64_t>(out - room.data);
  return true;
}

}  // namespace
}  // namespace rosidl_proto
