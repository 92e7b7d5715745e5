#include "arrays.hpp"

namespace stairmap {

namespace {

std::string text_of(nb::handle object) {
    nb::object text = nb::steal(PyObject_Str(object.ptr()));
    const char *bytes = text.is_valid() ? PyUnicode_AsUTF8(text.ptr()) : nullptr;
    if (bytes == nullptr) PyErr_Clear();
    return bytes ? bytes : "?";
}

std::string described(nb::handle object) {
    if (!nb::hasattr(object, "dtype") || !nb::hasattr(object, "flags"))
        return text_of(nb::object(object.type().attr("__name__")));
    const std::string text = text_of(nb::object(object.attr("dtype"))) + " of shape " +
                             text_of(nb::object(object.attr("shape")));
    const bool is_contiguous = nb::cast<bool>(nb::object(object.attr("flags").attr("c_contiguous")));
    return is_contiguous ? text : text + ", not contiguous";
}

}  // namespace

void refuse(const std::string &message) { throw nb::value_error(message.c_str()); }

void refuse_array(nb::handle object, const char *name, const char *type, int num_dimensions) {
    refuse(std::string(name) + ": expected a C-contiguous " + type + " array of " +
           std::to_string(num_dimensions) + (num_dimensions == 1 ? " dimension, got " : " dimensions, got ") +
           described(object) + "; use numpy.ascontiguousarray");
}

}  // namespace stairmap
