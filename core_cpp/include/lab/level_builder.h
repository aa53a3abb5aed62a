// Builds one level of the hierarchy: every vertex row is owned by one thread, which looks up the lights of
// the four cell rows around it. Scatter and gather of LY19 3.1 differ here in their source, S0 or S1; neither
// needs atomics.
#pragma once

#include <cstdint>
#include <vector>

#include "lab/alias_table.h"
#include "lab/grid.h"
#include "lab/params.h"
#include "lab/records.h"
#include "lab/row_index.h"

namespace lab {

// The lights that a level is built from: S0 (input lights) or S1.
struct LevelSource {
    std::vector<vec3> position, flux, normal;
    std::vector<Symmetric> normal_moment;
    std::vector<vec3> deviation;           // S1: inner spread of a light; empty for S0
    std::vector<float> weight;             // S1: sum of trilinear weights; empty for S0, where it is 1
    std::vector<Vertex> vertex;            // S1: its vertex; empty for S0
    std::vector<std::uint8_t> oriented;    // 0: no normals in it
    float flux_scale = 1.0f;               // power of two above every flux of S0
    std::uint32_t first_merged_index = 0;  // of the source's lights

    bool is_s1() const { return !vertex.empty(); }
};

// The compacted lights of one level, in grid order, and their member lists if asked for.
struct LevelLights {
    std::vector<vec3> position, flux, normal, deviation;
    std::vector<Symmetric> normal_moment;
    std::vector<Vertex> vertex;
    std::vector<std::uint8_t> oriented;
    std::vector<float> weight;
    std::vector<std::uint32_t> member_count;
    std::vector<AliasSlot> member;

    std::size_t size() const { return position.size(); }
    void append(LevelLights&& other);
};

LevelLights build_level(const LevelSource& source, const Grid& grid, int level, const Params& params,
                        bool with_members);

// How many vertices of `level` would be kept, without building it.
std::int64_t count_level(const LevelSource& source, const Grid& grid, int level);

}  // namespace lab
