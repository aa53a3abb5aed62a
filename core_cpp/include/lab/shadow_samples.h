// Shadow samples once their lights are picked: where each ray goes and what it counts (LY19 3.3), for a few hundred
// picks at a time.
#pragma once

#include "lab/buffer.h"
#include "lab/contribution.h"
#include "lab/direct_light.h"
#include "lab/params.h"
#include "lab/records.h"

namespace lab {

// A pixel of a block, as its rays see it. Rows of twelve floats: what is picked visits pixels in any order.
struct LitPixel {
    vec3 position;
    float unused0;
    vec3 normal;
    float unused1;
    vec3 origin;  // of its rays, just off the surface
    std::uint32_t pixel;
};

// Samples side by side.
struct SampleChunk {
    static constexpr int capacity = 256;
    int count = 0;
    // Given.
    std::uint32_t receiver[capacity];  // row of the block's lit pixels
    std::uint32_t sample[capacity];    // 0 .. k-1
    std::uint32_t light[capacity];     // merged index
    // Drawn: the point, the input light that lies there (merged index, or -1 for a jittered point), omega.
    float x[capacity], y[capacity], z[capacity], omega[capacity];
    std::int32_t member[capacity];
    // Found: the cell of the point on a curve that fills the scene, so that near cells have near numbers.
    static constexpr int place_bits = 6;  // an axis
    std::uint32_t place[capacity];
};

// The cube around the scene that places are cells of.
struct SampleBox {
    vec3 low;
    float scale;  // cells a length unit
};

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
    Sampler(const HierarchyView& hierarchy, const Params& params, const Scene& scene);

    void draw(const std::vector<LitPixel>& receivers, SampleChunk& chunk) const;

    // Share of a sample per channel, as ShadowEstimator::ratio_rgb defines it: the contribution c_i * omega * F / f.
    vec3 share_rgb(const LitPixel& at, std::uint32_t pick, float omega, float f, float sum) const;

    // What the kernels need; see draw().
    const HierarchyView& hierarchy() const { return h_; }
    const Params& params() const { return params_; }
    std::uint32_t key() const { return key_; }
    const Buffer<MemberRow>& members() const { return members_; }
    const Buffer<GridLightRow>& grid_lights() const { return grid_lights_; }
    Received receive_at(std::uint32_t pick, const LitPixel& at) const;

  private:
    const HierarchyView& h_;
    const Params& params_;
    LightSettings settings_;
    std::uint32_t key_;
    SampleBox box_;
    std::vector<float> scale_;
    Buffer<MemberRow> members_;         // of each input light
    Buffer<GridLightRow> grid_lights_;  // of each merged light after them

    LightTerm term(std::uint32_t pick) const;
    void jitter(const std::vector<LitPixel>& receivers, SampleChunk& chunk) const;
};

}  // namespace lab
