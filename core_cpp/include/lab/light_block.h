// A block of pixels being lit: it finds the lights in its reach, deals them to interleaving tiles, and lights its
// groups of pixels one after the other, each by the lights that may reach it.
#pragma once

#include <span>

#include "lab/light.h"
#include "lab/light_picks.h"
#include "lab/light_rows.h"

namespace lab {

// How a picture is cut: blocks of pixels, in them patches of one interleaving tile's pixels, in them groups.
struct BlockGrid {
    int width, height, interleave;
    int block_x, block_y, patch_x, patch_y;  // pixels

    explicit BlockGrid(const GBufferView& gbuffer, int interleave);
    int across() const { return (width + block_x - 1) / block_x; }
    int count() const { return across() * ((height + block_y - 1) / block_y); }
};

// All that a frame's blocks have in common.
struct LightFrame {
    const HierarchyView& hierarchy;
    const GBufferView& gbuffer;
    LightSettings settings;
    PickSettings picks;
    BlockGrid grid;
    std::vector<bool> dealt;      // is a level dealt?
    std::vector<LightRows> rows;  // of each level
    ReadyLights lights;
    Buffer<std::uint8_t> tile_of;  // interleaving tile of each light, where there are several
    std::uint32_t first_pick;      // merged index that shadow samples are picked from, up

    LightFrame(const HierarchyView& hierarchy, const GBufferView& gbuffer, const Params& params, float scene_radius);
};

// The pixels of one patch: groups [begin, end).
struct Patch {
    std::size_t begin, end;
    int tile;
};

// What a thread needs to light a block; kept from block to block.
struct BlockScratch {
    std::vector<PixelGroup> groups;
    std::vector<Patch> patches;
    std::vector<std::uint32_t> pixels;  // of a patch
    std::vector<float> radii;           // of its groups
    std::vector<std::size_t> regrouped;
    std::vector<ReadyLight> lights;   // in reach of the block, ascending
    std::vector<LightColumns> dealt;  // those of each interleaving tile
    LightColumns near;                // those in reach of a patch
    std::vector<std::uint32_t> kept, list;
    GroupPicks picks;
    LightBatch batch;
    std::uint64_t visited = 0;  // pairs of pixel and light evaluated, idle lanes included

    explicit BlockScratch(const LightFrame& frame)
        : dealt(frame.grid.interleave * frame.grid.interleave), picks(frame.picks.samples) {}
};

// Takes the block's pixels that see a surface into groups, whose bounds are not set; the others stay dark in `out`.
void load_block(const LightFrame& frame, int block, BlockScratch& scratch, LightingData& out);

// Makes new groups of the pixels whose groups lie across an edge or a bend; `scratch.regrouped` says which changed.
void regroup(const LightFrame& frame, const Patch& patch, BlockScratch& scratch);

// Finds the lights in reach of the block's groups, and deals them.
void find_lights(const LightFrame& frame, BlockScratch& scratch);

void light_block(const LightFrame& frame, int block, BlockScratch& scratch, LightingData& out);

}  // namespace lab
