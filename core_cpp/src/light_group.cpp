#include "lab/light_group.h"

#include <algorithm>

namespace lab {

void LightColumns::reserve(std::size_t count) {
    if (count + vector <= capacity_) return;
    // An odd number of vectors: columns a power of two apart would share their places in the cache.
    const std::size_t capacity = std::max<std::size_t>(1024, (count + vector) / vector * 2 * vector) + vector;
    std::vector<float> values(capacity * columns);
    for (std::size_t c = 0; c < columns; ++c)
        std::copy_n(values_.begin() + c * capacity_, count_, values.begin() + c * capacity);
    values_ = std::move(values);
    slot_.resize(capacity);
    capacity_ = capacity;
}

void LightColumns::push(const ReadyLight& light, std::uint32_t slot) {
    reserve(count_ + 1);
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
    for (int c = 0; c < columns; ++c) values_[c * capacity_ + count_] = row[c];
    slot_[count_++] = slot;
}

void LightColumns::assign(const LightColumns& from, const std::uint32_t* rows, std::size_t count) {
    count_ = 0;
    reserve(count);
    count_ = count;
    for (int c = 0; c < columns; ++c) {
        const float* in = from.values_.data() + c * from.capacity_;
        float* out = values_.data() + c * capacity_;
        for (std::size_t i = 0; i < count; ++i) out[i] = in[rows[i]];
    }
    for (std::size_t i = 0; i < count; ++i) slot_[i] = from.slot_[rows[i]];
}

}  // namespace lab
