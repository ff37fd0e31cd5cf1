#include "rosidl_adapter_proto/columns.hpp"

#include <algorithm>
#include <exception>

#include "column_sink.hpp"
#include "read_message.hpp"

namespace rosidl_proto {
namespace {

constexpr const char* kWrong = "the layout has columns that are not those of the plan";
constexpr const char* kNoMemory = "there is not enough memory for the columns";

bool is_time(const Plan& plan, const Message& message) {
  const Operation* const op = plan.begin(message);
  return message.count == 2 && op[0].reading == Reading::One && op[0].cdr == CdrForm::Int32 &&
         op[1].reading == Reading::One && op[1].cdr == CdrForm::Uint32;
}

// Arrow has booleans as bits, the lowest of a byte first.
void pack_bits(Memory& values) {
  uint8_t* const data = values.data();
  const uint64_t count = values.size(), whole = count / 8;
  for (uint64_t i = 0; i < whole; ++i) {
    // Gathers the lowest bit of each of 8 bytes in the highest byte.
    data[i] = static_cast<uint8_t>(load_little<uint64_t>(data + i * 8) * 0x0102040810204080u >> 56);
  }
  if (whole * 8 == count) {
    values.cut(whole);
    return;
  }
  uint8_t last = 0;
  for (uint64_t i = whole * 8; i < count; ++i) last = static_cast<uint8_t>(last | data[i] << (i & 7));
  data[whole] = last;
  values.cut(whole + 1);
}

// Gives back what a row took that was too large in the end.
void shrink(Memory& memory) {
  if (memory.size() < memory.capacity() / 2) memory.grow(memory.size() + 1);
}

// Counts the rows of a column and of those inside of it; returns the next one.
Column* finish(Column* column, uint64_t count) {
  column->count = count;
  const Column* const last = column + column->span;
  const uint64_t inner =
      column->fixed() ? count * column->length : load_little<uint32_t>(column->offsets.data() + count * 4);
  for (Column* each = column + 1; each != last;) each = finish(each, inner);
  if (column->boolean) pack_bits(column->values);
  shrink(column->offsets);
  shrink(column->values);
  return column + column->span;
}

}  // namespace

const char* Columns::load(const Plan& plan, const uint8_t* layout, size_t size) noexcept {
  try {
    plan_ = &plan;
    fields_ = std::make_unique<Fields>(plan);
    if (fields_->slots() == nullptr) return kNoMemory;
    columns_.reserve(size + 1);
    const uint8_t* const end = layout + size;
    if (const char* wrong = add(plan.root(), &layout, end)) return wrong;
    if (layout != end) return kWrong;
    find_variable(0, columns_.size(), 1);
    push(ColumnKind::Struct, 0, 1);
    return prepare(nullptr) ? nullptr : kNoMemory;
  } catch (const std::exception&) {
    return kNoMemory;
  }
}

Column& Columns::push(ColumnKind kind, uint32_t width, uint32_t length) {
  Column column;
  column.kind = kind;
  column.width = width;
  column.length = length;
  columns_.push_back(std::move(column));
  return columns_.back();
}

const char* Columns::add(const Message& message, const uint8_t** layout, const uint8_t* end) {
  for (const Operation* op = plan_->begin(message); op != plan_->end(message); ++op) {
    if (op->reading == Reading::Skip) continue;
    if (const char* wrong = add_field(*op, layout, end)) return wrong;
  }
  return nullptr;
}

const char* Columns::add_field(const Operation& op, const uint8_t** layout, const uint8_t* end) {
  const bool numbers = visit(op.cdr, [](auto form) { return decltype(form)::kIsNumber; });
  if (op.shape == Shape::Single || numbers) return add_element(op, layout, end);
  if (*layout == end || *(*layout)++ != static_cast<uint8_t>(ColumnKind::List)) return kWrong;
  const size_t index = columns_.size();
  push(ColumnKind::List, 0, op.shape == Shape::Array ? op.count : Column::kVariable);
  const char* const wrong = add_element(op, layout, end);
  Column& list = columns_[index];
  list.span = static_cast<uint32_t>(columns_.size() - index);
  list.hollow = std::all_of(columns_.begin() + static_cast<std::ptrdiff_t>(index), columns_.end(),
                            [](const Column& each) { return each.fixed() && each.width == 0; });
  return wrong;
}

const char* Columns::add_element(const Operation& op, const uint8_t** layout, const uint8_t* end) {
  if (*layout == end) return kWrong;
  const auto kind = static_cast<ColumnKind>(*(*layout)++);
  return visit(op.cdr, [&](auto form) -> const char* {
    using F = decltype(form);
    if constexpr (F::kIsNumber) {
      const bool single = op.shape == Shape::Single;
      if (kind != (single ? ColumnKind::Number : ColumnKind::Numbers)) return kWrong;
      const uint32_t length = single ? 1 : op.shape == Shape::Array ? op.count : Column::kVariable;
      push(kind, F::kSize, length).boolean = op.cdr == CdrForm::Boolean;
      return nullptr;
    } else if constexpr (F::kIsString) {
      if (kind != ColumnKind::Text) return kWrong;
      push(kind, 1, Column::kVariable);
      return nullptr;
    } else {
      const Message& message = plan_->message(op.message);
      if (kind == ColumnKind::Time && is_time(*plan_, message)) {
        push(kind, sizeof(int64_t), 1);
        return nullptr;
      }
      if (kind != ColumnKind::Struct) return kWrong;
      const size_t index = columns_.size();
      push(kind, 0, 1);
      const char* const wrong = add(message, layout, end);
      columns_[index].span = static_cast<uint32_t>(columns_.size() - index);
      return wrong;
    }
  });
}

// Finds out which columns grow with the number of rows alone; `values` of a row are in each of these.
void Columns::find_variable(size_t first, size_t last, uint64_t values) {
  for (size_t i = first; i != last; i += columns_[i].span) {
    const Column& column = columns_[i];
    const size_t end = i + column.span;
    if (column.fixed()) {
      row_bytes_ += values * column.length * column.width;
      find_variable(i + 1, end, values * column.length);
    } else {
      for (size_t each = i; each != end; ++each) variable_.push_back(static_cast<uint32_t>(each));
    }
  }
}

// Takes memory for the first rows: as much as a batch before this one took, if there is so much.
bool Columns::prepare(const std::vector<Column>* before) {
  rows_ = room_.taken = 0;
  for (size_t i = 0; i < columns_.size(); ++i) {
    Column& column = columns_[i];
    const Column* const model = before == nullptr ? nullptr : &(*before)[i];
    const uint64_t expected = model == nullptr ? 0 : model->values.size();
    // A place to begin with; what could be more comes when it is needed.
    if (column.width != 0 && grow(column.values, expected, room_) != Reason::None &&
        grow(column.values, 0, room_) != Reason::None)
      return false;
    if (column.fixed()) continue;
    const uint64_t size = model == nullptr ? sizeof(uint32_t) : model->offsets.size();
    if (grow(column.offsets, size, room_) != Reason::None) return false;
    store_little(column.offsets.data(), uint32_t{0});
    column.offsets.cut(sizeof(uint32_t));
  }
  return true;
}

bool Columns::append(Serialization serialization, Input message, Error& error) noexcept {
  if (run(serialization, message, error)) {
    ++rows_;
    return true;
  }
  Column* const last = columns_.data() + columns_.size() - 1;
  for (Column* each = columns_.data(); each != last;) each = cut(each, rows_);
  return false;
}

bool Columns::run(Serialization serialization, Input message, Error& error) {
  Column* at = columns_.data();
  return read_message(*plan_, serialization, message, ColumnSink(room_), *fields_, &at, error);
}

// Leaves the first `count` rows of a column and of those inside of it; returns the next one.
Column* Columns::cut(Column* column, uint64_t count) {
  const Column* const last = column + column->span;
  uint64_t inner = count * column->length;
  if (!column->fixed()) {
    inner = load_little<uint32_t>(column->offsets.data() + count * sizeof(uint32_t));
    column->offsets.cut((count + 1) * sizeof(uint32_t));
  }
  column->values.cut(inner * column->width);
  for (Column* each = column + 1; each != last;) each = cut(each, inner);
  return column + column->span;
}

bool Columns::take(std::vector<Column>* taken) noexcept {
  std::vector<Column> fresh;
  try {
    fresh.reserve(columns_.size());
    for (const Column& each : columns_) fresh.push_back(each.empty());
  } catch (const std::exception&) {
    return false;
  }
  const uint64_t rows = rows_, room = room_.taken;
  columns_.swap(fresh);
  if (!prepare(&fresh)) {
    columns_.swap(fresh);
    rows_ = rows;
    room_.taken = room;
    return false;
  }
  fresh.pop_back();
  for (Column* each = fresh.data(); each != fresh.data() + fresh.size();) each = finish(each, rows);
  taken->swap(fresh);
  return true;
}

}  // namespace rosidl_proto
