#include "lines.hpp"

#include <cstdint>

#include "../text.hpp"

namespace rosidl_proto {
namespace {

enum class Kind { Other, Space, Break };

Kind kind_of(uint32_t character) {
  switch (character) {
    case '\n':
    case '\v':
    case '\f':
    case '\r':
    case 0x1c:
    case 0x1d:
    case 0x1e:
    case 0x85:
    case 0x2028:
    case 0x2029:
      return Kind::Break;
    case '\t':
    case 0x1f:
    case ' ':
    case 0xa0:
    case 0x1680:
    case 0x202f:
    case 0x205f:
    case 0x3000:
      return Kind::Space;
    default:
      return character >= 0x2000 && character <= 0x200a ? Kind::Space : Kind::Other;
  }
}

struct Character {
  Kind kind;
  size_t size;
};

// The first character of a text that is not empty.
Character character_at(std::string_view text) {
  const auto* data = reinterpret_cast<const uint8_t*>(text.data());
  uint32_t code_point;
  const uint8_t* next = next_code_point(data, data + text.size(), &code_point);
  if (next == nullptr) return {Kind::Other, 1};
  return {kind_of(code_point), static_cast<size_t>(next - data)};
}

// Where the first character is of which `is_wanted` says so; the size of the text if there is none.
template <class IsWanted>
size_t find(std::string_view text, IsWanted is_wanted) {
  size_t place = 0;
  while (place < text.size()) {
    const Character character = character_at(text.substr(place));
    if (is_wanted(character.kind)) break;
    place += character.size;
  }
  return place;
}

size_t space_size(std::string_view text) {
  return find(text, [](Kind kind) { return kind == Kind::Other; });
}

// How many bytes the white space at the end has: the longest well-formed one.
size_t space_size_at_end(std::string_view text) {
  size_t size = 0;
  for (size_t more = 1; more <= 3 && size + more <= text.size();) {  // no white space has more bytes
    const Character last = character_at(text.substr(text.size() - size - more, more));
    if (last.kind != Kind::Other && last.size == more) {
      size += more;
      more = 1;
    } else {
      ++more;
    }
  }
  return size;
}

}  // namespace

std::string_view take_line(std::string_view* text) {
  const size_t end = find(*text, [](Kind kind) { return kind == Kind::Break; });
  const std::string_view line = text->substr(0, end);
  text->remove_prefix(end);
  if (!text->empty()) text->remove_prefix(character_at(*text).size);
  return line;
}

std::string_view take_word(std::string_view* text) {
  text->remove_prefix(space_size(*text));
  const std::string_view word = text->substr(0, find(*text, [](Kind kind) { return kind != Kind::Other; }));
  text->remove_prefix(word.size());
  return word;
}

std::string_view strip(std::string_view text) {
  text.remove_prefix(space_size(text));
  text.remove_suffix(space_size_at_end(text));
  return text;
}

}  // namespace rosidl_proto
