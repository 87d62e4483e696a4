/* The part of Embree that snell uses, in structs and functions of our own, the same for Embree 3 and 4.
 *
 * Ownership, threads and errors of each function: README.md in this folder. The Rust side of this header,
 * src/accel/embree/bindings.rs, is made from it by bindgen (feature `bindgen`, tests/bindings.rs).
 */
#ifndef SNELL_EMBREE_SHIM_H
#define SNELL_EMBREE_SHIM_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Shape and primitive of a miss. */
#define RT_NONE UINT32_MAX

/* The points o + t d with tmin < t < tmax. Laid out like snell's own ray, which is passed as this one. */
struct rt_ray {
    float o[3];
    float tmin;
    float d[3];
    float tmax;
};

/* What was hit, by the ids given to rt_scene_add_mesh, and by Embree's reckoning where, and how large the volume is that
 * the ray's direction spans with two edges of the triangle. t and volume mean nothing where there is no hit. */
struct rt_hit {
    uint32_t shape;
    uint32_t primitive;
    float t;
    float volume;
};

/* Embree's error code, and its words, or what the shim itself found wrong. */
struct rt_error {
    int32_t code;
    char text[252];
};

/* A device with one scene of triangle meshes. */
struct rt_scene;

/* The version of the header that the shim was compiled with, as 10000 major + 100 minor + patch. */
uint32_t rt_header_version(void);

/* A new scene on a new device of `threads` build threads (0: as many as the machine has), to be built quickly (quality 0),
 * well (2) or in between (1), or NULL and `error`. Rays meet it by arithmetic that is robust (mode 0), quick (1), or quick in a
 * tree of compressed nodes (2). What would make Embree hold more than `memory_limit` bytes fails. */
struct rt_scene *rt_scene_new(uint32_t threads, uint32_t quality, uint32_t mode, uint64_t memory_limit, struct rt_error *error);

/* The version of the library that is running, like rt_header_version. */
uint32_t rt_scene_library_version(const struct rt_scene *scene);

/* Adds a mesh with the id `shape`. `positions` are `vertex_count` times three floats with 4 more readable bytes after
 * them, `faces` `face_count` times three vertex indices. Both are borrowed until rt_scene_free. */
bool rt_scene_add_mesh(struct rt_scene *scene, uint32_t shape, const float *positions, size_t vertex_count,
                       const uint32_t *faces, size_t face_count, struct rt_error *error);

/* Builds the hierarchy. Must succeed before a query. */
bool rt_scene_commit(struct rt_scene *scene, struct rt_error *error);

/* The closest hit of each of `count` rays, by the scene's arithmetic. */
void rt_scene_closest(const struct rt_scene *scene, const struct rt_ray *rays, struct rt_hit *hits, size_t count);

/* The same for rays of which each goes much the way of its neighbours, sixteen at a time: twice as fast for those, half as
 * fast for others. */
void rt_scene_closest_coherent(const struct rt_scene *scene, const struct rt_ray *rays, struct rt_hit *hits, size_t count);

/* For each of `count` rays some hit, if Embree finds one. */
void rt_scene_any(const struct rt_scene *scene, const struct rt_ray *rays, struct rt_hit *hits, size_t count);

/* Bytes that Embree holds for the scene now. */
uint64_t rt_scene_memory(const struct rt_scene *scene);

/* Frees scene and device. */
void rt_scene_free(struct rt_scene *scene);

#ifdef __cplusplus
}
#endif

#endif
