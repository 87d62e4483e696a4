//! Numbers out of buffers: dense, interleaved and sparse accessors of every type.

use super::buffers::{View, part};
use super::model::Model;
use crate::error::Result;
use gltf::json::accessor::{Accessor, ComponentType, Type, sparse::Sparse};
use gltf::json::validation::Checked;

/// What numbers are for, which decides what types they may have.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Purpose {
    /// Indices of vertices.
    Indices,
    /// Indices of joints.
    Joints,
    /// Anything that is measured. With `KHR_mesh_quantization`, which is always taken to be there, integers as well.
    Measures,
}

/// Most elements of an accessor without a buffer view, all zero but for a few. Reason: they take no bytes in the file, so
/// nothing else keeps a file from asking for all memory; this is more than a mesh has whose vertices are not stored.
const MAX_ZEROS: u64 = 1 << 20;

/// Elements of `N` numbers and how each is stored.
struct Layout {
    component: ComponentType,
    normalized: bool,
    count: usize,
    /// Bytes of an element.
    size: usize,
}

impl Model {
    /// How many elements an accessor has.
    pub(super) fn count(&self, index: usize, place: &str) -> Result<usize> {
        let accessor = self.get(&self.root.accessors, index, "accessors", place)?;
        // More than that is found out where it is read.
        Ok(usize::try_from(accessor.count.0).unwrap_or(usize::MAX))
    }

    /// How many numbers each has.
    pub(super) fn width(&self, index: usize, place: &str) -> Result<usize> {
        let accessor = self.get(&self.root.accessors, index, "accessors", place)?;
        self.type_of(accessor, &format!("accessors[{index}]")).map(|(_, width, _)| width)
    }

    fn type_of(&self, accessor: &Accessor, place: &str) -> Result<(Type, usize, &'static str)> {
        let Checked::Valid(of) = accessor.type_ else {
            return Err(self.error(place, "its type is not one of SCALAR, VEC2, VEC3, VEC4, MAT2, MAT3, MAT4"));
        };
        let (width, name) = match of {
            Type::Scalar => (1, "SCALAR"),
            Type::Vec2 => (2, "VEC2"),
            Type::Vec3 => (3, "VEC3"),
            Type::Vec4 => (4, "VEC4"),
            Type::Mat2 => (4, "MAT2"),
            Type::Mat3 => (9, "MAT3"),
            Type::Mat4 => (16, "MAT4"),
        };
        Ok((of, width, name))
    }

    /// The elements of `accessors[index]`, which `place` refers to, and which must be of `N` numbers.
    pub(super) fn numbers<const N: usize>(&self, index: usize, place: &str, for_: Purpose) -> Result<Vec<[f64; N]>> {
        let accessor = self.get(&self.root.accessors, index, "accessors", place)?;
        let own = format!("accessors[{index}]");
        let layout = self.layout::<N>(accessor, &own, place, for_)?;
        // The same bytes may be asked for over and over.
        let bytes = (layout.count * size_of::<[f64; N]>()) as u64;
        self.files.memory().check(bytes).map_err(|m| self.error(&own, format!("it {m}")))?;
        let mut values = match accessor.buffer_view {
            Some(view) => {
                let view = self.view(view.value(), &own)?;
                self.dense(&layout, view, accessor.byte_offset.unwrap_or_default().0, &own)?
            }
            None if accessor.count.0 > MAX_ZEROS => {
                return Err(self.error(&own, format!("{} elements without a bufferView are too many", layout.count)));
            }
            None => vec![[0.0; N]; layout.count],
        };
        if let Some(sparse) = &accessor.sparse {
            self.substitute(&layout, sparse, &mut values, &own)?;
        }
        match values.iter().position(|v| v.iter().any(|n| !n.is_finite())) {
            Some(element) => Err(self.error(&own, format!("element {element} is not finite"))),
            None => Ok(values),
        }
    }

    /// Checks the types of an accessor.
    fn layout<const N: usize>(&self, a: &Accessor, own: &str, place: &str, for_: Purpose) -> Result<Layout> {
        let Checked::Valid(component) = a.component_type else {
            return Err(self.error(own, "its componentType is not one of 5120, 5121, 5122, 5123, 5125, 5126"));
        };
        let (of, width, name) = self.type_of(a, own)?;
        if width != N || of == Type::Mat2 {
            return Err(self.error(place, format!("expected {N} numbers an element, but {own} is {name}")));
        }
        use ComponentType::{F32, U8, U16, U32};
        let component = component.0;
        let fits = match for_ {
            Purpose::Indices => matches!(component, U8 | U16 | U32) && !a.normalized,
            Purpose::Joints => matches!(component, U8 | U16) && !a.normalized,
            Purpose::Measures => component != U32 && (component == F32 || of != Type::Mat4),
        };
        if !fits {
            let message = format!("{own} has numbers of the wrong type (componentType {})", component.as_gl_enum());
            return Err(self.error(place, message));
        }
        let count = u32::try_from(a.count.0);
        let count =
            count.map_err(|_| self.error(own, format!("{} elements are too many to be numbered", a.count.0)))?;
        let count = count as usize;
        Ok(Layout { component, normalized: a.normalized, count, size: N * component.size() })
    }

    /// Elements from `offset` in a view, one behind the other or `stride` apart.
    fn dense<const N: usize>(&self, layout: &Layout, view: View<'_>, offset: u64, own: &str) -> Result<Vec<[f64; N]>> {
        if layout.count == 0 {
            return Ok(Vec::new());
        }
        let size = layout.size;
        let stride = view.stride.unwrap_or(size);
        if stride < size {
            return Err(self.error(own, format!("elements of {size} bytes cannot be {stride} bytes apart")));
        }
        let span = (layout.count - 1).checked_mul(stride).and_then(|to_last| to_last.checked_add(size));
        let bytes = span.and_then(|span| part(view.bytes, offset, span as u64)).ok_or_else(|| {
            let (count, has) = (layout.count, view.bytes.len());
            let message = format!("{count} elements from byte {offset} do not fit into its bufferView of {has} bytes");
            self.error(own, message)
        })?;
        Ok(bytes.chunks(stride).map(|element| layout.element(element)).collect())
    }

    /// Puts the elements of a sparse accessor into their places.
    fn substitute<const N: usize>(
        &self,
        layout: &Layout,
        sparse: &Sparse,
        values: &mut [[f64; N]],
        own: &str,
    ) -> Result<()> {
        let place = format!("{own}.sparse");
        let Checked::Valid(component) = sparse.indices.component_type else {
            return Err(self.error(&place, "the componentType of its indices is not one of 5121, 5123, 5125"));
        };
        let count = usize::try_from(sparse.count.0).unwrap_or(usize::MAX);
        if count > values.len() {
            let most = values.len();
            return Err(self.error(&place, format!("it has {count} elements, but there are {most} to replace")));
        }
        let indices = Layout { component: component.0, normalized: false, count, size: component.0.size() };
        let view = self.view(sparse.indices.buffer_view.value(), &place)?;
        let indices: Vec<[f64; 1]> = self.dense(&indices, view, sparse.indices.byte_offset.0, &place)?;
        let new = Layout { count, ..*layout };
        let view = self.view(sparse.values.buffer_view.value(), &place)?;
        let new: Vec<[f64; N]> = self.dense(&new, view, sparse.values.byte_offset.0, &place)?;
        let total = values.len();
        for ([index], new) in indices.into_iter().zip(new) {
            let old = values.get_mut(index as usize);
            *old.ok_or_else(|| self.error(&place, format!("there is no element {index} of {total}")))? = new;
        }
        Ok(())
    }
}

impl Layout {
    fn element<const N: usize>(&self, bytes: &[u8]) -> [f64; N] {
        let size = self.component.size();
        std::array::from_fn(|i| self.number(&bytes[i * size..(i + 1) * size]))
    }

    /// A number from its bytes; integers that are normalised as section 3.11 of the specification has it.
    fn number(&self, bytes: &[u8]) -> f64 {
        let signed = |v: f64, most: f64| if self.normalized { (v / most).max(-1.0) } else { v };
        let unsigned = |v: f64, most: f64| if self.normalized { v / most } else { v };
        match (self.component, bytes) {
            (ComponentType::I8, &[a]) => signed(f64::from(a.cast_signed()), f64::from(i8::MAX)),
            (ComponentType::U8, &[a]) => unsigned(f64::from(a), f64::from(u8::MAX)),
            (ComponentType::I16, &[a, b]) => signed(f64::from(i16::from_le_bytes([a, b])), f64::from(i16::MAX)),
            (ComponentType::U16, &[a, b]) => unsigned(f64::from(u16::from_le_bytes([a, b])), f64::from(u16::MAX)),
            (ComponentType::U32, &[a, b, c, d]) => f64::from(u32::from_le_bytes([a, b, c, d])),
            (ComponentType::F32, &[a, b, c, d]) => f64::from(f32::from_le_bytes([a, b, c, d])),
            // The slices are as long as the type.
            _ => 0.0,
        }
    }
}
