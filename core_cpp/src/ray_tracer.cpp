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
#include <limits>
#include <stdexcept>
#include <vector>

#include "lab/scene.h"

namespace lab {
namespace {

constexpr int packet = 16;

#if LAB_EMBREE_MAJOR == 3
struct Query {
    RTCIntersectContext context;
    explicit Query(Coherence coherence) {
        rtcInitIntersectContext(&context);
        if (coherence == Coherence::coherent) context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    }
    void intersect(const int* valid, RTCScene scene, RTCRayHit16* rays) {
        rtcIntersect16(valid, scene, &context, rays);
    }
    void occluded(const int* valid, RTCScene scene, RTCRay16* rays) { rtcOccluded16(valid, scene, &context, rays); }
};
#else
struct Query {
    RTCIntersectArguments nearest;
    RTCOccludedArguments any;
    explicit Query(Coherence coherence) {
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

[[noreturn]] void fail(RTCDevice device, const char* what) {
    throw std::runtime_error(std::string("Embree could not ") + what + " (error " +
                             std::to_string(static_cast<int>(rtcGetDeviceError(device))) + ")");
}

// The triangles of one geometry, and which of the scene's they are.
struct Part {
    const SceneData* scene = nullptr;
    std::vector<std::uint32_t> triangle;
};

// Rejects hits in the holes of alpha-masked triangles.
void filter_holes(const RTCFilterFunctionNArguments* args) {
    const auto& part = *static_cast<const Part*>(args->geometryUserPtr);
    const SceneData& scene = *part.scene;
    for (unsigned i = 0; i < args->N; ++i) {
        if (args->valid[i] == 0) continue;
        const std::uint32_t t = part.triangle[RTCHitN_primID(args->hit, args->N, i)];
        const Material& material = scene.materials[scene.material_of[t]];
        const glm::uvec3 corner = scene.triangle[t];
        const float u = RTCHitN_u(args->hit, args->N, i), v = RTCHitN_v(args->hit, args->N, i);
        float alpha = material.alpha;
        if (material.texture >= 0) {
            const vec2 uv = (1 - u - v) * scene.uv[corner.x] + u * scene.uv[corner.y] + v * scene.uv[corner.z];
            alpha *= scene.textures[material.texture].alpha(uv);
        }
        if (alpha < material.alpha_cutoff) args->valid[i] = 0;
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

void RayTracer::intersect(std::span<const Ray> rays, std::span<Hit> hits, Coherence coherence) const {
    Query query(coherence);
    for (std::size_t first = 0; first < rays.size(); first += packet) {
        alignas(64) RTCRayHit16 r;
        alignas(64) int valid[packet];
        const int count = static_cast<int>(std::min<std::size_t>(packet, rays.size() - first));
        for (int i = 0; i < packet; ++i) {
            const Ray& ray = rays[first + std::min(i, count - 1)];
            valid[i] = i < count ? -1 : 0;
            r.ray.org_x[i] = ray.origin.x;
            r.ray.org_y[i] = ray.origin.y;
            r.ray.org_z[i] = ray.origin.z;
            r.ray.dir_x[i] = ray.direction.x;
            r.ray.dir_y[i] = ray.direction.y;
            r.ray.dir_z[i] = ray.direction.z;
            r.ray.tnear[i] = 0;
            r.ray.tfar[i] = ray.length;
            r.ray.time[i] = 0;
            r.ray.mask[i] = 0xffffffffu;
            r.ray.id[i] = 0;
            r.ray.flags[i] = 0;
            r.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
            r.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
        }
        query.intersect(valid, self_->scene, &r);
        for (int i = 0; i < count; ++i) {
            const unsigned geometry = r.hit.geomID[i];
            Hit& hit = hits[first + i];
            hit = Hit{};
            if (geometry == RTC_INVALID_GEOMETRY_ID) continue;
            const Part& part = geometry == self_->masked_id ? self_->masked : self_->solid;
            hit = {part.triangle[r.hit.primID[i]], r.ray.tfar[i], r.hit.u[i], r.hit.v[i]};
        }
    }
}

void RayTracer::visible(std::span<const Ray> rays, std::span<std::uint8_t> visible, Coherence coherence) const {
    Query query(coherence);
    for (std::size_t first = 0; first < rays.size(); first += packet) {
        alignas(64) RTCRay16 r;
        alignas(64) int valid[packet];
        const int count = static_cast<int>(std::min<std::size_t>(packet, rays.size() - first));
        for (int i = 0; i < packet; ++i) {
            const Ray& ray = rays[first + std::min(i, count - 1)];
            valid[i] = i < count ? -1 : 0;
            r.org_x[i] = ray.origin.x;
            r.org_y[i] = ray.origin.y;
            r.org_z[i] = ray.origin.z;
            r.dir_x[i] = ray.direction.x;
            r.dir_y[i] = ray.direction.y;
            r.dir_z[i] = ray.direction.z;
            r.tnear[i] = 0;
            r.tfar[i] = ray.length;
            r.time[i] = 0;
            r.mask[i] = 0xffffffffu;
            r.id[i] = 0;
            r.flags[i] = 0;
        }
        query.occluded(valid, self_->scene, &r);
        for (int i = 0; i < count; ++i) visible[first + i] = r.tfar[i] >= 0;  // Embree sets -inf where blocked
    }
}

std::string RayTracer::version() {
    return RTC_VERSION_STRING;
}

}  // namespace lab
