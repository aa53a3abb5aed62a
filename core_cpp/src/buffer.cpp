#include "lab/buffer.h"

#include <algorithm>
#include <cstdlib>
#include <mutex>

#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace lab::pool {
namespace {

constexpr std::size_t page = std::size_t{1} << 21;  // a huge page

std::size_t rounded(std::size_t bytes) {
    return (bytes + page - 1) / page * page;
}

struct Block {
    void* start;
    std::size_t size;
};

std::mutex mutex;
std::vector<Block> kept;  // oldest first
std::size_t in_use = 0, kept_bytes = 0, most_in_use = 0;
int keepers = 0;

void forget_oldest_beyond(std::size_t bytes) {
    std::size_t gone = 0;
    while (gone < kept.size() && kept_bytes > bytes) {
        kept_bytes -= kept[gone].size;
        std::free(kept[gone++].start);
    }
    kept.erase(kept.begin(), kept.begin() + static_cast<std::ptrdiff_t>(gone));
}

}  // namespace

void* take(std::size_t bytes) {
    const std::size_t size = rounded(bytes);
    const std::lock_guard lock(mutex);
    const auto fits = std::find_if(kept.begin(), kept.end(), [size](const Block& b) { return b.size == size; });
    void* block = nullptr;
    if (fits != kept.end()) {
        block = fits->start;
        kept_bytes -= size;
        kept.erase(fits);
    } else {
        block = std::aligned_alloc(page, size);
        if (!block) throw std::bad_alloc();
#if defined(__linux__)
        madvise(block, size, MADV_HUGEPAGE);  // a wish: without it, everything works with small pages
#endif
    }
    in_use += size;
    most_in_use = std::max(most_in_use, in_use);
    return block;
}

void give(void* block, std::size_t bytes) noexcept {
    const std::size_t size = rounded(bytes);
    const std::lock_guard lock(mutex);
    in_use -= size;
    if (keepers == 0) {
        std::free(block);
        return;
    }
    try {
        kept.push_back({block, size});
        kept_bytes += size;
    } catch (const std::bad_alloc&) {
        std::free(block);
    }
    forget_oldest_beyond(most_in_use + most_in_use / 4 - in_use);
}

void keep() {
    const std::lock_guard lock(mutex);
    if (keepers++ == 0) most_in_use = in_use;
}

void release() {
    const std::lock_guard lock(mutex);
    if (keepers > 0 && --keepers == 0) forget_oldest_beyond(0);
}

Usage usage() {
    const std::lock_guard lock(mutex);
    return {in_use, kept_bytes, most_in_use};
}

}  // namespace lab::pool
