// The Python module: buffers in, bytes out, errors as exceptions, and the interpreter lock. Everything else
// is in the core, which knows nothing of Python.
#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>

#include <algorithm>
#include <atomic>
#include <deque>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "../packed_fields.hpp"
#include "../transcode.hpp"

namespace nb = nanobind;

namespace rosidl_proto {
namespace {

// From this size on, the time that it takes to give the interpreter lock away and back does not count.
constexpr uint64_t kLarge = 64 * 1024;

// Messages that one thread takes at a time in a batch.
constexpr size_t kBlock = 64;

// The bytes of any contiguous Python buffer, kept alive and, if it can change its size, locked.
class Buffer {
 public:
  explicit Buffer(PyObject* object) {
    if (PyBytes_Check(object)) {
      Py_INCREF(object);
      bytes_ = object;
      input_ = {reinterpret_cast<const uint8_t*>(PyBytes_AS_STRING(object)),
                static_cast<uint64_t>(PyBytes_GET_SIZE(object))};
    } else {
      if (PyObject_GetBuffer(object, &view_, PyBUF_SIMPLE) != 0) throw nb::python_error();
      input_ = {static_cast<const uint8_t*>(view_.buf), static_cast<uint64_t>(view_.len)};
    }
  }
  Buffer(const Buffer&) = delete;
  Buffer(Buffer&& other) noexcept : bytes_(other.bytes_), view_(other.view_), input_(other.input_) {
    other.bytes_ = nullptr;
    other.view_.obj = nullptr;
  }
  Buffer& operator=(const Buffer&) = delete;
  ~Buffer() {
    Py_XDECREF(bytes_);
    if (view_.obj != nullptr) PyBuffer_Release(&view_);
  }

  Input input() const { return input_; }

 private:
  PyObject* bytes_ = nullptr;
  Py_buffer view_{};
  Input input_{};
};

// The two directions behind one interface. What a direction keeps between measuring and writing can be shared
// by many messages; a mark says where in it those of one message begin.
struct CdrToProto {
  struct Scratch {
    explicit Scratch(const Plan&) {}
    uint64_t mark() const { return lengths.size(); }
    Lengths lengths;
  };

  static bool measure(const Plan& plan, Input input, uint64_t limit, Scratch& scratch, uint64_t* size,
                      Error& error) {
    return measure_cdr_to_proto(plan, input, limit, scratch.lengths, size, error);
  }
  static bool write(const Plan& plan, Input input, Scratch& scratch, uint64_t mark, Output output,
                    Error& error) {
    return write_cdr_to_proto(plan, input, scratch.lengths, mark, output, error);
  }
};

struct ProtoToCdr {
  struct Scratch {
    explicit Scratch(const Plan& plan) : fields(plan) {}
    static uint64_t mark() { return 0; }
    Fields fields;
  };

  static bool measure(const Plan& plan, Input input, uint64_t limit, Scratch& scratch, uint64_t* size,
                      Error& error) {
    return measure_proto_to_cdr(plan, input, limit, scratch.fields, size, error);
  }
  static bool write(const Plan& plan, Input input, Scratch& scratch, uint64_t, Output output, Error& error) {
    return write_proto_to_cdr(plan, input, scratch.fields, output, error);
  }
};

nb::object new_bytes(uint64_t size) {
  PyObject* const bytes = PyBytes_FromStringAndSize(nullptr, static_cast<Py_ssize_t>(size));
  if (bytes == nullptr) throw nb::python_error();
  return nb::steal(bytes);
}

Output output_of(nb::handle bytes, uint64_t size) {
  return {reinterpret_cast<uint8_t*>(PyBytes_AS_STRING(bytes.ptr())), size};
}

// Calls `work(i)` for each i below `count`, in order of i, on up to `threads` threads. `work` does not throw.
template <class Work>
void run_on_threads(size_t threads, size_t count, Work work) {
  std::atomic<size_t> next{0};
  const auto loop = [&] {
    for (size_t i = next++; i < count; i = next++) work(i);
  };
  std::vector<std::thread> others;
  try {
    for (size_t i = 1; i < std::min(threads, count); ++i) others.emplace_back(loop);
  } catch (const std::exception&) {
    // The system has no more threads: those that there are do all of it.
  }
  loop();
  for (std::thread& each : others) each.join();
}

class Transcoder {
 public:
  Transcoder(nb::bytes plan, std::string type_name, uint64_t size_limit)
      : type_name_(std::move(type_name)), size_limit_(size_limit) {
    const char* wrong = plan_.load(static_cast<const uint8_t*>(plan.data()), plan.size());
    if (wrong != nullptr) throw nb::value_error(wrong);
  }

  const std::string& type_name() const { return type_name_; }

  template <class Direction>
  nb::object transcode(nb::handle data) const {
    const Buffer buffer(data.ptr());
    const Input input = buffer.input();
    Error error;
    typename Direction::Scratch scratch(plan_);
    uint64_t size = 0;
    if (input.size < kLarge) {
      if (!Direction::measure(plan_, input, size_limit_, scratch, &size, error)) fail(error, nb::none());
      nb::object result = new_bytes(size);
      if (!Direction::write(plan_, input, scratch, 0, output_of(result, size), error))
        fail(error, nb::none());
      return result;
    }
    bool good;
    {
      nb::gil_scoped_release release;
      good = Direction::measure(plan_, input, size_limit_, scratch, &size, error);
    }
    if (!good) fail(error, nb::none());
    nb::object result = new_bytes(size);
    const Output output = output_of(result, size);
    {
      nb::gil_scoped_release release;
      good = Direction::write(plan_, input, scratch, 0, output, error);
    }
    if (!good) fail(error, nb::none());
    return result;
  }

  template <class Direction>
  nb::list transcode_batch(nb::handle messages, size_t threads) const {
    if (threads == 0) throw nb::value_error("threads must be 1 or more");
    const nb::object fast =
        nb::steal(PySequence_Fast(messages.ptr(), "a batch must be a sequence of messages"));
    if (!fast.is_valid()) throw nb::python_error();

    struct Job {
      Buffer buffer;
      uint64_t size = 0, mark = 0;
      Output output{};
    };
    std::vector<Job> jobs;
    // Taking a buffer can run Python code, which can change the list: so its length is asked for each time.
    jobs.reserve(static_cast<size_t>(PySequence_Fast_GET_SIZE(fast.ptr())));
    for (Py_ssize_t i = 0; i < PySequence_Fast_GET_SIZE(fast.ptr()); ++i) {
      const nb::object item = nb::borrow(PySequence_Fast_GET_ITEM(fast.ptr(), i));
      jobs.push_back(Job{Buffer(item.ptr())});
    }
    const size_t blocks = (jobs.size() + kBlock - 1) / kBlock;
    std::deque<typename Direction::Scratch> scratches;
    for (size_t i = 0; i < blocks; ++i) scratches.emplace_back(plan_);
    Failure failure;

    // Calls `step(job, scratch, error)` for each job, and keeps the error of the first job that fails.
    const auto run = [&](auto step) {
      nb::gil_scoped_release release;
      run_on_threads(threads, blocks, [&](size_t block) {
        for (size_t i = block * kBlock; i < std::min(jobs.size(), (block + 1) * kBlock); ++i) {
          Error error;
          if (i < failure.index && !step(jobs[i], scratches[block], error)) failure.keep(i, error);
        }
      });
    };
    run([&](Job& job, auto& scratch, Error& error) {
      job.mark = scratch.mark();
      return Direction::measure(plan_, job.buffer.input(), size_limit_, scratch, &job.size, error);
    });
    failure.check(*this);
    nb::list results;
    for (Job& job : jobs) {
      const nb::object result = new_bytes(job.size);
      job.output = output_of(result, job.size);
      results.append(result);
    }
    run([&](Job& job, auto& scratch, Error& error) {
      return Direction::write(plan_, job.buffer.input(), scratch, job.mark, job.output, error);
    });
    failure.check(*this);
    return results;
  }

 private:
  struct Failure {
    std::atomic<size_t> index{SIZE_MAX};
    Error error;
    std::mutex mutex;

    void keep(size_t i, const Error& reason) {
      const std::lock_guard<std::mutex> guard(mutex);
      if (i >= index) return;
      index = i;
      error = reason;
    }

    void check(const Transcoder& transcoder) const {
      if (index != SIZE_MAX) transcoder.fail(error, nb::int_(index.load()));
    }
  };

  [[noreturn]] void fail(const Error& error, nb::object batch_index) const {
    const std::string path = field_path(error, plan_), text = reason(error);
    const nb::object type =
        nb::module_::import_("rosidl_adapter_proto.transcode.error").attr("TranscodeError");
    const nb::object exception = type(type_name_, path, error.offset, text, batch_index);
    PyErr_SetObject(type.ptr(), exception.ptr());
    throw nb::python_error();
  }

  Plan plan_;
  std::string type_name_;
  uint64_t size_limit_;
};

// The two directions from and to message objects. Python would do it in two lines, at twice the cost for small
// messages.
class Codec {
 public:
  Codec(nb::handle_t<Transcoder> transcoder, nb::object message_class)
      : owner_(nb::borrow(transcoder)),
        transcoder_(nb::cast<const Transcoder&>(transcoder)),
        message_class_(std::move(message_class)),
        from_string_(message_class_.attr("FromString")),
        // The method of the class: protobuf looks every name up among the fields of a message first.
        serialize_(message_class_.attr("SerializeToString")) {}

  nb::object to_cdr(nb::handle self, nb::handle message) const {
    if (reinterpret_cast<PyObject*>(Py_TYPE(message.ptr())) != message_class_.ptr()) self.attr("_refuse")(message);
    return transcoder_.transcode<ProtoToCdr>(call(serialize_, message));
  }

  nb::object from_cdr(nb::handle, nb::handle data) const {
    return call(from_string_, transcoder_.transcode<CdrToProto>(data));
  }

 private:
  static nb::object call(nb::handle function, nb::handle argument) {
    nb::object result = nb::steal(PyObject_CallOneArg(function.ptr(), argument.ptr()));
    if (!result.is_valid()) throw nb::python_error();
    return result;
  }

  nb::object owner_;
  const Transcoder& transcoder_;  // of the owner
  nb::object message_class_, from_string_, serialize_;
};

nb::tuple packed_fields(nb::handle serialize, nb::handle object, nb::args numbers) {
  const nb::object serialized = nb::steal(PyObject_CallOneArg(serialize.ptr(), object.ptr()));
  if (!serialized.is_valid()) throw nb::python_error();
  const auto message = nb::cast<nb::bytes>(serialized);
  std::vector<uint64_t> wanted(numbers.size());
  std::vector<Slice> slices(numbers.size());
  for (size_t i = 0; i < wanted.size(); ++i) wanted[i] = nb::cast<uint64_t>(numbers[i]);
  const auto* begin = static_cast<const uint8_t*>(message.data());
  if (!find_packed_fields(begin, begin + message.size(), wanted.data(), wanted.size(), slices.data()))
    throw nb::value_error("not a message as protobuf serializes it");
  nb::object result = nb::steal(PyTuple_New(static_cast<Py_ssize_t>(slices.size())));
  if (!result.is_valid()) throw nb::python_error();
  for (size_t i = 0; i < slices.size(); ++i) {
    PyObject* bytes = PyBytes_FromStringAndSize(reinterpret_cast<const char*>(slices[i].data),
                                                static_cast<Py_ssize_t>(slices[i].size));
    if (bytes == nullptr) throw nb::python_error();
    PyTuple_SET_ITEM(result.ptr(), static_cast<Py_ssize_t>(i), bytes);
  }
  return nb::borrow<nb::tuple>(result);
}

// The object behind `self`. It is missing where a class derives from ours and does not call its `__init__`.
template <class T>
const T& self_as(PyObject* self) {
  if (!nb::inst_ready(self)) throw nb::type_error("__init__ of the base class has not been called");
  return *nb::inst_ptr<T>(self);
}

// Runs C++ that CPython calls: what it throws becomes the exception of Python.
template <class Function>
PyObject* called_from_python(Function function) noexcept {
  try {
    return function().release().ptr();
  } catch (nb::python_error& error) {
    error.restore();
  } catch (const nb::builtin_exception& error) {
    PyErr_SetString(PyExc_TypeError, error.what());
  } catch (const std::bad_alloc&) {
    PyErr_NoMemory();
  } catch (const std::exception& error) {
    PyErr_SetString(PyExc_RuntimeError, error.what());
  }
  return nullptr;
}

template <class Direction>
PyObject* transcode(PyObject* self, PyObject* data) {
  return called_from_python([&] { return self_as<Transcoder>(self).transcode<Direction>(data); });
}

PyObject* codec_to_cdr(PyObject* self, PyObject* message) {
  return called_from_python([&] { return self_as<Codec>(self).to_cdr(self, message); });
}

PyObject* codec_from_cdr(PyObject* self, PyObject* data) {
  return called_from_python([&] { return self_as<Codec>(self).from_cdr(self, data); });
}

// Methods as CPython itself has them: the cheapest to call, and unlike those of nanobind they have signatures
// for `inspect` and can be pickled.
PyMethodDef transcoder_methods[] = {
    {"cdr_to_proto", transcode<CdrToProto>, METH_O,
     "cdr_to_proto($self, data, /)\n--\n\nTurn a serialized ROS message into a serialized protobuf message."},
    {"proto_to_cdr", transcode<ProtoToCdr>, METH_O,
     "proto_to_cdr($self, data, /)\n--\n\nTurn a serialized protobuf message into a serialized ROS message."},
    {nullptr, nullptr, 0, nullptr}};
PyType_Slot transcoder_slots[] = {{Py_tp_methods, transcoder_methods}, {0, nullptr}};

PyMethodDef codec_methods[] = {
    {"to_cdr", codec_to_cdr, METH_O,
     "to_cdr($self, message, /)\n--\n\nTurn a protobuf message into a serialized ROS message."},
    {"from_cdr", codec_from_cdr, METH_O,
     "from_cdr($self, data, /)\n--\n\nTurn a serialized ROS message into a protobuf message."},
    {"__class_getitem__", Py_GenericAlias, METH_O | METH_CLASS, "Codec[MessageT] is Codec."},
    {nullptr, nullptr, 0, nullptr}};
PyType_Slot codec_slots[] = {{Py_tp_methods, codec_methods}, {0, nullptr}};

}  // namespace
}  // namespace rosidl_proto

NB_MODULE(_core, module) {
  using namespace rosidl_proto;
  module.doc() = "The native transcoder: CDR to protobuf and back.";
  // Transcoders live as long as the classes that hold them, which is as long as the interpreter.
  nb::set_leak_warnings(false);
  module.def("packed_fields", &packed_fields, nb::arg("serialize"), nb::arg("message"), nb::arg("numbers"),
             "Return the bytes of packed repeated fields of a message, by their numbers.");
  nb::class_<Transcoder>(module, "Transcoder", nb::type_slots(transcoder_slots))
      .def(nb::init<nb::bytes, std::string, uint64_t>(), nb::arg("plan"), nb::arg("type_name"),
           nb::arg("size_limit"))
      .def_prop_ro("type_name", &Transcoder::type_name, "The ROS type, such as `sensor_msgs/msg/Imu`.")
      .def("cdr_to_proto_batch", &Transcoder::transcode_batch<CdrToProto>, nb::arg("messages"),
           nb::arg("threads") = 1, "Do `cdr_to_proto` for each message, on a number of threads.")
      .def("proto_to_cdr_batch", &Transcoder::transcode_batch<ProtoToCdr>, nb::arg("messages"),
           nb::arg("threads") = 1, "Do `proto_to_cdr` for each message, on a number of threads.");
  nb::class_<Codec>(module, "Codec", nb::type_slots(codec_slots))
      .def(nb::init<nb::handle_t<Transcoder>, nb::object>(), nb::arg("transcoder"), nb::arg("message_class"));
}
