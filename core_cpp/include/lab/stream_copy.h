// Copies of what nobody reads soon, past the caches: the lines that they fill need not be read before, and what others
// keep near stays there.
#pragma once

#include <cstddef>

namespace lab {

void stream_bytes(void* to, const void* from, std::size_t bytes);

template <class T>
void stream_copy(T* to, const T* from, std::size_t count) {
    stream_bytes(to, from, count * sizeof(T));
}

// Before other threads may read what this one has copied.
void finish_streams();

}  // namespace lab
