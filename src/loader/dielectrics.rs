//! Dielectrics by name: indices of refraction, for `int_ior` and `ext_ior`.
//!
//! Source: E. Hecht, Optics, 4th edition, and others, near 589 nm and between 0 and 20 °C; the names and values that
//! Mitsuba has.

/// The index of refraction of a material; names are not case-sensitive.
pub(crate) fn dielectric_ior(name: &str) -> Option<f64> {
    TABLE.iter().find(|row| row.0.eq_ignore_ascii_case(name)).map(|row| row.1)
}

/// Every name that [`dielectric_ior`] knows.
pub(crate) fn dielectric_names() -> impl Iterator<Item = &'static str> {
    TABLE.iter().map(|row| row.0)
}

#[rustfmt::skip]
const TABLE: &[(&str, f64)] = &[
    ("vacuum", 1.0), ("helium", 1.000036), ("hydrogen", 1.000132), ("air", 1.000277), ("carbon dioxide", 1.00045),
    ("water", 1.333), ("acetone", 1.36), ("ethanol", 1.361), ("carbon tetrachloride", 1.461), ("glycerol", 1.4729),
    ("benzene", 1.501), ("silicone oil", 1.52045), ("bromine", 1.661), ("water ice", 1.31), ("fused quartz", 1.458),
    ("pyrex", 1.47), ("acrylic glass", 1.49), ("polypropylene", 1.49), ("bk7", 1.5046), ("sodium chloride", 1.544),
    ("amber", 1.55), ("pet", 1.575), ("diamond", 2.419),
];
