// Pairs of a key and a value: in every format, from both readers, and never past the end of the output.
#include "rosidl_adapter_proto/flat.hpp"

#include "checks.hpp"
#include "rosidl_adapter_proto/wire.hpp"

namespace rosidl_proto::test {
namespace {

constexpr FlatFormat kFormats[] = {FlatFormat::Page, FlatFormat::Released, FlatFormat::Module};
constexpr uint64_t kRoom = 1 << 20;

Flattener flattener(Plan plan, FlatFormat format, FlatNotes notes = {}, ArrayPolicy policy = {}) {
  Flattener made;
  const char* const wrong = made.load(std::move(plan), std::move(notes), format);
  CHECK_EQUAL(std::string(wrong == nullptr ? "" : wrong), "");
  made.set_array_policy(policy);
  return made;
}

// The pairs in exactly `room` bytes, between bytes that stay as they are.
Bytes flatten(Flattener& flattener, Serialization serialization, const Bytes& message,
              uint64_t room = kRoom) {
  constexpr size_t kGuard = 64;
  Bytes output(room + 2 * kGuard, 0xa5);
  Error error;
  const uint64_t size = flattener.flatten(serialization, {message.data(), message.size()},
                                          {output.data() + kGuard, room}, error);
  CHECK(size <= room);
  CHECK_EQUAL(size == 0, error.reason != Reason::None);
  for (size_t i = 0; i < kGuard; ++i) CHECK(output[i] == 0xa5 && output[kGuard + room + i] == 0xa5);
  const auto begin = output.begin() + kGuard;
  return Bytes(begin, begin + static_cast<std::ptrdiff_t>(size));
}

// Reads pairs as lines like `/points[3]/x FLOAT64 1.5`.
class Lines {
 public:
  Lines(FlatFormat format, const Bytes& pairs) : format_(format), pairs_(pairs) {}

  std::string read() {
    if (pairs_.empty()) return "nothing\n";
    format_ == FlatFormat::Module ? read_module() : read_pairs();
    CHECK_EQUAL(place_, pairs_.size());
    return lines_;
  }

 private:
  void read_pairs() {
    for (auto count = number<uint32_t>(); count > 0; --count) {
      lines_ += text(size()) + " ";
      read_value(number<uint8_t>());
      lines_ += "\n";
    }
  }

  void read_value(uint8_t type) {
    switch (type) {
      case 0:
        return integer<uint8_t>("UINT8");
      case 1:
        return integer<uint16_t>("UINT16");
      case 2:
        return integer<uint32_t>("UINT32");
      case 3:
        return integer<uint64_t>("UINT64");
      case 8:
        return integer<int8_t>("INT8");
      case 9:
        return integer<int16_t>("INT16");
      case 10:
        return integer<int32_t>("INT32");
      case 11:
        return integer<int64_t>("INT64");
      case 16:
        return show("FLOAT32", number<float>());
      case 17:
        return show("FLOAT64", number<double>());
      case 18:
        lines_ += "STRING " + text(size());
        return;
      case 19:
        integer<uint32_t>("BLOB");
        lines_ += "," + std::to_string(number<uint32_t>());
        return;
      case 20:
        return integer<uint8_t>("BOOL");
      default:
        CHECK(!"a type that there is not");
    }
  }

  void read_module() {
    CHECK(Bytes(pairs_.begin(), pairs_.begin() + 20) ==
          Bytes({1, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}));
    place_ = 20;
    size_t names = 0;
    for (auto count = number<uint32_t>(); count > 0; --count) {
      const auto offset = number<uint32_t>(), length = number<uint32_t>();
      CHECK(offset <= pairs_.size() && length <= pairs_.size() - offset);
      lines_ += std::string(pairs_.begin() + offset, pairs_.begin() + offset + length) + " ";
      names += length;
      read_module_value(number<uint8_t>());
      lines_ += "\n";
    }
    place_ += names;
  }

  void read_module_value(uint8_t kind) {
    switch (kind) {
      case 0:
        return show("f64", number<double>());
      case 1:
        return integer<int64_t>("i64");
      case 2:
        return integer<uint64_t>("u64");
      case 3:
        return integer<uint8_t>("bool");
      case 4:
        lines_ += "string " + text(number<uint32_t>());
        return;
      default:
        CHECK(!"a kind that there is not");
    }
  }

  template <class T>
  void integer(const char* type) {
    lines_ += std::string(type) + " " + std::to_string(number<T>());
  }

  void show(const char* type, double value) {
    std::ostringstream text;
    text << type << " " << value;
    lines_ += text.str();
  }

  uint32_t size() { return format_ == FlatFormat::Page ? number<uint16_t>() : number<uint32_t>(); }

  template <class T>
  T number() {
    CHECK(sizeof(T) <= pairs_.size() - place_);
    place_ += sizeof(T);
    return load_little<T>(pairs_.data() + place_ - sizeof(T));
  }

  std::string text(uint32_t size) {
    CHECK(size <= pairs_.size() - place_);
    const auto* const begin = reinterpret_cast<const char*>(pairs_.data()) + place_;
    place_ += size;
    return std::string(begin, size);
  }

  const FlatFormat format_;
  const Bytes& pairs_;
  size_t place_ = 0;
  std::string lines_;
};

std::string lines(FlatFormat format, const Bytes& pairs) { return Lines(format, pairs).read(); }

const Bytes kImage = {0, 1, 0, 0, 0xff, 0xff, 0xff, 0xff, 2, 0, 0, 0, 2, 0, 0, 0, 'm', 0,
                      0, 0, 3, 0, 0,    0,    2,    0,    0, 0, 9, 8, 0, 0, 4, 0, 0,   0};

TEST(flat_pairs_of_a_message) {
  const std::string expected[] = {
      "/header/stamp/sec INT32 -1\n/header/stamp/nanosec UINT32 2\n/header/frame_id STRING m\n"
      "/width UINT32 3\n/data[0] UINT8 9\n/data[1] UINT8 8\n/step UINT32 4\n",
      "",
      "header/stamp/sec i64 -1\nheader/stamp/nanosec u64 2\nheader/frame_id string m\n"
      "width u64 3\ndata[0] u64 9\ndata[1] u64 8\nstep u64 4\n"};
  for (const FlatFormat format : kFormats) {
    Flattener made = flattener(golden_plan("image"), format);
    const auto index = format == FlatFormat::Released ? 0 : static_cast<size_t>(format);
    CHECK_EQUAL(lines(format, flatten(made, Serialization::Cdr, kImage)), expected[index]);
  }
}

TEST(flat_pairs_as_bytes) {
  const Plan plan = golden_plan("image");
  Flattener page = flattener(plan, FlatFormat::Page), released = flattener(plan, FlatFormat::Released);
  const Bytes from_page = flatten(page, Serialization::Cdr, kImage);
  const Bytes expected_page = {7,   0,   0,   0,   17,  0,   '/', 'h', 'e', 'a', 'd',  'e',  'r',  '/',
                               's', 't', 'a', 'm', 'p', '/', 's', 'e', 'c', 10,  0xff, 0xff, 0xff, 0xff};
  CHECK(Bytes(from_page.begin(), from_page.begin() + 28) == expected_page);
  const Bytes from_released = flatten(released, Serialization::Cdr, kImage);
  const Bytes expected_released = {7,   0,   0,   0,   17,  0,   0,    0,    '/',  'h',
                                   'e', 'a', 'd', 'e', 'r', '/', 's',  't',  'a',  'm',
                                   'p', '/', 's', 'e', 'c', 10,  0xff, 0xff, 0xff, 0xff};
  CHECK(Bytes(from_released.begin(), from_released.begin() + 30) == expected_released);
}

TEST(flat_pairs_are_the_same_from_both_readers) {
  for (const char* name : {"every_form", "image"}) {
    const Plan plan = golden_plan(name);
    for (const FlatFormat format : kFormats) {
      Flattener made = flattener(plan, format);
      for (uint32_t seed = 0; seed < 50; ++seed) {
        std::string error;
        const Bytes cdr = random_cdr(plan, seed);
        const Bytes from_cdr = flatten(made, Serialization::Cdr, cdr);
        CHECK(from_cdr == flatten(made, Serialization::Protobuf, to_proto(plan, cdr, &error)));
        CHECK(lines(format, from_cdr).size() > 50);
      }
    }
  }
}

}  // namespace
}  // namespace rosidl_proto::test
