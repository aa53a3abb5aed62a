// The shadow rays of one square block of pixels, in the order that traces them fastest.
#pragma once

#include <vector>

#include "lab/radix_sort.h"
#include "lab/ray_order.h"
#include "lab/ray_packet.h"
#include "lab/shadow_samples.h"
#include "lab/trace_shadow_rays.h"

namespace lab {

// Scratch of one thread, kept from block to block.
class ShadowBlock {
  public:
    ShadowBlock(const Scene& scene, const Sampler& sampler, const RayOrder& order, const TracePacket& trace,
                ShadowData& out)
        : scene_(scene),
          sampler_(sampler),
          g_(sampler.gbuffer()),
          lighting_(sampler.lighting()),
          params_(sampler.params()),
          order_(order),
          trace_(trace),
          out_(out) {}

    // Blocks are so large that each has some thousand samples to sort, whatever k.
    static int side(int shadow_samples);
    // Traces what was drawn for the pixels from (left, top), and sums it up.
    void shade(int left, int top, std::size_t block);

  private:
    const Scene& scene_;
    const Sampler& sampler_;
    const GBufferView& g_;
    const LightingView& lighting_;
    const Params& params_;
    const RayOrder& order_;
    const TracePacket& trace_;
    ShadowData& out_;

    std::size_t block_ = 0;
    int left_ = 0, right_ = 0, top_ = 0, bottom_ = 0;
    // Of the block's pixels, row by row.
    std::vector<RayRow> origins_;
    std::vector<vec3> direct_, area_;
    // Of their samples.
    std::vector<RayRow> directions_;
    std::vector<std::uint8_t> free_;
    std::vector<Keyed> rays_, spare_;
    std::vector<std::uint32_t> place_;

    int across() const { return right_ - left_; }
    // Number of a pixel in the image, and its number in the block.
    std::size_t pixel(int x, int y) const { return static_cast<std::size_t>(y) * g_.width + x; }
    std::uint32_t row(int x, int y) const { return static_cast<std::uint32_t>((y - top_) * across() + (x - left_)); }
    void find_origins();
    void collect_rays();
    void trace_samples();
    void accumulate();
    void light_directly();
    void store_direct();
    template <class Visit>
    void for_seen(const Visit& visit) const;
    template <class Candidate>
    void one_ray_each(const Candidate& candidate);
};

}  // namespace lab
