#include "recorded.hpp"

#include <algorithm>

#include "../heap_sort.hpp"
#include "lines.hpp"

namespace rosidl_proto {
namespace {

constexpr size_t kMaximumDefinitions = 10'000;

bool is_letter(char each) { return (each >= 'A' && each <= 'Z') || (each >= 'a' && each <= 'z'); }
bool is_digit(char each) { return each >= '0' && each <= '9'; }

bool is_blank(std::string_view text) { return strip(text).empty(); }

// Returns whether a line is one of the rules between definitions.
bool is_rule(std::string_view line) {
  constexpr size_t kWidth = 80;
  return line.find_first_not_of('=') >= kWidth && line.size() >= kWidth &&
         line.find_first_not_of(" \t", kWidth) == std::string_view::npos;
}

// Takes off a line up to `\n` or `\r\n`: only those stand around the rules and names between definitions.
std::string_view take_plain_line(std::string_view* text) {
  const size_t end = text->find('\n');
  std::string_view line = text->substr(0, end);
  text->remove_prefix(std::min(line.size() + 1, text->size()));
  if (end != std::string_view::npos && ends_with(line, "\r")) line.remove_suffix(1);
  return line;
}

// Reads the line behind a rule. `*type` is left without a name if it does not say what follows.
const char* read_heading(std::string_view line, const TypeName& top, TypeName* type) {
  if (starts_with(line, "IDL:"))
    return "the text has definitions in IDL, of which only those in .msg are read";
  if (starts_with(line, "SRV:") || starts_with(line, "ACTION:"))
    return "the text has definitions of services or actions, of which only those of messages are read";
  if (!starts_with(line, "MSG:")) return nullptr;
  line.remove_prefix(std::min(line.find_first_not_of(" \t", 4), line.size()));
  const std::string_view name = line.substr(0, line.find_last_not_of(" \t") + 1);
  *type = {top.package, "msg", name};  // of the same package if it does not say another one
  const bool is_type = name.find('/') == std::string_view::npos ? is_name(name) : read_type_name(name, type);
  return is_type ? nullptr : "a line `MSG: ` of the text does not have the name of a message behind it";
}

bool has_same_words(std::string_view a, std::string_view b) {
  for (;;) {
    const std::string_view word = take_word(&a);
    if (word != take_word(&b)) return false;
    if (word.empty()) return true;
  }
}

}  // namespace

bool starts_with(std::string_view text, std::string_view start) {
  return text.substr(0, start.size()) == start;
}

bool ends_with(std::string_view text, std::string_view end) {
  return text.size() >= end.size() && text.substr(text.size() - end.size()) == end;
}

bool is_name(std::string_view text) {
  return !text.empty() && is_letter(text[0]) && std::all_of(text.begin(), text.end(), [](char each) {
    return is_letter(each) || is_digit(each) || each == '_';
  });
}

bool read_type_name(std::string_view text, TypeName* type) {
  const size_t first = text.find('/'), last = text.rfind('/');
  if (first == std::string_view::npos) return false;
  type->package = text.substr(0, first);
  type->name_space = first == last ? "msg" : text.substr(first + 1, last - first - 1);
  type->name = text.substr(last + 1);
  return is_name(type->package) && is_name(type->name) &&
         (type->name_space == "msg" || type->name_space == "srv" || type->name_space == "action");
}

const char* Definitions::split(std::string_view text, const TypeName& top) {
  definitions_.push_back({top, text});
  for (std::string_view rest = text; !rest.empty();) {
    const char* const start = rest.data();
    if (!is_rule(take_plain_line(&rest))) continue;
    std::string_view behind = rest;
    TypeName type;
    if (const char* wrong = read_heading(take_plain_line(&behind), top, &type)) return wrong;
    if (type.name.empty()) continue;
    std::string_view& before = definitions_.back().text;
    before = before.substr(0, static_cast<size_t>(start - before.data()));
    definitions_.push_back({type, behind});
    rest = behind;
  }
  // A text that begins with a rule has its own type behind one; but a message without fields has no text.
  const bool is_behind = std::any_of(definitions_.begin() + 1, definitions_.end(),
                                     [&top](const Definition& each) { return each.type == top; });
  if (is_blank(definitions_.front().text) && (is_behind || top.name_space != "msg"))
    definitions_.erase(definitions_.begin());
  return nullptr;
}

// Leaves one definition of each type: recorders may write one twice, or an empty one before another.
const char* Definitions::merge() {
  heap_sort(definitions_.begin(), definitions_.end(), [](const Definition& a, const Definition& b) {
    return a.type == b.type ? a.text.data() < b.text.data() : a.type < b.type;
  });
  if (definitions_.empty()) return nullptr;
  auto kept = definitions_.begin();
  for (auto each = kept + 1; each != definitions_.end(); ++each) {
    if (!(each->type == kept->type)) {
      *++kept = *each;
    } else if (is_blank(kept->text)) {
      *kept = *each;
    } else if (!is_blank(each->text) && !has_same_words(kept->text, each->text)) {
      return "the text defines a type twice, not in the same way";
    }
  }
  definitions_.erase(kept + 1, definitions_.end());
  return definitions_.size() > kMaximumDefinitions ? "the text has more than 10000 definitions" : nullptr;
}

const char* Definitions::read(std::string_view text, const TypeName& top) {
  if (const char* wrong = split(text, top)) return wrong;
  if (const char* wrong = merge()) return wrong;
  for (const std::string_view name : {"Duration", "Time"}) {  // they are the same in all of ROS 2
    const TypeName type{"builtin_interfaces", "msg", name};
    if (find(type) == nullptr) definitions_.insert(place_of(type), {type, "int32 sec\nuint32 nanosec"});
  }
  return nullptr;
}

Definition* Definitions::find(const TypeName& type) {
  const auto place = place_of(type);
  return place != definitions_.end() && place->type == type ? &*place : nullptr;
}

std::vector<Definition>::iterator Definitions::place_of(const TypeName& type) {
  return std::lower_bound(definitions_.begin(), definitions_.end(), type,
                          [](const Definition& each, const TypeName& wanted) { return each.type < wanted; });
}

}  // namespace rosidl_proto
