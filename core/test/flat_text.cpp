// A third sink: lines like `points[3].x=1.5`. Both readers drive it, and it needs nothing of them that the
// other sinks do not.
#include <cstring>

#include "cdr_reader.hpp"
#include "checks.hpp"
#include "protobuf_reader.hpp"

namespace rosidl_proto::test {
namespace {

class FlatText : public Stop {
 public:
  using At = bool;  // everything is kept in the sink
  static constexpr bool kSizesOnly = false, kPlaces = false, kMakesCdr = false;

  struct Nested {
    At at;
  };

  FlatText(const Plan& plan, std::string* lines) : plan_(plan), lines_(lines) {}

  static bool failed(At at) { return !at; }
  static At failure() { return false; }

  template <class F>
  At number(const Operation& op, At, typename F::Raw raw) {
    return line(name(op, kNoElement), value(op.cdr, raw));
  }

  template <class F, class Numbers>
  At numbers(const Operation& op, At, const Numbers& numbers) {
    int64_t element = 0;
    line(name(op, kNoElement), "(" + std::to_string(numbers.count()) + ")");
    return numbers.each([&](typename F::Raw raw) { return line(name(op, element++), value(op.cdr, raw)); });
  }

  At elements(const Operation& op, At, uint64_t count) {
    return line(name(op, kNoElement), "(" + std::to_string(count) + ")");
  }

  At string(const Operation& op, At, int64_t element, Text text) {
    const auto* data = reinterpret_cast<const char*>(text.data);
    return line(name(op, element), std::string(data, data + text.size));
  }

  At bytes(const Operation& op, At at, int64_t element, Text bytes) { return string(op, at, element, bytes); }

  template <class Units>
  At wstring(const Operation& op, At, int64_t element, const Units& units) {
    std::string text;
    for (uint64_t i = 0; i < units.count(); ++i) text += std::to_string(units[i]) + " ";
    return line(name(op, element), text);
  }

  Nested begin(const Operation& op, At, int64_t element) {
    outer_.push_back(path_);
    path_ = name(op, element) + ".";
    return {true};
  }

  At end(const Operation&, At, const Nested&, At) {
    path_ = outer_.back();
    outer_.pop_back();
    return true;
  }

  bool finish(At) { return outer_.empty(); }

 private:
  std::string name(const Operation& op, int64_t element) const {
    return path_ + plan_.text(op.name) + (element == kNoElement ? "" : "[" + std::to_string(element) + "]");
  }

  At line(const std::string& name, const std::string& value) {
    *lines_ += name + "=" + value + "\n";
    return true;
  }

  // The value of bits in CDR: here alone it counts what type they are of.
  static std::string value(CdrForm form, uint64_t raw) {
    const auto bits = static_cast<uint32_t>(raw);
    float single;
    double twice;
    switch (form) {
      case CdrForm::Float:
        std::memcpy(&single, &bits, sizeof single);
        return std::to_string(single);
      case CdrForm::Double:
        std::memcpy(&twice, &raw, sizeof twice);
        return std::to_string(twice);
      case CdrForm::Int8:
        return std::to_string(static_cast<int8_t>(raw));
      case CdrForm::Int16:
        return std::to_string(static_cast<int16_t>(raw));
      case CdrForm::Int32:
      case CdrForm::Varint32:
      case CdrForm::Zigzag32:
        return std::to_string(static_cast<int32_t>(raw));
      case CdrForm::Int64:
      case CdrForm::Varint64:
      case CdrForm::Zigzag64:
        return std::to_string(static_cast<int64_t>(raw));
      case CdrForm::Boolean:
        return raw != 0 ? "true" : "false";
      case CdrForm::Uint8:
      case CdrForm::Char:
      case CdrForm::Uint16:
      case CdrForm::Wchar:
      case CdrForm::Uint32:
      case CdrForm::Uint64:
      case CdrForm::Varuint32:
      case CdrForm::Varuint64:
      case CdrForm::String:
      case CdrForm::Wstring:
      case CdrForm::Bytes:
      case CdrForm::Message:
        return std::to_string(raw);
    }
    return "";
  }

  const Plan& plan_;
  std::string* lines_;
  std::string path_;
  std::vector<std::string> outer_;
};

std::string lines_of_cdr(const Plan& plan, const Bytes& cdr) {
  std::string lines;
  Error error;
  bool at = true;
  CdrReader<false, true, FlatText> reader(plan, {cdr.data(), cdr.size()}, FlatText(plan, &lines), error);
  CHECK(reader.run(&at));
  return lines;
}

std::string lines_of_proto(const Plan& plan, const Bytes& proto) {
  std::string lines;
  Error error;
  Fields fields(plan);
  bool at = true;
  ProtobufReader<true, true, FlatText> reader(plan, {proto.data(), proto.size()}, FlatText(plan, &lines),
                                              error);
  CHECK(reader.run(fields.slots(), false, &at));
  return lines;
}

TEST(a_third_sink_gets_the_same_from_both_readers) {
  for (const char* name : {"every_form", "image", "general"}) {
    const Plan plan = golden_plan(name);
    for (uint32_t seed = 0; seed < 50; ++seed) {
      std::string error;
      const Bytes cdr = random_cdr(plan, seed);
      const std::string lines = lines_of_cdr(plan, cdr);
      CHECK(!lines.empty());
      CHECK_EQUAL(lines_of_proto(plan, to_proto(plan, cdr, &error)), lines);
    }
  }
}

TEST(lines_of_a_message) {
  const Bytes cdr = {0, 1, 0, 0, 0xff, 0xff, 0xff, 0xff, 2, 0, 0, 0, 2, 0, 0, 0, 'm', 0,
                     0, 0, 3, 0, 0,    0,    2,    0,    0, 0, 9, 8, 0, 0, 4, 0, 0,   0};
  CHECK_EQUAL(lines_of_cdr(golden_plan("image"), cdr),
              "header.stamp.sec=-1\nheader.stamp.nanosec=2\nheader.frame_id=m\nwidth=3\n"
              "data=(2)\ndata[0]=9\ndata[1]=8\nstep=4\n");
}

}  // namespace
}  // namespace rosidl_proto::test
