// Members of many picked lights drawn side by side. Part of a Highway region: included once for each instruction set.
#if defined(LAB_MEMBER_LANES_H) == defined(HWY_TARGET_TOGGLE)
#ifdef LAB_MEMBER_LANES_H
#undef LAB_MEMBER_LANES_H
#else
#define LAB_MEMBER_LANES_H
#endif

#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include <cstdint>

#include "lab/random.h"
#include "lab/shadow_samples.h"

HWY_BEFORE_NAMESPACE();
namespace lab {
namespace HWY_NAMESPACE {
namespace {

// So many samples at a time, all of a few pixels: their columns stay in the nearest cache, and so does what is asked
// for until it is read. The last pixel's may be written a little beyond.
constexpr int tile = 16;  // samples that are looked at together, a whole number of vectors
constexpr int capacity = 256, width = capacity + tile;
using Column = float[width];
using Bits = std::uint32_t[width];
static_assert(capacity >= max_shadow_samples && capacity % tile == 0);

// The lower and upper halves of words[index[i]], i < count, side by side: four words at a time. GCC would rather go
// through general registers one by one.
HWY_INLINE void halves_side_by_side(const std::uint64_t* words, const std::uint32_t* index, int count,
                                    std::uint32_t* lower, std::uint32_t* upper) {
    namespace hn = hwy::HWY_NAMESPACE;
    const hn::CappedTag<std::uint64_t, 1> one;
    const hn::Full128<std::uint64_t> two;
    const hn::Full128<std::uint32_t> d;
    for (int i = 0; i < count; i += 4) {
        const auto a = hn::Combine(two, hn::LoadU(one, words + index[i + 1]), hn::LoadU(one, words + index[i]));
        const auto b = hn::Combine(two, hn::LoadU(one, words + index[i + 3]), hn::LoadU(one, words + index[i + 2]));
        hn::StoreU(hn::ConcatEven(d, hn::BitCast(d, b), hn::BitCast(d, a)), d, lower + i);
        hn::StoreU(hn::ConcatOdd(d, hn::BitCast(d, b), hn::BitCast(d, a)), d, upper + i);
    }
}

// Lights on their way down to S0, a column each; `count` is a multiple of a tile.
struct Walk {
    const Sampler& sampler;
    const std::uint32_t inputs;
    const int count;
    std::uint32_t* light;
    Bits random, state;  // the number in use, and what the next is made of
    Bits table;          // the light's, the first for those that have arrived
    Bits slot, rest;     // chosen of the table; see alias_choice()
    Bits lower, upper;   // what was read last: a table's first slot and size, or a packed slot

    Walk(const Sampler& from, int lights, std::uint32_t* column)
        : sampler(from),
          inputs(static_cast<std::uint32_t>(from.hierarchy().input_index.size())),
          count(lights),
          light(column) {}
};

// Returns whether any light has a table yet.
bool find_tables(Walk& w) {
    // What no column's store can change stands by itself: else the loops would not become wide.
    const std::uint32_t* light = w.light;
    const std::uint32_t inputs = w.inputs;
    const int count = w.count;
    std::uint32_t* table = w.table;
    std::uint32_t coarser = 0;
#pragma omp simd reduction(| : coarser)
    for (int j = 0; j < count; ++j) {
        table[j] = light[j] < inputs ? 0 : light[j] - inputs;
        coarser |= light[j] < inputs ? 0u : 1u;
    }
    return coarser != 0;
}

// Chooses a slot in each light's table, and asks for it: while the next tile's are chosen, it comes nearer.
void choose_slots(Walk& w) {
    halves_side_by_side(w.sampler.tables().rows(), w.table, w.count, w.lower, w.upper);
    const PackedSlot* slots = w.sampler.tables().slots();
    const int count = w.count;
    for (int first = 0; first < count; first += tile) {
#pragma omp simd
        for (int j = first; j < first + tile; ++j) {
            const AliasChoice choice = alias_choice(w.upper[j], w.random[j]);
            w.slot[j] = w.lower[j] + choice.slot;
            w.rest[j] = choice.rest;
            w.random[j] = pcg(w.state[j]);
        }
        for (int j = first; j < first + tile; ++j) hwy::Prefetch(slots + w.slot[j]);
    }
}

// The slots' items in the lights' place; those that have arrived at S0 stay.
void take_items(Walk& w) {
    halves_side_by_side(w.sampler.tables().slots(), w.slot, w.count, w.lower, w.upper);
    Bits item;
    const int count = w.count;
    std::uint32_t undecided = 0;
#pragma omp simd reduction(| : undecided)
    for (int j = 0; j < count; ++j) {
        const PackedSlot packed = w.lower[j] | static_cast<PackedSlot>(w.upper[j]) << 32;
        item[j] = packed_item(packed, w.rest[j]);
        undecided |= packed_decides(packed, w.rest[j]) ? 0u : 1u;
    }
    if (undecided != 0) {
        const MembersView& members = w.sampler.hierarchy().members;
        for (int j = 0; j < count; ++j) item[j] = alias_item(members.slot[w.slot[j]], w.rest[j]);
    }
    std::uint32_t* light = w.light;
    const std::uint32_t inputs = w.inputs;
#pragma omp simd
    for (int j = 0; j < count; ++j) light[j] = light[j] < inputs ? light[j] : item[j];
}

// Members of many lights at a time: each is drawn from a finer level, down to S1 and then to S0, by its own sequence of
// random numbers. Nobody waits for memory alone: all take a step before any takes the next.
void draw_members(Walk& w) {
    while (find_tables(w)) {
        choose_slots(w);
        take_items(w);
    }
    for (int j = 0; j < w.count; ++j) hwy::Prefetch(w.sampler.members().data() + w.light[j]);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace lab
HWY_AFTER_NAMESPACE();

#endif
