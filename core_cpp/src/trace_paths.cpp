#include "lab/trace_paths.h"

#include <algorithm>
#include <numbers>

#include "lab/path_walk.h"

namespace lab {
namespace {

constexpr int block = 16;  // pixels a side of what one thread follows together

struct Block {
    int x0, y0, x1, y1;

    std::size_t pixels() const { return static_cast<std::size_t>(x1 - x0) * (y1 - y0); }
    // Calls visit(x, y, slot) for each pixel.
    template <class Visit>
    void each(const Visit& visit) const {
        std::size_t slot = 0;
        for (int y = y0; y < y1; ++y)
            for (int x = x0; x < x1; ++x) visit(x, y, slot++);
    }
};

template <class Work>
void for_blocks(int width, int height, const Work& make_work) {
    const int across = (width + block - 1) / block, down = (height + block - 1) / block;
#pragma omp parallel
    {
        auto work = make_work();
#pragma omp for schedule(dynamic)
        for (int b = 0; b < across * down; ++b) {
            const int x = b % across * block, y = b / across * block;
            work(Block{x, y, std::min(width, x + block), std::min(height, y + block)});
        }
    }
}

// What a sample of each pixel of a block sees first: path points of throughput albedo, and the emission.
class FirstHits {
  public:
    FirstHits(const Scene& scene, const GBufferView& gbuffer, const std::optional<Camera>& camera)
        : scene_(scene), g_(gbuffer) {
        if (camera) rays_from_.emplace(*camera, gbuffer.width, gbuffer.height);
    }

    void find(const Block& at, std::uint32_t key, std::vector<PathPoint>& points, std::span<vec3> emission) {
        points.clear();
        if (rays_from_)
            anywhere_in_pixels(at, key, points, emission);
        else
            at.each([&](int x, int y, std::size_t slot) {
                const std::size_t p = static_cast<std::size_t>(y) * g_.width + x;
                emission[slot] = g_.emission[p];
                if (g_.depth[p] > 0)
                    points.push_back({{g_.position[p], g_.normal[p], g_.geometric_normal[p]},
                                      g_.albedo[p],
                                      static_cast<std::uint32_t>(p),
                                      slot});
            });
    }

  private:
    const Scene& scene_;
    const GBufferView& g_;
    std::optional<CameraRays> rays_from_;
    std::vector<Ray> rays_;
    std::vector<Hit> hits_;

    void anywhere_in_pixels(const Block& at, std::uint32_t key, std::vector<PathPoint>& points,
                            std::span<vec3> emission) {
        rays_.clear();
        at.each([&](int x, int y, std::size_t) {
            const auto p = static_cast<std::uint32_t>(y * g_.width + x);
            const Random4 r = random4(p, 0, Stream::pixel_point, key);
            rays_.push_back(rays_from_->through(x + double{to_unit(r.x)}, y + double{to_unit(r.y)}));
        });
        hits_.resize(rays_.size());
        scene_.rays().intersect(rays_, hits_, Coherence::coherent);
        at.each([&](int x, int y, std::size_t slot) {
            emission[slot] = vec3(0.0f);
            if (!hits_[slot].found()) return;
            Surface s = scene_.surface(hits_[slot]);
            const bool front = s.turn_toward(rays_[slot].direction);
            if (front || s.emits_back) emission[slot] = s.emission;
            points.push_back({{s.position, s.normal, s.geometric_normal},
                              s.albedo,
                              static_cast<std::uint32_t>(y * g_.width + x),
                              slot});
        });
    }
};

}  // namespace

PathSums trace_paths(const Scene& scene, const LightsView& list, const GBufferView& g,
                     const std::optional<Camera>& camera, const SampleRange& samples, const Params& params) {
    PathSums out{SampleSums(g.pixels()), SampleSums(g.pixels()), SampleSums(g.pixels())};
    const NextEvent lights(scene, list);
    for_blocks(g.width, g.height, [&] {
        return [&, walk = PathWalk(scene, lights, params.max_bounces), first = FirstHits(scene, g, camera),
                points = std::vector<PathPoint>(), direct = std::vector<vec3>(),
                indirect = std::vector<vec3>()](const Block& at) mutable {
            direct.resize(at.pixels());
            indirect.resize(at.pixels());
            for (std::uint32_t i = 0; i < samples.count; ++i) {
                const std::uint32_t s = samples.first + i;  // numbers may wrap: they are only names
                const std::uint32_t key = frame_key(params.seed, s);
                first.find(at, key, points, direct);
                std::fill(indirect.begin(), indirect.end(), vec3(0.0f));
                walk.add_direct(points, 0, key, direct);
                walk.follow(points, key, nullptr, indirect);
                at.each([&](int x, int y, std::size_t slot) {
                    const std::size_t p = static_cast<std::size_t>(y) * g.width + x;
                    out.direct.add(p, direct[slot]);
                    out.indirect.add(p, indirect[slot]);
                    out.colour.add(p, direct[slot] + indirect[slot]);
                });
            }
        };
    });
    return out;
}

SampleSums trace_compensation(const Scene& scene, const GBufferView& g, const SampleRange& samples,
                              const Params& params) {
    SampleSums out(g.pixels());
    const NextEvent lights(scene, {});
    const float clamp = params.clamp_distance * scene.radius();
    const Residual residual{params.falloff, clamp * clamp};
    for_blocks(g.width, g.height, [&] {
        return [&, walk = PathWalk(scene, lights, params.max_bounces), points = std::vector<PathPoint>(),
                light = std::vector<vec3>()](const Block& at) mutable {
            for (std::uint32_t i = 0; i < samples.count; ++i) {
                const std::uint32_t s = samples.first + i;  // numbers may wrap: they are only names
                points.clear();
                light.assign(at.pixels(), vec3(0.0f));
                at.each([&](int x, int y, std::size_t slot) {
                    const std::size_t p = static_cast<std::size_t>(y) * g.width + x;
                    // pi: radiance averaged over the cosine-weighted hemisphere becomes irradiance.
                    if (g.depth[p] > 0)
                        points.push_back({{g.position[p], g.normal[p], g.geometric_normal[p]},
                                          vec3(std::numbers::pi_v<float>),
                                          static_cast<std::uint32_t>(p),
                                          slot});
                });
                walk.follow(points, frame_key(params.seed, s), &residual, light);
                at.each([&](int x, int y, std::size_t slot) {
                    out.add(static_cast<std::size_t>(y) * g.width + x, light[slot]);
                });
            }
        };
    });
    return out;
}

}  // namespace lab
