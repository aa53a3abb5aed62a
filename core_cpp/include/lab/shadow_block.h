// The shadow rays of one square block of pixels, in the order that traces them fastest.
#pragma once

#include <vector>

#include "lab/radix_sort.h"
#include "lab/ray_packet.h"
#include "lab/shadow_samples.h"
#include "lab/trace_shadow_rays.h"

namespace lab {

// Scratch of one thread, kept from block to block.
class ShadowBlock {
  public:
    ShadowBlock(const Scene& scene, const GBufferView& gbuffer, const LightingView& lighting, const Params& params,
                const Sampler& sampler, const TracePacket& trace, ShadowData& out)
        : scene_(scene),
          g_(gbuffer),
          lighting_(lighting),
          params_(params),
          sampler_(sampler),
          trace_(trace),
          out_(out) {}

    // Blocks are so large that each has some thousand samples to sort, whatever k.
    static int side(int shadow_samples);
    void shade(int left, int top, std::size_t block);

  private:
    const Scene& scene_;
    const GBufferView& g_;
    const LightingView& lighting_;
    const Params& params_;
    const Sampler& sampler_;
    const TracePacket& trace_;
    ShadowData& out_;

    std::size_t block_ = 0;
    std::vector<LitPixel> pixels_;
    std::vector<Keyed> picks_, rays_, spare_;
    std::vector<vec3> share_rgb_;

    void collect(int left, int top);
    void draw_samples();
    void put(SampleChunk& chunk);
    void trace_samples();
    void accumulate();
    void light_directly();
    template <class Candidate>
    void one_ray_each(const Candidate& candidate);
};

}  // namespace lab
