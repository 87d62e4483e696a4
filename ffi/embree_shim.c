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
STATIC_ASSERT(offsetof(struct RTCRay, dir_x) == offsetof(struct rt_ray, d), d_is_where_embree_has_it);

/* Every bit: geometries and rays all see each other. Embree 4's default mask of a geometry is 1. */
#define ALL 0xFFFFFFFFu

struct rt_scene {
    RTCDevice device;
    RTCScene scene;
    atomic_llong bytes;
    /* Whether this Embree, on this processor, has packets of sixteen rays. */
    bool packets;
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
    (void)post;
    atomic_fetch_add_explicit(&scene->bytes, (long long)bytes, memory_order_relaxed);
    return true;
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

struct rt_scene *rt_scene_new(uint32_t threads, struct rt_error *error) {
    struct rt_scene *scene = calloc(1, sizeof *scene);
    if (!scene) {
        set_error(error, RTC_ERROR_OUT_OF_MEMORY, "out of memory");
        return NULL;
    }
    atomic_init(&scene->bytes, 0);
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
    scene->packets = rtcGetDeviceProperty(scene->device, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED);
    scene->scene = rtcNewScene(scene->device);
    if (!succeeded(scene, error) || !scene->scene) {
        rt_scene_free(scene);
        return NULL;
    }
    rtcSetSceneFlags(scene->scene, RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(scene->scene, RTC_BUILD_QUALITY_MEDIUM);
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

static inline void load(struct RTCRay *to, const struct rt_ray *from) {
    memcpy(to, from, offsetof(struct rt_ray, tmax));
    to->time = 0.0f;
    to->tfar = from->tmax;
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

/* Rays of a packet. */
#define PACKET 16

/* The rays that `first` of `count` begins, at most a packet, into its lanes; returns how many. */
static size_t load_packet(struct RTCRayHit16 *to, int *valid, const struct rt_ray *rays, size_t first, size_t count) {
    size_t lanes = count - first < PACKET ? count - first : PACKET;
    memset(to, 0, sizeof *to);
    for (size_t lane = 0; lane < PACKET; ++lane) {
        const struct rt_ray *ray = &rays[first + (lane < lanes ? lane : 0)];
        valid[lane] = lane < lanes ? -1 : 0;
        to->ray.org_x[lane] = ray->o[0];
        to->ray.org_y[lane] = ray->o[1];
        to->ray.org_z[lane] = ray->o[2];
        to->ray.dir_x[lane] = ray->d[0];
        to->ray.dir_y[lane] = ray->d[1];
        to->ray.dir_z[lane] = ray->d[2];
        to->ray.tnear[lane] = ray->tmin;
        to->ray.tfar[lane] = ray->tmax;
        to->ray.mask[lane] = ALL;
        to->hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
        to->hit.primID[lane] = RTC_INVALID_GEOMETRY_ID;
        to->hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
    }
    return lanes;
}

/* The answer of one lane. */
static void store_lane(struct rt_hit *to, const struct RTCRayHit16 *from, size_t lane) {
    to->shape = from->hit.geomID[lane];
    to->primitive = from->hit.primID[lane];
    to->t = from->ray.tfar[lane];
    to->volume = fabsf(from->ray.dir_x[lane] * from->hit.Ng_x[lane] + from->ray.dir_y[lane] * from->hit.Ng_y[lane] +
                       from->ray.dir_z[lane] * from->hit.Ng_z[lane]);
}

void rt_scene_closest_coherent(const struct rt_scene *scene, const struct rt_ray *rays, struct rt_hit *hits, size_t count) {
    if (!scene->packets) {
        rt_scene_closest(scene, rays, hits, count);
        return;
    }
    struct RTCRayHit16 query;
    _Alignas(64) int valid[PACKET];
#if RTC_VERSION_MAJOR == 3
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
#else
    struct RTCIntersectArguments args;
    rtcInitIntersectArguments(&args);
    args.flags = RTC_RAY_QUERY_FLAG_COHERENT;
#endif
    for (size_t first = 0; first < count; first += PACKET) {
        size_t lanes = load_packet(&query, valid, rays, first, count);
#if RTC_VERSION_MAJOR == 3
        rtcIntersect16(valid, scene->scene, &context, &query);
#else
        rtcIntersect16(valid, scene->scene, &query, &args);
#endif
        for (size_t lane = 0; lane < lanes; ++lane) store_lane(&hits[first + lane], &query, lane);
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
