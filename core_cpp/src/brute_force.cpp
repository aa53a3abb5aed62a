#include "lab/brute_force.h"

#include <algorithm>
#include <limits>

#include "lab/all_lights.h"
#include "lab/direct_light.h"
#include "lab/select.h"

namespace lab {
namespace {

constexpr std::size_t chunk_lights = 256;

CommonFalloff falloff_of(const Params& params, float scene_radius) {
    const float clamp = params.clamp_distance * scene_radius, clamp2 = clamp * clamp;
    if (params.falloff == Falloff::softened) return {0.0f, clamp2};
    return {larger(clamp2, std::numeric_limits<float>::min()), 0.0f};
}

// One pixel's estimate; keeps its buffers from pixel to pixel.
class Pixel {
  public:
    Pixel(const Scene& scene, const LightsView& lights, const AllLights& arrays, const Params& params)
        : scene_(scene),
          lights_(lights),
          arrays_(arrays),
          falloff_(falloff_of(params, scene.radius())),
          weight_(arrays.count) {}

    void evaluate(const LitPoint& at, std::uint32_t pixel, int draws, std::uint32_t key, BruteForceData& out,
                  std::size_t slot) {
        weigh_lights(arrays_, at.position, at.normal, falloff_, weight_.data());
        // Over short runs of lights in float, over the runs in double.
        sum_runs(arrays_, weight_.data(), chunk_lights, chunks_);
        std::size_t lit = 0;
        double sum = 0;
        glm::dvec3 unshadowed(0);
        for (const RunSum& c : chunks_) {
            lit += static_cast<std::size_t>(c.lit);
            sum += c.bright;
            unshadowed += glm::dvec3(c.red, c.green, c.blue);
        }
        out.unshadowed[slot] = unshadowed;
        rays_.clear();
        value_.clear();
        if (draws == 0 || lit <= static_cast<std::size_t>(draws)) {
            for (std::size_t i = 0; i < arrays_.count; ++i)
                if (weight_[i] > 0) push(at, i, 1.0);
            trace();
            for (std::size_t i = 0; i < rays_.size(); ++i)
                if (free_[i]) out.irradiance[slot] += value_[i];
            exact_ += 1;
            return;
        }
        draw(at, pixel, draws / 2, key, sum);
        trace();
        const double strata = draws / 2;
        for (std::size_t i = 0; i + 1 < rays_.size(); i += 2) {
            const glm::dvec3 a = free_[i] ? value_[i] : glm::dvec3(0), b = free_[i + 1] ? value_[i + 1] : glm::dvec3(0);
            out.irradiance[slot] += 0.5 * (a + b);
            out.variance[slot] += 0.25 * (a - b) * (a - b);
        }
        out.irradiance[slot] /= strata;
        out.variance[slot] /= strata * strata;
    }

    std::int64_t exact() const { return exact_; }

  private:
    const Scene& scene_;
    const LightsView& lights_;
    const AllLights& arrays_;
    CommonFalloff falloff_;
    std::vector<float> weight_;
    std::vector<RunSum> chunks_;
    std::vector<Ray> rays_;
    std::vector<glm::dvec3> value_;
    std::vector<std::uint8_t> free_;
    std::int64_t exact_ = 0;

    void push(const LitPoint& at, std::size_t i, double scale) {
        rays_.push_back(shadow_ray(scene_, at, lights_.position[i]));
        value_.push_back(scale * double{weight_[i]} * glm::dvec3(lights_.flux[i]));
    }

    // Two lights in each stratum of the running sum of luminance; values are scaled by 1 / probability.
    void draw(const LitPoint& at, std::uint32_t pixel, int strata, std::uint32_t key, double sum) {
        const auto f = [&](std::size_t i) { return double{weight_[i]} * double{arrays_.bright[i]}; };
        std::size_t chunk = 0, i = 0, lit = 0;  // lit: the last light met that sends anything
        double before = 0, below = 0;           // luminance of the chunks before, and of the lights before i
        for (int s = 0; s < strata; ++s) {
            const Random4 r = random4(pixel, static_cast<std::uint32_t>(s), Stream::reference_pick, key);
            const double u = r.x * 0x1p-32, v = r.y * 0x1p-32;
            for (const double x : {std::min(u, v), std::max(u, v)}) {
                const double wanted = (s + x) / strata * sum;
                while (chunk + 1 < chunks_.size() && before + chunks_[chunk].bright <= wanted) {
                    before += chunks_[chunk++].bright;
                    below = before;
                    i = chunk * chunk_lights;
                }
                const std::size_t last = std::min(arrays_.count, (chunk + 1) * chunk_lights);
                // Rounding may end the walk behind the last light of a chunk that sends anything: that one it is.
                while (i < last && (f(i) <= 0 || below + f(i) <= wanted)) {
                    if (f(i) > 0) lit = i;
                    below += f(i++);
                }
                if (i < last) lit = i;
                push(at, lit, f(lit) > 0 ? sum / f(lit) : 0.0);
            }
        }
    }

    void trace() {
        free_.resize(rays_.size());
        scene_.rays().visible(rays_, free_, Coherence::incoherent);
    }
};

}  // namespace

BruteForceData brute_force(const Scene& scene, const LightsView& lights, const GBufferView& g, const RowRange& rows,
                           int draws, std::uint32_t pass, const Params& params) {
    const std::size_t pixels = static_cast<std::size_t>(rows.last - rows.first) * g.width;
    BruteForceData out;
    for (auto* plane : {&out.unshadowed, &out.irradiance, &out.variance}) plane->assign(pixels, glm::dvec3(0));
    const AllLights arrays(lights);
    const std::uint32_t key = frame_key(params.seed, pass);
    std::int64_t exact = 0;
#pragma omp parallel reduction(+ : exact)
    {
        Pixel pixel(scene, lights, arrays, params);
#pragma omp for schedule(dynamic, 16)
        for (std::size_t i = 0; i < pixels; ++i) {
            const std::size_t p = static_cast<std::size_t>(rows.first) * g.width + i;
            if (g.depth[p] > 0)
                pixel.evaluate({g.position[p], g.normal[p], g.geometric_normal[p]}, static_cast<std::uint32_t>(p),
                               draws, key, out, i);
        }
        exact = pixel.exact();
    }
    out.exact_pixels = exact;
    return out;
}

}  // namespace lab
