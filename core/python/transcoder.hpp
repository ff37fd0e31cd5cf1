// The class `Transcoder` of the Python module: the messages of one type, one at a time and in batches.
#pragma once

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "batch.hpp"
#include "objects.hpp"

namespace rosidl_proto {

// From this size on, the time that it takes to give the interpreter lock away and back does not count.
constexpr uint64_t kLarge = 64 * 1024;

// Calls `add(input)` for each message that `ranges` finds in `buffer`.
template <class Add>
void add_ranges(Input buffer, const Buffer& ranges, Add add) {
  const Py_buffer& view = ranges.view();
  if (!has_numbers(view, 8))
    throw nb::type_error("`ranges` must be a contiguous buffer of 64-bit numbers, such as array('Q')");
  const auto* const places = static_cast<const uint8_t*>(view.buf);
  if (view.len % sizeof(Range) != 0)
    throw nb::value_error(
        "`ranges` has an odd number of places; give each message its first byte and the one after its last");
  for (Py_ssize_t at = 0; at < view.len; at += sizeof(Range)) {
    Range range;
    std::memcpy(&range, places + at, sizeof range);
    if (range.first > range.last || range.last > buffer.size) {
      const std::string number = std::to_string(static_cast<size_t>(at) / sizeof(Range));
      const std::string text = "message " + number + " is from byte " + std::to_string(range.first) + " to " +
                               std::to_string(range.last) + ", which is not in a buffer of " +
                               std::to_string(buffer.size) + " bytes";
      throw nb::value_error(text.c_str());
    }
    add(Input{buffer.data + range.first, range.last - range.first});
  }
}

class Transcoder {
 public:
  Transcoder(nb::bytes plan, std::string type_name, uint64_t size_limit)
      : type_name_(std::move(type_name)), size_limit_(size_limit) {
    const char* wrong = plan_.load(static_cast<const uint8_t*>(plan.data()), plan.size());
    if (wrong != nullptr) throw nb::value_error(wrong);
  }

  const std::string& type_name() const { return type_name_; }
  const Plan& plan() const { return plan_; }
  uint64_t size_limit() const { return size_limit_; }

  nb::object exception(const Error& error, nb::object batch_index) const {
    const std::string path = field_path(error, plan_), text = reason(error);
    return error_class("TranscodeError")(type_name_, path, error.offset, text, batch_index);
  }

  template <class Direction>
  nb::object transcode(nb::handle data) const {
    if (PyBytes_Check(data.ptr())) return transcode<Direction>(input_of(data));
    const Buffer buffer(data);
    return transcode<Direction>(buffer.input());
  }

  template <class Direction>
  nb::object transcode(Input input) const {
    if (input.size >= kLarge && !plan_.partial()) return transcode_large<Direction>(input);
    // Chosen fields are often among the first, and what follows makes no difference: then this is no large
    // message.
    Error error;
    nb::object result = transcode_small<Direction>({input.data, std::min(input.size, kLarge)}, error);
    if (result.is_valid()) return result;
    if (input.size < kLarge) fail(error);
    return transcode_large<Direction>(input);
  }

  // Returns the buffer with the results, how much of it they take, their ranges, and the errors by index.
  template <class Direction>
  nb::tuple transcode_batch(nb::handle messages, nb::handle ranges, size_t threads, nb::handle into) const {
    Batch<Direction> batch(plan_, size_limit_);
    // Whatever is taken here is kept, and what can change its size is locked, until the end.
    std::optional<Buffer> whole;
    std::optional<HeldMessages> held;
    if (!ranges.is_none()) {
      const Buffer places(ranges, PyBUF_FORMAT | PyBUF_C_CONTIGUOUS);
      batch.reserve(static_cast<size_t>(places.view().len) / sizeof(Range));
      add_ranges(whole.emplace(messages).input(), places, [&](Input input) { batch.add(input); });
    } else {
      held.emplace(messages, "a batch must be a sequence of messages");
      batch.reserve(held->inputs().size());
      for (const Input each : held->inputs()) batch.add(each);
    }
    nb::object places = new_bytes(batch.size() * sizeof(Range));
    auto* const found = reinterpret_cast<Range*>(PyBytes_AS_STRING(places.ptr()));
    nb::object result = into.is_none() ? new_bytearray(0) : nb::borrow(into);
    uint64_t size;
    for (;;) {
      const Buffer buffer(result, PyBUF_WRITABLE);
      const Output output = buffer.output();
      for (size_t i = 0; i < batch.size(); ++i) {
        if (overlap(batch[i], output))
          throw nb::value_error("`into` is memory of the messages; give other memory");
      }
      {
        nb::gil_scoped_release release;
        size = batch.run(threads, output, found);
      }
      if (size <= output.size) break;
      if (!into.is_none()) throw_too_small(size, output.size);
      result = new_bytearray(size);  // The first time was to find the size.
    }
    nb::dict errors;
    for (size_t i = 0; i < batch.size(); ++i) {
      if (found[i].missing()) errors[nb::int_(i)] = exception(batch.error(i), nb::int_(i));
    }
    return nb::make_tuple(result, size, places, errors);
  }

 private:
  // Transcodes what takes less time than giving the interpreter lock away; if there is an error, nothing is
  // returned.
  template <class Direction>
  nb::object transcode_small(Input input, Error& error) const {
    typename Direction::Scratch scratch(plan_);
    uint64_t size = 0;
    if (!Direction::measure(plan_, input, size_limit_, scratch, &size, error)) return {};
    nb::object result = new_bytes(size);
    if (!Direction::write(plan_, input, scratch, 0, output_of(result, size), error)) return {};
    return result;
  }

  template <class Direction>
  nb::object transcode_large(Input input) const {
    Error error;
    typename Direction::Scratch scratch(plan_);
    uint64_t size = 0;
    bool good;
    {
      nb::gil_scoped_release release;
      good = Direction::measure(plan_, input, size_limit_, scratch, &size, error);
    }
    if (!good) fail(error);
    nb::object result = new_bytes(size);
    const Output output = output_of(result, size);
    {
      nb::gil_scoped_release release;
      good = Direction::write(plan_, input, scratch, 0, output, error);
    }
    if (!good) fail(error);
    return result;
  }

  static bool overlap(Input input, Output output) {
    const auto a = reinterpret_cast<uintptr_t>(input.data), b = reinterpret_cast<uintptr_t>(output.data);
    return a < b + output.size && b < a + input.size;
  }

  [[noreturn]] static void throw_too_small(uint64_t needed, uint64_t size) {
    raise(error_class("BufferTooSmallError")(needed, size));
  }

  [[noreturn]] void fail(const Error& error) const { raise(exception(error, nb::none())); }

  Plan plan_;
  std::string type_name_;
  uint64_t size_limit_;
};

}  // namespace rosidl_proto
