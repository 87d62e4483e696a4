//! Picks a cell of a sky's map for a surface, by what the cells send and by how the surface faces them.
//!
//! Of light from a direction ω a surface with the normal n reflects the more the larger n·ω is, and what comes from behind it
//! not at all: half of a sky, on average. So the map is divided into blocks of cells. For each bin of an octahedral map of all
//! normals (Cigolle et al. 2014, *A Survey of Efficient Representations for Independent Unit Vectors*) there is a table of how
//! often each block is picked: by its light times the mean cosine it has towards normals of that bin. Within a block a cell is
//! picked by its light alone. Everything is picked by inversion, rows before columns, so that both uniform numbers keep their
//! stratification (against alias tables: Walker 1977).
//!
//! # A block near the horizon
//!
//! Let d be the direction in which a block sends its light, on average, and r the radius of a cone around d that holds it; let m
//! be the middle of a bin and q the radius of a cone around it. No normal n of the bin sees the block unless m·d > −s, where
//! s = sin(r + q), and where m·d > s each sees all of it. There the block counts m·d; between, (m·d + s)/2: more than nothing
//! wherever it is seen, however little, and the same at m·d = s. What is seen of a block at m·d = δ − s has cosines of about δ at
//! most, twice what the block counts; so no sample counts much more than others.

use crate::math::float::{ONE_MINUS_EPSILON, min};
use glam::{DVec3, Vec2, Vec3};
use std::f64::consts::{FRAC_PI_2, TAU};

/// Ends of intervals that are compared at once: rows of blocks and cells are filled up to a multiple of it.
const LANES: usize = 8;

/// Ends of the intervals of the rows of blocks, and of a row's blocks: of those at most one fewer. Blocks of some 12° to 16° are
/// small enough to have one cosine, and their tables stay in a core's cache.
const ROWS: usize = 16;
const COLUMNS: usize = 32;

/// Bins of normals along either side of the octahedral map; even, so that folds of the map are edges of bins. Their radius is
/// about half of a block's.
const BINS: usize = 24;

/// Blocks of cells, and tables to pick one.
#[derive(Clone, Debug)]
pub(super) struct Blocks {
    /// Columns and rows of cells to a block, each one less than a multiple of [`LANES`].
    size: [usize; 2],
    /// Blocks to a row.
    columns: usize,
    /// For each block one over its part of all weight.
    rarity: Vec<f32>,
    /// For each block the ends of its rows, then of the cells of each of these.
    ends: Vec<f32>,
    /// For each bin of normals, and last for all normals.
    tables: Vec<Table>,
}

/// How often each block is picked: ends of intervals, increasing from 0, then ones.
#[derive(Clone, Debug)]
struct Table {
    rows: [f32; ROWS],
    columns: [[f32; COLUMNS]; ROWS - 1],
}

/// A block that was picked.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Block {
    row: usize,
    column: usize,
    /// The uniform numbers, stretched to the block.
    u: Vec2,
    /// Factor from the density by light alone to that for the normal.
    factor: f32,
}

/// A cell that was picked.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Cell {
    /// Column and row.
    pub(super) place: [u32; 2],
    /// The uniform numbers, stretched to the cell.
    pub(super) u: Vec2,
    /// Factor from the density by light alone to that for the normal.
    pub(super) factor: f32,
}

impl Blocks {
    /// For `width` × `height` cells of the weights `weight(column, row)`, between corners in the directions
    /// `corner(column, row)`, of unit length and in world space; and the sum of the weights. `None` unless that is finite and
    /// positive; no weight may be negative.
    pub(super) fn new(
        [width, height]: [usize; 2],
        weight: impl Fn(usize, usize) -> f64,
        corner: impl Fn(usize, usize) -> DVec3,
    ) -> Option<(Self, f64)> {
        let size =
            [width.div_ceil(COLUMNS - 1), height.div_ceil(ROWS - 1)].map(|n| (n + 1).next_multiple_of(LANES) - 1);
        let [columns, rows] = [width.div_ceil(size[0]), height.div_ceil(size[1])];
        let (mut sums, mut cones, mut ends) = (Vec::new(), Vec::new(), Vec::new());
        for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
            let first = [column * size[0], row * size[1]];
            let last = [width.min(first[0] + size[0]), height.min(first[1] + size[1])];
            let cells: Vec<Vec<f64>> =
                (first[1]..last[1]).map(|y| (first[0]..last[0]).map(|x| weight(x, y)).collect()).collect();
            let row_sums: Vec<f64> = cells.iter().map(|row| row.iter().sum()).collect();
            sums.push(row_sums.iter().sum::<f64>());
            cones.push(Cone::around(&cells, first, width, &corner));
            push_ends(&row_sums, size[1] + 1, &mut ends);
            for y in 0..size[1] {
                push_ends(cells.get(y).map_or(&[], |row| &row[..]), size[0] + 1, &mut ends);
            }
        }
        let total: f64 = sums.iter().sum();
        if !(total > 0.0 && total.is_finite()) {
            return None;
        }
        let bins = (0..BINS * BINS).map(|bin| {
            let normals = Cone::of_bin(bin);
            Table::new(columns, sums.iter().zip(&cones).map(|(sum, cone)| sum * cone.cosine(&normals)).collect())
        });
        let tables = bins.chain([Table::new(columns, sums.clone())]).collect();
        let rarity = sums.iter().map(|sum| (total / sum) as f32).collect();
        Some((Self { size, columns, rarity, ends, tables }, total))
    }

    /// A block for a uniform point of the unit square, and a surface that scatters on the side of the normal `n` of unit length,
    /// or, where that is zero, on both sides.
    #[inline(always)]
    pub(super) fn pick(&self, n: Vec3, u: Vec2) -> Block {
        let table = &self.tables[bin(n)];
        let (row, v) = interval(&table.rows, u.y);
        let (column, u) = interval(&table.columns[row], u.x);
        Block { row, column, u: Vec2::new(u, v), factor: self.factor_of(table, row, column) }
    }

    /// A cell of that block.
    #[inline(always)]
    pub(super) fn pick_in(&self, block: &Block) -> Cell {
        let [width, height] = self.size;
        let (across, down) = (width + 1, height + 1);
        let first = (block.row * self.columns + block.column) * (down + height * across);
        let (y, v) = interval(&self.ends[first..first + down], block.u.y);
        let cells = first + down + y * across;
        let (x, u) = interval(&self.ends[cells..cells + across], block.u.x);
        let place = [(block.column * width + x) as u32, (block.row * height + y) as u32];
        Cell { place, u: Vec2::new(u, v), factor: block.factor }
    }

    /// [`Cell::factor`] for a normal and the cell in this column and row.
    #[inline(always)]
    pub(super) fn factor(&self, n: Vec3, [x, y]: [u32; 2]) -> f32 {
        self.factor_of(&self.tables[bin(n)], y as usize / self.size[1], x as usize / self.size[0])
    }

    #[inline(always)]
    fn factor_of(&self, table: &Table, row: usize, column: usize) -> f32 {
        let columns = &table.columns[row];
        let p = (table.rows[row + 1] - table.rows[row]) * (columns[column + 1] - columns[column]);
        // What has no weight is infinitely rare.
        if p > 0.0 { p * self.rarity[row * self.columns + column] } else { 0.0 }
    }
}

impl Table {
    /// For blocks in rows of so many, of these weights.
    fn new(columns: usize, weights: Vec<f64>) -> Self {
        let mut table = Self { rows: [1.0; ROWS], columns: [[1.0; COLUMNS]; ROWS - 1] };
        let rows = weights.chunks(columns);
        fill_ends(&rows.clone().map(|row| row.iter().sum()).collect::<Vec<_>>(), &mut table.rows);
        rows.zip(&mut table.columns).for_each(|(row, ends)| fill_ends(row, ends));
        table
    }
}

/// The ends of as many intervals as there are weights, then ones. Where all are zero, all are ones.
fn fill_ends(weights: &[f64], ends: &mut [f32]) {
    let sum: f64 = weights.iter().sum();
    let mut before = 0.0;
    ends.fill(1.0);
    for (end, weight) in ends.iter_mut().zip(weights) {
        if sum > 0.0 {
            *end = (before / sum) as f32;
        }
        before += weight;
    }
}

/// Appends so many ends.
fn push_ends(weights: &[f64], count: usize, ends: &mut Vec<f32>) {
    let start = ends.len();
    ends.resize(start + count, 1.0);
    fill_ends(weights, &mut ends[start..]);
}

/// The interval that `u` in [0, 1) lies in, and where in it; of ends, a multiple of [`LANES`], of which the last is 1. The first
/// must be 0, but for what is never picked.
#[inline(always)]
fn interval(ends: &[f32], u: f32) -> (usize, f32) {
    let mut counts = [0; LANES];
    for ends in ends.chunks_exact(LANES) {
        for lane in 0..LANES {
            counts[lane] += i32::from(ends[lane] <= u);
        }
    }
    let mut passed = 0;
    for count in counts {
        passed += count;
    }
    let at = (passed.max(1) - 1) as usize;
    let (low, high) = (ends[at], ends[at + 1]);
    (at, min((u - low) / (high - low), ONE_MINUS_EPSILON))
}

/// The bin of a normal; the last where it is zero.
#[inline(always)]
fn bin(n: Vec3) -> usize {
    let sum = n.x.abs() + n.y.abs() + n.z.abs();
    let (x, y) = (n.x / sum, n.y / sum);
    // The lower half is folded outwards.
    let below = n.z < 0.0;
    let u = if below { (1.0 - y.abs()).copysign(x) } else { x };
    let v = if below { (1.0 - x.abs()).copysign(y) } else { y };
    let place = |x: f32| (((0.5 * x + 0.5) * BINS as f32) as i32).clamp(0, BINS as i32 - 1) as usize;
    if sum > 0.0 { place(v) * BINS + place(u) } else { BINS * BINS }
}

/// A cone of directions.
#[derive(Clone, Copy, Debug)]
struct Cone {
    /// Of unit length, or zero where there is nothing.
    axis: DVec3,
    /// Half of its opening angle.
    radius: f64,
}

impl Cone {
    /// Around cells, in the direction in which these weights are. They lie between meridians Δφ apart and parallels, which leave
    /// the great circle between two corners by Δφ²/16 at most: sin θ cos θ (1 − cos Δφ/2).
    fn around(
        weights: &[Vec<f64>],
        [x0, y0]: [usize; 2],
        columns: usize,
        corner: &impl Fn(usize, usize) -> DVec3,
    ) -> Self {
        let mut sum = DVec3::ZERO;
        for (y, row) in (y0..).zip(weights) {
            for (x, weight) in (x0..).zip(row) {
                sum += (corner(x, y) + corner(x + 1, y + 1)) * *weight;
            }
        }
        // The farthest point is on the edge, or more than a right angle away.
        let [x1, y1] = [x0 + weights.first().map_or(0, Vec::len), y0 + weights.len()];
        let across = (x0..=x1).flat_map(|x| [corner(x, y0), corner(x, y1)]);
        let down = (y0..=y1).flat_map(|y| [corner(x0, y), corner(x1, y)]);
        let cone = Self::holding(sum.normalize_or_zero(), across.chain(down));
        let step = TAU / columns as f64;
        Self { radius: cone.radius + step * step / 16.0, ..cone }
    }

    /// The normals of a bin.
    fn of_bin(bin: usize) -> Self {
        let place = |x: f64, y: f64| {
            let [x, y] = [(bin % BINS) as f64 + x, (bin / BINS) as f64 + y].map(|x| 2.0 * x / BINS as f64 - 1.0);
            let z = 1.0 - x.abs() - y.abs();
            let folded = if z < 0.0 { [(1.0 - y.abs()).copysign(x), (1.0 - x.abs()).copysign(y)] } else { [x, y] };
            DVec3::new(folded[0], folded[1], z).normalize()
        };
        Self::holding(place(0.5, 0.5), [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)].map(|(x, y)| place(x, y)))
    }

    fn holding(axis: DVec3, directions: impl IntoIterator<Item = DVec3>) -> Self {
        let least = directions.into_iter().map(|d| axis.dot(d)).fold(1.0, f64::min);
        Self { axis, radius: libm::acos(least.max(-1.0)) }
    }

    /// What a block in this cone counts for surfaces with these normals: see the head of this file.
    fn cosine(&self, normals: &Self) -> f64 {
        let radius = self.radius + normals.radius;
        if radius >= FRAC_PI_2 {
            return 1.0;
        }
        let (cos, sin) = (self.axis.dot(normals.axis), libm::sin(radius));
        if cos >= sin { cos } else { (0.5 * (cos + sin)).max(0.0) }
    }
}
