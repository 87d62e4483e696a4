//! Which extensions are understood.

use super::model::Model;
use crate::error::Result;

/// Those that are read.
const SUPPORTED: [&str; 16] = [
    "EXT_mesh_gpu_instancing",
    "KHR_lights_punctual",
    "KHR_materials_clearcoat",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
    // Says nothing about the picture.
    "KHR_xmp_json_ld",
];

/// What those do that pack data in ways that are not unpacked.
const PACKED: [(&str, &str); 8] = [
    ("KHR_draco_mesh_compression", "its meshes are compressed by Draco"),
    ("EXT_meshopt_compression", "its buffers are compressed by meshopt"),
    ("KHR_meshopt_compression", "its buffers are compressed by meshopt"),
    ("KHR_texture_basisu", "its textures are KTX2 pictures of Basis Universal"),
    ("EXT_texture_webp", "its textures are WebP pictures"),
    ("EXT_texture_avif", "its textures are AVIF pictures"),
    ("MSFT_texture_dds", "its textures are DDS pictures"),
    ("KHR_gaussian_splatting", "it has Gaussian splats"),
];

/// What a packing extension does, if it is one.
pub(super) fn packing(name: &str) -> Option<&'static str> {
    PACKED.iter().find(|(known, _)| *known == name).map(|(_, what)| *what)
}

/// Refuses a file that cannot be shown without what is not known; warns of what is left out.
pub(super) fn check(model: &Model) -> Result<()> {
    let unknown = |name: &&String| !SUPPORTED.contains(&name.as_str());
    for name in model.root.extensions_required.iter().filter(unknown) {
        let what = packing(name).map_or_else(String::new, |what| format!(" ({what})"));
        let hint = format!("; supported: {}", SUPPORTED.join(", "));
        let error = model.unsupported(format!("extensionsRequired: {name}{what}"), hint);
        if !model.is_lenient() {
            return Err(error);
        }
        model.warn("extensionsRequired", format!("{name} is left out{what}"));
    }
    let required = &model.root.extensions_required;
    let left_out = |name: &&String| unknown(name) && !required.contains(name);
    for name in model.root.extensions_used.iter().filter(left_out) {
        model.warn("extensionsUsed", format!("{name} is left out"));
    }
    Ok(())
}

/// Refuses versions that are not 2.
pub(super) fn check_version(model: &Model) -> Result<()> {
    let asset = &model.root.asset;
    let least = asset.min_version.as_ref().unwrap_or(&asset.version);
    let (major, minor) = least.split_once('.').unwrap_or((least, "0"));
    let known = major == "2" && (asset.min_version.is_none() || minor == "0");
    if known { Ok(()) } else { Err(model.unsupported(format!("glTF {least}"), "; supported: glTF 2.0".into())) }
}
