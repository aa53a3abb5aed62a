#include "lab/light.h"

#include "lab/light_block.h"

namespace lab {

LightingData light(const HierarchyView& h, const GBufferView& g, const Params& params, float scene_radius,
                   bool counts) {
    const std::size_t pixels = g.pixels(), picks = pixels * params.shadow_samples;
    LightingData out;
    out.irradiance.resize(pixels);
    out.light.resize(picks);
    out.target_weight.resize(picks);
    out.weight_sum.resize(pixels);
    if (counts) {
        out.overdraw.assign(pixels * h.cell_size.size(), 0);
        out.lights_used.assign(pixels * h.cell_size.size(), 0);
    }

    const LightFrame frame(h, g, params, scene_radius);
    std::uint64_t visited = 0;
#pragma omp parallel reduction(+ : visited)
    {
        BlockScratch scratch(frame);
#pragma omp for schedule(dynamic)
        for (int block = 0; block < frame.grid.count(); ++block) light_block(frame, block, scratch, out);
        visited = scratch.visited;
    }
    out.visited = visited;
    return out;
}

}  // namespace lab
