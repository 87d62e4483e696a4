//! Files that are made to do harm: sizes that are lies, structures without end, numbers that are none.

#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used, reason = "test code")]
#![allow(dead_code, reason = "of what the fuzz targets have not all is used here")]

#[allow(unreachable_pub, reason = "as another crate has it")]
mod fuzz_seeds;
mod gltf_file;
#[allow(dead_code, unreachable_pub, reason = "as another crate has it")]
#[path = "../fuzz/targets.rs"]
mod targets;

use snell::files::{Files, Memory};
use snell::image::Raster;
use snell::loader::{LoadOptions, load};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// What is wrong with a scene among files that are held in memory.
fn fault(name: &str, files: Vec<(String, Vec<u8>)>) -> String {
    let held = files.into_iter().map(|(name, bytes)| (PathBuf::from(name), bytes));
    let options = LoadOptions { files: Files::held(held).within(Memory::limited(256 << 20)), ..LoadOptions::default() };
    load(Path::new(name), &options).expect_err(name).to_string()
}

fn scene(body: &str) -> Vec<u8> {
    format!("<scene version=\"3.0.0\">{body}</scene>").into_bytes()
}

#[test]
fn includes_that_double_at_each_level_are_stopped() {
    let twice = |level: usize| scene(&format!("<include filename=\"{level}.xml\"/>").repeat(2));
    let mut files: Vec<(String, Vec<u8>)> = (0..14).map(|i| (format!("{i}.xml"), twice(i + 1))).collect();
    files.push(("14.xml".into(), scene("")));
    let told = fault("0.xml", files);
    assert!(told.contains("the scene includes more than 4096 files"), "{told}");
}

#[cfg(unix)]
#[test]
fn links_in_circles_are_no_files() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::os::unix::fs::symlink("b.xml", path("a.xml")).unwrap();
    std::os::unix::fs::symlink("a.xml", path("b.xml")).unwrap();
    std::os::unix::fs::symlink(".", path("here")).unwrap();
    std::os::unix::fs::symlink("s.xml", path("itself.xml")).unwrap();
    let told = |name: &str, body: &str| {
        std::fs::write(path("s.xml"), scene(body)).unwrap();
        load(&path(name), &LoadOptions::default()).unwrap_err().to_string()
    };
    assert!(told("a.xml", "").contains("a.xml: "));
    assert!(told("s.xml", "<include filename=\"a.xml\"/>").contains("there is no file 'a.xml'"));
    // By another name, but the same file.
    for name in ["itself.xml", "here/here/s.xml"] {
        let include = format!("<include filename=\"{name}\"/>");
        assert!(told("s.xml", &include).contains("the file includes itself: s.xml → s.xml"), "{name}");
    }
}

/// Headers that ask for up to 2⁶⁴ of something in files of some bytes.
#[test]
fn sizes_that_are_lies_ask_for_no_memory() {
    let picture = |extension: &str, bytes: &[u8]| {
        let named = image::ImageFormat::from_extension(extension);
        [Memory::default(), Memory::limited(1 << 20)]
            .map(|memory| Raster::decode(bytes, named, false, &memory).expect_err(extension))
    };
    let with = |bytes: &[u8], at: usize, new: &[u8]| {
        let mut bytes = bytes.to_vec();
        bytes[at..at + new.len()].copy_from_slice(new);
        bytes
    };
    let [png, bmp, tga] = ["png", "bmp", "tga"].map(|name| fuzz_seeds::of(name).swap_remove(0));
    for side in [i32::MAX, 1 << 14] {
        let [big, little] = [side.to_be_bytes(), side.to_le_bytes()];
        // The header's checksum is wrong then, too, unless it is made right.
        let mut lying = with(&png, 16, &[big, big].concat());
        let sum = crc32(&lying[12..29]).to_be_bytes();
        lying[29..33].copy_from_slice(&sum);
        let hdr = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {side} +X {side}\n");
        for (kind, bytes) in
            [("png", lying), ("bmp", with(&bmp, 18, &[little, little].concat())), ("hdr", hdr.into_bytes())]
        {
            let told = picture(kind, &bytes);
            // How many pixels the bytes of a BMP can be is known; sides that are too long its decoder refuses in its own words.
            let [expected, limited] = match (kind, side) {
                ("bmp", i32::MAX) => ["", ""],
                ("bmp", _) => ["16384x16384 pixels are more than 1138 bytes can hold"; 2],
                (_, i32::MAX) => ["are too many"; 2],
                _ => ["", "--memory-limit"],
            };
            assert!(told[0].contains(expected) && told[1].contains(limited), "{kind}: {told:?}");
        }
    }
    let [told, limited] = picture("tga", &with(&tga, 12, &[0xff; 4]));
    assert!(told.contains("65535x65535 pixels are too many") && limited == told, "{told}, {limited}");
    let claims = include_bytes!("../fuzz/found/jpeg/claims-millions-of-pixels");
    let [told, limited] = picture("jpg", claims);
    let expected = "it is cut off: 65033x255 pixels are more than 424 bytes can hold";
    assert!(told.contains(expected) && limited == told, "{told}, {limited}");
    let window = b"dataWindow\0box2i\0\x10\0\0\0";
    for exr in fuzz_seeds::of("exr") {
        let at = exr.windows(window.len()).position(|w| w == window).unwrap() + window.len();
        for most in [i32::MAX, i32::MAX - 1, 1 << 30, 1 << 20, 1 << 13] {
            picture("exr", &with(&exr, at + 8, &[most.to_le_bytes(), most.to_le_bytes()].concat()));
            let least = (-most).to_le_bytes();
            picture("exr", &with(&exr, at, &[least, least, most.to_le_bytes(), most.to_le_bytes()].concat()));
        }
    }
    // A picture of 36 bytes a pixel.
    let told = picture("exr", &huge_exr(1 << 14));
    assert!(told[0].contains("its layers have more than 8589934592 bytes of pixels"), "{}", told[0]);
}

#[test]
fn counts_that_are_lies_ask_for_no_memory() {
    for count in ["2147483647", "4294967296", "18446744073709551615"] {
        for seed in fuzz_seeds::of("ply") {
            let text = String::from_utf8_lossy(&seed[..seed.len().min(330)]).into_owned();
            for element in ["vertex 3", "face 1", "extra 1"] {
                let at = text.find(element).unwrap() + element.len() - 1;
                let lying = [&seed[..at], count.as_bytes(), &seed[at + 1..]].concat();
                let told = fault("m.ply", vec![("m.ply".into(), lying)]);
                assert!(told.contains("too short for") || told.contains("--memory-limit"), "{told}");
            }
        }
        for key in ["count", "byteLength", "byteOffset", "byteStride"] {
            let json = String::from_utf8(fuzz_seeds::of("gltf").pop().unwrap()).unwrap();
            let lying = match json.find(&format!("\"{key}\":")) {
                Some(at) => {
                    let start = at + key.len() + 3;
                    let end = start + json[start..].find([',', '}']).unwrap();
                    format!("{}{count}{}", &json[..start], &json[end..])
                }
                None => json.replace("\"byteStride\"", &format!("\"{key}\":{count},\"byteStride\"")),
            };
            let held = vec![("m.gltf".into(), lying.into_bytes()), ("b.bin".into(), vec![0; 48])];
            assert!(!fault("m.gltf", held).is_empty());
        }
    }
}

/// A file of nine channels that says that it is so many pixels wide and high.
fn huge_exr(side: i32) -> Vec<u8> {
    use exr::prelude::{
        AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer, LayerAttributes, Text, WritableImage,
    };
    let channel = |i: u8| AnyChannel::new(Text::from(&*char::from(b'A' + i).to_string()), FlatSamples::F32(vec![0.0]));
    let channels = AnyChannels::sort((0..9).map(channel).collect());
    let layer = Layer::new((1, 1), LayerAttributes::named("l"), Encoding::UNCOMPRESSED, channels);
    let mut bytes = std::io::Cursor::new(Vec::new());
    Image::from_layer(layer).write().non_parallel().to_buffered(&mut bytes).unwrap();
    let mut bytes = bytes.into_inner();
    let window = b"dataWindow\0box2i\0\x10\0\0\0";
    let at = bytes.windows(window.len()).position(|w| w == window).unwrap() + window.len();
    bytes[at + 8..at + 16].copy_from_slice(&[(side - 1).to_le_bytes(), (side - 1).to_le_bytes()].concat());
    bytes
}

/// The checksum of PNG (ISO 3309).
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0_u32, |sum, byte| {
        (0..8).fold(sum ^ u32::from(*byte), |sum, _| (sum >> 1) ^ (0xedb8_8320 & (sum & 1).wrapping_neg()))
    })
}

#[test]
fn depth_is_limited_wherever_something_nests() {
    const DEEP: usize = 100_000;
    let nested = |open: &str, close: &str| format!("{}{}", open.repeat(DEEP), close.repeat(DEEP)).into_bytes();
    for body in [nested("<shape type=\"shapegroup\">", "</shape>"), nested("<x>", "</x>"), nested("<", ">")] {
        assert!(!fault("s.xml", vec![("s.xml".into(), [b"<scene version=\"3.0.0\">", &body[..]].concat())]).is_empty());
    }
    for json in [nested("[", "]"), nested("{\"extras\":", "}"), nested("{\"asset\":[", "]}")] {
        let told = fault("m.gltf", vec![("m.gltf".into(), json)]);
        assert!(told.contains("this is no glTF"), "{told}");
    }
    // Nodes below nodes are no recursion of ours: this is right, but for a mesh.
    let mut nodes = String::new();
    for i in 1..DEEP {
        write!(nodes, "{{\"children\":[{i}]}},").unwrap();
    }
    let json = format!("{{\"asset\":{{\"version\":\"2.0\"}},\"nodes\":[{nodes}{{}}]}}");
    assert!(fault("m.gltf", vec![("m.gltf".into(), json.into_bytes())]).contains("there is nothing in it to look at"));
    // Bsdfs by reference, each in the next.
    let mut chain = "<bsdf type=\"diffuse\" id=\"b0\"/>".to_owned();
    for i in 1..10_000 {
        write!(chain, "<bsdf type=\"mask\" id=\"b{i}\"><ref id=\"b{}\"/></bsdf>", i - 1).unwrap();
    }
    let body = format!("<sensor type=\"perspective\"/>{chain}<shape type=\"cube\"><ref id=\"b9999\"/></shape>");
    assert!(fault("s.xml", vec![("s.xml".into(), scene(&body))]).contains("bsdfs are nested more than 64 deep"));
}

#[test]
fn entities_are_not_expanded() {
    let laughs =
        "<!DOCTYPE s [<!ENTITY a \"ha\"><!ENTITY b \"&a;&a;&a;&a;&a;&a;&a;&a;\">]><scene version=\"3.0.0\">&b;</scene>";
    let file = "<!DOCTYPE s [<!ENTITY f SYSTEM \"file:///etc/passwd\">]><scene version=\"3.0.0\">&f;</scene>";
    for text in [laughs, file] {
        assert!(fault("s.xml", vec![("s.xml".into(), text.into())]).contains("document type declarations"));
    }
    assert!(fault("s.xml", vec![("s.xml".into(), scene("&b;"))]).contains("broken XML"));
}

/// Every number of the seeds in turn becomes one of these: what is not refused renders.
#[test]
fn no_number_does_harm_in_any_place() {
    const NUMBERS: [&str; 8] = ["nan", "inf", "1e999", "-1e308", "3e38", "1e-320", "4294967296", "-1"];
    let (mut tried, is_number) = (0, |c: &u8| c.is_ascii_digit() || b"+-.e".contains(c));
    for (target, seeds) in [("xml", fuzz_seeds::of("xml")), ("gltf", fuzz_seeds::of("gltf"))] {
        for seed in seeds {
            let mut at = 0;
            while let Some(start) = seed[at..].iter().position(u8::is_ascii_digit).map(|i| at + i) {
                let length = seed[start..].iter().take_while(|c| is_number(c)).count();
                at = start + length;
                // Not the digits of names and of base64.
                if !matches!(seed[start - 1], b'"' | b' ' | b',' | b':' | b'[' | b'-') || length > 12 {
                    continue;
                }
                for number in NUMBERS {
                    let _ = targets::run(target, &[&seed[..start], number.as_bytes(), &seed[at..]].concat());
                    tried += 1;
                }
            }
        }
    }
    assert!(tried > 1000, "only {tried}");
}

/// What is wrong with a scene that may take so many bytes.
fn fault_within(bytes: u64, name: &str, files: &[(&str, &[u8])]) -> String {
    let held = files.iter().map(|(name, bytes)| (PathBuf::from(*name), bytes.to_vec()));
    let options = LoadOptions {
        files: Files::held(held).within(Memory::limited(bytes)),
        lenient: true,
        ..LoadOptions::default()
    };
    load(Path::new(name), &options).expect_err(name).to_string()
}

#[test]
fn whatever_takes_too_much_memory_is_refused_before_it_is_made() {
    let limit = "which beside 0.0 MiB in use is more than the 0.0 MiB of --memory-limit";
    let refused = |bytes: u64, name: &str, files: &[(&str, &[u8])], expected: &str| {
        let told = fault_within(bytes, name, files);
        assert!(told.contains(expected) && told.contains(limit), "expected '{expected}' in '{told}'");
    };
    let empty = scene("");
    refused(empty.len() as u64 + 1, "s.xml", &[("s.xml", &empty)], "s.xml: the tree of its elements takes 0.0 MiB");
    let with = |body: &str| scene(&format!("<sensor type=\"perspective\"/>{body}"));
    let of = |plugin: &str, file: &str| {
        with(&format!("<shape type=\"{plugin}\"><string name=\"filename\" value=\"{file}\"/></shape>"))
    };
    let ply = fuzz_seeds::of("ply").swap_remove(0);
    // As files of a mesh alone, so that the scene's own text takes nothing.
    refused(100, "m.ply", &[("m.ply", &ply)], "m.ply: the mesh takes 0.0 MiB");
    let text = of("serialized", "m.serialized");
    let huge = {
        let mut content = 0x1000_u32.to_le_bytes().to_vec();
        content.push(0);
        content.extend([100_000_u64, 1].iter().flat_map(|n| n.to_le_bytes()));
        content.resize(2_000_000, 0);
        let mut encoder = flate2::write::ZlibEncoder::new(vec![0x1c, 0x04, 4, 0], flate2::Compression::fast());
        std::io::Write::write_all(&mut encoder, &content).unwrap();
        encoder.finish().unwrap()
    };
    let told = fault_within(1 << 20, "s.xml", &[("s.xml", &text), ("m.serialized", &huge)]);
    assert!(told.contains("m.serialized: byte 0: the mesh takes 4.6 MiB"), "{told}");
    // A picture, before and after it is decoded; a sky.
    let bitmap = "<shape type=\"sphere\"><bsdf type=\"diffuse\"><texture type=\"bitmap\" name=\"reflectance\">\
        <string name=\"filename\" value=\"p.png\"/></texture></bsdf></shape>";
    let mut wide = std::io::Cursor::new(Vec::new());
    image::RgbImage::new(2000, 1000).write_to(&mut wide, image::ImageFormat::Png).unwrap();
    let told = fault_within(2 << 20, "s.xml", &[("s.xml", &with(bitmap)), ("p.png", wide.get_ref())]);
    assert!(told.contains("cannot read the picture: 2000x1000 pixels: that takes 5.7 MiB"), "{told}");
    let sky = with("<emitter type=\"envmap\"><string name=\"filename\" value=\"p.png\"/></emitter>");
    let told = fault_within(8 << 20, "s.xml", &[("s.xml", &sky), ("p.png", wide.get_ref())]);
    assert!(told.contains("'p.png' takes 22.9 MiB"), "{told}");
}

/// Many small objects, the same bytes over and over, pictures under many names, places.
#[test]
fn models_that_take_too_much_memory_are_refused_before_they_are_made() {
    let materials = format!("{{\"asset\":{{\"version\":\"2.0\"}},\"materials\":[{}{{}}]}}", "{},".repeat(5000));
    let told = fault_within(4 << 20, "m.gltf", &[("m.gltf", materials.as_bytes())]);
    assert!(told.contains("m.gltf: its JSON takes 4.9 MiB"), "{told}");
    let buffer: Vec<u8> = (0..90_000_u32).flat_map(|i| ((i % 7) as f32).to_le_bytes()).collect();
    let json = |primitives: usize, extra: &str| {
        let primitive = "{\"attributes\":{\"POSITION\":0}}";
        format!(
            "{{\"asset\":{{\"version\":\"2.0\"}},\"nodes\":[{{\"mesh\":0{extra}}}],\"meshes\":[{{\"primitives\":[{}]}}],
            \"buffers\":[{{\"byteLength\":360000,\"uri\":\"b.bin\"}}],\"bufferViews\":[{{\"buffer\":0,\"byteLength\":360000}}],
            \"accessors\":[{{\"bufferView\":0,\"componentType\":5126,\"count\":30000,\"type\":\"VEC3\"}}]}}",
            vec![primitive; primitives].join(",")
        )
    };
    let told =
        |bytes: u64, text: &str| fault_within(bytes, "m.gltf", &[("m.gltf", text.as_bytes()), ("b.bin", &buffer)]);
    let many = told(16 << 20, &json(1000, ""));
    assert!(many.contains("]: it takes 0.7 MiB, which beside 15.6 MiB in use"), "{many}");
    let large = told(1 << 19, &json(1, ""));
    assert!(large.contains("accessors[0]: it takes 0.7 MiB"), "{large}");
    // A picture of which each name is another.
    let names = vec!["{\"uri\":\"b.bin\"}"; 100].join(",");
    let textures: Vec<String> = (0..100).map(|i| format!("{{\"source\":{i}}}")).collect();
    let materials: Vec<String> =
        (0..100).map(|i| format!("{{\"pbrMetallicRoughness\":{{\"baseColorTexture\":{{\"index\":{i}}}}}}}")).collect();
    let primitives: Vec<String> =
        (0..100).map(|i| format!("{{\"attributes\":{{\"POSITION\":0,\"TEXCOORD_0\":1}},\"material\":{i}}}")).collect();
    let pictures = format!(
        "{{\"asset\":{{\"version\":\"2.0\"}},\"nodes\":[{{\"mesh\":0}}],\"meshes\":[{{\"primitives\":[{}]}}],
        \"images\":[{names}],\"textures\":[{}],\"materials\":[{}],\"buffers\":[{{\"byteLength\":360000,\"uri\":\"b.bin\"}}],
        \"bufferViews\":[{{\"buffer\":0,\"byteLength\":360000}}],\"accessors\":[{{\"bufferView\":0,\"componentType\":5126,
        \"count\":3,\"type\":\"VEC3\"}},{{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC2\"}}]}}",
        primitives.join(","),
        textures.join(","),
        materials.join(",")
    );
    let named = told(4 << 20, &pictures);
    assert!(named.contains("images[") && named.contains("]: it takes 0.3 MiB, which beside 3."), "{named}");
    let places = ",\"extensions\":{\"EXT_mesh_gpu_instancing\":{\"attributes\":{\"TRANSLATION\":0}}}";
    let glowing = json(1, places)
        .replace("\"POSITION\":0}", "\"POSITION\":0},\"material\":0")
        .replace("\"buffers\"", "\"materials\":[{\"emissiveFactor\":[1,1,1]}],\"buffers\"");
    let placed = told(64 << 20, &glowing);
    assert!(placed.contains("30000 times, it takes"), "{placed}");
}
