#include <cstdlib>
#include <limits>

#include "cdr_sinks.hpp"
#include "protobuf_reader.hpp"
#include "rosidl_adapter_proto/transcode.hpp"

namespace rosidl_proto {

Fields::Fields(const Plan& plan) {
  const uint64_t count = plan.root().slots;
  if (count <= kFew) return;
  const bool possible = count <= std::numeric_limits<size_t>::max() / sizeof(Slot);
  slots_ = more_ =
      possible ? static_cast<Slot*>(std::malloc(static_cast<size_t>(count) * sizeof(Slot))) : nullptr;
}

namespace {

constexpr uint8_t kHeader[kCdrHeader] = {0x00, 0x01, 0x00, 0x00};  // CDR_LE, no options

bool stop(Error& error, Reason reason, uint64_t a = 0) {
  error.reason = reason;
  error.a = a;
  return false;
}

}  // namespace

bool measure_proto_to_cdr(const Plan& plan, Input proto, uint64_t limit, Fields& fields, uint64_t* size,
                          Error& error) noexcept {
  fields.message = nullptr;
  if (plan.partial()) return stop(error, Reason::Partial);
  if (proto.size > kMaximumSize) return stop(error, Reason::WireSize, proto.size);
  if (fields.slots() == nullptr) return stop(error, Reason::OutOfMemory);
  CdrSize sink(limit < kMaximumSize ? limit : kMaximumSize);
  uint64_t position = 0;
  if (!ProtobufReader<true, false, CdrSize>(plan, proto, sink, error).run(fields.slots(), false, &position))
    return false;
  const bool indexed = !plan.root().fixed && proto.size != 0;
  fields.message = indexed ? proto.data : nullptr;
  *size = kCdrHeader + position;
  return true;
}

bool write_proto_to_cdr(const Plan& plan, Input proto, Fields& fields, Output cdr, Error& error) noexcept {
  if (plan.partial()) return stop(error, Reason::Partial);
  if (fields.slots() == nullptr) return stop(error, Reason::OutOfMemory);
  if (cdr.size < kCdrHeader) return stop(error, Reason::Changed);
  copy(cdr.data, kHeader, kCdrHeader);
  CdrWriter sink(cdr);
  uint8_t* out = sink.origin();
  const bool indexed = fields.message != nullptr && fields.message == proto.data;
  fields.message = nullptr;
  return ProtobufReader<false, true, CdrWriter>(plan, proto, sink, error).run(fields.slots(), indexed, &out);
}

}  // namespace rosidl_proto
