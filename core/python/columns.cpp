#include "columns.hpp"

#include <nanobind/stl/string.h>

#include <mutex>
#include <new>
#include <optional>
#include <rosidl_adapter_proto/columns.hpp>
#include <vector>

#include "transcoder.hpp"

namespace rosidl_proto {
namespace {

// Fills columns with messages of one type; one thread at a time does.
class ColumnFiller {
 public:
  ColumnFiller(nb::handle_t<Transcoder> transcoder, nb::bytes layout, uint8_t serialization)
      : serialization_(static_cast<Serialization>(serialization)),
        owner_(nb::borrow(transcoder)),
        transcoder_(object_of<Transcoder>(transcoder.ptr())) {
    if (serialization >= kSerializations) throw nb::value_error("there is no such serialization");
    const char* const wrong =
        columns_.load(transcoder_.plan(), static_cast<const uint8_t*>(layout.data()), layout.size());
    if (wrong != nullptr) throw nb::value_error(wrong);
  }

  uint64_t rows() const { return columns_.rows(); }

  // Appends messages from `first` on until there are so many rows or bytes; returns the index of the next
  // message.
  size_t append(nb::handle messages, nb::handle ranges, size_t first, uint64_t maximum_rows,
                uint64_t maximum_bytes) {
    std::optional<Buffer> whole;
    std::optional<HeldMessages> held;
    std::vector<Input> places;
    if (!ranges.is_none()) {
      const Buffer numbers(ranges, PyBUF_FORMAT | PyBUF_C_CONTIGUOUS);
      add_ranges(whole.emplace(messages).input(), numbers, [&](Input input) { places.push_back(input); });
    } else {
      held.emplace(messages, "messages must be a sequence of messages");
    }
    const std::vector<Input>& inputs = held ? held->inputs() : places;
    Error error;
    size_t next = first;
    bool good = true;
    {
      nb::gil_scoped_release release;
      const std::lock_guard<std::mutex> lock(mutex_);
      while (next < inputs.size() && columns_.rows() < maximum_rows && columns_.bytes() < maximum_bytes) {
        good = columns_.append(serialization_, inputs[next], error);
        if (!good) break;
        ++next;
      }
      // What does not fit is the first row of the next columns; alone, it is an error.
      if (error.reason == Reason::ColumnsFull && columns_.rows() != 0) good = true;
    }
    if (!good) raise(transcoder_.exception(error, nb::int_(next)));
    return next;
  }

  // Returns how many rows there are, and of each column its rows and its buffers of offsets and values.
  nb::tuple take() {
    std::vector<Column> columns;
    uint64_t rows;
    {
      nb::gil_scoped_release release;
      const std::lock_guard<std::mutex> lock(mutex_);
      rows = columns_.rows();
      if (!columns_.take(&columns)) throw std::bad_alloc();
    }
    nb::list result;
    for (Column& each : columns) {
      nb::object offsets = each.fixed() ? nb::none() : nb::cast(std::move(each.offsets));
      result.append(nb::make_tuple(each.count, offsets, nb::cast(std::move(each.values))));
    }
    return nb::make_tuple(rows, result);
  }

 private:
  const Serialization serialization_;
  nb::object owner_;
  const Transcoder& transcoder_;  // of the owner
  std::mutex mutex_;
  Columns columns_;
};

}  // namespace

void define_columns(nb::module_& module) {
  nb::class_<ColumnFiller>(module, "ColumnFiller")
      .def(nb::init<nb::handle_t<Transcoder>, nb::bytes, uint8_t>(), nb::arg("transcoder"), nb::arg("layout"),
           nb::arg("serialization"))
      .def_prop_ro("rows", &ColumnFiller::rows, "How many messages the columns have.")
      .def("append", &ColumnFiller::append, nb::arg("messages"), nb::arg("ranges").none(), nb::arg("first"),
           nb::arg("maximum_rows"), nb::arg("maximum_bytes"))
      .def("take", &ColumnFiller::take);
}

}  // namespace rosidl_proto
