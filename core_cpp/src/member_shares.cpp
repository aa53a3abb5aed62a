#include "lab/member_shares.h"

#include <algorithm>

namespace lab {
namespace {

// Calls visit(light, probability) for both lights of every slot of a row.
template <class Visit>
void for_slots(const HierarchyView& h, std::size_t light, const Visit& visit) {
    const std::size_t row = light - h.input_index.size();
    const std::int64_t first = h.members.offset[row], last = h.members.offset[row + 1];
    const double slot_share = 1.0 / static_cast<double>(std::max<std::int64_t>(1, last - first));
    for (std::int64_t s = first; s < last; ++s) {
        const AliasSlot slot = h.members.slot[static_cast<std::size_t>(s)];
        const double keep = slot.keep * 0x1p-32;
        visit(slot.own, slot_share * keep);
        visit(slot.other, slot_share * (1 - keep));
    }
}

}  // namespace

std::vector<double> member_sums(const HierarchyView& h, std::vector<double> weight) {
    // Members are of finer levels, which come first: going down the merged buffer, what a light has is whole when it
    // is met.
    const std::size_t inputs = h.input_index.size();
    for (std::size_t light = weight.size(); light-- > inputs;) {
        const double mine = weight[light];
        if (mine > 0) for_slots(h, light, [&](std::uint32_t member, double part) { weight[member] += mine * part; });
    }
    weight.resize(inputs);
    return weight;
}

MemberShares member_shares(const HierarchyView& h, std::uint32_t index) {
    if (index < h.input_index.size()) return {{index}, {1.0}};
    std::vector<double> one(std::size_t{index} + 1, 0.0);
    one[index] = 1;
    const std::vector<double> share = member_sums(h, std::move(one));
    MemberShares out;
    for (std::size_t light = 0; light < share.size(); ++light)
        if (share[light] > 0) {
            out.member.push_back(static_cast<std::uint32_t>(light));
            out.share.push_back(share[light]);
        }
    return out;
}

std::vector<double> member_means(const HierarchyView& h, std::span<const double> values, std::size_t columns) {
    std::vector<double> mean(h.position.size() * columns, 0.0);
    std::copy(values.begin(), values.end(), mean.begin());
    for (int level = 1; level <= h.top(); ++level)
#pragma omp parallel for schedule(dynamic, 64)
        for (std::int64_t light = h.offset[level]; light < h.offset[level + 1]; ++light)
            for_slots(h, static_cast<std::size_t>(light), [&](std::uint32_t member, double part) {
                for (std::size_t c = 0; c < columns; ++c)
                    mean[static_cast<std::size_t>(light) * columns + c] += part * mean[member * columns + c];
            });
    return mean;
}

}  // namespace lab
