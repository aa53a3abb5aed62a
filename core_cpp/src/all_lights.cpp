#include "lab/all_lights.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "lab/luminance.h"
#include "lab/select.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "src/all_lights.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace lab {
namespace HWY_NAMESPACE {
namespace {

void weigh(const AllLights& lights, const vec3& x, const vec3& n, const CommonFalloff& falloff, float* weight) {
    const float ax = x.x, ay = x.y, az = x.z, bx = n.x, by = n.y, bz = n.z;
    const float least = falloff.least, more = falloff.more;
    const float *px = lights.px.data(), *py = lights.py.data(), *pz = lights.pz.data();
    const float *nx = lights.nx.data(), *ny = lights.ny.data(), *nz = lights.nz.data();
    const float* isotropic = lights.isotropic.data();
#pragma omp simd
    for (std::size_t i = 0; i < lights.count; ++i) {
        const float vx = px[i] - ax, vy = py[i] - ay, vz = pz[i] - az;
        const float d2 = larger(vx * vx + vy * vy + vz * vz, std::numeric_limits<float>::min());
        const float receiver = larger(0.0f, vx * bx + vy * by + vz * bz);
        const float emitter = larger(0.0f, -(vx * nx[i] + vy * ny[i] + vz * nz[i]));
        const float per_distance = 1.0f / std::sqrt(d2);
        const float cosines = receiver * per_distance * (emitter * per_distance + isotropic[i]);
        weight[i] = cosines / (larger(d2, least) + more) * std::numbers::inv_pi_v<float>;
    }
}

RunSum sum_run(const AllLights& lights, const float* w, std::size_t first, std::size_t last) {
    const float *f = lights.bright.data(), *r = lights.red.data(), *g = lights.green.data(), *b = lights.blue.data();
    float bright = 0, red = 0, green = 0, blue = 0;
    int lit = 0;
#pragma omp simd reduction(+ : bright, red, green, blue, lit)
    for (std::size_t i = first; i < last; ++i) {
        bright += w[i] * f[i];
        red += w[i] * r[i];
        green += w[i] * g[i];
        blue += w[i] * b[i];
        lit += w[i] > 0.0f ? 1 : 0;
    }
    return {bright, red, green, blue, lit};
}

void sum_all_runs(const AllLights& lights, const float* weight, std::size_t run, std::vector<RunSum>& sums) {
    sums.clear();
    for (std::size_t first = 0; first < lights.count; first += run)
        sums.push_back(sum_run(lights, weight, first, std::min(lights.count, first + run)));
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace lab
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lab {

HWY_EXPORT(weigh);
HWY_EXPORT(sum_all_runs);

AllLights::AllLights(const LightsView& lights) : count(lights.position.size()) {
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

void weigh_lights(const AllLights& lights, const vec3& x, const vec3& n, const CommonFalloff& falloff, float* weight) {
    HWY_DYNAMIC_DISPATCH(weigh)(lights, x, n, falloff, weight);
}

void sum_runs(const AllLights& lights, const float* weight, std::size_t run, std::vector<RunSum>& sums) {
    HWY_DYNAMIC_DISPATCH(sum_all_runs)(lights, weight, run, sums);
}

}  // namespace lab
#endif
