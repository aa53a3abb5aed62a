// What the machine could do at best: the yardsticks that `lab bench` holds the stages to.
#pragma once

#include <cstddef>

namespace lab {

// Bytes a second at which all threads together read an array of `bytes` once: the best of `passes` readings.
// Meant for arrays much larger than the caches.
double stream_rate(std::size_t bytes, int passes);

}  // namespace lab
