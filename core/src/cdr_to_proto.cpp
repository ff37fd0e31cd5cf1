#include <limits>

#include "protobuf_append.hpp"
#include "rosidl_adapter_proto/transcode.hpp"

namespace rosidl_proto {

bool Lengths::grow() {
  const uint64_t capacity = capacity_ * 2;
  if (capacity > std::numeric_limits<size_t>::max() / sizeof(uint32_t)) return false;
  void* memory = std::malloc(static_cast<size_t>(capacity) * sizeof(uint32_t));
  if (memory == nullptr) return false;
  std::memcpy(memory, data_, static_cast<size_t>(size_) * sizeof(uint32_t));
  if (data_ != few_) std::free(data_);
  data_ = static_cast<uint32_t*>(memory);
  capacity_ = capacity;
  return true;
}

bool measure_cdr_to_proto(const Plan& plan, Input cdr, uint64_t limit, Lengths& lengths, uint64_t* size,
                          Error& error) noexcept {
  bool swapped;
  if (!byte_order(cdr, &swapped, error)) return false;
  ProtobufSize sink(lengths, limit < kMaximumSize ? limit : kMaximumSize);
  *size = 0;
  return swapped ? CdrReader<true, true, ProtobufSize>(plan, cdr, sink, error).run(size)
                 : CdrReader<false, true, ProtobufSize>(plan, cdr, sink, error).run(size);
}

bool write_cdr_to_proto(const Plan& plan, Input cdr, const Lengths& lengths, uint64_t first, Output proto,
                        Error& error) noexcept {
  bool swapped;
  if (!byte_order(cdr, &swapped, error)) return false;
  uint8_t nothing;
  if (proto.size == 0) proto.data = &nothing;  // a sink that is nowhere has stopped
  ProtobufWriter sink(proto, lengths, first);
  uint8_t* out = proto.data;
  return swapped ? CdrReader<true, false, ProtobufWriter>(plan, cdr, sink, error).run(&out)
                 : CdrReader<false, false, ProtobufWriter>(plan, cdr, sink, error).run(&out);
}

bool append_cdr_to_proto(const Plan& plan, Input cdr, Output room, uint64_t* size, Error& error) noexcept {
  bool swapped;
  if (!byte_order(cdr, &swapped, error)) return false;
  return swapped ? append_protobuf<true, PlainCdr>(plan, cdr, room, size, error)
                 : append_protobuf<false, PlainCdr>(plan, cdr, room, size, error);
}

}  // namespace rosidl_proto
