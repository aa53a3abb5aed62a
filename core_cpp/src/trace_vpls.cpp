#include "lab/trace_vpls.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>

#include "lab/light_paths.h"
#include "lab/sampling.h"

namespace lab {
namespace {

constexpr std::int64_t chunk_paths = 256;  // traced together by one thread

struct Vpl {
    vec3 position, flux, normal;
    std::int64_t path;  // that made it
};
using Chunk = std::vector<Vpl>;  // of a run of paths, in path order

struct Walker {
    vec3 flux;
    std::int64_t path;
};

// Advances all paths of a chunk bounce by bounce; VPLs come out by bounce and are put into path order
// afterwards.
Chunk trace_chunk(const Scene& scene, const LightPaths& lights, std::int64_t first, int max_bounces, std::uint32_t key,
                  const SeeRays& see) {
    std::vector<Ray> rays;
    std::vector<Walker> walkers;
    rays.reserve(chunk_paths);
    walkers.reserve(chunk_paths);
    for (std::int64_t path = first; path < first + chunk_paths; ++path) {
        const EmittedRay start = lights.emit(static_cast<std::uint32_t>(path), key);
        rays.push_back(start.ray);
        walkers.push_back({start.flux, path});
    }
    Chunk found;
    found.reserve(3 * chunk_paths);
    std::array<std::uint32_t, chunk_paths + 1> begin{};  // of each path's VPLs, once these are counted
    std::vector<Hit> hits;
    for (int bounce = 0; bounce < max_bounces && !rays.empty(); ++bounce) {
        hits.resize(rays.size());
        if (see) see(rays);
        scene.rays().intersect(rays, hits, Coherence::incoherent);
        for (const Hit& hit : hits)
            if (hit.found()) scene.prefetch_triangle(hit.triangle);
        for (const Hit& hit : hits)
            if (hit.found()) scene.prefetch_texels(hit);
        std::size_t alive = 0;
        for (std::size_t i = 0; i < rays.size(); ++i) {
            if (!hits[i].found()) continue;
            Surface surface = scene.surface(scene.settled(rays[i], hits[i]));
            const vec3 flux = walkers[i].flux * surface.albedo;
            if (!(flux.x > 0 || flux.y > 0 || flux.z > 0)) continue;
            surface.turn_toward(rays[i].direction);
            const vec3 side = surface.geometric_normal, normal = surface.normal;
            const vec3 position = scene.off_surface(surface.position, side);
            found.push_back({position, flux, normal, walkers[i].path});
            ++begin[walkers[i].path - first + 1];
            const Random4 r = random4(static_cast<std::uint32_t>(walkers[i].path), static_cast<std::uint32_t>(bounce),
                                      Stream::bounce, key);
            const vec3 next = sample_cosine(normal, to_unit(r.x), to_unit(r.y));
            if (glm::dot(next, side) <= 0) continue;  // into the surface, by its interpolated normal
            rays[alive] = {position, next, std::numeric_limits<float>::infinity()};
            walkers[alive] = {flux, walkers[i].path};
            ++alive;
        }
        rays.resize(alive);
        walkers.resize(alive);
    }
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    Chunk sorted(found.size());
    for (const Vpl& vpl : found) sorted[begin[vpl.path - first]++] = vpl;  // bounces stay in order
    return sorted;
}

}  // namespace

VplData trace_vpls(const Scene& scene, const Params& params, const SeeRays& see) {
    const LightPaths lights(scene);
    if (lights.empty()) throw UnlitScene("the scene has no light with any power");
    const std::uint32_t key = frame_key(params.seed, 0);  // frames share their lights
    const auto wanted = static_cast<std::size_t>(params.vpls);
    const std::int64_t patience = 1'000'000, most = std::max<std::int64_t>(1000 * params.vpls, 100'000'000);
    VplData vpls;
    vpls.position.resize(wanted);
    vpls.flux.resize(wanted);
    vpls.normal.resize(wanted);
    std::size_t done = 0;
    for (std::int64_t launched = 0; done < wanted;) {
        const auto missing = static_cast<std::int64_t>(wanted - done);
        const std::int64_t chunks = std::clamp<std::int64_t>(missing / chunk_paths / 2, 4, 1024);
        std::vector<Chunk> found(chunks);
#pragma omp parallel for schedule(dynamic)
        for (std::int64_t c = 0; c < chunks; ++c)
            found[c] = trace_chunk(scene, lights, launched + c * chunk_paths, params.max_bounces, key, see);
        launched += chunks * chunk_paths;
        std::vector<std::size_t> first{done};
        for (const Chunk& chunk : found) first.push_back(std::min(wanted, first.back() + chunk.size()));
#pragma omp parallel for
        for (std::int64_t c = 0; c < chunks; ++c)
            for (std::size_t i = first[c]; i < first[c + 1]; ++i) {
                const Vpl& vpl = found[c][i - first[c]];
                vpls.position[i] = vpl.position;
                vpls.flux[i] = vpl.flux;
                vpls.normal[i] = vpl.normal;
            }
        for (std::int64_t c = chunks; c-- > 0 && first[chunks] > done;)
            if (first[c + 1] > first[c]) {
                vpls.paths_launched = found[c][first[c + 1] - first[c] - 1].path + 1;
                break;
            }
        done = first[chunks];
        if (done == 0 && launched >= patience)
            throw UnlitScene("none of " + std::to_string(launched) +
                             " rays from the lights reached a surface that reflects");
        if (done < wanted && launched >= most)
            throw UnlitScene("only " + std::to_string(done) + " of " + std::to_string(launched) +
                             " rays from the lights reached a surface that reflects");
    }
    const float scale = 1.0f / static_cast<float>(vpls.paths_launched);
#pragma omp parallel for
    for (std::size_t i = 0; i < wanted; ++i) vpls.flux[i] *= scale;
    return vpls;
}

}  // namespace lab
