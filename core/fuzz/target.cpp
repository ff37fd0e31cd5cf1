// The fuzz target: both directions, and plans themselves.
//
// The first byte of an input says what to do with the rest:
//   0  a CDR message, 1  a protobuf message: of the type whose packed plan is in the file that the
//   environment variable
//      ROSIDL_PROTO_FUZZ_PLAN names
//   2  a packed plan, its size before it as uint32, and then a CDR message; 3  the same with a protobuf
//   message
// make_corpus.py writes the file with the plan and inputs to begin with.
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <vector>

#include "../bytes.hpp"
#include "../transcode.hpp"

using namespace rosidl_proto;

namespace {

constexpr uint64_t kLimit = 1 << 20;

// Exact sizes on the heap let the address sanitizer see every read and write beyond them.
struct Heap {
  explicit Heap(uint64_t bytes) : data(new uint8_t[bytes]), size(bytes) {}
  std::unique_ptr<uint8_t[]> data;
  uint64_t size;
};

void check(bool good, const char* what) {
  if (good) return;
  std::fprintf(stderr, "fuzz target: %s\n", what);
  std::abort();
}

void check_error(const Plan& plan, const Error& error, uint64_t size) {
  check(error.reason != Reason::None, "an error has no reason");
  check(error.reason != Reason::Changed, "the two steps do not agree");
  check(error.offset <= size, "an error lies outside of the input");
  check(!reason(error).empty(), "a reason has no text");
  field_path(error, plan);
}

std::unique_ptr<Heap> to_proto(const Plan& plan, Input cdr) {
  Error error;
  Lengths lengths;
  uint64_t size = 0;
  if (!measure_cdr_to_proto(plan, cdr, kLimit, lengths, &size, error))
    return check_error(plan, error, cdr.size), nullptr;
  check(size <= kLimit, "a result passes the limit");
  check(lengths.size() <= cdr.size, "there are more lengths than bytes");
  auto proto = std::make_unique<Heap>(size);
  check(write_cdr_to_proto(plan, cdr, lengths, 0, {proto->data.get(), size}, error),
        "measured CDR cannot be written");
  return proto;
}

std::unique_ptr<Heap> to_cdr(const Plan& plan, Input proto) {
  Error error;
  Fields fields(plan);
  uint64_t size = 0;
  if (!measure_proto_to_cdr(plan, proto, kLimit, fields, &size, error))
    return check_error(plan, error, proto.size), nullptr;
  check(size <= kLimit, "a result passes the limit");
  auto cdr = std::make_unique<Heap>(size);
  if (!write_proto_to_cdr(plan, proto, fields, {cdr->data.get(), size}, error))
    return check_error(plan, error, proto.size), nullptr;
  return cdr;
}

Input input_of(const std::unique_ptr<Heap>& heap) { return {heap->data.get(), heap->size}; }

bool equal(const std::unique_ptr<Heap>& a, const std::unique_ptr<Heap>& b) {
  return a && b && a->size == b->size &&
         (a->size == 0 || std::memcmp(a->data.get(), b->data.get(), a->size) == 0);
}

// What was written must be readable, and must give the same again. One thing is read from CDR and not from
// protobuf: strings with NUL inside.
void round_trip(const Plan& plan, bool is_cdr, Input input) {
  const auto proto = is_cdr ? to_proto(plan, input) : nullptr;
  if (is_cdr && !proto) return;
  const auto cdr = to_cdr(plan, is_cdr ? input_of(proto) : input);
  if (!cdr) return;
  const auto again = to_proto(plan, input_of(cdr));
  if (is_cdr) check(equal(proto, again), "CDR does not survive the round trip");
  if (!again) return;  // Past the limit, which protobuf can be and CDR not
  check(equal(cdr, to_cdr(plan, input_of(again))), "protobuf does not survive the round trip");
}

// The input may change between measuring and writing: whatever comes out, memory stays in order.
void change(const Plan& plan, Input cdr) {
  Error error;
  Lengths lengths;
  uint64_t size = 0;
  if (!measure_cdr_to_proto(plan, cdr, kLimit, lengths, &size, error)) return;
  Heap proto(size), changed(cdr.size);
  for (uint64_t step = 1; step < cdr.size; step = step * 3 + 1) {
    copy(changed.data.get(), cdr.data, cdr.size);
    for (uint64_t i = 4; i < cdr.size; i += step) changed.data[i] ^= static_cast<uint8_t>(step);
    write_cdr_to_proto(plan, {changed.data.get(), changed.size}, lengths, 0, {proto.data.get(), size}, error);
    error = Error();
  }
}

void change_proto(const Plan& plan, Input proto) {
  Error error;
  Fields fields(plan);
  uint64_t size = 0;
  if (!measure_proto_to_cdr(plan, proto, kLimit, fields, &size, error)) return;
  Heap cdr(size), changed(proto.size);
  for (uint64_t step = 1; step < proto.size; step = step * 3 + 1) {
    copy(changed.data.get(), proto.data, proto.size);
    // An index of what stood there before.
    uint64_t same = 0;
    check(measure_proto_to_cdr(plan, {changed.data.get(), changed.size}, kLimit, fields, &same, error) &&
              same == size,
          "one message has two sizes");
    for (uint64_t i = 0; i < proto.size; i += step) changed.data[i] ^= static_cast<uint8_t>(step);
    write_proto_to_cdr(plan, {changed.data.get(), changed.size}, fields, {cdr.data.get(), size}, error);
    error = Error();
  }
}

const Plan& plan_from_file() {
  static const Plan plan = [] {
    const char* name = std::getenv("ROSIDL_PROTO_FUZZ_PLAN");
    std::FILE* file = name ? std::fopen(name, "rb") : nullptr;
    check(file != nullptr, "ROSIDL_PROTO_FUZZ_PLAN does not name the file that make_corpus.py wrote");
    std::vector<uint8_t> bytes(1 << 20);
    bytes.resize(std::fread(bytes.data(), 1, bytes.size(), file));
    std::fclose(file);
    Plan loaded;
    check(loaded.load(bytes.data(), bytes.size()) == nullptr,
          "the plan in ROSIDL_PROTO_FUZZ_PLAN cannot be loaded");
    return loaded;
  }();
  return plan;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size == 0) return 0;
  const uint8_t mode = data[0];
  Input message{data + 1, size - 1};
  if (mode < 2) {
    round_trip(plan_from_file(), mode == 0, message);
    mode == 0 ? change(plan_from_file(), message) : change_proto(plan_from_file(), message);
  } else if (mode < 4 && message.size >= 4) {
    const uint32_t plan_size = load_little<uint32_t>(message.data);
    Plan plan;
    if (plan_size > message.size - 4 || plan.load(message.data + 4, plan_size) != nullptr) return 0;
    round_trip(plan, mode == 2, {message.data + 4 + plan_size, message.size - 4 - plan_size});
  }
  return 0;
}
