/* Calls Embree; the only file that sees its headers. SNELL_EMBREE_MAJOR, 3 or 4, comes from build.rs. */

#include "embree_shim.h"

#include <math.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#if SNELL_EMBREE_MAJOR == 3
#include <embree3/rtcore.h>
#elif SNELL_EMBREE_MAJOR == 4
#include <embree4/rtcore.h>
#else
#error "SNELL_EMBREE_MAJOR must be 3 or 4"
#endif

#define STATIC_ASSERT(condition, name) typedef char static_assert_##name[(condition) ? 1 : -1]

STATIC_ASSERT(RTC_VERSION_MAJOR == SNELL_EMBREE_MAJOR, the_header_is_of_the_version_that_build_rs_found);
STATIC_ASSERT(RTC_INVALID_GEOMETRY_ID == RT_NONE, a_miss_has_embrees_invalid_id);
STATIC_ASSERT(sizeof(struct rt_ray) == 32, rt_ray_has_no_padding);
STATIC_ASSERT(sizeof(struct rt_hit) == 16, rt_hit_has_no_padding);
STATIC_ASSERT(offsetof(struct RTCRay, tnear) == offsetof(struct rt_ray, tmin), tmin_is_where_embree_has_it);
STATIC_ASSERT(offsetof(struct RTCRay, time) == offsetof(struct rt_ray, tmax), time_follows_d);

/* Every bit: geometries and rays all see each other. Embree 4's default mask of a geometry is 1. */
#define ALL 0xFFFFFFFFu

struct rt_scene {
    RTCDevice device;
    RTCScene scene;
    atomic_llong bytes;
    long long memory_limit;
    /* Rays of the largest packet that this Embree, on this processor, has instructions for: 16, 8, or 0 if fewer. */
    int packet;
    /* Raised by the first error since it was last read: the later ones are its consequences. */
    atomic_flag error_is_set;
    struct rt_error error;
};

static void set_error(struct rt_error *error, int32_t code, const char *text) {
    error->code = code;
    snprintf(error->text, sizeof error->text, "%s", text ? text : "no description");
}

static void on_error(void *user, enum RTCError code, const char *text) {
    struct rt_scene *scene = user;
    if (!atomic_flag_test_and_set(&scene->error_is_set)) set_error(&scene->error, (int32_t)code, text);
}

static bool on_memory(void *user, ssize_t bytes, bool post) {
    struct rt_scene *scene = user;
    long long before = atomic_fetch_add_explicit(&scene->bytes, (long long)bytes, memory_order_relaxed);
    /* What was allocated already, or is freed, cannot be refused. */
    if (post || bytes <= 0 || before + bytes <= scene->memory_limit) return true;
    atomic_fetch_sub_explicit(&scene->bytes, (long long)bytes, memory_order_relaxed);
    return false;
}

/* Whether nothing went wrong on the device since the last call; else moves what did to `error`. */
static bool succeeded(struct rt_scene *scene, struct rt_error *error) {
    enum RTCError code = rtcGetDeviceError(scene->device);
    if (code == RTC_ERROR_NONE) return true;
    if (scene->error.code == RTC_ERROR_NONE) set_error(&scene->error, (int32_t)code, NULL);
    *error = scene->error;
    scene->error.code = RTC_ERROR_NONE;
    atomic_flag_clear(&scene->error_is_set);
    return false;
}

uint32_t rt_header_version(void) {
    return RTC_VERSION_MAJOR * 10000u + RTC_VERSION_MINOR * 100u + RTC_VERSION_PATCH;
}

uint32_t rt_scene_library_version(const struct rt_scene *scene) {
    ssize_t major = rtcGetDeviceProperty(scene->device, RTC_DEVICE_PROPERTY_VERSION_MAJOR);
    ssize_t minor = rtcGetDeviceProperty(scene->device, RTC_DEVICE_PROPERTY_VERSION_MINOR);
    ssize_t patch = rtcGetDeviceProperty(scene->device, RTC_DEVICE_PROPERTY_VERSION_PATCH);
    return (uint32_t)(major * 10000 + minor * 100 + patch);
}

/* What this build of Embree cannot do or does otherwise, of what can be chosen when Embree is built; NULL if nothing.
 * Without the filter function no occlusion query would ever answer yes. */
static const char *missing(RTCDevice device) {
    if (!rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_TRIANGLE_GEOMETRY_SUPPORTED))
        return "this Embree was built without triangles";
    if (!rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_FILTER_FUNCTION_SUPPORTED))
        return "this Embree was built without filter functions";
    if (rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_BACKFACE_CULLING_ENABLED))
        return "this Embree was built to miss triangles seen from behind";
    return NULL;
}

struct rt_scene *rt_scene_new(uint32_t threads, uint32_t quality, uint32_t mode, uint64_t memory_limit, struct rt_error *error) {
    struct rt_scene *scene = calloc(1, sizeof *scene);
    if (!scene) {
        set_error(error, RTC_ERROR_OUT_OF_MEMORY, "out of memory");
        return NULL;
    }
    atomic_init(&scene->bytes, 0);
    scene->memory_limit = memory_limit > INT64_MAX ? INT64_MAX : (long long)memory_limit;
    atomic_flag_clear(&scene->error_is_set);
    char config[32];
    snprintf(config, sizeof config, "threads=%u", threads);
    scene->device = rtcNewDevice(config);
    if (!scene->device) {
        /* Of a device that does not exist, Embree keeps the reason at NULL. */
        set_error(error, (int32_t)rtcGetDeviceError(NULL), "Embree could not create a device");
        free(scene);
        return NULL;
    }
    rtcSetDeviceErrorFunction(scene->device, on_error, scene);
    rtcSetDeviceMemoryMonitorFunction(scene->device, on_memory, scene);
    const char *lack = missing(scene->device);
    if (lack) {
        set_error(error, RTC_ERROR_INVALID_OPERATION, lack);
        rt_scene_free(scene);
        return NULL;
    }
    if (rtcGetDeviceProperty(scene->device, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED))
        scene->packet = 16;
    else if (rtcGetDeviceProperty(scene->device, RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED))
        scene->packet = 8;
    scene->scene = rtcNewScene(scene->device);
    if (!succeeded(scene, error) || !scene->scene) {
        rt_scene_free(scene);
        return NULL;
    }
    const enum RTCSceneFlags modes[] = {RTC_SCENE_FLAG_ROBUST, RTC_SCENE_FLAG_NONE, RTC_SCENE_FLAG_COMPACT};
    rtcSetSceneFlags(scene->scene, modes[mode < 3 ? mode : 0]);
    const enum RTCBuildQuality qualities[] = {RTC_BUILD_QUALITY_LOW, RTC_BUILD_QUALITY_MEDIUM, RTC_BUILD_QUALITY_HIGH};
    rtcSetSceneBuildQuality(scene->scene, qualities[quality < 3 ? quality : 1]);
    return scene;
}

void rt_scene_free(struct rt_scene *scene) {
    if (scene->scene) rtcReleaseScene(scene->scene);
    /* Embree frees more than the scene with the device: no callback may find the scene gone. */
    rtcReleaseDevice(scene->device);
    free(scene);
}

/* What a query gives to the occlusion filter: Embree's context, and where to write. */
struct any_context {
#if RTC_VERSION_MAJOR == 3
    struct RTCIntersectContext base;
#else
    struct RTCRayQueryContext base;
#endif
    struct rt_hit *hit;
};

static inline void store(struct rt_hit *to, const struct RTCRay *ray, const struct RTCHit *hit) {
    to->shape = hit->geomID;
    to->primitive = hit->primID;
    to->t = ray->tfar;
    to->volume = fabsf(ray->dir_x * hit->Ng_x + ray->dir_y * hit->Ng_y + ray->dir_z * hit->Ng_z);
}

/* Notes which triangle it was that ended an occlusion query, and accepts it. */
static void note_occluder(const struct RTCFilterFunctionNArguments *args) {
    struct any_context *context = (struct any_context *)args->context;
    /* Of a query of one ray, args->N is 1, and then these are laid out like the structs for one. */
    store(context->hit, (const struct RTCRay *)args->ray, (const struct RTCHit *)args->hit);
}

bool rt_scene_add_mesh(struct rt_scene *scene, uint32_t shape, const float *positions, size_t vertex_count,
                       const uint32_t *faces, size_t face_count, struct rt_error *error) {
    RTCGeometry mesh = rtcNewGeometry(scene->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    if (!mesh) {
        if (succeeded(scene, error)) set_error(error, RTC_ERROR_UNKNOWN, "Embree could not create a mesh");
        return false;
    }
    rtcSetSharedGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, positions, 0, 3 * sizeof(float),
                               vertex_count);
    rtcSetSharedGeometryBuffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, faces, 0, 3 * sizeof(uint32_t),
                               face_count);
    rtcSetGeometryMask(mesh, ALL);
    rtcSetGeometryOccludedFilterFunction(mesh, note_occluder);
    rtcCommitGeometry(mesh);
    rtcAttachGeometryByID(scene->scene, mesh, shape);
    /* The scene holds it now. */
    rtcReleaseGeometry(mesh);
    return succeeded(scene, error);
}

bool rt_scene_commit(struct rt_scene *scene, struct rt_error *error) {
    rtcCommitScene(scene->scene);
    return succeeded(scene, error);
}

/* Four numbers that are stored by one instruction. */
typedef float four __attribute__((vector_size(16)));

/* Embree loads the origin and what follows it as four numbers, and the direction: had they been stored by other parts,
 * it would wait for the stores to reach the cache. */
static inline void load(struct RTCRay *to, const struct rt_ray *from) {
    four origin, direction;
    memcpy(&origin, from->o, sizeof origin);
    memcpy(&direction, from->d, sizeof direction);
    to->tfar = direction[3];
    /* The time. */
    direction[3] = 0.0f;
    memcpy(&to->org_x, &origin, sizeof origin);
    memcpy(&to->dir_x, &direction, sizeof direction);
    to->mask = ALL;
    to->id = 0;
    to->flags = 0;
}

void rt_scene_closest(const struct rt_scene *scene, const struct rt_ray *rays, struct rt_hit *hits, size_t count) {
    struct RTCRayHit query;
#if RTC_VERSION_MAJOR == 3
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
#else
    struct RTCIntersectArguments args;
    rtcInitIntersectArguments(&args);
#endif
    for (size_t i = 0; i < count; ++i) {
        load(&query.ray, &rays[i]);
        query.hit.Ng_x = query.hit.Ng_y = query.hit.Ng_z = 0.0f;
        query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        query.hit.primID = RTC_INVALID_GEOMETRY_ID;
        query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
#if RTC_VERSION_MAJOR == 3
        rtcIntersect1(scene->scene, &context, &query);
#else
        rtcIntersect1(scene->scene, &query, &args);
#endif
        store(&hits[i], &query.ray, &query.hit);
    }
}

/* Packets of sixteen rays and of eight. */
#define PACKET 16
#include "embree_packet.h"
#undef PACKET
#define PACKET 8
#include "embree_packet.h"
#undef PACKET

void rt_scene_closest_coherent(const struct rt_scene *scene, const struct rt_ray *rays, struct rt_hit *hits, size_t count) {
    switch (scene->packet) {
    case 16: closest_in_packets_16(scene, rays, hits, count); break;
    case 8: closest_in_packets_8(scene, rays, hits, count); break;
    default: rt_scene_closest(scene, rays, hits, count);
    }
}

void rt_scene_any(const struct rt_scene *scene, const struct rt_ray *rays, struct rt_hit *hits, size_t count) {
    struct RTCRay query;
    struct any_context context;
#if RTC_VERSION_MAJOR == 3
    rtcInitIntersectContext(&context.base);
#else
    struct RTCOccludedArguments args;
    rtcInitRayQueryContext(&context.base);
    rtcInitOccludedArguments(&args);
    args.context = &context.base;
#endif
    for (size_t i = 0; i < count; ++i) {
        load(&query, &rays[i]);
        hits[i].shape = RT_NONE;
        hits[i].primitive = RT_NONE;
        context.hit = &hits[i];
#if RTC_VERSION_MAJOR == 3
        rtcOccluded1(scene->scene, &context.base, &query);
#else
        rtcOccluded1(scene->scene, &query, &args);
#endif
    }
}

uint64_t rt_scene_memory(const struct rt_scene *scene) {
    long long bytes = atomic_load_explicit(&scene->bytes, memory_order_relaxed);
    return bytes > 0 ? (uint64_t)bytes : 0;
}
