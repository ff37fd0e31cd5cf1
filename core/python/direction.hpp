// The directions behind one interface. What a direction keeps between measuring and writing can be shared
// by many messages; a mark says where in it those of one message begin.
#pragma once

#include <rosidl_adapter_proto/transcode.hpp>

namespace rosidl_proto {

template <auto kMeasure, auto kWrite>
struct ToProto {
  struct Scratch {
    explicit Scratch(const Plan&) {}
    uint64_t mark() const { return lengths.size(); }
    Lengths lengths;
  };

  static bool measure(const Plan& plan, Input input, uint64_t limit, Scratch& scratch, uint64_t* size,
                      Error& error) {
    return kMeasure(plan, input, limit, scratch.lengths, size, error);
  }
  static bool write(const Plan& plan, Input input, Scratch& scratch, uint64_t mark, Output output,
                    Error& error) {
    return kWrite(plan, input, scratch.lengths, mark, output, error);
  }
};

using CdrToProto = ToProto<measure_cdr_to_proto, write_cdr_to_proto>;
using Ros1ToProto = ToProto<measure_ros1_to_proto, write_ros1_to_proto>;

struct ProtoToCdr {
  struct Scratch {
    explicit Scratch(const Plan& plan) : fields(plan) {}
    static uint64_t mark() { return 0; }
    Fields fields;
    uint64_t size = 0;  // of the message that was measured last
  };

  static bool measure(const Plan& plan, Input input, uint64_t limit, Scratch& scratch, uint64_t* size,
                      Error& error) {
    scratch.size = input.size;
    return measure_proto_to_cdr(plan, input, limit, scratch.fields, size, error);
  }
  static bool write(const Plan& plan, Input input, Scratch& scratch, uint64_t, Output output, Error& error) {
    // Another message can begin at the same place.
    if (scratch.size != input.size) scratch.fields.message = nullptr;
    return write_proto_to_cdr(plan, input, scratch.fields, output, error);
  }
};

}  // namespace rosidl_proto
