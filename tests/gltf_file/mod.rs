//! glTF files made of a few lines, for the tests of the loader.

#![allow(dead_code, reason = "each test file uses its own part of this")]
#![allow(missing_docs, unreachable_pub, clippy::unwrap_used, reason = "test code")]

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};
use snell::description::SceneDescription;
use snell::loader::{LoadOptions, load};
use std::fs;

pub const FLOAT: u32 = 5126;

/// A file in the making: its JSON, and the one buffer that all its accessors lie in.
#[derive(Clone)]
pub struct File {
    pub json: Value,
    pub bytes: Vec<u8>,
}

impl File {
    /// Nothing.
    pub fn new() -> Self {
        let json = json!({
            "asset": {"version": "2.0"},
            "buffers": [], "bufferViews": [], "accessors": [], "meshes": [], "nodes": [], "materials": [],
            "textures": [], "images": [], "samplers": [], "cameras": [], "skins": [],
        });
        Self { json, bytes: Vec::new() }
    }

    /// A node with a mesh of one triangle.
    pub fn triangle() -> Self {
        let mut file = Self::new();
        let positions = file.floats("VEC3", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
        file.push("meshes", json!({"primitives": [{"attributes": {"POSITION": positions}}]}));
        file.push("nodes", json!({"mesh": 0}));
        file
    }

    /// The same with texture coordinates, a texture, and a material.
    pub fn textured(material: Value) -> Self {
        let mut file = Self::triangle();
        let uvs = file.floats("VEC2", &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
        file.primitive()["attributes"]["TEXCOORD_0"] = json!(uvs);
        file.primitive()["material"] = json!(0);
        file.push("materials", material);
        let uri = format!("data:image/png;base64,{}", STANDARD.encode(png()));
        file.push("images", json!({"uri": uri}));
        file.push("textures", json!({"source": 0}));
        file
    }

    pub fn push(&mut self, list: &str, element: Value) -> usize {
        let list = self.json[list].as_array_mut().unwrap();
        list.push(element);
        list.len() - 1
    }

    pub fn primitive(&mut self) -> &mut Value {
        &mut self.json["meshes"][0]["primitives"][0]
    }

    /// A view of new bytes.
    pub fn view(&mut self, bytes: &[u8]) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let offset = self.bytes.len();
        self.bytes.extend_from_slice(bytes);
        self.push("bufferViews", json!({"buffer": 0, "byteOffset": offset, "byteLength": bytes.len()}))
    }

    /// An accessor of new bytes.
    pub fn accessor(&mut self, kind: &str, component: u32, count: usize, bytes: &[u8]) -> usize {
        let view = self.view(bytes);
        self.push("accessors", json!({"bufferView": view, "componentType": component, "count": count, "type": kind}))
    }

    pub fn floats(&mut self, kind: &str, values: &[f32]) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.accessor(kind, FLOAT, values.len() / width(kind), &bytes)
    }

    /// The text of a `.gltf` file with its buffer inside.
    pub fn text(&self) -> String {
        let mut json = self.json.clone();
        if json["buffers"] == json!([]) {
            let uri = format!("data:application/octet-stream;base64,{}", STANDARD.encode(&self.bytes));
            json["buffers"] = json!([{"byteLength": self.bytes.len(), "uri": uri}]);
        }
        json.to_string()
    }

    /// The bytes of a `.glb` file.
    pub fn binary(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        json["buffers"] = json!([{"byteLength": self.bytes.len()}]);
        let mut text = json.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let mut blob = self.bytes.clone();
        blob.resize(blob.len().next_multiple_of(4), 0);
        let mut all = b"glTF".to_vec();
        let word = |all: &mut Vec<u8>, n: usize| all.extend((n as u32).to_le_bytes());
        word(&mut all, 2);
        word(&mut all, 12 + 8 + text.len() + 8 + blob.len());
        word(&mut all, text.len());
        all.extend(b"JSON");
        all.extend(text);
        word(&mut all, blob.len());
        all.extend(b"BIN\0");
        all.extend(blob);
        all
    }

    /// What the loader makes of it.
    pub fn loaded(&self) -> SceneDescription {
        self.outcome(false).unwrap_or_else(|e| panic!("{e}\n{}", self.json))
    }

    pub fn outcome(&self, lenient: bool) -> Result<SceneDescription, String> {
        outcome("m.gltf", self.text().as_bytes(), lenient)
    }
}

/// Loads a file of this name and content.
pub fn outcome(name: &str, bytes: &[u8], lenient: bool) -> Result<SceneDescription, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    fs::write(&path, bytes).unwrap();
    load(&path, &LoadOptions { lenient, ..LoadOptions::default() }).map_err(|e| e.to_string())
}

fn width(kind: &str) -> usize {
    match kind {
        "SCALAR" => 1,
        "MAT4" => 16,
        vector => vector[3..].parse().unwrap(),
    }
}

/// A picture of two pixels: red, and green of half opacity.
pub fn png() -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let pixels = image::RgbaImage::from_raw(2, 1, vec![255, 0, 0, 255, 0, 255, 0, 128]).unwrap();
    pixels.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}
