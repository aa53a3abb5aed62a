#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "src/stream_copy.cpp"
#include <hwy/foreach_target.h>

#include <cstdint>
#include <cstring>

#include "lab/stream_copy.h"

#include <hwy/cache_control.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace lab {
namespace HWY_NAMESPACE {
namespace {

void StreamBytes(std::uint8_t* to, const std::uint8_t* from, std::size_t bytes) {
    namespace hn = hwy::HWY_NAMESPACE;
    const hn::ScalableTag<std::uint8_t> d;
    const std::size_t width = hn::Lanes(d);
    std::size_t done = (width - reinterpret_cast<std::uintptr_t>(to) % width) % width;
    done = done < bytes ? done : bytes;
    std::memcpy(to, from, done);
    for (; done + width <= bytes; done += width) hn::Stream(hn::LoadU(d, from + done), d, to + done);
    std::memcpy(to + done, from + done, bytes - done);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace lab
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lab {

HWY_EXPORT(StreamBytes);

void stream_bytes(void* to, const void* from, std::size_t bytes) {
    HWY_DYNAMIC_DISPATCH(StreamBytes)(static_cast<std::uint8_t*>(to), static_cast<const std::uint8_t*>(from), bytes);
}

void finish_streams() {
    hwy::FlushStream();
}

}  // namespace lab
#endif
