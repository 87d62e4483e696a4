//! Many rays in turn through a tree of triangles, for processors with AVX2 or AVX-512.
//!
//! A ray by itself waits: for the next node to come from memory, for the end of one test to know what to ask next, and for
//! the processor to mend its guesses of how many children are met. So many rays are under way at once ([`SLOTS`]), and
//! each pass does the same thing for all of them: take the next subtree from each ray's stack (and ask memory for it),
//! put new rays where one is done, test the boxes of all that are at nodes, then the triangles of all that are at leaves. Nothing
//! that cannot be foreseen is a branch: not whether a ray is done, nor whether a node or a leaf comes next. No step of a node depends on a
//! branch: the children that are met go onto the stack, packed to the front by a permutation from a table, while the
//! ray goes on with the nearest, and how far its stack grows is the number of the others.
//!
//! Nothing is stored to an address that follows from what was just computed: all later loads would have to wait for it. So
//! the nearest child does not go onto the stack (which had made a node cost twice as much), and what a slot does
//! next is a bit in a register and not an entry of a list.
//!
//! The boxes and their bounds are those of [`super::wide`], and so are the answers: the same bits as one ray at a time.
#![allow(unsafe_code, reason = "a SIMD kernel; loads and stores of vectors are unsafe")]

use super::block::SceneRay;
use super::triangles::{Best, Lanes, TriangleBlock, TriangleRay};
use super::wide::{BLOCK, Node, Slab, WIDTH};
use crate::accel::Hit;
use crate::math::ray::Ray;
use crate::shape::triangle::{FourTriangles, Meetings, ShearedRay, meet4_avx512};
use fearless_simd::Level;
use fearless_simd::prelude::*;
use fearless_simd::x86::{Avx2, Avx512};
use glam::Vec3;
use std::arch::x86_64::*;
use std::cell::RefCell;
use std::hint::select_unpredictable;

/// Rays under way: enough to hide the answers of a slow memory, and for long passes, for at the end of each loop the processor
/// guesses wrong; few enough for what is used of their slots to stay in the first-level cache. 16 take 1.06 to 1.1 times as long.
const SLOTS: usize = 32;

/// What stands at the bottom of a stack: no tree has so many nodes.
const DONE: u32 = BLOCK - 1;

/// Entries under the first of a stack: the eight entries below any top can be loaded, and the last one is [`DONE`].
const BASE: usize = WIDTH;

/// Permutations that pack the lanes of a mask to the front, in order.
static PACK: [[u8; WIDTH]; 1 << WIDTH] = packing(false);

/// The same with the last lane first, so that the first is on top of a stack.
static PACK_BACKWARDS: [[u8; WIDTH]; 1 << WIDTH] = packing(true);

const fn packing(backwards: bool) -> [[u8; WIDTH]; 1 << WIDTH] {
    let mut table = [[0; WIDTH]; 1 << WIDTH];
    let mut mask = 0;
    while mask < table.len() {
        let (mut lane, mut count) = (0, 0);
        while lane < WIDTH {
            let next = if backwards { WIDTH - 1 - lane } else { lane };
            if mask >> next & 1 == 1 {
                table[mask][count] = next as u8;
                count += 1;
            }
            lane += 1;
        }
        mask += 1;
    }
    table
}

/// The most nodes on a path from the root of a tree that can be walked so. Trees of a thousand million triangles that are
/// worth the name have half as many.
pub(super) const MAX_DEPTH: usize = 36;

/// Entries of a stack: the root under a block that is visited first; a node leaves at most seven children more than it takes, and a
/// whole vector is stored above the last.
const STACK: usize = BASE + 1 + (WIDTH - 1) * MAX_DEPTH + WIDTH;

/// Sets of directions: by the signs of their components, and the largest of these.
const DIRECTIONS: usize = 32;

/// What hid the last ray of each set of directions, and may hide the next one: its block is visited before the root. (Where most rays
/// end at a few walls, this saves most of their way.)
#[derive(Clone, Copy)]
struct Occluders {
    /// References to blocks; [`DONE`] where nothing is known.
    blocks: [u32; DIRECTIONS],
    /// Positive where it has paid lately.
    hope: i32,
    /// How many blocks the tree has. Of another tree with as many the guesses are no good, but do no harm.
    count: usize,
}

impl Occluders {
    /// What a guess that is right adds to hope; one that is not takes 1. A right one saves several visits, a wrong one costs one.
    const GAIN: i32 = 6;

    /// Hope stays within these bounds, so that it follows what changes.
    const HOPE: [i32; 2] = [-16, 64];

    /// One of so many rays tries without hope.
    const TRIES: usize = 16;

    const fn none(count: usize) -> Self {
        Self { blocks: [DONE; DIRECTIONS], hope: 0, count }
    }

    /// The set of directions that `d` is in.
    #[inline(always)]
    fn set_of(d: Vec3) -> usize {
        let size = d.abs();
        let largest = if size.x >= size.y && size.x >= size.z { 0 } else { 1 + usize::from(size.z > size.y) };
        largest << 3 | d.is_negative_bitmask() as usize
    }

    /// The block to visit before the root, for the ray of this number.
    #[inline(always)]
    fn guess(&self, set: usize, index: usize) -> Option<u32> {
        let block = self.blocks[set % DIRECTIONS];
        (block != DONE && (self.hope > 0 || index.is_multiple_of(Self::TRIES))).then_some(block)
    }

    /// Nothing hid a ray.
    #[inline(always)]
    fn learn_nothing(&mut self) {
        self.hope = (self.hope - 1).max(Self::HOPE[0]);
    }

    /// This block hid a ray.
    #[inline(always)]
    fn learn(&mut self, set: usize, block: u32) {
        if self.blocks[set % DIRECTIONS] == block {
            self.hope = (self.hope + Self::GAIN).min(Self::HOPE[1]);
        } else {
            self.blocks[set % DIRECTIONS] = block;
            self.learn_nothing();
        }
    }
}

/// A ray under way, and its stack.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
struct Slot {
    slab: Slab,
    /// No box that is entered beyond matters.
    limit: f32,
    /// The subtree to visit.
    next: u32,
    /// Where the next entry of its stack goes.
    top: usize,
    /// The number of the ray.
    index: usize,
    /// The set of directions that it is in; not kept for a ray that asks for the closest hit.
    directions: usize,
    best: Best,
    ray: TriangleRay,
    /// What the passes over leaves hand on.
    meetings: Meetings,
    lanes: Lanes,
    /// Where the ray enters what is on the stack; not kept for a ray that asks for any hit.
    distances: [f32; STACK],
    children: [u32; STACK],
}

/// What a thread keeps from batch to batch.
struct Room {
    slots: Box<[Slot; SLOTS]>,
    occluders: Occluders,
}

impl Room {
    fn new() -> Self {
        let mut slots = vec![Slot::EMPTY; SLOTS];
        for slot in &mut slots {
            slot.distances[BASE - 1] = f32::NEG_INFINITY;
            slot.children[BASE - 1] = DONE;
        }
        let slots = slots.into_boxed_slice().try_into().unwrap_or_else(|_| unreachable!("as many as asked for"));
        Self { slots, occluders: Occluders::none(0) }
    }
}

thread_local! {
    static ROOM_OF_THREAD: RefCell<Room> = RefCell::new(Room::new());
}

/// What rays ask.
pub(super) trait Query {
    /// Whether any hit will do.
    const ANY: bool;

    /// The ends of a ray.
    fn ends(&self, index: usize) -> [Hit; 2];

    /// Whether a ray needs an answer.
    fn wants(&self, index: usize) -> bool;

    /// Takes the answer.
    fn answer(&mut self, index: usize, best: &Best);
}

/// Asks the first triangle that each ray meets.
pub(super) struct Closest<'a, F> {
    /// What the rays start on; may be empty.
    pub(super) from: &'a [Hit],
    /// Takes the answer to each.
    pub(super) take: F,
}

impl<F: FnMut(usize, &Best)> Query for Closest<'_, F> {
    const ANY: bool = false;

    #[inline(always)]
    fn ends(&self, index: usize) -> [Hit; 2] {
        [if index < self.from.len() { self.from[index] } else { Hit::NONE }, Hit::NONE]
    }

    #[inline(always)]
    fn wants(&self, _: usize) -> bool {
        true
    }

    #[inline(always)]
    fn answer(&mut self, index: usize, best: &Best) {
        (self.take)(index, best);
    }
}

/// Asks whether each ray meets any; what is true already is left alone.
pub(super) struct Any<'a> {
    pub(super) ends: &'a [[Hit; 2]],
    pub(super) occluded: &'a mut [bool],
}

impl Query for Any<'_> {
    const ANY: bool = true;

    #[inline(always)]
    fn ends(&self, index: usize) -> [Hit; 2] {
        if index < self.ends.len() { self.ends[index] } else { [Hit::NONE; 2] }
    }

    #[inline(always)]
    fn wants(&self, index: usize) -> bool {
        !self.occluded[index]
    }

    #[inline(always)]
    fn answer(&mut self, index: usize, best: &Best) {
        self.occluded[index] = best.is_some();
    }
}

/// What the kernel reads of a tree.
#[derive(Clone, Copy)]
pub(super) struct View<'a> {
    pub(super) nodes: &'a [Node],
    pub(super) blocks: &'a [TriangleBlock],
    pub(super) root: u32,
    pub(super) reach: f32,
    pub(super) depth: usize,
}

impl View<'_> {
    /// Asks memory for the four lines of a node, or the three of a block and the next.
    #[inline(always)]
    fn fetch(&self, child: u32) {
        let node = self.nodes.as_ptr().wrapping_add(child as usize).cast::<i8>();
        let block = self.blocks.as_ptr().wrapping_add((child & !BLOCK) as usize).cast::<i8>();
        // A branch would be guessed wrong every other time.
        let place = select_unpredictable(child & BLOCK == 0, node, block);
        // SAFETY: to fetch touches nothing, wherever it is.
        unsafe {
            _mm_prefetch::<_MM_HINT_T0>(place);
            _mm_prefetch::<_MM_HINT_T0>(place.wrapping_add(64));
            _mm_prefetch::<_MM_HINT_T0>(place.wrapping_add(128));
            _mm_prefetch::<_MM_HINT_T0>(place.wrapping_add(192));
        }
    }
}

/// What the walk does with each set of instructions in its own way. Only sets that have AVX2 are one.
trait Kernel: Simd {
    /// [`ShearedRay::meet4`].
    fn meet(self, ray: &ShearedRay, triangles: &FourTriangles) -> Meetings;
}

impl Kernel for Avx2 {
    #[inline(always)]
    fn meet(self, ray: &ShearedRay, triangles: &FourTriangles) -> Meetings {
        ray.meet4(triangles)
    }
}

impl Kernel for Avx512 {
    #[inline(always)]
    fn meet(self, ray: &ShearedRay, triangles: &FourTriangles) -> Meetings {
        meet4_avx512(self, ray, triangles)
    }
}

/// Answers `query` for all `rays`, in any order, if the instructions of `level` are enough for that; says whether they are.
/// The tree is at most [`MAX_DEPTH`] deep.
pub(super) fn trace<Q: Query>(level: Level, tree: View<'_>, rays: &[Ray], query: &mut Q) -> bool {
    assert!(tree.depth <= MAX_DEPTH, "the stacks have no more room");
    ROOM_OF_THREAD.with_borrow_mut(|room| {
        if let Some(simd) = level.as_avx512() {
            simd.vectorize(
                #[inline(always)]
                || trace_in(simd, room, tree, rays, query),
            );
        } else if let Some(simd) = level.as_avx2() {
            simd.vectorize(
                #[inline(always)]
                || trace_in(simd, room, tree, rays, query),
            );
        } else {
            return false;
        }
        true
    })
}

#[inline(always)]
fn trace_in<K: Kernel, Q: Query>(simd: K, room: &mut Room, tree: View<'_>, rays: &[Ray], query: &mut Q) {
    let Room { slots, occluders } = room;
    if occluders.count != tree.blocks.len() {
        *occluders = Occluders::none(tree.blocks.len());
    }
    let mut next = 0;
    let mut wait = Waiting { stacks: 0, nodes: 0, leaves: 0 };
    // At first, all slots wait for a ray, and have none that was answered.
    let (mut done, mut begun) = (u32::MAX >> (u32::BITS - SLOTS as u32), false);
    loop {
        for number in Bits(std::mem::take(&mut wait.stacks)) {
            let child = slots[number].pop::<K, Q>(simd);
            // Whether a ray is done cannot be foreseen, and then others would wait for the wrong guess to be mended.
            let is_done = child == DONE;
            done |= u32::from(is_done) << number;
            wait.visit(tree, number, &mut slots[number], select_unpredictable(is_done, tree.root, child));
        }
        for number in Bits(std::mem::take(&mut done)) {
            let slot = &mut slots[number];
            wait.leave(number);
            if begun {
                query.answer(slot.index, &slot.best);
                if Q::ANY && !slot.best.is_some() {
                    occluders.learn_nothing();
                }
            }
            if !slot.start(tree, rays, &mut next, query) {
                continue;
            }
            let mut child = tree.root;
            if Q::ANY
                && let Some(block) = occluders.guess(slot.directions, slot.index)
            {
                slot.children[slot.top] = child;
                slot.top += 1;
                child = block;
            }
            wait.visit(tree, number, slot, child);
        }
        begun = true;
        if wait.nodes | wait.leaves == 0 {
            return;
        }
        let leaves = std::mem::take(&mut wait.leaves);
        for number in Bits(std::mem::take(&mut wait.nodes)) {
            slots[number].step::<K, Q>(simd, tree, number, &mut wait);
        }
        test_blocks::<K, Q>(simd, slots, leaves, tree, occluders);
        wait.stacks |= leaves;
    }
}

/// Tests the blocks that these rays have come to.
#[inline(always)]
fn test_blocks<K: Kernel, Q: Query>(
    simd: K,
    slots: &mut [Slot; SLOTS],
    leaves: u32,
    tree: View<'_>,
    occluders: &mut Occluders,
) {
    // First whether triangles may be met, for all; then, of the few that may, how far away they are; then what is nearer.
    let (mut crossed, mut nearer) = (0, 0);
    for number in Bits(leaves) {
        let slot = &mut slots[number];
        let block = slot.next & !BLOCK;
        let block = &tree.blocks[block as usize];
        slot.meetings = simd.meet(&slot.ray.sheared, block.rows());
        // Nearly every ray that leaves a surface visits the block that it starts in: no use to find out how far that is. Only a
        // ray that asks for any hit ends on something.
        let ends = &slot.ray.ends;
        slot.meetings.candidates &= if Q::ANY { block.others(simd, ends) } else { block.others(simd, &[ends[0]]) };
        crossed |= u32::from(slot.meetings.candidates != 0) << number;
    }
    for number in Bits(crossed) {
        let slot = &mut slots[number];
        slot.lanes = Lanes::new(&slot.meetings, &slot.ray, slot.limit);
        nearer |= u32::from(slot.lanes.rest != 0) << number;
    }
    for number in Bits(nearer) {
        let slot = &mut slots[number];
        let block = slot.next & !BLOCK;
        if !Q::ANY {
            TriangleBlock::take_closest::<false>(tree.blocks, block, &slot.ray, &slot.lanes, &mut slot.best);
            slot.limit = slot.best.limit();
        } else if TriangleBlock::meets_any::<false>(tree.blocks, block, &slot.ray, &slot.lanes) {
            slot.best = Best::SOME;
            slot.top = BASE;
            occluders.learn(slot.directions, slot.next);
        }
    }
}

/// The numbers of the bits that are set.
struct Bits(u32);

impl Iterator for Bits {
    type Item = usize;

    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        if self.0 == 0 {
            return None;
        }
        let number = self.0.trailing_zeros() as usize % SLOTS;
        self.0 &= self.0 - 1;
        Some(number)
    }
}

/// Slots by what they are to do next, a bit each.
struct Waiting {
    /// Those that take from their stacks.
    stacks: u32,
    nodes: u32,
    leaves: u32,
}

impl Waiting {
    /// Lets a slot visit a subtree next.
    #[inline(always)]
    fn visit(&mut self, tree: View<'_>, number: usize, slot: &mut Slot, child: u32) {
        slot.next = child;
        tree.fetch(child);
        let is_leaf = child >> 31;
        self.leaves |= is_leaf << number;
        self.nodes |= (1 - is_leaf) << number;
    }

    /// Lets it visit nothing.
    #[inline(always)]
    fn leave(&mut self, number: usize) {
        self.nodes &= !(1 << number);
        self.leaves &= !(1 << number);
    }
}

impl Slot {
    const EMPTY: Self = Self {
        slab: Slab::EMPTY,
        limit: 0.0,
        next: DONE,
        top: BASE,
        index: 0,
        directions: 0,
        best: Best::NONE,
        ray: TriangleRay::EMPTY,
        meetings: Meetings::NONE,
        lanes: Lanes::NONE,
        distances: [0.0; STACK],
        children: [0; STACK],
    };

    /// Takes the next ray that needs an answer; false if there is none.
    #[inline(always)]
    fn start<Q: Query>(&mut self, tree: View<'_>, rays: &[Ray], next: &mut usize, query: &Q) -> bool {
        while *next < rays.len() && !query.wants(*next) {
            *next += 1;
        }
        let Some(ray) = rays.get(*next) else { return false };
        self.slab = Slab::new(ray, tree.reach);
        self.limit = ray.tmax;
        self.top = BASE;
        self.index = *next;
        if Q::ANY {
            self.directions = Occluders::set_of(ray.d);
        }
        self.ray = TriangleRay::new(ray, query.ends(*next));
        self.best = Best::none(ray);
        *next += 1;
        true
    }

    /// The last subtree on the stack that is not beyond what was found already.
    #[inline(always)]
    fn pop<K: Kernel, Q: Query>(&mut self, _: K) -> u32 {
        if Q::ANY {
            self.top -= 1;
            return self.children[self.top];
        }
        loop {
            // SAFETY: the top of a stack is at least `BASE`, and inside it; who has a kernel has AVX2.
            let near = unsafe {
                let below = _mm256_loadu_ps(self.distances.as_ptr().add(self.top - WIDTH));
                _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(below, _mm256_set1_ps(self.limit))) as u8
            };
            if near != 0 {
                self.top -= 1 + near.leading_zeros() as usize;
                return self.children[self.top];
            }
            self.top -= WIDTH;
        }
    }

    /// Tests the boxes of a node; all children that are met but the nearest go onto the stack.
    #[inline(always)]
    fn step<K: Kernel, Q: Query>(&mut self, _: K, tree: View<'_>, number: usize, wait: &mut Waiting) {
        let slot = self;
        // SAFETY: a reference without `BLOCK` is the index of a node; the places of planes are inside it; the stack has room
        // for all children. Who has a kernel has AVX2 and what comes with it.
        unsafe {
            let node = tree.nodes.as_ptr().add(slot.next as usize);
            let planes = node.cast::<f32>();
            let slab = &slot.slab;
            let near = |axis: usize| _mm256_load_ps(planes.add(slab.planes.near[axis] as usize));
            let far = |axis: usize| _mm256_load_ps(planes.add(slab.planes.far[axis] as usize));
            let all = |x: &f32| _mm256_broadcast_ss(x);
            let [ix, iy, iz] = [all(&slab.inverse.x), all(&slab.inverse.y), all(&slab.inverse.z)];
            let x = _mm256_fmadd_ps(near(0), ix, all(&slab.entry_start.x));
            let y = _mm256_fmadd_ps(near(1), iy, all(&slab.entry_start.y));
            let z = _mm256_fmadd_ps(near(2), iz, all(&slab.entry_start.z));
            let entry = _mm256_max_ps(_mm256_max_ps(x, y), _mm256_max_ps(z, all(&slab.tmin)));
            let x = _mm256_fmadd_ps(far(0), ix, all(&slab.exit_start.x));
            let y = _mm256_fmadd_ps(far(1), iy, all(&slab.exit_start.y));
            let z = _mm256_fmadd_ps(far(2), iz, all(&slab.exit_start.z));
            let exit = _mm256_min_ps(_mm256_min_ps(x, y), _mm256_min_ps(z, all(&slot.limit)));
            let hit = _mm256_cmp_ps::<_CMP_LE_OQ>(entry, exit);
            let met = _mm256_movemask_ps(hit) as u32;
            let children = (*node).children.as_ptr();
            let distances_top = slot.distances.as_mut_ptr().add(slot.top);
            let children_top = slot.children.as_mut_ptr().add(slot.top);
            let lanes = _mm256_load_si256(children.cast());
            let nearest = if Q::ANY {
                met.trailing_zeros() as usize % WIDTH
            } else {
                // The bits of a distance that is not negative sort like the distance; the lane takes the lowest.
                let keys = _mm256_or_si256(
                    _mm256_and_si256(_mm256_castps_si256(entry), _mm256_set1_epi32(!(WIDTH as i32 - 1))),
                    _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7),
                );
                let keys = _mm256_or_si256(keys, _mm256_xor_si256(_mm256_castps_si256(hit), _mm256_set1_epi32(-1)));
                let least = _mm_min_epu32(_mm256_castsi256_si128(keys), _mm256_extracti128_si256::<1>(keys));
                let least = _mm_min_epu32(least, _mm_shuffle_epi32::<0b01_00_11_10>(least));
                let least = _mm_min_epu32(least, _mm_shuffle_epi32::<0b10_11_00_01>(least));
                let least = _mm_cvtsi128_si32(least) as u32;
                least as usize & (WIDTH - 1)
            };
            let others = met & !(1 << nearest);
            let table = if Q::ANY { &PACK_BACKWARDS } else { &PACK };
            let pack = _mm256_cvtepu8_epi32(_mm_loadl_epi64(table[others as usize & 255].as_ptr().cast()));
            if !Q::ANY {
                _mm256_storeu_ps(distances_top, _mm256_permutevar8x32_ps(entry, pack));
            }
            _mm256_storeu_si256(children_top.cast(), _mm256_permutevar8x32_epi32(lanes, pack));
            slot.top += others.count_ones() as usize;
            // The nearest one does not go onto the stack: a store to an address that is known so late makes all loads after it
            // wait.
            let child = *children.add(nearest);
            slot.next = child;
            tree.fetch(child);
            let is_met = u32::from(met != 0);
            let is_leaf = child >> 31;
            wait.stacks |= (1 - is_met) << number;
            wait.leaves |= (is_met & is_leaf) << number;
            wait.nodes |= (is_met & (1 - is_leaf)) << number;
        }
    }
}
