// A block of pixels being lit: it finds the lights in its reach, and lights its clusters of pixels one after the other,
// each by the lights that may reach it.
#pragma once

#include <span>

#include "lab/dealt_lists.h"
#include "lab/light.h"
#include "lab/light_picks.h"
#include "lab/light_rows.h"

namespace lab {

// How a picture is cut: blocks of pixels, in them patches, in them clusters of squares. A square is one pixel of each
// interleaving tile.
struct BlockGrid {
    int width, height, interleave;
    int block_x, block_y, patch_x, patch_y;  // pixels; a square is `interleave` wide

    explicit BlockGrid(const GBufferView& gbuffer, int interleave);
    int across() const { return (width + block_x - 1) / block_x; }
    int count() const { return across() * ((height + block_y - 1) / block_y); }
    int tiles() const { return interleave * interleave; }
};

// All that a frame's blocks have in common.
struct LightFrame {
    const HierarchyView& hierarchy;
    const GBufferView& gbuffer;
    LightSettings settings;
    PickSettings picks;
    BlockGrid grid;
    std::vector<LightRows> rows;  // of each level
    ReadyLights lights;
    Buffer<std::uint8_t> tile_of;  // interleaving tile of each light, or every_tile, where there are several
    std::uint32_t first_pick;      // merged index that shadow samples are picked from, up

    LightFrame(const HierarchyView& hierarchy, const GBufferView& gbuffer, const Params& params, float scene_radius);
};

// As many squares as a group has lanes: one group for each interleaving tile, and the same lights in reach of all.
struct Cluster {
    GroupBounds bounds;
    std::uint32_t square[group_lanes];  // their first pixels
    std::uint32_t count;
};

// Where a square lies.
struct SquareSite {
    vec3 at;
    std::uint32_t square;
};

// Neighbouring clusters [begin, end).
struct Patch {
    std::size_t begin, end;
};

// What a thread needs to light a block; kept from block to block.
struct BlockScratch {
    std::vector<Cluster> clusters;
    Buffer<PixelGroup> groups;  // of the clusters, in order of tiles
    std::vector<Patch> patches;
    std::vector<std::uint32_t> squares;  // of a patch
    std::vector<SquareSite> sites;
    std::vector<float> radii;  // of its clusters
    std::vector<std::size_t> regrouped;
    std::vector<std::uint32_t> found;
    Buffer<ReadyLight> lights;            // in reach of the block, ascending
    Buffer<std::uint8_t> tile_of;         // of these
    LightColumns in_block, in_patch;      // the same, and those in reach of a patch
    std::vector<std::uint32_t> kept;      // those in reach of a cluster
    DealtLists lists;                     // and those dealt to each of its groups
    std::vector<std::uint32_t> reaching;  // and to some pixel of one
    GroupPicks picks;
    LightBatch batch;
    std::uint64_t visited = 0;  // pairs of pixel and light evaluated, idle lanes included

    explicit BlockScratch(const LightFrame& frame) : picks(frame.picks.samples) {}
};

// Takes the block's pixels that see a surface into clusters, whose bounds are not set; the others stay dark in `out`.
void load_block(const LightFrame& frame, int block, BlockScratch& scratch, LightingData& out);

// Makes new clusters of the squares whose clusters lie across an edge or a bend; `scratch.regrouped` says which
// changed.
void regroup(const LightFrame& frame, const Patch& patch, BlockScratch& scratch);

// Finds the lights in reach of the block's clusters; `cubes`: also those that only a cube as large would reach.
void find_lights(const LightFrame& frame, bool cubes, BlockScratch& scratch);

void light_block(const LightFrame& frame, int block, BlockScratch& scratch, LightingData& out);

}  // namespace lab
