// The Python module: buffers in, bytes out, errors as exceptions, and the interpreter lock. Everything else
// is in the core, which knows nothing of Python.
#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>

#include <algorithm>
#include <cstring>
#include <deque>
#include <rosidl_adapter_proto/packed_fields.hpp>
#include <string>
#include <vector>

#include "batch.hpp"

namespace nb = nanobind;

namespace rosidl_proto {
namespace {

// From this size on, the time that it takes to give the interpreter lock away and back does not count.
constexpr uint64_t kLarge = 64 * 1024;

// So many choices of fields a codec remembers.
constexpr size_t kMaximumChoices = 64;

// The bytes of any contiguous Python buffer, kept alive and, if it can change its size, locked.
class Buffer {
 public:
  explicit Buffer(nb::handle object, int flags = PyBUF_SIMPLE) {
    if (PyObject_GetBuffer(object.ptr(), &view_, flags) != 0) throw nb::python_error();
  }
  Buffer(const Buffer&) = delete;
  Buffer& operator=(const Buffer&) = delete;
  ~Buffer() { PyBuffer_Release(&view_); }

  const Py_buffer& view() const { return view_; }
  Input input() const { return {static_cast<const uint8_t*>(view_.buf), static_cast<uint64_t>(view_.len)}; }
  Output output() const { return {static_cast<uint8_t*>(view_.buf), static_cast<uint64_t>(view_.len)}; }

 private:
  Py_buffer view_{};
};

// The content of a bytes object, which does not change as long as somebody holds it.
Input input_of(nb::handle bytes) {
  return {reinterpret_cast<const uint8_t*>(PyBytes_AS_STRING(bytes.ptr())),
          static_cast<uint64_t>(PyBytes_GET_SIZE(bytes.ptr()))};
}

nb::object new_bytes(uint64_t size) {
  PyObject* const bytes = PyBytes_FromStringAndSize(nullptr, static_cast<Py_ssize_t>(size));
  if (bytes == nullptr) throw nb::python_error();
  return nb::steal(bytes);
}

nb::object new_bytearray(uint64_t size) {
  PyObject* const bytes = PyByteArray_FromStringAndSize(nullptr, static_cast<Py_ssize_t>(size));
  if (bytes == nullptr) throw nb::python_error();
  return nb::steal(bytes);
}

Output output_of(nb::handle bytes, uint64_t size) {
  return {reinterpret_cast<uint8_t*>(PyBytes_AS_STRING(bytes.ptr())), size};
}

// Calls `add(input)` for each message that `ranges` finds in `buffer`.
template <class Add>
void add_ranges(Input buffer, const Buffer& ranges, Add add) {
  const Py_buffer& view = ranges.view();
  const char* format = view.format == nullptr ? "B" : view.format;
  if (*format == '@' || *format == '=' || *format == '<') ++format;
  if (view.itemsize != 8 || std::strchr("QLNqln", *format) == nullptr)
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
    nb::object held;
    std::deque<Buffer> buffers;
    if (!ranges.is_none()) {
      const Buffer places(ranges, PyBUF_FORMAT | PyBUF_C_CONTIGUOUS);
      batch.reserve(static_cast<size_t>(places.view().len) / sizeof(Range));
      add_ranges(buffers.emplace_back(messages).input(), places, [&](Input input) { batch.add(input); });
    } else {
      // A tuple of our own: taking a buffer can run Python code, which can change a list.
      held = nb::steal(PySequence_Fast(messages.ptr(), "a batch must be a sequence of messages"));
      if (held.is_valid()) held = nb::steal(PySequence_Tuple(held.ptr()));
      if (!held.is_valid()) throw nb::python_error();
      const Py_ssize_t count = PyTuple_GET_SIZE(held.ptr());
      batch.reserve(static_cast<size_t>(count));
      for (Py_ssize_t i = 0; i < count; ++i) {
        PyObject* const item = PyTuple_GET_ITEM(held.ptr(), i);
        batch.add(PyBytes_Check(item) ? input_of(item) : buffers.emplace_back(item).input());
      }
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

  static nb::object error_class(const char* name) {
    return nb::module_::import_("rosidl_adapter_proto.transcode.error").attr(name);
  }

  [[noreturn]] static void raise(const nb::object& exception) {
    PyErr_SetObject(reinterpret_cast<PyObject*>(Py_TYPE(exception.ptr())), exception.ptr());
    throw nb::python_error();
  }

  [[noreturn]] static void throw_too_small(uint64_t needed, uint64_t size) {
    raise(error_class("BufferTooSmallError")(needed, size));
  }

  nb::object exception(const Error& error, nb::object batch_index) const {
    const std::string path = field_path(error, plan_), text = reason(error);
    return error_class("TranscodeError")(type_name_, path, error.offset, text, batch_index);
  }

  [[noreturn]] void fail(const Error& error) const { raise(exception(error, nb::none())); }

  Plan plan_;
  std::string type_name_;
  uint64_t size_limit_;
};

// The object behind `self`. It is missing where a class derives from ours and does not call its `__init__`.
template <class T>
T& object_of(PyObject* self) {
  if (!nb::inst_ready(self)) {
    PyErr_SetString(PyExc_TypeError, "__init__ of the base class has not been called");
    throw nb::python_error();
  }
  return *nb::inst_ptr<T>(self);
}

// The two directions from and to message objects. Python would do it in two lines, at twice the cost for
// small messages.
class Codec {
 public:
  Codec(nb::handle_t<Transcoder> transcoder, nb::object message_class)
      : owner_(nb::borrow(transcoder)),
        transcoder_(object_of<Transcoder>(transcoder.ptr())),
        message_class_(std::move(message_class)),
        from_string_(message_class_.attr("FromString")),
        // The method of the class: protobuf looks every name up among the fields of a message first.
        serialize_(message_class_.attr("SerializeToString")) {}

  nb::object to_cdr(nb::handle self, nb::handle message) const {
    if (reinterpret_cast<PyObject*>(Py_TYPE(message.ptr())) != message_class_.ptr())
      self.attr("_refuse")(message);
    nb::object proto;
    try {
      proto = call(serialize_, message);
    } catch (nb::python_error& error) {
      self.attr("_refuse_to_serialize")(error.value());
      throw;
    }
    return transcoder_.transcode<ProtoToCdr>(proto);
  }

  nb::object from_cdr(nb::handle self, nb::handle data, nb::handle fields) {
    if (fields.is_none()) return call(from_string_, transcoder_.transcode<CdrToProto>(data));
    const nb::object chosen = transcoder_of(self, fields);
    return call(from_string_, object_of<Transcoder>(chosen.ptr()).transcode<CdrToProto>(data));
  }

 private:
  // The transcoder of some fields. A program asks for the same few again and again, so each is made once.
  nb::object transcoder_of(nb::handle self, nb::handle fields) {
    // A text, which is a sequence of texts as well, is for Python to refuse.
    const nb::object key = PyUnicode_Check(fields.ptr()) ? nb::borrow(fields) : names_of(fields);
    PyObject* const known = PyDict_GetItemWithError(choices_.ptr(), key.ptr());
    if (known != nullptr) return nb::borrow(known);
    if (PyErr_Occurred() != nullptr) throw nb::python_error();
    nb::object made = self.attr("_transcoder_of")(key);
    if (!nb::isinstance<Transcoder>(made)) {
      PyErr_SetString(PyExc_TypeError, "_transcoder_of() must return a Transcoder");
      throw nb::python_error();
    }
    if (choices_.size() >= kMaximumChoices) choices_.clear();
    choices_[key] = made;
    return made;
  }

  static nb::object names_of(nb::handle fields) {
    const auto refuse = [](const char* before, nb::handle found) {
      PyErr_Format(PyExc_TypeError, "from_cdr() takes fields as a list of names, %s %s", before,
                   Py_TYPE(found.ptr())->tp_name);
      throw nb::python_error();
    };
    if (Py_TYPE(fields.ptr())->tp_iter == nullptr && !PySequence_Check(fields.ptr())) refuse("not", fields);
    nb::object names = nb::steal(PySequence_Tuple(fields.ptr()));
    if (!names.is_valid()) throw nb::python_error();
    for (Py_ssize_t i = 0; i < PyTuple_GET_SIZE(names.ptr()); ++i) {
      PyObject* const name = PyTuple_GET_ITEM(names.ptr(), i);
      if (!PyUnicode_Check(name)) refuse("and one of these is", name);
    }
    return names;
  }

  static nb::object call(nb::handle function, nb::handle argument) {
    nb::object result = nb::steal(PyObject_CallOneArg(function.ptr(), argument.ptr()));
    if (!result.is_valid()) throw nb::python_error();
    return result;
  }

  nb::object owner_;
  const Transcoder& transcoder_;  // of the owner
  nb::object message_class_, from_string_, serialize_;
  nb::dict choices_;  // the transcoders of chosen fields
};

nb::tuple packed_fields(nb::handle serialize, nb::handle object, nb::args numbers) {
  const nb::object message = nb::steal(PyObject_CallOneArg(serialize.ptr(), object.ptr()));
  if (!message.is_valid()) throw nb::python_error();
  if (!PyBytes_Check(message.ptr())) throw nb::type_error("serialize must return bytes");
  std::vector<uint64_t> wanted(numbers.size());
  std::vector<Slice> slices(numbers.size());
  for (size_t i = 0; i < wanted.size(); ++i) {
    wanted[i] = PyLong_AsUnsignedLongLong(nb::handle(numbers[i]).ptr());
    if (PyErr_Occurred() != nullptr) throw nb::python_error();
  }
  const Input input = input_of(message);
  if (!find_packed_fields(input.data, input.data + input.size, wanted.data(), wanted.size(), slices.data()))
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

// Runs C++ that CPython calls: what it throws becomes the exception of Python.
template <class Function>
PyObject* called_from_python(Function function) noexcept {
  try {
    return function().release().ptr();
  } catch (nb::python_error& error) {
    error.restore();
  } catch (const std::bad_alloc&) {
    PyErr_NoMemory();
  } catch (const std::exception& error) {
    PyErr_SetString(PyExc_RuntimeError, error.what());
  }
  return nullptr;
}

template <class Direction>
PyObject* transcode(PyObject* self, PyObject* data) {
  return called_from_python([&] { return object_of<Transcoder>(self).transcode<Direction>(data); });
}

PyObject* codec_to_cdr(PyObject* self, PyObject* message) {
  return called_from_python([&] { return object_of<Codec>(self).to_cdr(self, message); });
}

// Takes `data` and then `fields`, the second one by name as well.
PyObject* codec_from_cdr(PyObject* self, PyObject* const* arguments, Py_ssize_t count, PyObject* names) {
  const Py_ssize_t named = names == nullptr ? 0 : PyTuple_GET_SIZE(names);
  const auto is_named = [&](const char* name) {
    return named == 1 && PyUnicode_CompareWithASCIIString(PyTuple_GET_ITEM(names, 0), name) == 0;
  };
  if (is_named("data"))
    return PyErr_Format(PyExc_TypeError, "from_cdr() takes the data by position, as from_cdr(data)");
  if (count == 0 && is_named("fields"))
    return PyErr_Format(PyExc_TypeError,
                        "from_cdr() takes the data and perhaps fields, but only fields were given");
  if (count == 0 || count + named > 2)
    return PyErr_Format(PyExc_TypeError,
                        "from_cdr() takes the data and perhaps fields, but %zd arguments were given",
                        count + named);
  if (named == 1 && !is_named("fields"))
    return PyErr_Format(PyExc_TypeError, "from_cdr() has no argument %R; give fields=[...] to choose some",
                        PyTuple_GET_ITEM(names, 0));
  PyObject* const fields = count + named == 2 ? arguments[1] : Py_None;
  return called_from_python([&] { return object_of<Codec>(self).from_cdr(self, arguments[0], fields); });
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
    {"from_cdr", reinterpret_cast<PyCFunction>(reinterpret_cast<void (*)()>(codec_from_cdr)),
     METH_FASTCALL | METH_KEYWORDS,
     "from_cdr($self, data, /, fields=None)\n--\n\n"
     "Turn a serialized ROS message, or only the chosen fields of it, into a protobuf message."},
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
      .def("_cdr_to_proto_batch", &Transcoder::transcode_batch<CdrToProto>, nb::arg(), nb::arg().none(),
           nb::arg(), nb::arg().none())
      .def("_proto_to_cdr_batch", &Transcoder::transcode_batch<ProtoToCdr>, nb::arg(), nb::arg().none(),
           nb::arg(), nb::arg().none());
  nb::class_<Codec>(module, "Codec", nb::type_slots(codec_slots))
      .def(nb::init<nb::handle_t<Transcoder>, nb::object>(), nb::arg("transcoder"), nb::arg("message_class"));
}
