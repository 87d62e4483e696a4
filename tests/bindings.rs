//! The bindings in the tree are those that bindgen makes of ffi/embree_shim.h.
//!
//! After a change of the header: `UPDATE_BINDINGS=1 cargo test --features bindgen --test bindings`.
#![cfg(feature = "bindgen")]

use std::path::Path;

#[test]
fn bindings_are_those_of_the_header() {
    let fresh = include_str!(concat!(env!("OUT_DIR"), "/bindings.rs"));
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/accel/embree/bindings.rs");
    let kept = std::fs::read_to_string(&path).unwrap();
    assert!(kept == fresh, "{} is out of date; see the head of this test", path.display());
}
