//! What a file has and what of that was used, for who asks: nothing of it changes a picture.

use std::collections::BTreeMap;

/// The objects of a file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Inventory {
    /// How many objects of each plugin are used, by kind and plugin (`bsdf`, `diffuse`).
    pub used: BTreeMap<(String, String), u64>,
    /// What is not, each with its place; of what is inside of something unused only that.
    pub unused: Vec<String>,
}
