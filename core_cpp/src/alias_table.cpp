#include "lab/alias_table.h"

#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "src/alias_table.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace lab {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

constexpr int weight_bits = 36;

// What each item has, in whole numbers of 2^-32 slots. Whole vectors are read and written.
void SetShares(const double* weight, std::size_t count, std::uint64_t* share) {
    const hn::CappedTag<double, AliasTables::vector> d;
    const hn::Rebind<std::int64_t, decltype(d)> di;
    const hn::Rebind<std::uint64_t, decltype(d)> du;
    const std::size_t step = hn::Lanes(d);
    const auto weights = [&](std::size_t i) HWY_ATTR {  // those after the last are others'
        return hn::IfThenElseZero(hn::FirstN(d, count - i), hn::LoadU(d, weight + i));
    };
    auto most = hn::Zero(d);
    for (std::size_t i = 0; i < count; i += step) most = hn::Max(most, weights(i));
    const double largest = hn::GetLane(hn::MaxOfLanes(d, most));
    int exponent = 0;
    std::frexp(largest, &exponent);
    const auto scale = hn::Set(d, largest > 0 ? std::ldexp(1.0, weight_bits - exponent) : 0.0);
    auto sum = hn::Zero(di);
    for (std::size_t i = 0; i < count; i += step) {
        const auto whole = hn::ConvertTo(di, hn::Mul(weights(i), scale));
        hn::StoreU(hn::BitCast(du, whole), du, share + i);
        sum = hn::Add(sum, whole);
    }
    const std::int64_t total = hn::GetLane(hn::SumOfLanes(di, sum));
    const auto each = hn::Set(d, total > 0 ? static_cast<double>(count) * 0x1p32 / static_cast<double>(total) : 0.0);
    for (std::size_t i = 0; i < count; i += step) {
        const auto whole = hn::BitCast(di, hn::LoadU(du, share + i));
        hn::StoreU(hn::BitCast(du, hn::ConvertTo(di, hn::Mul(hn::ConvertTo(d, whole), each))), du, share + i);
    }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace lab
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lab {
namespace {

HWY_EXPORT(SetShares);

constexpr std::uint64_t slot = std::uint64_t{1} << 32;  // what fills one

// Poor items, which don't fill a slot, in their order are filled up by rich ones in theirs. A rich one that has less
// left than a slot takes becomes poor, and the next one fills it up. What rounding leaves over falls to the last.
struct Sweep {
    AliasSlot* table = nullptr;
    const std::uint32_t *item = nullptr, *poor = nullptr, *rich = nullptr;
    const std::uint64_t *poor_share = nullptr, *rich_share = nullptr;
    std::uint32_t poor_count = 0, rich_count = 0, next = 0, from = 0;
    std::uint64_t left = 0;

    bool goes_on() const { return (from + 1 < rich_count) & ((next < poor_count) | (left < slot)); }

    // Without a branch on a share: which fills its slot cannot be foretold.
    void step() {
        const bool spent = left < slot;
        const std::uint32_t giver = rich[from + spent], to = spent ? rich[from] : poor[next];
        const std::uint64_t kept = spent ? left : poor_share[next];
        table[to].other = item[giver];
        table[to].keep = static_cast<std::uint32_t>(kept);
        left = (spent ? rich_share[from + 1] : left) - (slot - kept);
        from += spent;
        next += !spent;
    }

    void finish() {
        if (rich_count == 0) return;  // all are the same, but for rounding
        for (; next < poor_count; ++next) {
            table[poor[next]].other = item[rich[from]];
            table[poor[next]].keep = static_cast<std::uint32_t>(poor_share[next]);
        }
    }
};

}  // namespace

void AliasTables::fill(std::span<AliasSlot> slots, std::span<const std::int64_t> offset,
                       std::span<const std::uint32_t> item, std::span<const double> weight) {
    const std::size_t tables = offset.size() - 1, room = slots.size() + tables + vector;
    share_.resize(slots.size() + vector);
    for (Items* items : {&poor_, &rich_}) {
        items->index.resize(room);
        items->share.resize(room);
    }
    const auto sorted = [&](std::size_t t) {
        const auto first = static_cast<std::size_t>(offset[t] - offset[0]);
        const auto count = static_cast<std::uint32_t>(offset[t + 1] - offset[t]);
        HWY_DYNAMIC_DISPATCH(SetShares)(weight.data() + first, count, share_.data() + first);
        Sweep s;
        s.table = slots.data() + first;
        s.item = item.data() + first;
        const std::uint64_t* share = share_.data() + first;
        const std::size_t at = first + t;  // room for one more item each
        std::uint32_t *const poor = poor_.index.data() + at, *const rich = rich_.index.data() + at;
        std::uint64_t *const poor_share = poor_.share.data() + at, *const rich_share = rich_.share.data() + at;
        for (std::uint32_t i = 0; i < count; ++i) {
            s.table[i] = {s.item[i], s.item[i], 0};
            poor[s.poor_count] = rich[s.rich_count] = i;
            poor_share[s.poor_count] = rich_share[s.rich_count] = share[i];
            const bool less = share[i] < slot;
            s.poor_count += less;
            s.rich_count += !less;
        }
        poor[s.poor_count] = 0;  // looked at after the last, and left
        poor_share[s.poor_count] = 0;
        s.poor = poor;
        s.rich = rich;
        s.poor_share = poor_share;
        s.rich_share = rich_share;
        s.left = rich_share[0];
        return s;
    };
    // Two tables side by side: each step waits for the one before it.
    for (std::size_t t = 0; t < tables; t += 2) {
        Sweep one = sorted(t), two = t + 1 < tables ? sorted(t + 1) : Sweep{};
        while ((static_cast<int>(one.goes_on()) & static_cast<int>(two.goes_on())) != 0) {  // one branch, not two
            one.step();
            two.step();
        }
        while (one.goes_on()) one.step();
        while (two.goes_on()) two.step();
        one.finish();
        two.finish();
    }
}

}  // namespace lab
#endif
