#include "lab/light_group.h"

namespace lab {

void LightColumns::resize(std::size_t count) {
    count_ = count;
    if (count + vector <= capacity_) return;
    // An odd number of vectors: columns a power of two apart would share their places in the cache.
    capacity_ = std::max<std::size_t>(1024, (count + vector) / vector * 2 * vector) + vector;
    values_.resize(capacity_ * columns);
    slot_.resize(capacity_);
}

void LightColumns::set(std::size_t i, const ReadyLight& light, std::uint32_t slot) {
    const EmissionLobe& lobe = light.lobe;
    const Symmetric& m = lobe.moment;
    const float row[columns] = {light.position.x,
                                light.position.y,
                                light.position.z,
                                lobe.mean.x,
                                lobe.mean.y,
                                lobe.mean.z,
                                m.xx,
                                m.yy,
                                m.zz,
                                m.xy,
                                m.xz,
                                m.yz,
                                light.steepness,
                                light.inner,
                                light.outer};
    for (int c = 0; c < columns; ++c) values_[c * capacity_ + i] = row[c];
    slot_[i] = slot;
}

}  // namespace lab
