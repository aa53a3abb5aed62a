// The shadow rays of one square block of pixels, in the order that traces them fastest.
#pragma once

#include <vector>

#include "lab/ray_order.h"
#include "lab/ray_packet.h"
#include "lab/shadow_samples.h"
#include "lab/trace_shadow_rays.h"

namespace lab {

// A part of an image, 2^n pixels wide and high where the image does not end.
struct PixelSquare {
    int left, top, side;
};

// What one thread does at a time: so large that each has some thousand samples to sort, whatever their number a pixel.
std::vector<PixelSquare> shadow_blocks(const GBufferView& gbuffer, const Params& params);

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

    // Traces what was drawn for the pixels of one of the blocks, and sums it up.
    void shade(const PixelSquare& square, std::size_t block);

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
    int side_ = 0, left_ = 0, right_ = 0, top_ = 0, bottom_ = 0;
    // Of the block's pixels, row by row, side_ to a row.
    std::vector<RayOrigin> origins_;
    std::vector<vec3> direct_, area_;
    std::vector<float> cosine_;  // to a sun
    // Of their samples, numbered in the same way.
    std::vector<std::uint8_t> free_;
    std::vector<RayKey> rays_, spare_;
    std::size_t count_ = 0;  // of the rays
    // Of a row.
    std::vector<float> share_, weight_, shadowed_;

    int across() const { return right_ - left_; }
    // Number of a pixel in the image, and its number in the block.
    std::size_t pixel(int x, int y) const { return static_cast<std::size_t>(y) * g_.width + x; }
    std::uint32_t row(int x, int y) const { return static_cast<std::uint32_t>((y - top_) * side_ + (x - left_)); }
    void find_origins();
    void collect_rays();
    void trace_samples();
    void accumulate();
    void accumulate_rgb();
    void light_directly();
    void light_by(const SunLight& sun);
    void store_direct();
    template <class Visit>
    void for_squares(const Visit& visit) const;
    template <class Visit>
    void for_seen(const Visit& visit) const;
    template <class Candidate>
    void one_ray_each(const Candidate& candidate);
};

}  // namespace lab
