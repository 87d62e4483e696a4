//! Bindings of ffi/embree_shim.h, made by bindgen. Do not edit: see tests/bindings.rs.


pub const RT_NONE: u32 = 4294967295;
#[repr(C)]
#[derive(Debug, Copy, Clone)]
pub struct rt_ray {
    pub o: [f32; 3usize],
    pub tmin: f32,
    pub d: [f32; 3usize],
    pub tmax: f32,
}
#[allow(clippy::unnecessary_operation, clippy::identity_op)]
const _: () = {
    ["Size of rt_ray"][::core::mem::size_of::<rt_ray>() - 32usize];
    ["Alignment of rt_ray"][::core::mem::align_of::<rt_ray>() - 4usize];
    ["Offset of field: rt_ray::o"][::core::mem::offset_of!(rt_ray, o) - 0usize];
    ["Offset of field: rt_ray::tmin"][::core::mem::offset_of!(rt_ray, tmin) - 12usize];
    ["Offset of field: rt_ray::d"][::core::mem::offset_of!(rt_ray, d) - 16usize];
    ["Offset of field: rt_ray::tmax"][::core::mem::offset_of!(rt_ray, tmax) - 28usize];
};
#[repr(C)]
#[derive(Debug, Copy, Clone)]
pub struct rt_hit {
    pub shape: u32,
    pub primitive: u32,
    pub t: f32,
    pub volume: f32,
}
#[allow(clippy::unnecessary_operation, clippy::identity_op)]
const _: () = {
    ["Size of rt_hit"][::core::mem::size_of::<rt_hit>() - 16usize];
    ["Alignment of rt_hit"][::core::mem::align_of::<rt_hit>() - 4usize];
    ["Offset of field: rt_hit::shape"][::core::mem::offset_of!(rt_hit, shape) - 0usize];
    ["Offset of field: rt_hit::primitive"][::core::mem::offset_of!(rt_hit, primitive) - 4usize];
    ["Offset of field: rt_hit::t"][::core::mem::offset_of!(rt_hit, t) - 8usize];
    ["Offset of field: rt_hit::volume"][::core::mem::offset_of!(rt_hit, volume) - 12usize];
};
#[repr(C)]
#[derive(Debug, Copy, Clone)]
pub struct rt_error {
    pub code: i32,
    pub text: [::core::ffi::c_char; 252usize],
}
#[allow(clippy::unnecessary_operation, clippy::identity_op)]
const _: () = {
    ["Size of rt_error"][::core::mem::size_of::<rt_error>() - 256usize];
    ["Alignment of rt_error"][::core::mem::align_of::<rt_error>() - 4usize];
    ["Offset of field: rt_error::code"][::core::mem::offset_of!(rt_error, code) - 0usize];
    ["Offset of field: rt_error::text"][::core::mem::offset_of!(rt_error, text) - 4usize];
};
#[repr(C)]
#[derive(Debug)]
pub struct rt_scene {
    _unused: [u8; 0],
}
unsafe extern "C" {
    pub fn rt_header_version() -> u32;
    pub fn rt_scene_new(
        threads: u32,
        quality: u32,
        mode: u32,
        memory_limit: u64,
        error: *mut rt_error,
    ) -> *mut rt_scene;
    pub fn rt_scene_library_version(scene: *const rt_scene) -> u32;
    pub fn rt_scene_add_mesh(
        scene: *mut rt_scene,
        shape: u32,
        positions: *const f32,
        vertex_count: usize,
        faces: *const u32,
        face_count: usize,
        error: *mut rt_error,
    ) -> bool;
    pub fn rt_scene_commit(scene: *mut rt_scene, error: *mut rt_error) -> bool;
    pub fn rt_scene_closest(scene: *const rt_scene, rays: *const rt_ray, hits: *mut rt_hit, count: usize);
    pub fn rt_scene_closest_coherent(scene: *const rt_scene, rays: *const rt_ray, hits: *mut rt_hit, count: usize);
    pub fn rt_scene_any(scene: *const rt_scene, rays: *const rt_ray, hits: *mut rt_hit, count: usize);
    pub fn rt_scene_memory(scene: *const rt_scene) -> u64;
    pub fn rt_scene_free(scene: *mut rt_scene);
}
