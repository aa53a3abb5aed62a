// The array vocabulary of the bindings: checked, zero-copy views of numpy arrays, and vectors handed to numpy
// without a copy. A wrong dtype, shape or layout raises; nothing is converted silently.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <array>
#include <glm/glm.hpp>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "lab/records.h"

namespace lab::bind {

namespace py = pybind11;

// An element type and the numbers it is made of: vec3 is 3 floats, Symmetric 6, Vertex 3 uint16.
template <class T>
struct Element {
    using Scalar = T;
    static constexpr py::ssize_t columns = 1;
};
template <>
struct Element<glm::vec3> {
    using Scalar = float;
    static constexpr py::ssize_t columns = 3;
};
template <>
struct Element<glm::dvec3> {
    using Scalar = double;
    static constexpr py::ssize_t columns = 3;
};
template <>
struct Element<glm::uvec3> {
    using Scalar = std::uint32_t;
    static constexpr py::ssize_t columns = 3;
};
template <>
struct Element<glm::vec2> {
    using Scalar = float;
    static constexpr py::ssize_t columns = 2;
};
template <>
struct Element<Symmetric> {
    using Scalar = float;
    static constexpr py::ssize_t columns = 6;
};
template <>
struct Element<AliasSlot> {
    using Scalar = std::uint32_t;
    static constexpr py::ssize_t columns = 3;
};
template <>
struct Element<Vertex> {
    using Scalar = std::uint16_t;
    static constexpr py::ssize_t columns = 3;
};

// The array behind `object` as a span of T: any leading shape, last axis = the numbers of one T (if more than
// one).
template <class T>
std::span<const T> view(const py::handle& object, const char* name) {
    using Scalar = typename Element<T>::Scalar;
    constexpr auto columns = Element<T>::columns;
    static_assert(sizeof(T) == sizeof(Scalar) * columns);
    if (!py::isinstance<py::array_t<Scalar>>(object))
        throw py::type_error(std::string(name) + ": expected a numpy array of " +
                             py::str(py::dtype::of<Scalar>()).cast<std::string>());
    const auto array = py::reinterpret_borrow<py::array>(object);
    if (!(array.flags() & py::array::c_style))
        throw py::type_error(std::string(name) + ": expected a C-contiguous array");
    if (columns > 1 && (array.ndim() == 0 || array.shape(array.ndim() - 1) != columns))
        throw py::type_error(std::string(name) + ": the last axis must have " + std::to_string(columns) + " numbers");
    return {static_cast<const T*>(array.data()), static_cast<std::size_t>(array.size() / columns)};
}

// As `view`, with the number of elements it must have.
template <class T>
std::span<const T> view(const py::handle& object, const char* name, std::size_t count) {
    const auto span = view<T>(object, name);
    if (span.size() != count)
        throw py::type_error(std::string(name) + ": expected " + std::to_string(count) + " elements, got " +
                             std::to_string(span.size()));
    return span;
}

// Work that needs no Python, with the interpreter free for others.
template <class F>
auto without_gil(const F& f) {
    const py::gil_scoped_release release;
    return f();
}

// Three numbers of a Python sequence: a colour, a point, a direction.
inline glm::vec3 vec3_from(const py::handle& object) {
    const auto t = object.cast<std::array<float, 3>>();
    return {t[0], t[1], t[2]};
}

// Hands `values` to numpy without a copy; `shape` counts elements, the numbers of one T become the last axis.
template <class T, class Allocator>
py::array to_numpy(std::vector<T, Allocator>&& values, std::vector<py::ssize_t> shape) {
    using Scalar = typename Element<T>::Scalar;
    if (Element<T>::columns > 1) shape.push_back(Element<T>::columns);
    using Vector = std::vector<T, Allocator>;
    auto owner = std::make_unique<Vector>(std::move(values));
    const auto* data = reinterpret_cast<const Scalar*>(owner->data());
    py::capsule free(owner.release(), [](void* p) { delete static_cast<Vector*>(p); });
    return py::array_t<Scalar>(std::move(shape), data, free);
}

template <class T, class Allocator>
py::array to_numpy(std::vector<T, Allocator>&& values) {
    const auto count = static_cast<py::ssize_t>(values.size());
    return to_numpy(std::move(values), {count});
}

}  // namespace lab::bind
