// Lines and words of a text in UTF-8, as Python takes texts apart. What is not well-formed is no white space.
#pragma once

#include <cstddef>
#include <string_view>

namespace rosidl_proto {

// Takes off the first line, up to a line break as `str.splitlines` has them.
std::string_view take_line(std::string_view* text);

// Takes off the first word, and what white space stands before it; empty if there is no word.
std::string_view take_word(std::string_view* text);

// Without white space at both ends, as `str.strip` leaves a text.
std::string_view strip(std::string_view text);

}  // namespace rosidl_proto
