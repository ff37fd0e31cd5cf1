#include "records.hpp"

#include <nanobind/stl/string.h>

#include <rosidl_adapter_proto/convert.hpp>
#include <vector>

#include "memory_pool.hpp"
#include "transcoder.hpp"

namespace rosidl_proto {
namespace {

[[noreturn]] void fail(const RecordsError& error) {
  raise(error_class("RecordsError")(error.offset, reason(error)));
}

uint16_t topic_id_of(nb::handle number) {
  uint16_t id;
  if (nb::try_cast(number, id)) return id;
  const std::string text =
      std::string(nb::repr(number).c_str()) + " is no topic id; give a number from 0 to 65535";
  throw nb::value_error(text.c_str());
}

TimeRange times_of(uint64_t start, nb::handle end) {
  if (end.is_none()) return {start};
  return {start, nb::cast<uint64_t>(end), false};
}

// Columns of Python: numbers of one size, one for each message.

template <class T>
class Column {
 public:
  Column(nb::handle object, const char* name) : buffer_(object, PyBUF_FORMAT | PyBUF_C_CONTIGUOUS) {
    if (has_numbers(buffer_.view(), sizeof(T))) return;
    const std::string text = "`" + std::string(name) + "` must be a contiguous buffer of " +
                             std::to_string(8 * sizeof(T)) + "-bit numbers, such as array('" +
                             (sizeof(T) == 2   ? "H"
                              : sizeof(T) == 4 ? "I"
                                               : "Q") +
                             "')";
    throw nb::type_error(text.c_str());
  }

  void check_count(size_t count, const char* name) const {
    if (size() == count) return;
    const std::string text = "there are " + std::to_string(count) + " messages and " +
                             std::to_string(size()) + " numbers in `" + name + "`; give one for each";
    throw nb::value_error(text.c_str());
  }

  T operator[](size_t index) const { return load_little<T>(buffer_.input().data + index * sizeof(T)); }

 private:
  size_t size() const { return static_cast<size_t>(buffer_.view().len) / sizeof(T); }

  Buffer buffer_;
};

template <class T>
nb::object column(const std::vector<T>& numbers) {
  nb::object result = new_bytes(numbers.size() * sizeof(T));
  copy(reinterpret_cast<uint8_t*>(PyBytes_AS_STRING(result.ptr())),
       reinterpret_cast<const uint8_t*>(numbers.data()), numbers.size() * sizeof(T));
  return result;
}

// The messages of a chunk, in columns.
struct Columns {
  std::vector<uint16_t> topic_ids;
  std::vector<uint32_t> sequences;
  std::vector<uint64_t> log_times, publish_times;
  std::vector<Range> ranges;

  void add(const MessageRecord& message, Input chunk) {
    const auto first = static_cast<uint64_t>(message.data.data - chunk.data);
    topic_ids.push_back(message.topic_id);
    sequences.push_back(message.sequence);
    log_times.push_back(message.log_time);
    publish_times.push_back(message.publish_time);
    ranges.push_back({first, first + message.data.size});
  }
};

nb::tuple read_records(nb::handle data, nb::handle topic_ids, uint64_t start_time, nb::handle end_time) {
  const Buffer buffer(data);
  const Input chunk = buffer.input();
  const TimeRange times = times_of(start_time, end_time);
  ByTopic<bool> wanted;
  const bool all = topic_ids.is_none();
  if (!all) {
    for (const nb::handle each : topic_ids) wanted[topic_id_of(each)] = true;
  }
  Columns columns;
  std::vector<Record> others;
  RecordsError error;
  bool good;
  {
    nb::gil_scoped_release release;
    const auto add = [&](const MessageRecord& message) {
      if (!times.has(message.log_time)) return true;
      if (!all) {
        const bool* const found = wanted.find(message.topic_id);
        if (found == nullptr || !*found) return true;
      }
      columns.add(message, chunk);
      return true;
    };
    const auto add_other = [&](const Record& other) {
      if (others.size() == kMaximumOthers)
        return error.stop(RecordsReason::TooManyOthers, other.offset, kMaximumOthers);
      others.push_back(other);
      return true;
    };
    good = walk_records(chunk, error, add, add_other);
  }
  if (!good) fail(error);
  nb::list other_records;
  for (const Record& each : others)
    other_records.append(nb::make_tuple(each.opcode, each.offset + kRecordHeader,
                                        each.offset + kRecordHeader + each.content.size));
  return nb::make_tuple(column(columns.topic_ids), column(columns.sequences), column(columns.log_times),
                        column(columns.publish_times), column(columns.ranges), other_records);
}

nb::object pack_records(nb::handle topic_ids, nb::handle sequences, nb::handle log_times,
                        nb::handle publish_times, nb::handle messages) {
  const Column<uint16_t> ids(topic_ids, "topic_ids");
  const Column<uint32_t> numbers(sequences, "sequences");
  const Column<uint64_t> logged(log_times, "log_times"), published(publish_times, "publish_times");
  const HeldMessages held(messages, "messages must be a sequence of buffers");
  const std::vector<Input>& inputs = held.inputs();
  ids.check_count(inputs.size(), "topic_ids");
  numbers.check_count(inputs.size(), "sequences");
  logged.check_count(inputs.size(), "log_times");
  published.check_count(inputs.size(), "publish_times");
  uint64_t size = 0;
  RecordsError error;
  for (const Input& each : inputs) {
    const uint64_t record = kRecordHeader + kMessageFields + each.size;
    if (record > kMaximumChunk - size) {
      error.stop(RecordsReason::TooLarge, size, kMaximumChunk);
      fail(error);
    }
    size += record;
  }
  nb::object result = new_bytearray(size);
  auto* out = reinterpret_cast<uint8_t*>(PyByteArray_AS_STRING(result.ptr()));
  {
    nb::gil_scoped_release release;
    for (size_t i = 0; i < inputs.size(); ++i) {
      const MessageRecord message = {0, ids[i], numbers[i], logged[i], published[i], inputs[i]};
      out = put_message_header(out, message, message.topic_id, message.data.size);
      copy(out, message.data.data, message.data.size);
      out += message.data.size;
    }
  }
  return result;
}

nb::tuple index(nb::handle data) {
  const Buffer buffer(data);
  RecordIndex index;
  RecordsError error;
  bool good;
  {
    nb::gil_scoped_release release;
    good = index_records(buffer.input(), index, error);
  }
  if (!good) fail(error);
  nb::dict places, counts;
  for (const RecordIndex::Topic& topic : index.topics) {
    places[nb::int_(topic.id)] = topic.place;
    counts[nb::int_(topic.id)] = topic.message_count;
  }
  return nb::make_tuple(column(index.data), places, counts, index.start_time, index.end_time);
}

// Memory as Python reads it: any number of views, none of which can change it.
int view_memory(PyObject* self, Py_buffer* view, int flags) noexcept {
  static uint8_t nothing;
  if (!nb::inst_ready(self)) {
    PyErr_SetString(PyExc_BufferError, "only the native module makes memory");
    view->obj = nullptr;
    return -1;
  }
  const Memory& memory = *nb::inst_ptr<Memory>(self);
  void* const data = memory.size() == 0 ? &nothing : const_cast<uint8_t*>(memory.data());
  return PyBuffer_FillInfo(view, self, data, static_cast<Py_ssize_t>(memory.size()), 1, flags);
}

PyType_Slot memory_slots[] = {{Py_bf_getbuffer, reinterpret_cast<void*>(view_memory)}, {0, nullptr}};

// What a row of a route calls it: `Direction` and `_row` in records.py.
Treatment treatment_of(const std::string& name) {
  if (name == "leave_out") return Treatment::LeaveOut;
  if (name == "copy") return Treatment::Copy;
  if (name == "cdr_to_proto") return Treatment::CdrToProto;
  if (name == "proto_to_cdr") return Treatment::ProtoToCdr;
  if (name == "ros1_to_proto") return Treatment::Ros1ToProto;
  throw nb::value_error("a route has an unknown direction");
}

// The rows of routes come from Python: the topic id in the chunk, what to do, the topic id in the result, the
// transcoder, and the topic id of messages that cannot be transcoded.
class Converter {
 public:
  explicit Converter(nb::list rows) {
    for (const nb::handle row : rows) {
      const auto topic_id = topic_id_of(row[0]);
      Route route;
      route.treatment = treatment_of(nb::cast<std::string>(row[1]));
      route.topic_id = topic_id_of(row[2]);
      const nb::object owner = row[3], failed = row[4];
      if (!owner.is_none()) {
        const auto& transcoder = object_of<Transcoder>(owner.ptr());
        route.plan = &transcoder.plan();
        route.size_limit = transcoder.size_limit();
        transcoders_[topic_id] = &transcoder;
        owners_.append(owner);
      }
      route.copy_failed = !failed.is_none();
      if (route.copy_failed) route.failed_topic_id = topic_id_of(failed);
      converter_.add(topic_id, route);
    }
  }

  // Returns the result, the number of its messages, how many messages of each topic failed, and of the first
  // of those topic id, log time, sequence, index and error.
  nb::tuple convert(nb::handle data, uint64_t start_time, nb::handle end_time) const {
    const Buffer buffer(data);
    const TimeRange times = times_of(start_time, end_time);
    ConvertedChunk result;
    result.data = pool_->take();
    RecordsError error;
    bool good;
    {
      nb::gil_scoped_release release;
      good = converter_.convert(buffer.input(), times, result, error);
    }
    nb::object memory = nb::cast(PooledMemory(std::move(result.data), pool_));
    if (!good) fail(error);
    nb::dict failure_counts;
    result.failure_counts.each([&](uint16_t topic_id, uint64_t count) {
      if (count != 0) failure_counts[nb::int_(topic_id)] = count;
    });
    nb::list failures;
    for (const FailedMessage& failed : result.failures) {
      const MessageRecord& message = failed.message;
      const Transcoder& transcoder = **transcoders_.find(message.topic_id);
      failures.append(nb::make_tuple(message.topic_id, message.log_time, message.sequence, failed.index,
                                     transcoder.exception(converter_.error(message), nb::none())));
    }
    return nb::make_tuple(memory, result.message_count, failure_counts, failures);
  }

 private:
  RecordConverter converter_;
  std::shared_ptr<MemoryPool> pool_ = std::make_shared<MemoryPool>();
  ByTopic<const Transcoder*> transcoders_;  // of the owners
  nb::list owners_;
};

}  // namespace

void define_records(nb::module_& module) {
  module.def("read_records", &read_records, nb::arg(), nb::arg().none(), nb::arg(), nb::arg().none());
  module.def("pack_records", &pack_records, nb::arg("topic_ids"), nb::arg("sequences"), nb::arg("log_times"),
             nb::arg("publish_times"), nb::arg("messages"),
             "Return message records, one after the other, as they stand in a chunk.");
  module.def("index_records", &index, nb::arg());
  module.attr("KEPT_FAILURES") = kKeptFailures;
  nb::class_<Memory>(module, "Memory", nb::type_slots(memory_slots));
  nb::class_<PooledMemory, Memory>(module, "PooledMemory");
  nb::class_<Converter>(module, "RecordConverter")
      .def(nb::init<nb::list>(), nb::arg("routes"))
      .def("_convert", &Converter::convert, nb::arg(), nb::arg(), nb::arg().none());
}

}  // namespace rosidl_proto
