#include "lab/alias_table.h"

#include <cmath>

namespace lab {
namespace {

constexpr int weight_bits = 36;
constexpr std::uint64_t slot = std::uint64_t{1} << 32;  // what fills one

}  // namespace

void AliasTables::set_shares(std::span<const double> weight) {
    double largest = 0.0;
    for (const double w : weight) largest = w > largest ? w : largest;
    int exponent = 0;
    std::frexp(largest, &exponent);
    const double scale = largest > 0 ? std::ldexp(1.0, weight_bits - exponent) : 0.0;
    share_.resize(weight.size());
    std::int64_t total = 0;
    for (std::size_t i = 0; i < weight.size(); ++i) {
        const auto whole = static_cast<std::int64_t>(weight[i] * scale);
        share_[i] = static_cast<std::uint64_t>(whole);
        total += whole;
    }
    const double each = total > 0 ? static_cast<double>(weight.size()) * 0x1p32 / static_cast<double>(total) : 0.0;
    for (std::uint64_t& share : share_)
        share = static_cast<std::uint64_t>(
            static_cast<std::int64_t>(static_cast<double>(static_cast<std::int64_t>(share)) * each));
}

void AliasTables::fill(std::span<AliasSlot> table, std::span<const double> weight) {
    const auto count = static_cast<std::uint32_t>(table.size());
    set_shares(weight);
    // Nothing below branches on a share: which fills its slot cannot be foretold.
    poor_.resize(count + 1);
    rich_.resize(count + 1);
    std::uint32_t poor = 0, rich = 0;
    for (std::uint32_t i = 0; i < count; ++i) {
        table[i].other = table[i].own;
        table[i].keep = 0;
        poor_[poor] = i;
        rich_[rich] = i;
        const bool less = share_[i] < slot;
        poor += less;
        rich += !less;
    }
    if (rich == 0) return;  // all are the same, but for rounding
    // Poor items in their order are filled up by rich ones in theirs. A rich one that has less left than a slot takes
    // becomes poor, and the next one fills it up. What rounding leaves over falls to the last.
    poor_[poor] = 0;
    std::uint32_t next = 0, from = 0;
    std::uint64_t left = share_[rich_[0]];
    while (from + 1 < rich && (next < poor || left < slot)) {
        const bool spent = left < slot;
        const std::uint32_t giver = rich_[from + spent], to = spent ? rich_[from] : poor_[next];
        const std::uint64_t kept = spent ? left : share_[poor_[next]];
        table[to].other = table[giver].own;
        table[to].keep = static_cast<std::uint32_t>(kept);
        left = (spent ? share_[giver] : left) - (slot - kept);
        from += spent;
        next += !spent;
    }
    for (; next < poor; ++next) {
        table[poor_[next]].other = table[rich_[from]].own;
        table[poor_[next]].keep = static_cast<std::uint32_t>(share_[poor_[next]]);
    }
}

}  // namespace lab
