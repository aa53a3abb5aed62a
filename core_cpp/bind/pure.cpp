// The pure functions, on arrays, so that tests can run each engine's against the same float64 oracle.
#include <pybind11/pybind11.h>

#include <algorithm>

#include "arrays.h"
#include "bind.h"
#include "lab/barycentrics.h"
#include "lab/blending.h"
#include "lab/interleave.h"
#include "lab/jitter.h"
#include "lab/lobe.h"
#include "lab/packed_slots.h"
#include "lab/random.h"
#include "lab/reservoir.h"
#include "lab/sampling.h"

namespace lab::bind {
namespace {

// (n, 4) uint32 -> (n, 4) uint32.
py::array pcg4d_(const py::object& keys) {
    const auto in = view<std::uint32_t>(keys, "keys");
    std::vector<std::uint32_t> out(in.size());
    for (std::size_t i = 0; i + 3 < in.size(); i += 4) {
        const Random4 r = pcg4d({in[i], in[i + 1], in[i + 2], in[i + 3]});
        out[i] = r.x;
        out[i + 1] = r.y;
        out[i + 2] = r.z;
        out[i + 3] = r.w;
    }
    return to_numpy(std::move(out), {static_cast<py::ssize_t>(in.size() / 4), 4});
}

// (n,) distances -> (n,) B of one level.
py::array blend_weight_(const py::object& distance, float blend_radius, bool first, bool top) {
    const auto in = view<float>(distance, "distance");
    const Blend blend = make_blend(blend_radius, first, top);
    std::vector<float> out;
    for (const float d : in) out.push_back(blend_weight(blend, d));
    return to_numpy(std::move(out));
}

// (n, 3) unit directions from the light -> (n,) emission.
py::array emission_(const py::object& direction, const std::string& kind, const py::object& normal,
                    const py::object& normal_moment, bool oriented) {
    const auto word =
        std::find_if(words_of<Lobe>.begin(), words_of<Lobe>.end(), [&](const char* w) { return kind == w; });
    if (word == words_of<Lobe>.end()) throw py::value_error("unknown lobe " + kind);
    const EmissionLobe lobe =
        make_lobe(static_cast<Lobe>(word - words_of<Lobe>.begin()), view<vec3>(normal, "normal", 1)[0],
                  view<Symmetric>(normal_moment, "normal_moment", 1)[0], oriented);
    std::vector<float> out;
    for (const vec3& w : view<vec3>(direction, "direction")) out.push_back(emission(lobe, w.x, w.y, w.z, 1.0f));
    return to_numpy(std::move(out));
}

// (n,) sums and (n,) seeds -> (n,) last records and (n,) sums up to which they stay the last.
py::tuple last_record_(const py::object& below, const py::object& seed) {
    const auto b = view<float>(below, "below");
    const auto s = view<std::uint32_t>(seed, "seed", b.size());
    std::vector<float> last(b.size()), next(b.size());
    for (std::size_t i = 0; i < b.size(); ++i) last[i] = last_record(b[i], s[i], next[i]);
    return py::make_tuple(to_numpy(std::move(last)), to_numpy(std::move(next)));
}

// (n,) random bits and (n,) weights -> (n,) keys.
py::array race_key_(const py::object& bits, const py::object& weight) {
    const auto b = view<std::uint32_t>(bits, "bits");
    const auto f = view<float>(weight, "weight", b.size());
    std::vector<float> out;
    for (std::size_t i = 0; i < b.size(); ++i) out.push_back(race_key(b[i], f[i]));
    return to_numpy(std::move(out));
}

// (n,) in [0, 1) -> (n, 2) cos and sin of so many turns.
py::array turn_(const py::object& turns) {
    std::vector<float> out;
    for (const float v : view<float>(turns, "turns")) {
        const glm::vec2 at = turn(v);
        out.insert(out.end(), {at.x, at.y});
    }
    const auto rows = static_cast<py::ssize_t>(out.size() / 2);
    return to_numpy(std::move(out), {rows, 2});
}

// (n, 3) normals and (n,), (n,) uniforms -> (n, 3) directions.
py::array sample_cosine_(const py::object& normal, const py::object& first, const py::object& second) {
    const auto n = view<vec3>(normal, "normal");
    const auto u = view<float>(first, "first", n.size()), v = view<float>(second, "second", n.size());
    std::vector<vec3> out;
    for (std::size_t i = 0; i < n.size(); ++i) out.push_back(sample_cosine(n[i], u[i], v[i]));
    return to_numpy(std::move(out));
}

// Rays (n, 3) and triangles (n, 3) a corner -> (n, 2) u, v.
py::array barycentrics_(const py::object& origin, const py::object& direction, const py::object& a, const py::object& b,
                        const py::object& c) {
    const auto o = view<vec3>(origin, "origin");
    const auto d = view<vec3>(direction, "direction", o.size());
    const auto corner_a = view<vec3>(a, "a", o.size()), corner_b = view<vec3>(b, "b", o.size());
    const auto corner_c = view<vec3>(c, "c", o.size());
    std::vector<float> out;
    for (std::size_t i = 0; i < o.size(); ++i) {
        const glm::vec2 uv = barycentrics(o[i], d[i], corner_a[i], corner_b[i], corner_c[i]);
        out.insert(out.end(), {uv.x, uv.y});
    }
    return to_numpy(std::move(out), {static_cast<py::ssize_t>(o.size()), 2});
}

py::array raised_cosine(const py::object& uniform) {
    std::vector<float> out;
    for (const float u : view<float>(uniform, "uniform")) out.push_back(sample_raised_cosine(u));
    return to_numpy(std::move(out));
}

py::array dealt_tile_(std::uint32_t count, std::uint32_t level, int n) {
    std::vector<std::int32_t> out;
    for (std::uint32_t i = 0; i < count; ++i) out.push_back(dealt_tile(i, level, n));
    return to_numpy(std::move(out));
}

// (n, 3) slots (own, other, keep) and (n,) bits -> (n,) items as the packed slots tell them, -1 where they don't.
py::array packed_items(const py::object& slots, const py::object& rest) {
    const auto r = view<std::uint32_t>(rest, "rest");
    const auto s = view<std::uint32_t>(slots, "slots", 3 * r.size());
    std::vector<std::int64_t> out;
    for (std::size_t i = 0; i < r.size(); ++i) {
        const PackedSlot slot = pack({s[3 * i], s[3 * i + 1], s[3 * i + 2]});
        out.push_back(packed_decides(slot, r[i]) ? std::int64_t{packed_item(slot, r[i])} : -1);
    }
    return to_numpy(std::move(out));
}

}  // namespace

void bind_pure(py::module_& m) {
    m.def("pcg4d", &pcg4d_, py::arg("keys"));
    m.def("blend_weight", &blend_weight_, py::arg("distance"), py::arg("blend_radius"), py::arg("first"),
          py::arg("top"));
    m.def("emission", &emission_, py::arg("direction"), py::arg("kind"), py::arg("normal"), py::arg("normal_moment"),
          py::arg("oriented"));
    m.def("last_record", &last_record_, py::arg("below"), py::arg("seed"));
    m.def("race_key", &race_key_, py::arg("bits"), py::arg("weight"));
    m.def("turn", &turn_, py::arg("turns"));
    m.def("sample_cosine", &sample_cosine_, py::arg("normal"), py::arg("first"), py::arg("second"));
    m.def("barycentrics", &barycentrics_, py::arg("origin"), py::arg("direction"), py::arg("a"), py::arg("b"),
          py::arg("c"));
    m.def("sample_raised_cosine", &raised_cosine, py::arg("uniform"));
    m.def("dealt_tile", &dealt_tile_, py::arg("count"), py::arg("level"), py::arg("n"));
    m.def("packed_items", &packed_items, py::arg("slots"), py::arg("rest"));
}

}  // namespace lab::bind
