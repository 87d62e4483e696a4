//! Groups and where they are placed: each group is compiled once, in a space that is fitted to it as the scene's is to the
//! scene, and each shape of each instance becomes a shape of the scene.

use super::geometry::{self, Compiled};
use crate::description::{self, SceneDescription};
use crate::error::Result;
use crate::math::bounds::DBounds;
use crate::scene::space::ToScene;
use crate::shape::Shape;
use crate::shape::placed::{Group, Placed, Placement};
use glam::{DAffine3, DVec3};
use std::sync::Arc;

/// The boxes of all instances, in the file's world space: around the images of their groups' boxes.
pub(super) fn bounds(description: &SceneDescription) -> impl Iterator<Item = DBounds> {
    let groups: Vec<DBounds> = description.groups.iter().map(|group| geometry::bounds_of(&group.shapes)).collect();
    description.instances.iter().map(move |instance| {
        let b = groups[instance.group.0];
        if b.is_empty() {
            return b;
        }
        let choose = |mask: usize, axis: usize| if mask >> axis & 1 == 0 { b.min[axis] } else { b.max[axis] };
        let corners = (0..8).map(|mask| DVec3::new(choose(mask, 0), choose(mask, 1), choose(mask, 2)));
        corners.fold(DBounds::EMPTY, |all, p| all.with(instance.to_world.transform_point3(p)))
    })
}

/// A compiled group.
struct Prepared<'a> {
    /// From the file's space of the group to the compiled one's.
    to_group: ToScene,
    group: Arc<Group>,
    kept: Vec<&'a description::Shape>,
}

/// Adds the shapes of every instance.
pub(super) fn place<'a>(
    description: &'a SceneDescription,
    to_scene: &ToScene,
    compiled: &mut Compiled<'a>,
    warnings: &mut Vec<String>,
) -> Result<()> {
    let groups = description.groups.iter().map(|group| prepare(group, warnings)).collect::<Result<Vec<_>>>()?;
    for instance in &description.instances {
        let Prepared { to_group, group, kept } = &groups[instance.group.0];
        let m = instance.to_world;
        let map = DAffine3 {
            // Both units are powers of two.
            matrix3: m.matrix3 * (to_scene.unit / to_group.unit),
            translation: to_scene.point(m.transform_point3(to_group.centre)),
        };
        if !map.is_finite() {
            return Err(geometry::not_finite(&instance.at, &instance.name));
        }
        let Some(placement) = Placement::new(map).map(Arc::new) else {
            warnings.push(geometry::too_small(&instance.at, &instance.name));
            continue;
        };
        let placed = (0..kept.len() as u32)
            .map(|index| Placed { group: group.clone(), index, placement: placement.clone() })
            .map(Shape::Placed);
        compiled.shapes.extend(placed);
        compiled.kept.extend(kept);
        compiled.spaces.extend(kept.iter().map(|_| *to_group));
    }
    Ok(())
}

fn prepare<'a>(group: &'a description::Group, warnings: &mut Vec<String>) -> Result<Prepared<'a>> {
    let to_group = ToScene::fitting(&geometry::bounds_of(&group.shapes));
    let Compiled { shapes, kept, .. } = geometry::own_shapes(&group.shapes, &to_group, warnings)?;
    Ok(Prepared { to_group, group: Arc::new(Group::new(shapes)), kept })
}
