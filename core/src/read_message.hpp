// Reads a message, however it is serialized, and drives a sink that takes what it is given in one go.
#pragma once

#include "cdr_reader.hpp"
#include "protobuf_reader.hpp"

namespace rosidl_proto {
namespace {

// `*at` is where the sink begins, and then where it ended. `fields` are those of the plan.
template <class Sink>
bool read_message(const Plan& plan, Serialization serialization, Input message, const Sink& sink,
                  Fields& fields, typename Sink::At* at, Error& error) {
  uint8_t nothing;
  if (message.size == 0) message.data = &nothing;  // a place that is nowhere is an error
  switch (serialization) {
    case Serialization::Cdr: {
      bool swapped;
      if (!byte_order(message, &swapped, error)) return false;
      return swapped ? CdrReader<true, true, Sink>(plan, message, sink, error).run(at)
                     : CdrReader<false, true, Sink>(plan, message, sink, error).run(at);
    }
    case Serialization::Ros1:
      return CdrReader<false, true, Sink, Ros1>(plan, message, sink, error).run(at);
    case Serialization::Protobuf:
      if (message.size > kMaximumSize) {
        error.reason = Reason::WireSize;
        error.a = message.size;
        return false;
      }
      return ProtobufReader<true, true, Sink>(plan, message, sink, error).run(fields.slots(), false, at);
  }
  return false;
}

}  // namespace
}  // namespace rosidl_proto
