// Grid lights as arrays, one a property; see Hierarchy in lab/records.py for the meaning and shape of each.
#pragma once

#include <cstddef>

#include "lab/buffer.h"
#include "lab/records.h"

namespace lab {

struct LightArrays {
    Buffer<vec3> position, flux, normal, deviation;
    Buffer<Symmetric> normal_moment;
    Buffer<Vertex> vertex;
    Buffer<std::uint8_t> oriented;

    std::size_t size() const { return position.size(); }

    template <class Change>
    void for_each(const Change& change) {
        change(position);
        change(flux);
        change(normal);
        change(deviation);
        change(normal_moment);
        change(vertex);
        change(oriented);
    }
    void resize(std::size_t count) {
        reserve(count);
        for_each([count](auto& array) { array.resize(count); });
    }
    void reserve(std::size_t count) {
        for_each([count](auto& array) { array.reserve(count); });
    }
};

}  // namespace lab
