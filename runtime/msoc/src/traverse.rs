//! Interleaved front-to-back traversal of a bounding volume hierarchy (Listing 1 of the paper).

use std::collections::BinaryHeap;
use std::time::{Duration, Instant};

use crate::footprint::{Footprint, Visibility};
use crate::geometry::{Aabb, Matrix4, Occluder};
use crate::msoc::{MeshError, Msoc};

/// What is at a node of a tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Node {
    /// Two nodes below.
    Children([u32; 2]),
    /// An object.
    Object(u32),
}

/// A bounding volume hierarchy, as the caller has it. Bounds of a node contain those below it.
pub trait Hierarchy {
    /// The root, if there is any object.
    fn root(&self) -> Option<u32>;
    /// What is at a node.
    fn node(&self, node: u32) -> Node;
    /// Its bounds in world space.
    fn bounds(&self, node: u32) -> Aabb;
}

/// What a traversal did.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Traversal {
    /// The objects that are not known to be hidden, nearest bounds first.
    pub visible: Vec<u32>,
    /// Occluders rasterized.
    pub occluders: usize,
    /// Nodes asked about.
    pub queries: usize,
    /// Whether the time was up and occluders were left out.
    pub out_of_time: bool,
}

/// A node on the heap, the nearest on top; equal ones by number, so that the order is always the same.
#[derive(Clone, Copy)]
struct Entry {
    nearest: f32,
    node: u32,
    footprint: Footprint,
}

impl Ord for Entry {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        let nearest = self.nearest.total_cmp(&other.nearest);
        nearest.then(other.node.cmp(&self.node))
    }
}

impl PartialOrd for Entry {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Entry {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Entry {}

impl Msoc {
    /// Visits a tree from front to back: asks about each node, opens those that are not hidden, and
    /// rasterizes the occluders of the objects found. `occluder` says what hides things at an object, if
    /// anything does. After `budget` no more occluders are rasterized, but queries go on. Clears nothing.
    ///
    /// A node is asked about when it is pushed, as in the paper, and, since occluders may have come since,
    /// once more when it is popped.
    ///
    /// # Errors
    /// If an occluder's index is out of range.
    pub fn traverse<'a>(
        &mut self,
        clip_from_world: &Matrix4,
        tree: &impl Hierarchy,
        budget: Option<Duration>,
        mut occluder: impl FnMut(u32) -> Option<Occluder<'a>>,
    ) -> Result<Traversal, MeshError> {
        let start = Instant::now();
        let mut found = Traversal::default();
        let mut heap = BinaryHeap::new();
        let seen = |msoc: &Self, node: u32| {
            let (nearest, footprint) = msoc.box_footprint(clip_from_world, &tree.bounds(node));
            let seen = msoc.ask(footprint) == Visibility::Visible;
            seen.then_some(Entry {
                nearest,
                node,
                footprint,
            })
        };
        found.queries += usize::from(tree.root().is_some());
        heap.extend(tree.root().and_then(|root| seen(self, root)));
        while let Some(Entry {
            node, footprint, ..
        }) = heap.pop()
        {
            if self.ask(footprint) != Visibility::Visible {
                continue;
            }
            match tree.node(node) {
                Node::Children(children) => {
                    found.queries += children.len();
                    heap.extend(children.into_iter().filter_map(|child| seen(self, child)));
                }
                Node::Object(object) => {
                    found.visible.push(object);
                    found.out_of_time |= budget.is_some_and(|budget| start.elapsed() >= budget);
                    if !found.out_of_time
                        && let Some(occluder) = occluder(object)
                    {
                        self.rasterize(clip_from_world, &[occluder])?;
                        found.occluders += 1;
                    }
                }
            }
        }
        Ok(found)
    }
}
