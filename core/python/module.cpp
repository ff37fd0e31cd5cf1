// The Python module: buffers in, bytes out, errors as exceptions, and the interpreter lock. Everything else
// is in the core, which knows nothing of Python.
#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>

#include <rosidl_adapter_proto/packed_fields.hpp>
#include <string>
#include <vector>

#include "columns.hpp"
#include "records.hpp"
#include "schema.hpp"
#include "transcoder.hpp"

namespace rosidl_proto {
namespace {

// So many choices of fields a codec remembers.
constexpr size_t kMaximumChoices = 64;

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
    {"ros1_to_proto", transcode<Ros1ToProto>, METH_O,
     "ros1_to_proto($self, data, /)\n--\n\nTurn a message serialized by ROS 1 into a serialized protobuf "
     "message."},
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
  define_columns(module);
  define_records(module);
  define_schema(module);
}
