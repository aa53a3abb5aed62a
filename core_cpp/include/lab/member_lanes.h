// Members of many picked lights drawn side by side. Part of a Highway region: included once for each instruction set.
#if defined(LAB_MEMBER_LANES_H) == defined(HWY_TARGET_TOGGLE)
#ifdef LAB_MEMBER_LANES_H
#undef LAB_MEMBER_LANES_H
#else
#define LAB_MEMBER_LANES_H
#endif

#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cstdint>

#include "lab/random.h"
#include "lab/shadow_samples.h"

HWY_BEFORE_NAMESPACE();
namespace lab {
namespace HWY_NAMESPACE {
namespace {

// So many samples at a time, all of a few pixels: their columns stay in the nearest cache. The last pixel's may be
// written a little beyond.
constexpr int capacity = 256, width = capacity + 16;
using Column = float[width];
using Bits = std::uint32_t[width];
static_assert(capacity >= max_shadow_samples);

struct RandomColumns {
    Bits x, y;
};

// The next numbers of all sequences.
void advance(RandomColumns& random, int count) {
#pragma omp simd
    for (int j = 0; j < count; ++j) random.x[j] = pcg(random.y[j]);
}

// The slots that random numbers choose in the lights' tables. Loops that do little keep many loads on their way at
// once.
struct ChosenSlots {
    std::uint64_t slot[width];
    Bits rest;
};

void choose_slots(const HierarchyView& h, const PackedSlot* slots, const std::uint32_t* light,
                  const RandomColumns& random, int count, ChosenSlots& out) {
    const auto inputs = static_cast<std::uint32_t>(h.input_index.size());
    const std::int64_t* offset = h.members.offset.data();
    std::uint64_t first[width];
    Bits size;
    for (int j = 0; j < count; ++j) {
        const std::size_t row = light[j] < inputs ? 0 : light[j] - inputs;
        first[j] = static_cast<std::uint64_t>(offset[row]);
        size[j] = static_cast<std::uint32_t>(offset[row + 1] - offset[row]);
    }
#pragma omp simd
    for (int j = 0; j < count; ++j) {
        const AliasChoice choice = alias_choice(size[j], random.x[j]);
        out.slot[j] = first[j] + choice.slot;
        out.rest[j] = choice.rest;
    }
    for (int j = 0; j < count; ++j) hwy::Prefetch(slots + out.slot[j]);
}

// The slots' items in the lights' place; those that have arrived at S0 go along unchanged. Returns whether all have.
bool take_items(const HierarchyView& h, const PackedSlot* slots, const ChosenSlots& chosen, int count,
                std::uint32_t* light) {
    const auto inputs = static_cast<std::uint32_t>(h.input_index.size());
    PackedSlot packed[width];
    Bits item;
    for (int j = 0; j < count; ++j) packed[j] = slots[chosen.slot[j]];
    std::uint32_t undecided = 0;
#pragma omp simd reduction(| : undecided)
    for (int j = 0; j < count; ++j) {
        item[j] = packed_item(packed[j], chosen.rest[j]);
        undecided |= packed_decides(packed[j], chosen.rest[j]) ? 0u : 1u;
    }
    if (undecided != 0)
        for (int j = 0; j < count; ++j) item[j] = alias_item(h.members.slot[chosen.slot[j]], chosen.rest[j]);
    std::uint32_t coarser = 0;
#pragma omp simd reduction(| : coarser)
    for (int j = 0; j < count; ++j) {
        light[j] = light[j] < inputs ? light[j] : item[j];
        coarser |= light[j] < inputs ? 0u : 1u;
    }
    return coarser == 0;
}

// What is read of the lights next: their rows in S0, or where their tables lie.
void ask_for(const HierarchyView& h, const MemberRow* rows, const std::uint32_t* light, int count) {
    const auto inputs = static_cast<std::uint32_t>(h.input_index.size());
    const auto row = reinterpret_cast<std::uintptr_t>(rows);
    const auto offset = reinterpret_cast<std::uintptr_t>(h.members.offset.data());
    std::uintptr_t next[width];
#pragma omp simd
    for (int j = 0; j < count; ++j) {
        const std::uintptr_t i = light[j];
        next[j] = light[j] < inputs ? row + i * sizeof(MemberRow) : offset + (i - inputs) * sizeof(std::int64_t);
    }
    for (int j = 0; j < count; ++j) hwy::Prefetch(reinterpret_cast<const char*>(next[j]));
}

// Members of many lights at a time: each is drawn from a finer level, down to S1 and then to S0. The memory that a step
// will read is asked for while the others' addresses are found, so that nobody waits for it alone.
void draw_members(const Sampler& sampler, RandomColumns& random, int count, std::uint32_t* light) {
    const HierarchyView& h = sampler.hierarchy();
    const PackedSlot* slots = sampler.slots().data();
    const MemberRow* rows = sampler.members().data();
    const std::uint32_t coarsest = *std::max_element(light, light + count);
    bool arrived = coarsest < h.input_index.size();
    ask_for(h, rows, light, count);
    while (!arrived) {
        ChosenSlots chosen;
        choose_slots(h, slots, light, random, count, chosen);
        advance(random, count);
        arrived = take_items(h, slots, chosen, count, light);
        ask_for(h, rows, light, count);
    }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace lab
HWY_AFTER_NAMESPACE();

#endif
