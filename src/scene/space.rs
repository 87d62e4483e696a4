//! From the file's space to the compiled scene's: a translation and a power of two, in f64.

use crate::math::bounds::DBounds;
use glam::DVec3;

/// The map from the file's world space to the compiled scene's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ToScene {
    /// The point that becomes the origin.
    pub(crate) centre: DVec3,
    /// The power of two that lengths are multiplied by.
    pub(crate) unit: f64,
}

impl ToScene {
    /// The map for a scene whose surfaces fill `bounds`; for a scene without surfaces lengths stay as they are.
    pub(crate) fn fitting(bounds: &DBounds) -> Self {
        if bounds.is_empty() {
            return Self { centre: DVec3::ZERO, unit: 1.0 };
        }
        // Halves first: the sum of two huge coordinates could overflow.
        let centre = bounds.min * 0.5 + bounds.max * 0.5;
        let reach = (bounds.max - centre).max(centre - bounds.min).max_element();
        // reach < 2^exponent, so that every coordinate ends below one.
        let exponent = if reach > 0.0 { libm::frexp(reach).1 } else { 0 };
        Self { centre, unit: libm::ldexp(1.0, -exponent) }
    }

    /// A point.
    pub(crate) fn point(&self, p: DVec3) -> DVec3 {
        (p - self.centre) * self.unit
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scaling_by_a_power_of_two_gives_the_same_scene_space() {
        let b = DBounds::EMPTY.with(DVec3::new(-3.7, 0.1, 12.0)).with(DVec3::new(9.3, 0.7, 12.5));
        let map = ToScene::fitting(&b);
        let p = DVec3::new(1.1, 0.5, 12.3);
        for k in [-40, -1, 3, 40] {
            let s = libm::ldexp(1.0, k);
            let scaled = ToScene::fitting(&DBounds { min: b.min * s, max: b.max * s });
            assert_eq!(scaled.point(p * s), map.point(p), "2^{k}");
        }
        let reach = map.point(b.max).abs().max(map.point(b.min).abs()).max_element();
        assert!((0.5..1.0).contains(&reach), "{reach}");
    }

    #[test]
    fn a_single_point_and_nothing_at_all_have_a_space() {
        assert_eq!(ToScene::fitting(&DBounds::EMPTY).unit, 1.0);
        let p = DVec3::new(5.0, -1e300, 2.0);
        assert_eq!(ToScene::fitting(&DBounds::EMPTY.with(p)).point(p), DVec3::ZERO);
    }
}
