//! Scenes too large to keep: ten million triangles, and a mesh that stands in 25,000 places. Written when they are asked for.

use crate::common::million;
use std::path::{Path, PathBuf};
use std::{fs, io};

/// What can be asked for by name.
pub const NAMES: [&str; 2] = ["ten-million", "instances"];

/// Rings and vertices of a ring of the knot of `scenes/million` for ten million triangles.
const FINE: [u32; 2] = [12_800, 392];

/// The same for the mesh that is placed: 4,096 triangles.
const COARSE: [u32; 2] = [128, 16];

/// Instances along each side of their square: 24,964 in all.
const ALONG: u32 = 158;

/// Turns and sizes follow multiples of this, which do not repeat (1 − 1/φ).
const STEP: f64 = 0.381_966;

/// The scene file of one of [`NAMES`] and its defines. Puts into `folder` what it needs.
///
/// # Errors
///
/// Those of writing files.
pub fn write(name: &str, folder: &Path) -> io::Result<(PathBuf, Vec<(String, String)>)> {
    let mesh = folder.join(format!("{name}.ply"));
    if name == NAMES[0] {
        million::write_mesh(&mesh, FINE)?;
        let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/million/scene.xml");
        return Ok((scene, vec![("mesh".into(), mesh.display().to_string())]));
    }
    million::write_mesh(&mesh, COARSE)?;
    let scene = folder.join(format!("{name}.xml"));
    fs::write(&scene, instances(&mesh))?;
    Ok((scene, Vec::new()))
}

/// Knots of all sizes side by side, seen from above at an angle, under a sky.
fn instances(mesh: &Path) -> String {
    let mut xml = format!(
        r#"<scene version="3.0.0">
    <integrator type="path"><integer name="max_depth" value="6"/></integrator>
    <sensor type="perspective">
        <float name="fov" value="38"/>
        <transform name="to_world"><lookat origin="0, 60, 180" target="0, 0, 0" up="0, 1, 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="512"/><integer name="height" value="512"/></film>
    </sensor>
    <emitter type="constant"/>
    <shape type="shapegroup" id="knot">
        <shape type="ply"><string name="filename" value="{}"/><bsdf type="diffuse"/></shape>
    </shape>
"#,
        mesh.display()
    );
    for i in 0..ALONG * ALONG {
        let middle = f64::from(ALONG) / 2.0;
        let (x, z) = (f64::from(i % ALONG) - middle, f64::from(i / ALONG) - middle);
        let turn = (f64::from(i) * STEP).fract();
        xml.push_str(&format!(
            r#"    <shape type="instance"><ref id="knot"/><transform name="to_world">
        <rotate x="1" y="{turn}" angle="{}"/><scale x="{}" y="0.6" z="0.5"/><translate x="{x}" z="{z}"/>
    </transform></shape>
"#,
            360.0 * turn,
            0.3 + 0.4 * turn
        ));
    }
    xml.push_str("</scene>\n");
    xml
}
