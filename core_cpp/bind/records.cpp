#include "records.h"

#include <algorithm>
#include <cstring>
#include <numbers>
#include <type_traits>

#include "arrays.h"

namespace lab::bind {
namespace {

template <class T>
T from_python(const py::handle& value, const char* name) {
    if constexpr (std::is_enum_v<T>) {
        const auto word = value.cast<std::string>();
        const auto found =
            std::find_if(words_of<T>.begin(), words_of<T>.end(), [&](const char* w) { return word == w; });
        if (found == words_of<T>.end()) throw py::value_error(std::string(name) + ": unknown word " + word);
        return static_cast<T>(found - words_of<T>.begin());
    } else {
        return value.cast<T>();
    }
}

template <class T>
py::object to_python(const T& value) {
    if constexpr (std::is_enum_v<T>)
        return py::str(words_of<T>[static_cast<std::size_t>(value)]);
    else
        return py::cast(value);
}

template <class T>
void list_words(py::dict& d, const char* name) {
    if constexpr (std::is_enum_v<T>) {
        py::list words;
        for (const char* word : words_of<T>) words.append(word);
        d[name] = words;
    }
}

}  // namespace

Params params_from(const py::dict& values) {
    Params params;
#define LAB_READ(type, name, value) params.name = from_python<type>(values[#name], #name);
    LAB_PARAMS(LAB_READ)
#undef LAB_READ
    return params;
}

py::dict params_to_dict(const Params& params) {
    py::dict d;
#define LAB_WRITE(type, name, value) d[#name] = to_python(params.name);
    LAB_PARAMS(LAB_WRITE)
#undef LAB_WRITE
    return d;
}

py::dict choices() {
    py::dict d;
#define LAB_WORDS(type, name, value) list_words<type>(d, #name);
    LAB_PARAMS(LAB_WORDS)
#undef LAB_WORDS
    return d;
}

Camera camera_from(const py::handle& camera) {
    return {vec3_from(camera.attr("eye")), vec3_from(camera.attr("target")), vec3_from(camera.attr("up")),
            camera.attr("fov_y_deg").cast<float>() * std::numbers::pi_v<float> / 180.0f};
}

LightsView lights_view(const py::handle& lights) {
    const auto position = view<vec3>(lights.attr("position"), "position");
    return {position, view<vec3>(lights.attr("flux"), "flux", position.size()),
            view<vec3>(lights.attr("normal"), "normal", position.size())};
}

HierarchyView hierarchy_view(const py::handle& h) {
    HierarchyView out;
    out.origin = view<vec3>(h.attr("origin"), "origin", 1)[0];
    out.cell_size = view<float>(h.attr("cell_size"), "cell_size");
    out.offset = view<std::int64_t>(h.attr("offset"), "offset", out.cell_size.size() + 1);
    out.position = view<vec3>(h.attr("position"), "position", static_cast<std::size_t>(out.offset.back()));
    if (out.cell_size.size() < 2 || out.offset.front() != 0 || !std::is_sorted(out.offset.begin(), out.offset.end()))
        throw py::value_error("hierarchy: offset must rise from 0, over two levels or more");
    const std::size_t lights = out.position.size();
    out.flux = view<vec3>(h.attr("flux"), "flux", lights);
    out.normal = view<vec3>(h.attr("normal"), "normal", lights);
    out.normal_moment = view<Symmetric>(h.attr("normal_moment"), "normal_moment", lights);
    out.deviation = view<vec3>(h.attr("deviation"), "deviation", lights);
    out.vertex = view<Vertex>(h.attr("vertex"), "vertex", lights);
    out.oriented = view<std::uint8_t>(h.attr("oriented"), "oriented", lights);
    out.input_index =
        view<std::uint32_t>(h.attr("input_index"), "input_index", static_cast<std::size_t>(out.offset[1]));
    const py::object members = h.attr("members");
    if (!members.is_none()) {
        out.members.offset =
            view<std::int64_t>(members.attr("offset"), "members.offset", lights - out.input_index.size() + 1);
        const auto entries = static_cast<std::size_t>(out.members.offset.back());
        out.members.slot = view<AliasSlot>(members.attr("slot"), "members.slot", entries);
    }
    return out;
}

GBufferView gbuffer_view(const py::handle& g) {
    GBufferView out;
    out.depth = view<float>(g.attr("depth"), "depth");
    const auto shape = g.attr("depth").attr("shape").cast<std::pair<int, int>>();
    out.height = shape.first;
    out.width = shape.second;
    const std::size_t pixels = out.depth.size();
    out.position = view<vec3>(g.attr("position"), "position", pixels);
    out.normal = view<vec3>(g.attr("normal"), "normal", pixels);
    out.geometric_normal = view<vec3>(g.attr("geometric_normal"), "geometric_normal", pixels);
    out.albedo = view<vec3>(g.attr("albedo"), "albedo", pixels);
    out.emission = view<vec3>(g.attr("emission"), "emission", pixels);
    out.pixel_angle = g.attr("pixel_angle").cast<float>();
    return out;
}

LightingView lighting_view(const py::handle& l, const GBufferView& g, int samples) {
    const std::size_t slots = g.pixels() * samples;
    return {view<vec3>(l.attr("irradiance"), "irradiance", g.pixels()),
            view<std::int32_t>(l.attr("light"), "light", slots),
            view<float>(l.attr("target_weight"), "target_weight", slots),
            view<float>(l.attr("weight_sum"), "weight_sum", g.pixels())};
}

}  // namespace lab::bind
