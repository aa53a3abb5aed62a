// Shadow samples once their lights are picked: where each ray goes and what it counts (LY19 3.3).
#pragma once

#include "lab/buffer.h"
#include "lab/contribution.h"
#include "lab/packed_slots.h"
#include "lab/params.h"
#include "lab/records.h"
#include "lab/scene.h"
#include "lab/trace_shadow_rays.h"

namespace lab {

// Lights as drawing looks at them, one row of a cache line's width each.
struct MemberRow {
    vec3 position;
    float constant;  // emission of a light without a normal, to every side
    vec3 normal;
    float unused;
};
struct GridLightRow {
    vec3 position;
    EmissionLobe lobe;
    float unused[3];
};

class Sampler {
  public:
    Sampler(const HierarchyView& hierarchy, const GBufferView& gbuffer, const LightingView& lighting,
            const Params& params, const Scene& scene);

    // Point, member and omega of all samples of pixels first .. first + count - 1.
    void draw(std::size_t first, std::size_t count, ShadowData& out) const;

    // Share of a sample per channel, as ShadowEstimator::ratio_rgb defines it: the contribution c_i * omega * F / f.
    vec3 share_rgb(std::size_t pixel, std::size_t slot, float omega) const;

    // What the kernels need; see draw().
    const HierarchyView& hierarchy() const { return h_; }
    const GBufferView& gbuffer() const { return g_; }
    const LightingView& lighting() const { return lighting_; }
    const Params& params() const { return params_; }
    std::uint32_t key() const { return key_; }
    const Buffer<MemberRow>& members() const { return members_; }
    const Buffer<GridLightRow>& grid_lights() const { return grid_lights_; }
    const PackedTables& tables() const { return tables_; }
    Received receive_at(std::uint32_t pick, std::size_t pixel) const;

  private:
    const HierarchyView& h_;
    const GBufferView& g_;
    const LightingView& lighting_;
    const Params& params_;
    LightSettings settings_;
    std::uint32_t key_;
    std::vector<float> scale_;
    Buffer<MemberRow> members_;         // of each input light
    Buffer<GridLightRow> grid_lights_;  // of each merged light after them
    PackedTables tables_;               // of the hierarchy's members

    LightTerm term(std::uint32_t pick) const;
    void jitter(std::size_t first, std::size_t count, ShadowData& out) const;
};

}  // namespace lab
