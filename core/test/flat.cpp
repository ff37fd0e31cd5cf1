// Pairs of a key and a value: in every format, from both readers, and never past the end of the output.
#include "rosidl_adapter_proto/flat.hpp"

#include "checks.hpp"
#include "rosidl_adapter_proto/wire.hpp"
#include "schema/packed_plan.hpp"

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

// Plans of one field `a`, whose element may be a message of one field `b`.
Plan plan_of(CdrForm form, Shape shape = Shape::Single, uint32_t count = kUnbounded) {
  std::vector<PlannedMessage> messages;
  PlannedField field{"a", 0, form, protobuf_form(form, shape), shape, 1, count};
  if (form == CdrForm::Message) {
    const CdrForm inner = CdrForm::Int16;
    messages.push_back({"test/msg/Inner",
                        "Inner",
                        {{"b", 0, inner, protobuf_form(inner, Shape::Single), Shape::Single, 1}}});
  }
  messages.push_back({"test/msg/Outer", "Outer", {field}});
  const std::vector<uint8_t> packed = pack_plan(messages);
  Plan plan;
  CHECK(plan.load(packed.data(), packed.size()) == nullptr);
  return plan;
}

Bytes cdr_of(const Bytes& content) {
  Bytes cdr(4 + content.size());
  cdr[1] = 1;
  copy(cdr.data() + 4, content.data(), content.size());
  return cdr;
}

TEST(flat_pairs_of_every_type) {
  const struct {
    CdrForm form;
    Bytes content;
    const char *page, *released, *module;
  } rows[] = {
      {CdrForm::Boolean, {1}, "UINT8 1", "BOOL 1", "bool 1"},
      {CdrForm::Uint8, {0xff}, "UINT8 255", "UINT8 255", "u64 255"},
      {CdrForm::Char, {'A'}, "UINT8 65", "UINT8 65", "u64 65"},
      {CdrForm::Int8, {0xff}, "INT8 -1", "INT8 -1", "i64 -1"},
      {CdrForm::Uint16, {0xff, 0xff}, "UINT16 65535", "UINT16 65535", "u64 65535"},
      {CdrForm::Wchar, {0xff, 0xff}, "UINT16 65535", "UINT16 65535", "u64 65535"},
      {CdrForm::Int16, {0xfe, 0xff}, "INT16 -2", "INT16 -2", "i64 -2"},
      {CdrForm::Uint32, {0xff, 0xff, 0xff, 0xff}, "UINT32 4294967295", "UINT32 4294967295", "u64 4294967295"},
      {CdrForm::Int32, {0xfd, 0xff, 0xff, 0xff}, "INT32 -3", "INT32 -3", "i64 -3"},
      {CdrForm::Varuint32, {1, 0, 0, 0x80}, "UINT32 2147483649", "UINT32 2147483649", "u64 2147483649"},
      {CdrForm::Varint32, {0xfd, 0xff, 0xff, 0xff}, "INT32 -3", "INT32 -3", "i64 -3"},
      {CdrForm::Zigzag32, {0xfd, 0xff, 0xff, 0xff}, "INT32 -3", "INT32 -3", "i64 -3"},
      {CdrForm::Float, {0, 0, 0xc0, 0xbf}, "FLOAT32 -1.5", "FLOAT32 -1.5", "f64 -1.5"},
      {CdrForm::Uint64, Bytes(8, 0xff), "UINT64 18446744073709551615", "UINT64 18446744073709551615",
       "u64 18446744073709551615"},
      {CdrForm::Varuint64, Bytes(8, 0), "UINT64 0", "UINT64 0", "u64 0"},
      {CdrForm::Int64, Bytes(8, 0xff), "INT64 -1", "INT64 -1", "i64 -1"},
      {CdrForm::Varint64, Bytes(8, 0xff), "INT64 -1", "INT64 -1", "i64 -1"},
      {CdrForm::Zigzag64, Bytes(8, 0xff), "INT64 -1", "INT64 -1", "i64 -1"},
      {CdrForm::Double, {0, 0, 0, 0, 0, 0, 0xf8, 0xbf}, "FLOAT64 -1.5", "FLOAT64 -1.5", "f64 -1.5"},
      {CdrForm::String, {3, 0, 0, 0, 'h', 'i', 0}, "STRING hi", "STRING hi", "string hi"},
      // Half of a pair, a pair, and a letter.
      {CdrForm::Wstring,
       {4, 0, 0, 0, 0x3d, 0xd8, 0, 0, 0x3d, 0xd8, 0, 0, 0, 0xde, 0, 0, 'a', 0, 0, 0},
       "STRING \uFFFD\U0001F600a",
       "STRING \uFFFD\U0001F600a",
       "string \uFFFD\U0001F600a"},
      {CdrForm::Message, {7, 0}, nullptr, nullptr, nullptr},
  };
  for (const auto& row : rows) {
    const Plan plan = plan_of(row.form);
    const bool message = row.form == CdrForm::Message;
    const std::string expected[] = {
        std::string("/a") + (message ? "/b INT16 7" : std::string(" ") + row.page),
        std::string("/a") + (message ? "/b INT16 7" : std::string(" ") + row.released),
        std::string("a") + (message ? "/b i64 7" : std::string(" ") + row.module)};
    const Bytes cdr = cdr_of(row.content);
    for (const FlatFormat format : kFormats) {
      Flattener made = flattener(plan, format);
      const Bytes from_cdr = flatten(made, Serialization::Cdr, cdr);
      CHECK_EQUAL(lines(format, from_cdr), expected[static_cast<size_t>(format)] + "\n");
      std::string error;
      CHECK(flatten(made, Serialization::Protobuf, to_proto(plan, cdr, &error)) == from_cdr ||
            row.form == CdrForm::Wstring);
    }
  }
}

// What there is of `a` if it has `count` elements and three are the maximum.
std::string shown(FlatFormat format, CdrForm form, uint32_t count, bool clamp) {
  Bytes content = {static_cast<uint8_t>(count), 0, 0, 0};
  for (uint8_t i = 0; i < count; ++i) {
    if (form == CdrForm::String)
      content.insert(content.end(), {2, 0, 0, 0, static_cast<uint8_t>('a' + i), 0});
    if (form == CdrForm::Uint8 || form == CdrForm::Int8 || form == CdrForm::Char) content.push_back(i);
    if (form == CdrForm::Int16 || form == CdrForm::Message) content.insert(content.end(), {i, 0});
    while (form == CdrForm::String && i + 1u < count && content.size() % 4 != 0) content.push_back(0);
  }
  const Plan plan = plan_of(form, Shape::Sequence);
  Flattener made = flattener(plan, format, {}, {clamp, 3});
  std::string error;
  const Bytes cdr = cdr_of(content);
  const std::string result = lines(format, flatten(made, Serialization::Cdr, cdr));
  const std::string other =
      lines(format, flatten(made, Serialization::Protobuf, to_proto(plan, cdr, &error)));
  if (result.find("BLOB") == std::string::npos) CHECK_EQUAL(other, result);  // a blob lies elsewhere
  return result;
}

TEST(arrays_below_at_and_above_the_maximum) {
  const struct {
    CdrForm form;
    const char *three, *four_clamped, *four;  // elements
  } rows[] = {
      {CdrForm::Int16, "/a[0] INT16 0\n/a[1] INT16 1\n/a[2] INT16 2\n",
       "/a[0] INT16 0\n/a[1] INT16 1\n/a[2] INT16 2\n", ""},
      {CdrForm::Char, "/a[0] UINT8 0\n/a[1] UINT8 1\n/a[2] UINT8 2\n",
       "/a[0] UINT8 0\n/a[1] UINT8 1\n/a[2] UINT8 2\n", ""},
      {CdrForm::String, "/a[0] STRING a\n/a[1] STRING b\n/a[2] STRING c\n",
       "/a[0] STRING a\n/a[1] STRING b\n/a[2] STRING c\n", ""},
      {CdrForm::Message, "/a[0]/b INT16 0\n/a[1]/b INT16 1\n/a[2]/b INT16 2\n",
       "/a[0]/b INT16 0\n/a[1]/b INT16 1\n/a[2]/b INT16 2\n", ""},
      {CdrForm::Uint8, "/a[0] UINT8 0\n/a[1] UINT8 1\n/a[2] UINT8 2\n", "/a BLOB 8,4\n", "/a BLOB 8,4\n"},
      {CdrForm::Int8, "/a[0] INT8 0\n/a[1] INT8 1\n/a[2] INT8 2\n", "/a BLOB 8,4\n", "/a BLOB 8,4\n"},
  };
  for (const auto& row : rows) {
    const std::string three = row.three;
    for (const FlatFormat format : {FlatFormat::Page, FlatFormat::Released}) {
      for (const bool clamp : {false, true}) {
        CHECK_EQUAL(shown(format, row.form, 0, clamp), "");
        CHECK_EQUAL(shown(format, row.form, 2, clamp), three.substr(0, three.find("/a[2]")));
        CHECK_EQUAL(shown(format, row.form, 3, clamp), three);
        CHECK_EQUAL(shown(format, row.form, 4, clamp), clamp ? row.four_clamped : row.four);
      }
    }
  }
  CHECK_EQUAL(shown(FlatFormat::Module, CdrForm::Uint8, 3, true), "a[0] u64 0\na[1] u64 1\na[2] u64 2\n");
  CHECK_EQUAL(shown(FlatFormat::Module, CdrForm::Uint8, 4, true), "");
}

TEST(a_blob_lies_in_the_message) {
  const Plan plan = plan_of(CdrForm::Uint8, Shape::Sequence);
  Flattener made = flattener(plan, FlatFormat::Page, {}, {false, 3});
  CHECK_EQUAL(lines(FlatFormat::Page, flatten(made, Serialization::Protobuf, {0x0a, 4, 9, 8, 7, 6})),
              "/a BLOB 2,4\n");
  // A submessage in two pieces: its bytes are joined elsewhere.
  std::vector<PlannedMessage> messages;
  messages.push_back(
      {"test/msg/Inner", "Inner", {{"b", 0, CdrForm::Uint8, ProtobufForm::Bytes, Shape::Sequence, 1}}});
  messages.push_back(
      {"test/msg/Outer", "Outer", {{"a", 0, CdrForm::Message, ProtobufForm::Message, Shape::Single, 1}}});
  const std::vector<uint8_t> packed = pack_plan(messages);
  Plan nested;
  CHECK(nested.load(packed.data(), packed.size()) == nullptr);
  made = flattener(std::move(nested), FlatFormat::Page, {}, {true, 2});
  CHECK_EQUAL(lines(FlatFormat::Page, flatten(made, Serialization::Protobuf, {0x0a, 5, 0x0a, 3, 9, 8, 7})),
              "/a/b BLOB 4,3\n");
  CHECK_EQUAL(
      lines(FlatFormat::Page, flatten(made, Serialization::Protobuf, {0x0a, 5, 0x0a, 3, 9, 8, 7, 0x0a, 0})),
      "/a/b[0] UINT8 9\n/a/b[1] UINT8 8\n");
}

TEST(output_is_cut_at_a_whole_pair) {
  for (const char* name : {"image", "every_form"}) {
    const Plan plan = golden_plan(name);
    const Bytes cdr = random_cdr(plan, 3);
    for (const FlatFormat format : kFormats) {
      Flattener made = flattener(plan, format);
      const Bytes whole = flatten(made, Serialization::Cdr, cdr);
      const std::string all = lines(format, whole);
      const uint64_t header = format == FlatFormat::Module ? 24 : 4;
      const uint64_t step = whole.size() > 1000 ? 97 : 1;
      size_t before = 0;
      for (uint64_t room = 0; room <= whole.size() + 8; room += step) {
        const Bytes part = flatten(made, Serialization::Cdr, cdr, room);
        CHECK_EQUAL(part.empty(), room < header);
        if (part.empty()) continue;
        const std::string some = lines(format, part);
        CHECK(some.size() >= before && some == all.substr(0, some.size()));
        CHECK(room < whole.size() || part == whole);
        before = some.size();
      }
      CHECK(flatten(made, Serialization::Cdr, cdr, whole.size()) == whole);
    }
  }
}

// The notes of tests/golden/plans/general.txt.
FlatNotes general_notes(const Plan& plan) {
  FlatNotes notes(plan.operation_count());
  for (uint32_t i = 0; i < notes.size(); ++i) {
    const std::string name = plan.text(plan.operation(i).name);
    notes[i].map = name == "counts" || name == "nodes";
    notes[i].single = name == "left";
    if (name == "color" || name == "colors") notes[i].enum_values = {{-1, "NONE"}, {0, "RED"}, {7, "BLUE"}};
  }
  return notes;
}

// What a message of that plan has, but for the numbers that come first.
std::string general(const Bytes& proto, ArrayPolicy policy = {}) {
  const Plan plan = golden_plan("general");
  Flattener made = flattener(plan, FlatFormat::Released, general_notes(plan), policy);
  const std::string all = lines(FlatFormat::Released, flatten(made, Serialization::Protobuf, proto));
  std::istringstream stream(all);
  std::string rest;
  for (std::string line; std::getline(stream, line);) {
    if (line.compare(0, 5, "/one_") != 0) rest += line + "\n";
  }
  return rest;
}

TEST(defaults_of_protobuf_are_shown_in_the_order_of_the_schema) {
  CHECK_EQUAL(general({}), "/color STRING RED\n/tree/name STRING \n/small INT8 0\n/wide STRING \n");
}

TEST(enumerations_have_names) {
  // color = 7, colors = [-1, 3]
  CHECK_EQUAL(general({0xf8, 1, 7, 0x82, 2, 11, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 1, 3}),
              "/color STRING BLUE\n/colors[0] STRING NONE\n/colors[1] STRING 3\n/tree/name STRING \n"
              "/small INT8 0\n/wide STRING \n");
}

TEST(maps_have_their_keys_in_the_path) {
  // counts = {"x": -1, "": 0}, nodes = {-2: {name: "n", left: {name: "m"}}}
  const Bytes proto = {0xa2, 2,    5,    0x0a, 1,    'x',  0x10, 1,    0xa2, 2,    0,    0xaa,
                       2,    21,   0x08, 0xfe, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff,
                       1,    0x12, 8,    0x0a, 1,    'n',  0x12, 3,    0x0a, 1,    'm'};
  CHECK_EQUAL(general(proto),
              "/color STRING RED\n/tree/name STRING \n/counts/x INT64 -1\n/counts/ INT64 0\n"
              "/nodes/-2/name STRING n\n/nodes/-2/left/name STRING m\n/small INT8 0\n/wide STRING \n");
  // Entries are elements; what is single is none.
  CHECK_EQUAL(general(proto, {true, 1}),
              "/color STRING RED\n/tree/name STRING \n/counts/x INT64 -1\n"
              "/nodes/-2/name STRING n\n/nodes/-2/left/name STRING m\n/small INT8 0\n/wide STRING \n");
  CHECK_EQUAL(general(proto, {false, 0}),
              "/color STRING RED\n/tree/name STRING \n/small INT8 0\n/wide STRING \n");
}

TEST(keys_of_maps_are_cut_at_a_character) {
  Bytes proto = {0xa2, 2, 0x90, 2, 0x0a, 0x8d, 2, 'a'};
  for (int i = 0; i < 67; ++i) proto.insert(proto.end(), {0xf0, 0x9f, 0x98, 0x80});
  const std::string found = general(proto);
  const size_t key = found.find("/counts/") + 8;
  CHECK_EQUAL(found.find(' ', key) - key, 253u);
}

TEST(bytes_that_repeat_are_arrays_of_arrays) {
  CHECK_EQUAL(general({0xf2, 1, 2, 5, 0xff, 0xf2, 1, 0, 0xf2, 1, 3, 1, 2, 3}, {false, 2}),
              "/color STRING RED\n/tree/name STRING \n/small INT8 0\n/wide STRING \n");
  CHECK_EQUAL(general({0xf2, 1, 2, 5, 0xff, 0xf2, 1, 3, 1, 2, 3}, {false, 2}),
              "/many_bytes[0][0] UINT8 5\n/many_bytes[0][1] UINT8 255\n/many_bytes[1] BLOB 8,3\n"
              "/color STRING RED\n/tree/name STRING \n/small INT8 0\n/wide STRING \n");
}

TEST(text_of_the_page_is_cut_at_a_character) {
  for (const CdrForm form : {CdrForm::String, CdrForm::Wstring}) {
    const Plan plan = plan_of(form);
    Bytes proto = {0x0a, 0xfe, 0xff, 7};  // 131,070 bytes
    for (int i = 0; i < 65535; ++i) {
      form == CdrForm::String ? proto.insert(proto.end(), {0xc3, 0xa4})
                              : proto.insert(proto.end(), {0xe4, 0x00});
    }
    Flattener page = flattener(plan, FlatFormat::Page), released = flattener(plan, FlatFormat::Released);
    CHECK_EQUAL(flatten(page, Serialization::Protobuf, proto).size(), 4u + 4 + 1 + 2 + 65534);
    CHECK_EQUAL(flatten(released, Serialization::Protobuf, proto).size(), 4u + 6 + 1 + 4 + 131070);
  }
}

// "a", a NUL, a byte that begins no character, a surrogate as UTF-8 (two of its three bytes are none), "z".
TEST(any_bytes_are_text) {
  const std::string shown = std::string("a\0", 2) + "\xef\xbf\xbd" + "\xef\xbf\xbd" + "\xef\xbf\xbd" + "z";
  const Bytes text = {'a', 0, 0xff, 0xed, 0xa0, 'z'};
  Bytes cdr = {7, 0, 0, 0};
  Bytes proto = {0x0a, 6};
  for (Bytes* const each : {&cdr, &proto}) each->insert(each->end(), text.begin(), text.end());
  cdr.push_back(0);
  for (const FlatFormat format : kFormats) {
    Flattener made = flattener(plan_of(CdrForm::String), format);
    const Bytes found = flatten(made, Serialization::Protobuf, proto);
    CHECK(lines(format, found).find(shown + "\n") != std::string::npos);
    CHECK(flatten(made, Serialization::Cdr, cdr_of(cdr)) == found);
  }
  // counts = {"x", a NUL, a byte that is none, "y"}
  CHECK_EQUAL(general({0xa2, 2, 6, 0x0a, 4, 'x', 0, 0x80, 'y'}),
              "/color STRING RED\n/tree/name STRING \n" + std::string("/counts/x\0", 10) +
                  "\xef\xbf\xbdy INT64 0\n/small INT8 0\n/wide STRING \n");
}

TEST(text_may_have_nul_inside_where_no_cdr_is_made) {
  const Plan plan = plan_of(CdrForm::String);
  const Bytes proto = {0x0a, 3, 'a', 0, 'b'};
  Flattener made = flattener(plan, FlatFormat::Released);
  const Bytes pairs = flatten(made, Serialization::Protobuf, proto);
  CHECK(pairs.size() > 3 && Bytes(pairs.end() - 3, pairs.end()) == (Bytes{'a', 0, 'b'}));
  std::string error;
  to_cdr(plan, proto, &error);
  CHECK(error.find("the string contains NUL, which ends a string in ROS; remove it") != std::string::npos);
}

TEST(messages_that_are_not_valid_have_no_pairs) {
  for (const FlatFormat format : kFormats) {
    Flattener made = flattener(golden_plan("every_form"), format);
    const Bytes cdr = random_cdr(golden_plan("every_form"), 1);
    for (size_t size = 0; size < cdr.size(); size += 7)
      CHECK(flatten(made, Serialization::Cdr, Bytes(cdr.begin(), cdr.begin() + static_cast<long>(size)))
                .empty());
    // Elements that are not shown are read as well: the last of these is no character.
    Flattener letters = flattener(plan_of(CdrForm::Char, Shape::Sequence), format, {}, {true, 1});
    CHECK(flatten(letters, Serialization::Cdr, cdr_of({3, 0, 0, 0, 1, 2, 0x80})).empty());
    Flattener small = flattener(plan_of(CdrForm::Int16, Shape::Sequence), format, {}, {true, 1});
    CHECK(flatten(small, Serialization::Protobuf, {0x0a, 5, 1, 2, 0x80, 0x80, 4}).empty());
  }
}

TEST(many_elements_that_are_not_shown) {
  const uint32_t count = 2'000'000;
  Bytes content(4 + 2 * size_t{count});
  store_little(content.data(), count);
  for (const CdrForm form : {CdrForm::Int16, CdrForm::Message}) {
    Flattener made = flattener(plan_of(form, Shape::Sequence), FlatFormat::Page);
    CHECK_EQUAL(flatten(made, Serialization::Cdr, cdr_of(content)).size(), 4u);
    made.set_array_policy({true, count});
    CHECK(flatten(made, Serialization::Cdr, cdr_of(content)).size() > kRoom - 32);
  }
}

TEST(notes_and_names_are_checked) {
  const auto wrong = [](const Plan& plan, FlatNotes notes) {
    Flattener made;
    const char* const text = made.load(plan, std::move(notes), FlatFormat::Page);
    return std::string(text == nullptr ? "" : text);
  };
  const char* const kNotes = "the notes are not those of the plan";
  const Plan plan = golden_plan("general");
  CHECK_EQUAL(wrong(plan, {}), "");
  CHECK_EQUAL(wrong(plan, FlatNotes(1)), kNotes);
  FlatNote map, single, named;
  map.map = single.single = true;
  named.enum_values = {{0, "ZERO"}};
  for (const FlatNote& note : {map, single, named})
    CHECK_EQUAL(wrong(plan_of(CdrForm::String), {note}), kNotes);
  CHECK_EQUAL(wrong(plan_of(CdrForm::Message, Shape::Sequence), {map, {}}), kNotes);
  const std::string name(65535, 'a');
  std::vector<PlannedMessage> messages;
  messages.push_back({"A", "A", {{name, 0, CdrForm::Boolean, ProtobufForm::Bool, Shape::Single, 1}}});
  const std::vector<uint8_t> packed = pack_plan(messages);
  Plan long_plan;
  CHECK(long_plan.load(packed.data(), packed.size()) == nullptr);
  CHECK_EQUAL(wrong(long_plan, {}), "the path of a field is longer than 65,535 bytes; shorten its names");
}

}  // namespace
}  // namespace rosidl_proto::test
