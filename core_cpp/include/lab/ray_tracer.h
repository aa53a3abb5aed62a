// Rays against the triangles of a scene. Embree stays behind this header.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <string>

#include "lab/ray_packet.h"

namespace lab {

struct SceneData;

// A segment: points origin + t * direction for t in (0, length).
struct Ray {
    glm::vec3 origin, direction;
    float length;
};

struct Hit {
    static constexpr std::uint32_t none = 0xffffffffu;
    std::uint32_t triangle = none;
    float t = 0, u = 0, v = 0;  // point = (1-u-v) a + u b + v c

    bool found() const { return triangle != none; }
};

// The nearest hits of a packet; `triangle` is Hit::none where there is none, and then nothing else is set.
struct alignas(64) HitPacket {
    std::uint32_t triangle[RayPacket::size];
    float t[RayPacket::size], u[RayPacket::size], v[RayPacket::size];
};

class RayTracer {
  public:
    explicit RayTracer(const SceneData& scene);  // keeps a reference to it
    ~RayTracer();
    RayTracer(const RayTracer&) = delete;
    RayTracer& operator=(const RayTracer&) = delete;

    // All skip the holes of alpha-masked triangles, and may be called from any thread.
    void intersect(std::span<const Ray> rays, std::span<Hit> hits, Coherence coherence) const;
    void visible(std::span<const Ray> rays, std::span<std::uint8_t> visible, Coherence coherence) const;

    // The first `count` rays of a packet. Bit i of what `visible` returns: ray i is free.
    void intersect(const RayPacket& packet, int count, Coherence coherence, HitPacket& hits) const;
    std::uint32_t visible(RayPacket& packet, int count, Coherence coherence) const;

    // Seconds that Embree alone takes for prepared packets, on all threads: the limit of any stage that traces them.
    struct Prepared {
        RayPacket packet;
        int count;
        Coherence coherence;
    };
    enum class Query { nearest, any };
    double seconds(std::span<const Prepared> packets, Query query) const;

    static std::string version();

  private:
    struct Implementation;
    std::unique_ptr<Implementation> self_;
};

}  // namespace lab
