// Python objects as the core takes and gives them: buffers, bytes, objects of classes of ours, and errors.
#pragma once

#include <nanobind/nanobind.h>

#include <cstring>
#include <deque>
#include <rosidl_adapter_proto/transcode.hpp>
#include <vector>

namespace rosidl_proto {

namespace nb = nanobind;

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
inline Input input_of(nb::handle bytes) {
  return {reinterpret_cast<const uint8_t*>(PyBytes_AS_STRING(bytes.ptr())),
          static_cast<uint64_t>(PyBytes_GET_SIZE(bytes.ptr()))};
}

inline nb::object new_bytes(uint64_t size) {
  PyObject* const bytes = PyBytes_FromStringAndSize(nullptr, static_cast<Py_ssize_t>(size));
  if (bytes == nullptr) throw nb::python_error();
  return nb::steal(bytes);
}

inline nb::object new_bytearray(uint64_t size) {
  PyObject* const bytes = PyByteArray_FromStringAndSize(nullptr, static_cast<Py_ssize_t>(size));
  if (bytes == nullptr) throw nb::python_error();
  return nb::steal(bytes);
}

inline Output output_of(nb::handle bytes, uint64_t size) {
  return {reinterpret_cast<uint8_t*>(PyBytes_AS_STRING(bytes.ptr())), size};
}

// The messages of a sequence, kept and, where they can change their size, locked as long as this lives.
class HeldMessages {
 public:
  // `refusal` is the error of what is no sequence.
  HeldMessages(nb::handle sequence, const char* refusal) {
    // A tuple of our own: taking a buffer can run Python code, which can change a list.
    held_ = nb::steal(PySequence_Fast(sequence.ptr(), refusal));
    if (held_.is_valid()) held_ = nb::steal(PySequence_Tuple(held_.ptr()));
    if (!held_.is_valid()) throw nb::python_error();
    const Py_ssize_t count = PyTuple_GET_SIZE(held_.ptr());
    inputs_.reserve(static_cast<size_t>(count));
    for (Py_ssize_t i = 0; i < count; ++i) {
      PyObject* const item = PyTuple_GET_ITEM(held_.ptr(), i);
      inputs_.push_back(PyBytes_Check(item) ? input_of(item) : buffers_.emplace_back(item).input());
    }
  }

  const std::vector<Input>& inputs() const { return inputs_; }

 private:
  nb::object held_;
  std::deque<Buffer> buffers_;
  std::vector<Input> inputs_;
};

// Whether a buffer has whole numbers of `size` bytes, signed or not, in the order of this machine.
inline bool has_numbers(const Py_buffer& view, Py_ssize_t size) {
  const char* format = view.format == nullptr ? "B" : view.format;
  if (*format == '@' || *format == '=' || *format == '<') ++format;
  return view.itemsize == size && *format != '\0' && std::strchr("BHILQNbhilqn", *format) != nullptr;
}

// The object behind `self`. It is missing where a class derives from ours and does not call its `__init__`.
template <class T>
T& object_of(PyObject* self) {
  if (!nb::inst_ready(self)) {
    PyErr_SetString(PyExc_TypeError, "__init__ of the base class has not been called");
    throw nb::python_error();
  }
  return *nb::inst_ptr<T>(self);
}

inline nb::object error_class(const char* name) {
  return nb::module_::import_("rosidl_adapter_proto.transcode.error").attr(name);
}

[[noreturn]] inline void raise(const nb::object& exception) {
  PyErr_SetObject(reinterpret_cast<PyObject*>(Py_TYPE(exception.ptr())), exception.ptr());
  throw nb::python_error();
}

}  // namespace rosidl_proto
