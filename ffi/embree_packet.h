/* Queries of PACKET rays at a time. No header of its own: embree_shim.c includes it once for every width. */

#ifndef CONCAT
#define CONCAT_EXPANDED(a, b) a##b
#define CONCAT(a, b) CONCAT_EXPANDED(a, b)
/* A name for each width. */
#define OF_WIDTH(name) CONCAT(name##_, PACKET)
#endif


/* The rays that `first` of `count` begins, at most a packet, into its lanes; returns how many. */
static size_t OF_WIDTH(load_packet)(struct CONCAT(RTCRayHit, PACKET) *to, int *valid, const struct rt_ray *rays, size_t first, size_t count) {
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
static void OF_WIDTH(store_lane)(struct rt_hit *to, const struct CONCAT(RTCRayHit, PACKET) *from, size_t lane) {
    to->shape = from->hit.geomID[lane];
    to->primitive = from->hit.primID[lane];
    to->t = from->ray.tfar[lane];
    to->volume = fabsf(from->ray.dir_x[lane] * from->hit.Ng_x[lane] + from->ray.dir_y[lane] * from->hit.Ng_y[lane] +
                       from->ray.dir_z[lane] * from->hit.Ng_z[lane]);
}

static void OF_WIDTH(closest_in_packets)(const struct rt_scene *scene, const struct rt_ray *rays, struct rt_hit *hits,
                                         size_t count) {
    struct CONCAT(RTCRayHit, PACKET) query;
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
        size_t lanes = OF_WIDTH(load_packet)(&query, valid, rays, first, count);
#if RTC_VERSION_MAJOR == 3
        CONCAT(rtcIntersect, PACKET)(valid, scene->scene, &context, &query);
#else
        CONCAT(rtcIntersect, PACKET)(valid, scene->scene, &query, &args);
#endif
        for (size_t lane = 0; lane < lanes; ++lane) OF_WIDTH(store_lane)(&hits[first + lane], &query, lane);
    }
}
