// The only file that knows Embree, 3.13 or 4: their APIs differ in names and in how a query's arguments are
// passed.
#include "lab/ray_tracer.h"

#if LAB_EMBREE_MAJOR == 3
#include <embree3/rtcore.h>
#else
#include <embree4/rtcore.h>
#endif

#include <omp.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <vector>

#include "lab/scene.h"

namespace lab {
namespace {

static_assert(sizeof(RayPacket) == sizeof(RTCRay16) && alignof(RayPacket) >= alignof(RTCRay16));
static_assert(offsetof(RayPacket, start) == offsetof(RTCRay16, tnear));
static_assert(offsetof(RayPacket, direction_x) == offsetof(RTCRay16, dir_x));
static_assert(offsetof(RayPacket, time) == offsetof(RTCRay16, time));
static_assert(offsetof(RayPacket, length) == offsetof(RTCRay16, tfar));
static_assert(offsetof(RayPacket, mask) == offsetof(RTCRay16, mask));
static_assert(offsetof(RayPacket, flags) == offsetof(RTCRay16, flags));

RTCRay16* embree(RayPacket& packet) {
    return reinterpret_cast<RTCRay16*>(&packet);
}

struct alignas(64) Valid {
    int lane[RayPacket::size];
    explicit Valid(int count) {
        for (int i = 0; i < RayPacket::size; ++i) lane[i] = i < count ? -1 : 0;
    }
};

#if LAB_EMBREE_MAJOR == 3
struct EmbreeQuery {
    RTCIntersectContext context;
    explicit EmbreeQuery(Coherence coherence) {
        rtcInitIntersectContext(&context);
        if (coherence == Coherence::coherent) context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    }
    void intersect(const int* valid, RTCScene scene, RTCRayHit16* rays) {
        rtcIntersect16(valid, scene, &context, rays);
    }
    void occluded(const int* valid, RTCScene scene, RTCRay16* rays) { rtcOccluded16(valid, scene, &context, rays); }
};
#else
struct EmbreeQuery {
    RTCIntersectArguments nearest;
    RTCOccludedArguments any;
    explicit EmbreeQuery(Coherence coherence) {
        rtcInitIntersectArguments(&nearest);
        rtcInitOccludedArguments(&any);
        if (coherence == Coherence::coherent) nearest.flags = any.flags = RTC_RAY_QUERY_FLAG_COHERENT;
    }
    void intersect(const int* valid, RTCScene scene, RTCRayHit16* rays) {
        rtcIntersect16(valid, scene, rays, &nearest);
    }
    void occluded(const int* valid, RTCScene scene, RTCRay16* rays) { rtcOccluded16(valid, scene, rays, &any); }
};
#endif

// Fills a packet with the first rays, and returns how many it took.
int fill(RayPacket& packet, std::span<const Ray> rays) {
    const int count = static_cast<int>(std::min<std::size_t>(RayPacket::size, rays.size()));
    for (int i = 0; i < count; ++i) packet.set(i, rays[i].origin, rays[i].direction, rays[i].length);
    packet.pad(count);
    return count;
}

[[noreturn]] void fail(RTCDevice device, const char* what) {
    throw std::runtime_error(std::string("Embree could not ") + what + " (error " +
                             std::to_string(static_cast<int>(rtcGetDeviceError(device))) + ")");
}

// What decides whether a point of a masked triangle is a hole.
struct Mask {
    vec2 a, b, c;            // texture coordinates of the corners
    const Texture* texture;  // or null
    float alpha, cutoff;
};

// The triangles of one geometry, and which of the scene's they are.
struct Part {
    const SceneData* scene = nullptr;
    std::vector<std::uint32_t> triangle;
    std::vector<Mask> mask;  // of each triangle, where they have holes
};

Mask mask_of(const SceneData& scene, std::uint32_t triangle) {
    const Material& material = scene.materials[scene.material_of[triangle]];
    const glm::uvec3 corner = scene.triangle[triangle];
    return {scene.uv[corner.x], scene.uv[corner.y],
            scene.uv[corner.z], material.texture >= 0 ? &scene.textures[material.texture] : nullptr,
            material.alpha,     material.alpha_cutoff};
}

// Rejects hits in the holes of alpha-masked triangles.
void filter_holes(const RTCFilterFunctionNArguments* args) {
    const auto& part = *static_cast<const Part*>(args->geometryUserPtr);
    for (unsigned i = 0; i < args->N; ++i) {
        if (args->valid[i] == 0) continue;
        const Mask& mask = part.mask[RTCHitN_primID(args->hit, args->N, i)];
        const float u = RTCHitN_u(args->hit, args->N, i), v = RTCHitN_v(args->hit, args->N, i);
        float alpha = mask.alpha;
        if (mask.texture) alpha *= mask.texture->alpha((1 - u - v) * mask.a + u * mask.b + v * mask.c);
        if (alpha < mask.cutoff) args->valid[i] = 0;
    }
}

}  // namespace

struct RayTracer::Implementation {
    RTCDevice device = nullptr;
    RTCScene scene = nullptr;
    Part solid, masked;
    unsigned masked_id = RTC_INVALID_GEOMETRY_ID;

    ~Implementation() {
        if (scene) rtcReleaseScene(scene);
        if (device) rtcReleaseDevice(device);
    }

    unsigned attach(Part& part) {
        if (part.triangle.empty()) return RTC_INVALID_GEOMETRY_ID;
        const SceneData& data = *part.scene;
        RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
        auto* vertices = static_cast<vec3*>(rtcSetNewGeometryBuffer(
            geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(vec3), data.position.size()));
        auto* indices = static_cast<glm::uvec3*>(rtcSetNewGeometryBuffer(
            geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, sizeof(glm::uvec3), part.triangle.size()));
        if (!vertices || !indices) fail(device, "allocate the scene's buffers");
        std::copy(data.position.begin(), data.position.end(), vertices);
        for (std::size_t i = 0; i < part.triangle.size(); ++i) indices[i] = data.triangle[part.triangle[i]];
        if (&part == &masked) {
            for (const std::uint32_t t : part.triangle) part.mask.push_back(mask_of(data, t));
            rtcSetGeometryUserData(geometry, &part);
            rtcSetGeometryIntersectFilterFunction(geometry, filter_holes);
            rtcSetGeometryOccludedFilterFunction(geometry, filter_holes);
        }
        rtcCommitGeometry(geometry);
        const unsigned id = rtcAttachGeometry(scene, geometry);
        rtcReleaseGeometry(geometry);
        return id;
    }
};

RayTracer::RayTracer(const SceneData& data) : self_(std::make_unique<Implementation>()) {
    // Embree builds its tree with threads of its own: as many as the stages use.
    self_->device = rtcNewDevice(("threads=" + std::to_string(omp_get_max_threads())).c_str());
    if (!self_->device) fail(nullptr, "open a device");
    self_->scene = rtcNewScene(self_->device);
    rtcSetSceneFlags(self_->scene, RTC_SCENE_FLAG_ROBUST);  // no light through the seams between triangles
    self_->solid.scene = self_->masked.scene = &data;
    for (std::uint32_t t = 0; t < data.triangle.size(); ++t) {
        const Material& material = data.materials[data.material_of[t]];
        const bool holes =
            material.alpha_cutoff > 0 && (material.texture >= 0 || material.alpha < material.alpha_cutoff);
        (holes ? self_->masked : self_->solid).triangle.push_back(t);
    }
    self_->attach(self_->solid);
    self_->masked_id = self_->attach(self_->masked);
    rtcCommitScene(self_->scene);
    if (rtcGetDeviceError(self_->device) != RTC_ERROR_NONE) fail(self_->device, "build the scene");
}

RayTracer::~RayTracer() = default;

void RayTracer::intersect(const RayPacket& packet, int count, Coherence coherence, HitPacket& hits) const {
    alignas(64) RTCRayHit16 r;
    std::memcpy(&r.ray, &packet, sizeof r.ray);
    for (int i = 0; i < RayPacket::size; ++i) {
        r.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
        r.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
        r.hit.u[i] = r.hit.v[i] = 0.0f;  // rays that meet nothing are computed along with the others
    }
    EmbreeQuery(coherence).intersect(Valid(count).lane, self_->scene, &r);
    for (int i = 0; i < count; ++i) {
        const unsigned geometry = r.hit.geomID[i];
        const Part& part = geometry == self_->masked_id ? self_->masked : self_->solid;
        hits.triangle[i] = geometry == RTC_INVALID_GEOMETRY_ID ? Hit::none : part.triangle[r.hit.primID[i]];
    }
    for (int i = count; i < RayPacket::size; ++i) hits.triangle[i] = Hit::none;
    std::memcpy(hits.t, r.ray.tfar, sizeof hits.t);
    std::memcpy(hits.u, r.hit.u, sizeof hits.u);
    std::memcpy(hits.v, r.hit.v, sizeof hits.v);
}

std::uint32_t RayTracer::visible(RayPacket& packet, int count, Coherence coherence) const {
    EmbreeQuery(coherence).occluded(Valid(count).lane, self_->scene, embree(packet));
    std::uint32_t free = 0;
    for (int i = 0; i < RayPacket::size; ++i)  // Embree sets -inf where blocked
        free |= static_cast<std::uint32_t>(packet.length[i] >= 0) << i;
    return free & ((1u << count) - 1u);
}

void RayTracer::intersect(std::span<const Ray> rays, std::span<Hit> hits, Coherence coherence) const {
    RayPacket packet;
    HitPacket found;
    for (std::size_t first = 0; first < rays.size(); first += RayPacket::size) {
        const int count = fill(packet, rays.subspan(first));
        intersect(packet, count, coherence, found);
        for (int i = 0; i < count; ++i) {
            Hit& hit = hits[first + i];
            hit = Hit{};
            if (found.triangle[i] != Hit::none) hit = {found.triangle[i], found.t[i], found.u[i], found.v[i]};
        }
    }
}

void RayTracer::visible(std::span<const Ray> rays, std::span<std::uint8_t> visible, Coherence coherence) const {
    RayPacket packet;
    for (std::size_t first = 0; first < rays.size(); first += RayPacket::size) {
        const int count = fill(packet, rays.subspan(first));
        const std::uint32_t free = this->visible(packet, count, coherence);
        for (int i = 0; i < count; ++i) visible[first + i] = (free >> i) & 1u;
    }
}

double RayTracer::seconds(std::span<const Prepared> packets, Query query) const {
    const auto count = static_cast<std::int64_t>(packets.size());
    std::vector<RTCRayHit16> work(packets.size());
    for (std::int64_t i = 0; i < count; ++i) {
        std::memcpy(&work[i].ray, &packets[i].packet, sizeof work[i].ray);
        for (int lane = 0; lane < RayPacket::size; ++lane)
            work[i].hit.geomID[lane] = work[i].hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
    }
    const auto start = std::chrono::steady_clock::now();
#pragma omp parallel for schedule(dynamic, 64)
    for (std::int64_t i = 0; i < count; ++i) {
        EmbreeQuery embree(packets[i].coherence);
        const Valid valid(packets[i].count);
        if (query == Query::nearest)
            embree.intersect(valid.lane, self_->scene, &work[i]);
        else
            embree.occluded(valid.lane, self_->scene, &work[i].ray);
    }
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

std::string RayTracer::version() {
    return RTC_VERSION_STRING;
}

}  // namespace lab
