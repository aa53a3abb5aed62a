// Vectors for images and light arrays. Memory that is new to the process costs a page fault every 4 KiB and is
// cleared by the system: as much work as some stages. So large blocks lie in huge pages, are not cleared on resize,
// and are used again by the next frame where somebody keeps them (lab.Renderer).
#pragma once

#include <cstddef>
#include <memory>
#include <new>
#include <utility>
#include <vector>

namespace lab {

namespace pool {

// Blocks of `least` bytes or more come from the pool.
inline constexpr std::size_t least = std::size_t{1} << 20;

void* take(std::size_t bytes);
void give(void* block, std::size_t bytes) noexcept;

// From the first keep() to the release() that answers it, returned blocks are kept for the next frame. With those in
// use never more than a quarter above what was in use at once before: a caller may hold the last frame while it makes
// the next, and blocks of a size that is not asked for again go in time.
void keep();
void release();

struct Usage {
    std::size_t in_use, kept, most_in_use;  // bytes; most_in_use since the last first keep()
};
Usage usage();

}  // namespace pool

template <class T>
class PoolAllocator {
  public:
    using value_type = T;

    PoolAllocator() = default;
    template <class U>
    PoolAllocator(const PoolAllocator<U>&) {}

    T* allocate(std::size_t count) {
        const std::size_t bytes = count * sizeof(T);
        if (bytes >= pool::least) return static_cast<T*>(pool::take(bytes));
        return std::allocator<T>().allocate(count);
    }

    void deallocate(T* values, std::size_t count) noexcept {
        const std::size_t bytes = count * sizeof(T);
        if (bytes >= pool::least)
            pool::give(values, bytes);
        else
            std::allocator<T>().deallocate(values, count);
    }

    // resize(n) leaves new numbers unset, resize(n, value) sets them.
    template <class U>
    void construct(U* at) {
        ::new (static_cast<void*>(at)) U;
    }
    template <class U, class... Args>
    void construct(U* at, Args&&... args) {
        ::new (static_cast<void*>(at)) U(std::forward<Args>(args)...);
    }

    friend bool operator==(const PoolAllocator&, const PoolAllocator&) { return true; }
};

template <class T>
using Buffer = std::vector<T, PoolAllocator<T>>;

}  // namespace lab
