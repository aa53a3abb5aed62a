#include "lab/brute_force.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "lab/direct_light.h"
#include "lab/luminance.h"
#include "lab/select.h"

namespace lab {
namespace {

constexpr std::size_t chunk_lights = 256;

// Lights in structure-of-arrays form. Written apart from the renderer's own evaluation, which it judges.
struct LightArrays {
    std::vector<float> px, py, pz, nx, ny, nz, isotropic, bright, red, green, blue;
    std::size_t count;

    explicit LightArrays(const LightsView& lights) : count(lights.position.size()) {
        for (auto* a : {&px, &py, &pz, &nx, &ny, &nz, &isotropic, &bright, &red, &green, &blue}) a->resize(count);
        for (std::size_t i = 0; i < count; ++i) {
            const vec3 p = lights.position[i], n = lights.normal[i];
            px[i] = p.x, py[i] = p.y, pz[i] = p.z;
            nx[i] = n.x, ny[i] = n.y, nz[i] = n.z;
            isotropic[i] = n == vec3(0.0f) ? 0.25f : 0.0f;
            bright[i] = luminance(lights.flux[i]);
            red[i] = lights.flux[i].x, green[i] = lights.flux[i].y, blue[i] = lights.flux[i].z;
        }
    }

    // Irradiance per flux from each light at a point, unshadowed.
    void weigh(const vec3& x, const vec3& n, float clamp2, bool softened, std::vector<float>& weight) const {
        const float ax = x.x, ay = x.y, az = x.z, bx = n.x, by = n.y, bz = n.z;
        const float least = softened ? 0.0f : larger(clamp2, std::numeric_limits<float>::min());
        const float more = softened ? clamp2 : 0.0f;
        float* out = weight.data();
#pragma omp simd
        for (std::size_t i = 0; i < count; ++i) {
            const float vx = px[i] - ax, vy = py[i] - ay, vz = pz[i] - az;
            const float d2 = larger(vx * vx + vy * vy + vz * vz, std::numeric_limits<float>::min());
            const float receiver = larger(0.0f, vx * bx + vy * by + vz * bz);
            const float emitter = larger(0.0f, -(vx * nx[i] + vy * ny[i] + vz * nz[i]));
            const float per_distance = 1.0f / std::sqrt(d2);
            const float cosines = receiver * per_distance * (emitter * per_distance + isotropic[i]);
            out[i] = cosines / (larger(d2, least) + more) * std::numbers::inv_pi_v<float>;
        }
    }
};

// One pixel's estimate; keeps its buffers from pixel to pixel.
class Pixel {
  public:
    Pixel(const Scene& scene, const LightsView& lights, const LightArrays& arrays, const Params& params)
        : scene_(scene), lights_(lights), arrays_(arrays), params_(params), weight_(arrays.count) {}

    void evaluate(const LitPoint& at, std::uint32_t pixel, int draws, std::uint32_t key, BruteForceData& out,
                  std::size_t slot) {
        const float clamp = params_.clamp_distance * scene_.radius();
        arrays_.weigh(at.position, at.normal, clamp * clamp, params_.falloff == Falloff::softened, weight_);
        const std::size_t lit = sum_chunks();
        double sum = 0;
        glm::dvec3 unshadowed(0);
        for (const Chunk& c : chunks_) {
            sum += c.bright;
            unshadowed += c.flux;
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
    const LightArrays& arrays_;
    const Params& params_;
    struct Chunk {
        double bright;
        glm::dvec3 flux;
    };
    std::vector<float> weight_;
    std::vector<Chunk> chunks_;
    std::vector<Ray> rays_;
    std::vector<glm::dvec3> value_;
    std::vector<std::uint8_t> free_;
    std::int64_t exact_ = 0;

    void push(const LitPoint& at, std::size_t i, double scale) {
        rays_.push_back(shadow_ray(scene_, at, lights_.position[i]));
        value_.push_back(scale * double{weight_[i]} * glm::dvec3(lights_.flux[i]));
    }

    // Sums over short runs of lights in float, over the runs in double; counts the lights that send anything.
    std::size_t sum_chunks() {
        std::size_t lit = 0;
        chunks_.clear();
        for (std::size_t first = 0; first < arrays_.count; first += chunk_lights) {
            const std::size_t last = std::min(arrays_.count, first + chunk_lights);
            const float *w = weight_.data(), *f = arrays_.bright.data();
            const float *r = arrays_.red.data(), *g = arrays_.green.data(), *b = arrays_.blue.data();
            float bright = 0, red = 0, green = 0, blue = 0;
            int count = 0;
#pragma omp simd reduction(+ : bright, red, green, blue, count)
            for (std::size_t i = first; i < last; ++i) {
                bright += w[i] * f[i];
                red += w[i] * r[i];
                green += w[i] * g[i];
                blue += w[i] * b[i];
                count += w[i] > 0.0f ? 1 : 0;
            }
            lit += static_cast<std::size_t>(count);
            chunks_.push_back({double{bright}, {red, green, blue}});
        }
        return lit;
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
    const LightArrays arrays(lights);
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
