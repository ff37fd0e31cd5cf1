// A message as flat pairs of a key and a value, as parser plugins of PlotJuggler give them.
//
// Keys are paths such as `/header/stamp/sec` and `/ranges[0]`, made of the names of fields. What a pair looks
// like is said by the format; how a message is serialized, by the reader that drives the sink.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace rosidl_proto {

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

}  // namespace rosidl_proto
