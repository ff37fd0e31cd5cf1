// Field numbers from hashes of names: those of `HashNumbering` in rosidl_adapter_proto/schema/numbering.py.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

namespace rosidl_proto {

// The numbers of the fields of one message.
class FieldNumbers {
 public:
  // The number of the next field; 0 if it and others have too many hashes in common.
  uint32_t add(std::string_view name);

 private:
  bool use(uint32_t number);

  std::vector<uint32_t> used_;  // sorted
};

}  // namespace rosidl_proto
