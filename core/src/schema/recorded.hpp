// The definitions in a text that is recorded for a type: the rules of
// rosidl_adapter_proto/interfaces/recorded.py.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

namespace rosidl_proto {

struct TypeName {
  std::string_view package, name_space, name;  // std_msgs, msg, Header

  bool operator<(const TypeName& other) const { return parts() < other.parts(); }
  bool operator==(const TypeName& other) const { return parts() == other.parts(); }

 private:
  std::tuple<const std::string_view&, const std::string_view&, const std::string_view&> parts() const {
    return {package, name_space, name};
  }
};

// Reads `pkg/Type` or `pkg/msg/Type`; returns whether it is one.
bool read_type_name(std::string_view text, TypeName* type);

// Whether a text has only letters, digits and underscores, a letter first.
bool is_name(std::string_view text);

bool starts_with(std::string_view text, std::string_view start);
bool ends_with(std::string_view text, std::string_view end);

// One definition in a text.
struct Definition {
  enum class State : uint8_t { Unread, Reading, Planned };

  TypeName type;
  std::string_view text;
  State state = State::Unread;
  uint32_t message = 0;  // its index in the plan
  uint32_t height = 0;   // how many messages lie in each other, itself included
};

// The definitions of a text, sorted by their names.
class Definitions {
 public:
  // `top` is the type that the text is recorded for.
  const char* read(std::string_view text, const TypeName& top);

  // The definition of a type, or nullptr.
  Definition* find(const TypeName& type);

 private:
  const char* split(std::string_view text, const TypeName& top);
  const char* merge();
  std::vector<Definition>::iterator place_of(const TypeName& type);

  std::vector<Definition> definitions_;
};

}  // namespace rosidl_proto
