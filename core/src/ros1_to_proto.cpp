#include "protobuf_append.hpp"
#include "rosidl_adapter_proto/transcode.hpp"

namespace rosidl_proto {

bool measure_ros1_to_proto(const Plan& plan, Input ros1, uint64_t limit, Lengths& lengths, uint64_t* size,
                           Error& error) noexcept {
  uint8_t nothing;
  if (ros1.size == 0) ros1.data = &nothing;  // a place that is nowhere is an error
  ProtobufSize sink(lengths, limit < kMaximumSize ? limit : kMaximumSize);
  *size = 0;
  return CdrReader<false, true, ProtobufSize, Ros1>(plan, ros1, sink, error).run(size);
}

bool write_ros1_to_proto(const Plan& plan, Input ros1, const Lengths& lengths, uint64_t first, Output proto,
                         Error& error) noexcept {
  uint8_t nothing;
  if (ros1.size == 0) ros1.data = &nothing;
  if (proto.size == 0) proto.data = &nothing;
  ProtobufWriter sink(proto, lengths, first);
  uint8_t* out = proto.data;
  return CdrReader<false, false, ProtobufWriter, Ros1>(plan, ros1, sink, error).run(&out);
}

bool append_ros1_to_proto(const Plan& plan, Input ros1, Output room, uint64_t* size, Error& error) noexcept {
  uint8_t nothing;
  if (ros1.size == 0) ros1.data = &nothing;
  return append_protobuf<false, Ros1>(plan, ros1, room, size, error);
}

}  // namespace rosidl_proto
