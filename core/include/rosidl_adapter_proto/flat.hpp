// A message as flat pairs of a key and a value, as parser plugins of PlotJuggler give them.
//
// Keys are paths such as `/header/stamp/sec` and `/ranges[0]`, made of the names of fields. What a pair looks
// like is said by the format; how a message is serialized, by the reader that drives the sink.
// Any bytes are text: one that is part of no character of UTF-8 is shown as U+FFFD, and a NUL as a NUL.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "error.hpp"
#include "plan.hpp"
#include "transcode.hpp"

namespace rosidl_proto {

// How pairs are written. All begin with what there is of them; numbers are little endian.
//
//   Page      what PlotJuggler documents for its plugins: uint32 count; for each pair the key, a type, the
//             value. Text has its size before it as uint16; a boolean is a UINT8. Keys begin with "/".
//   Released  what PlotJuggler 3.13 to 3.17 reads: as Page, but sizes are uint32, and a boolean is a BOOL.
//   Module    the scalar output of PlotJuggler 4, without a timestamp: keys do not begin with "/", numbers
//             have 64 bits, and there are no blobs.
enum class FlatFormat : uint8_t { Page, Released, Module };

// What becomes of an array or sequence of more than `maximum` elements: the first ones are shown (`clamp`),
// or none. Bytes (uint8, octet, int8) become a blob, if they lie together in the message and the format has
// blobs.
struct ArrayPolicy {
  bool clamp = false;
  uint32_t maximum = 500;
};

// What the plan of a protobuf message cannot say of a field.
struct FlatNote {
  struct EnumValue {
    int32_t number;
    std::string name;
  };

  std::vector<EnumValue> enum_values;  // sorted by number: shown by their names
  bool map = false;     // elements are entries: the key is part of the path, and the value has no name
  bool single = false;  // a sequence of at most one element, which has no index in its path
};

// A note for each operation of a plan; none at all if there is nothing to say.
using FlatNotes = std::vector<FlatNote>;

// Longer paths are refused, and longer keys of maps are cut.
constexpr uint32_t kMaximumFlatKey = 0xffff;
constexpr uint32_t kMaximumMapKey = 256;

// How a field is shown.
struct FlatField {
  Name name;                                                // empty: the value of a map
  const std::vector<FlatNote::EnumValue>* names = nullptr;  // of its values, if they have any
  bool map_key = false;                                     // part of the path of its map's value
  bool single = false;                                      // all elements are shown
  bool indexed = false;                                     // the index of an element is part of its path
};

// Makes pairs of messages of one type. Memory is only taken when it is loaded, and when a message has a
// submessage in pieces.
class Flattener {
 public:
  // Returns nullptr, or what is wrong with the plan and the notes. It is loaded once.
  const char* load(Plan plan, FlatNotes notes, FlatFormat format) noexcept;

  void set_array_policy(ArrayPolicy policy) noexcept { policy_ = policy; }
  void set_format(FlatFormat format) noexcept { format_ = format; }

  // Writes the pairs of a message and returns how many bytes these are; 0 and an error if the message is not
  // valid, or if there is no room for the count. Pairs that do not fit are left out, and so are all that
  // follow.
  uint64_t flatten(Serialization serialization, Input message, Output output, Error& error) noexcept {
    switch (serialization) {  // here, so that a plugin that only wants one does not have the others
      case Serialization::Cdr:
        return flatten_as<Serialization::Cdr>(message, output, error);
      case Serialization::Protobuf:
        return flatten_as<Serialization::Protobuf>(message, output, error);
      case Serialization::Ros1:
        return flatten_as<Serialization::Ros1>(message, output, error);
    }
    return 0;
  }

 private:
  template <Serialization serialization>
  uint64_t flatten_as(Input message, Output output, Error& error) noexcept;
  const char* read();
  const char* add(const Operation& op, FlatField& field);
  const char* add_map(const Operation& op);
  const char* measure_paths();

  Plan plan_;
  FlatNotes notes_;
  FlatFormat format_ = FlatFormat::Page;
  ArrayPolicy policy_;
  std::unique_ptr<Fields> fields_;
  std::vector<FlatField> shown_;  // for each operation
  std::vector<uint8_t> names_;    // of the plan
  std::vector<uint8_t> path_;     // room for the longest one
};

}  // namespace rosidl_proto
