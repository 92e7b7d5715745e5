// Arrays that come from Python and go back: checked on the way in, owned by NumPy on the way out.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <string>

namespace nb = nanobind;

namespace stairmap {

template <class T>
struct ElementType;
template <>
struct ElementType<double> {
    static constexpr const char *name = "float64", *codes = "d";
};
template <>
struct ElementType<float> {
    static constexpr const char *name = "float32", *codes = "f";
};
template <>
struct ElementType<int64_t> {
    static constexpr const char *name = "int64", *codes = sizeof(long) == 8 ? "lq" : "q";
};
template <>
struct ElementType<bool> {
    static constexpr const char *name = "bool", *codes = "?";
};

// Says what was expected of the argument `name` and what came.
[[noreturn]] void refuse_array(nb::handle object, const char *name, const char *type, int num_dimensions);

// Refuses an argument whose value is not as expected.
[[noreturn]] void refuse(const std::string &message);

// A C-contiguous array of one element type that is read, and kept alive while it is.
template <class T, int N>
class Input {
  public:
    Input(nb::handle object, const char *name) {
        if (PyObject_GetBuffer(object.ptr(), &buffer_, PyBUF_FORMAT | PyBUF_C_CONTIGUOUS) != 0) {
            PyErr_Clear();
            refuse_array(object, name, ElementType<T>::name, N);
        }
        if (!fits()) {
            PyBuffer_Release(&buffer_);
            refuse_array(object, name, ElementType<T>::name, N);
        }
    }
    ~Input() { PyBuffer_Release(&buffer_); }
    Input(const Input &) = delete;
    Input &operator=(const Input &) = delete;

    const T *data() const { return static_cast<const T *>(buffer_.buf); }
    size_t shape(int axis) const { return static_cast<size_t>(buffer_.shape[axis]); }
    size_t size() const { return static_cast<size_t>(buffer_.len) / sizeof(T); }
    const T &operator[](size_t index) const { return data()[index]; }
    const T *row(size_t index) const { return data() + index * (size() / shape(0)); }

  private:
    bool fits() const {
        if (buffer_.ndim != N || buffer_.itemsize != sizeof(T)) return false;
        const char *format = buffer_.format;
        if (*format == '@' || *format == '=') ++format;
        if (format[0] == '\0' || format[1] != '\0' || std::strchr(ElementType<T>::codes, *format) == nullptr)
            return false;
        return reinterpret_cast<uintptr_t>(buffer_.buf) % alignof(T) == 0;
    }

    Py_buffer buffer_;
};

// Refuses an array whose length along an axis is not that of another one.
template <class Array>
void check_length(const Array &array, const char *name, size_t expected, int axis = 0) {
    if (array.shape(axis) != expected)
        refuse(std::string(name) + ": expected length " + std::to_string(expected) + " along axis " +
               std::to_string(axis) + ", got " + std::to_string(array.shape(axis)));
}

// A new NumPy array, filled with zeros, and where its elements lie.
template <class T>
class Output {
  public:
    explicit Output(std::initializer_list<size_t> shape) {
        size_t size = 1;
        for (size_t length : shape) size *= length;
        data_ = new T[size ? size : 1]();
        nb::capsule owner(data_, [](void *data) noexcept { delete[] static_cast<T *>(data); });
        array_ = nb::ndarray<nb::numpy, T>(data_, shape, owner);
    }
    T *data() { return data_; }
    T &operator[](size_t index) { return data_[index]; }
    nb::object object() const { return nb::cast(array_); }

  private:
    T *data_;
    nb::ndarray<nb::numpy, T> array_;
};

}  // namespace stairmap
