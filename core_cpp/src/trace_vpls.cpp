#include "lab/trace_vpls.h"

#include <algorithm>
#include <limits>

#include "lab/light_paths.h"
#include "lab/sampling.h"

namespace lab {
namespace {

constexpr std::int64_t chunk_paths = 256;  // traced together by one thread

// The VPLs of a run of paths, in path order, and for each the path that made it.
struct Chunk {
    std::vector<vec3> position, flux, normal;
    std::vector<std::int64_t> path;
};

struct Walker {
    vec3 flux;
    std::int64_t path;
};

// Advances all paths of a chunk bounce by bounce; VPLs come out by bounce and are put into path order
// afterwards.
Chunk trace_chunk(const Scene& scene, const LightPaths& lights, std::int64_t first, int max_bounces,
                  std::uint32_t key) {
    std::vector<Ray> rays;
    std::vector<Walker> walkers;
    for (std::int64_t path = first; path < first + chunk_paths; ++path) {
        const EmittedRay start = lights.emit(static_cast<std::uint32_t>(path), key);
        rays.push_back(start.ray);
        walkers.push_back({start.flux, path});
    }
    Chunk found;
    std::vector<Hit> hits;
    for (int bounce = 0; bounce < max_bounces && !rays.empty(); ++bounce) {
        hits.resize(rays.size());
        scene.rays().intersect(rays, hits, Coherence::incoherent);
        std::size_t alive = 0;
        for (std::size_t i = 0; i < rays.size(); ++i) {
            if (!hits[i].found()) continue;
            Surface surface = scene.surface(hits[i], 0.0f);
            const vec3 flux = walkers[i].flux * surface.albedo;
            if (!(flux.x > 0 || flux.y > 0 || flux.z > 0)) continue;
            surface.turn_toward(rays[i].direction);
            const vec3 side = surface.geometric_normal, normal = surface.normal;
            const vec3 position = scene.off_surface(surface.position, side);
            found.position.push_back(position);
            found.flux.push_back(flux);
            found.normal.push_back(normal);
            found.path.push_back(walkers[i].path);
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
    std::vector<std::size_t> order(found.path.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return found.path[a] < found.path[b]; });
    Chunk sorted;
    for (const std::size_t i : order) {
        sorted.position.push_back(found.position[i]);
        sorted.flux.push_back(found.flux[i]);
        sorted.normal.push_back(found.normal[i]);
        sorted.path.push_back(found.path[i]);
    }
    return sorted;
}

}  // namespace

VplData trace_vpls(const Scene& scene, const Params& params) {
    const LightPaths lights(scene);
    if (lights.empty()) throw UnlitScene("the scene has no light with any power");
    const std::uint32_t key = frame_key(params.seed, 0);  // frames share their lights
    const auto wanted = static_cast<std::size_t>(params.vpls);
    const std::int64_t patience = 1'000'000, most = std::max<std::int64_t>(1000 * params.vpls, 100'000'000);
    VplData vpls;
    for (std::int64_t launched = 0; vpls.position.size() < wanted;) {
        const auto missing = static_cast<std::int64_t>(wanted - vpls.position.size());
        const std::int64_t chunks = std::clamp<std::int64_t>(missing / chunk_paths / 2, 4, 1024);
        std::vector<Chunk> found(chunks);
#pragma omp parallel for schedule(dynamic)
        for (std::int64_t c = 0; c < chunks; ++c)
            found[c] = trace_chunk(scene, lights, launched + c * chunk_paths, params.max_bounces, key);
        launched += chunks * chunk_paths;
        for (const Chunk& chunk : found)
            for (std::size_t i = 0; i < chunk.path.size() && vpls.position.size() < wanted; ++i) {
                vpls.position.push_back(chunk.position[i]);
                vpls.flux.push_back(chunk.flux[i]);
                vpls.normal.push_back(chunk.normal[i]);
                vpls.paths_launched = chunk.path[i] + 1;
            }
        if (vpls.position.empty() && launched >= patience)
            throw UnlitScene("none of " + std::to_string(launched) +
                             " rays from the lights reached a surface that reflects");
        if (vpls.position.size() < wanted && launched >= most)
            throw UnlitScene("only " + std::to_string(vpls.position.size()) + " of " + std::to_string(launched) +
                             " rays from the lights reached a surface that reflects");
    }
    const float scale = 1.0f / static_cast<float>(vpls.paths_launched);
    for (vec3& flux : vpls.flux) flux *= scale;
    return vpls;
}

}  // namespace lab
