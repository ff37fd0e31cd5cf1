// The columns of a plan as Python has them, except that times are messages like others.
#pragma once

#include <vector>

#include "rosidl_adapter_proto/columns.hpp"

namespace rosidl_proto {

inline void add_plain_layout(const Plan& plan, const Message& message, size_t limit,
                             std::vector<uint8_t>& layout) {
  const auto add = [&](ColumnKind kind) { layout.push_back(static_cast<uint8_t>(kind)); };
  for (const Operation* op = plan.begin(message); op != plan.end(message) && layout.size() < limit; ++op) {
    if (op->reading == Reading::Skip) continue;
    const bool single = op->shape == Shape::Single;
    visit(op->cdr, [&](auto form) {
      using F = decltype(form);
      if (!F::kIsNumber && !single) add(ColumnKind::List);
      if constexpr (F::kIsNumber) {
        add(single ? ColumnKind::Number : ColumnKind::Numbers);
      } else if constexpr (F::kIsString) {
        add(ColumnKind::Text);
      } else {
        add(ColumnKind::Struct);
        add_plain_layout(plan, plan.message(op->message), limit, layout);
      }
    });
  }
}

// Columns can be many more than operations: what has `limit` of them or more is not complete.
inline std::vector<uint8_t> plain_layout(const Plan& plan, size_t limit) {
  std::vector<uint8_t> layout;
  add_plain_layout(plan, plan.root(), limit, layout);
  return layout;
}

}  // namespace rosidl_proto
