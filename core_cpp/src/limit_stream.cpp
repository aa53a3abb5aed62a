#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "src/limit_stream.cpp"
#include <hwy/foreach_target.h>
// Above: this file once more for each instruction set.
#include <omp.h>

#include <algorithm>
#include <cstdint>
#include <stdexcept>

#include <hwy/highway.h>

#include "lab/buffer.h"
#include "lab/limits.h"

HWY_BEFORE_NAMESPACE();
namespace lab {
namespace HWY_NAMESPACE {
namespace {

// In 16 sums of their own, so that no addition waits for another: one sum would read no faster than it adds.
std::uint64_t sum(const std::uint64_t* values, std::size_t count) {
    constexpr std::size_t sums = 16;
    std::uint64_t total[sums] = {};
    std::size_t i = 0;
    for (; i + sums <= count; i += sums)
#pragma omp simd
        for (std::size_t j = 0; j < sums; ++j) total[j] += values[i + j];
    std::uint64_t all = 0;
    for (const std::uint64_t part : total) all += part;
    for (; i < count; ++i) all += values[i];
    return all;
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace lab
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lab {
namespace {

HWY_EXPORT(sum);

}  // namespace

double stream_rate(std::size_t bytes, int passes) {
    const std::size_t count = bytes / sizeof(std::uint64_t);
    if (count == 0 || passes < 1) throw std::invalid_argument("stream_rate: needs eight bytes and one pass, at least");
    Buffer<std::uint64_t> values(count);
    double best = 0;
    // Each thread first writes, then reads, a run of its own.
    for (int pass = -1; pass < passes; ++pass) {
        std::uint64_t total = 0;
        const double start = omp_get_wtime();
#pragma omp parallel reduction(+ : total)
        {
            const std::size_t threads = omp_get_num_threads(), t = omp_get_thread_num();
            const std::size_t first = count * t / threads, last = count * (t + 1) / threads;
            if (pass < 0)
                std::fill(values.data() + first, values.data() + last, std::uint64_t{1});
            else
                total = HWY_DYNAMIC_DISPATCH(sum)(values.data() + first, last - first);
        }
        const double seconds = omp_get_wtime() - start;
        if (pass < 0) continue;
        if (total != count) throw std::logic_error("stream_rate: what was read is not what was written");
        best = std::max(best, static_cast<double>(count * sizeof(std::uint64_t)) / seconds);
    }
    return best;
}

}  // namespace lab
#endif
