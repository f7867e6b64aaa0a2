//! Trees over objects in several cells.
//!
//! Builders take boxes in one f32 space. Where objects lie far from that space's zero in proportion to their size, the
//! boxes are too coarse to choose by, so a subtree is built again about a zero of its own as soon as it is small
//! in proportion to its distance. Then every box is stored in a cell near it.

use super::TreeBuilder;
use crate::bvh::{BuildError, from_depth_first, measure_in_cells};
use crate::world_bounds::{round_down, round_up};
use glam::DVec3;
use hroc_format::{Bounds, Bvh, BvhNode, ObjectBounds};

/// A subtree is built again where it is this many times smaller than its distance from the zero of its coordinates:
/// they then have 2^17 steps or fewer for it.
const FARTHEST: f64 = 64.0;

/// The tree of `builder` over objects in cells with these `origins`. One over objects in a single cell is what the
/// builder makes of their bounds.
///
/// # Errors
/// As [`TreeBuilder::build`].
pub fn build(
    builder: &dyn TreeBuilder,
    bounds: &[ObjectBounds],
    origins: &[DVec3],
) -> Result<Bvh, BuildError> {
    if bounds.iter().all(|b| b.cell == 0) {
        let plain = |b: &ObjectBounds| Bounds {
            min: b.min,
            max: b.max,
        };
        return builder.build(&bounds.iter().map(plain).collect::<Vec<_>>());
    }
    let scene = Boxes { bounds, origins };
    let all: Vec<u32> = (0..bounds.len() as u32).collect();
    let sequence = scene.sequence(builder, all)?;
    let world = |b: &ObjectBounds| about(b, origins, origins[0]);
    let rough: Vec<Bounds> = bounds.iter().map(world).collect();
    // Keeps the depth within its limit, by halving as the builder does.
    let mut tree = from_depth_first(&rough, builder.name(), &sequence);
    scene.place_nodes(&mut tree.nodes);
    tree.stats = measure_in_cells(&tree.nodes, origins);
    Ok(tree)
}

struct Boxes<'a> {
    bounds: &'a [ObjectBounds],
    origins: &'a [DVec3],
}

impl Boxes<'_> {
    /// The middle of some objects.
    fn middle(&self, ids: &[u32]) -> DVec3 {
        let [min, max] =
            ids.iter()
                .fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[min, max], &id| {
                    let b = &self.bounds[id as usize];
                    let origin = self.origins[b.cell as usize];
                    let corner = |corner: [f32; 3]| DVec3::from(corner.map(f64::from)) + origin;
                    [min.min(corner(b.min)), max.max(corner(b.max))]
                });
        min + (max - min) * 0.5
    }

    /// The nodes of the tree over `ids`, depth first: the object of a leaf, `None` for an interior node.
    fn sequence(
        &self,
        builder: &dyn TreeBuilder,
        ids: Vec<u32>,
    ) -> Result<Vec<Option<u32>>, BuildError> {
        let zero = self.middle(&ids);
        let own = |&id: &u32| about(&self.bounds[id as usize], self.origins, zero);
        let boxes: Vec<Bounds> = ids.iter().map(own).collect();
        let tree = builder.build(&boxes)?;
        let mut sequence = Vec::with_capacity(tree.nodes.len());
        let mut n = 0;
        while let Some(node) = tree.nodes.get(n) {
            match node.object() {
                Some(object) => sequence.push(Some(ids[object as usize])),
                // Recursion ends: a subtree is FARTHEST times smaller than the tree it is of, and f64 holds no more
                // than some 350 such steps.
                None if n > 0 && is_far(node) => {
                    let end = node.skip as usize;
                    let below = tree.nodes[n..end].iter().filter_map(BvhNode::object);
                    let below = below.map(|object| ids[object as usize]).collect();
                    sequence.extend(self.sequence(builder, below)?);
                    n = end;
                    continue;
                }
                None => sequence.push(None),
            }
            n += 1;
        }
        Ok(sequence)
    }

    /// Stores each node in the cell of its first leaf, with a box that contains its children's.
    fn place_nodes(&self, nodes: &mut [BvhNode]) {
        for n in (0..nodes.len()).rev() {
            let placed = match nodes[n].object() {
                Some(object) => {
                    let b = &self.bounds[object as usize];
                    (b.cell, b.min, b.max)
                }
                None => {
                    let left = nodes[n + 1];
                    let right = nodes[left.skip as usize];
                    let cell = left.cell();
                    let [own, others] =
                        [cell, right.cell()].map(|cell| self.origins[cell as usize]);
                    let right = match others - own {
                        DVec3::ZERO => Bounds {
                            min: right.min,
                            max: right.max,
                        },
                        shift => shifted(right.min, right.max, shift),
                    };
                    let min = std::array::from_fn(|k| f32::min(left.min[k], right.min[k]));
                    let max = std::array::from_fn(|k| f32::max(left.max[k], right.max[k]));
                    (cell, min, max)
                }
            };
            let (cell, min, max) = placed;
            nodes[n] = BvhNode {
                min,
                skip: nodes[n].skip,
                max,
                cell_and_object: BvhNode::pack(cell, nodes[n].object()),
            };
        }
    }
}

/// The bounds of an object about `zero`, rounded outward; bit for bit the same where that is its cell's zero.
pub fn about(bounds: &ObjectBounds, origins: &[DVec3], zero: DVec3) -> Bounds {
    let ObjectBounds { min, cell, max, .. } = *bounds;
    match origins[cell as usize] - zero {
        DVec3::ZERO => Bounds { min, max },
        shift => shifted(min, max, shift),
    }
}

/// Whether the coordinates of a node are coarse for its size.
fn is_far(node: &BvhNode) -> bool {
    let (mut size, mut reach) = (0.0_f64, 0.0_f64);
    for k in 0..3 {
        let [min, max] = [node.min[k], node.max[k]].map(f64::from);
        size = size.max(max - min);
        reach = reach.max(min.abs()).max(max.abs());
    }
    reach > FARTHEST * size
}

/// A box moved by `shift`, rounded outward. The sum of f64 may itself be off by a unit in its last place, for which
/// 2^-50 of its terms is left.
fn shifted(min: [f32; 3], max: [f32; 3], shift: DVec3) -> Bounds {
    const SLACK: f64 = 1.0 / (1_u64 << 50) as f64;
    let moved = |x: f32, k: usize| {
        let sum = f64::from(x) + shift[k];
        (sum, SLACK * (f64::from(x).abs() + shift[k].abs()))
    };
    Bounds {
        min: std::array::from_fn(|k| {
            let (sum, slack) = moved(min[k], k);
            round_down(sum - slack)
        }),
        max: std::array::from_fn(|k| {
            let (sum, slack) = moved(max[k], k);
            round_up(sum + slack)
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tree::builders;
    use crate::{bvh, split};

    /// Two rows of bolts of a tenth of a metre, on either side of the planet, and a marker at each end.
    fn bolts() -> (Vec<ObjectBounds>, Vec<DVec3>) {
        let origins = vec![
            DVec3::ZERO,
            DVec3::new(6_378_137.5, 0.5, -3.5),
            DVec3::new(-6_378_137.5, 0.5, 3.5),
        ];
        let bolt = |cell: u32, i: u32| {
            let x = i as f32 * 0.25;
            ObjectBounds {
                min: [x, 0.0, 0.0],
                cell,
                max: [x + 0.1, 0.1, 0.1],
                reserved: 0,
            }
        };
        let marker = |x: f32| ObjectBounds {
            min: [x - 1.0, -1.0, -1.0],
            cell: 0,
            max: [x + 1.0, 1.0, 1.0],
            reserved: 0,
        };
        let mut bounds: Vec<_> = (0..300).map(|i| bolt(1 + i % 2, i / 2)).collect();
        bounds.extend([marker(0.0), marker(6e6)]);
        (bounds, origins)
    }

    #[test]
    fn subtrees_are_built_in_coordinates_of_their_own() {
        let (bounds, origins) = bolts();
        for builder in builders() {
            let tree = build(builder, &bounds, &origins).unwrap();
            let scene = Boxes {
                bounds: &bounds,
                origins: &origins,
            };
            let mut small = 0;
            for (n, node) in tree.nodes.iter().enumerate() {
                let Some(object) = node.object() else {
                    let left = tree.nodes[n + 1];
                    for child in [left, tree.nodes[left.skip as usize]] {
                        let shift = origins[child.cell() as usize] - origins[node.cell() as usize];
                        for k in 0..3 {
                            let [min, max] =
                                [child.min[k], child.max[k]].map(|x| f64::from(x) + shift[k]);
                            assert!(f64::from(node.min[k]) <= min && max <= f64::from(node.max[k]));
                        }
                    }
                    let extent = f64::from(node.max[0]) - f64::from(node.min[0]);
                    small += usize::from(extent < 0.4);
                    continue;
                };
                let b = &bounds[object as usize];
                assert_eq!((node.cell(), node.min, node.max), (b.cell, b.min, b.max));
                assert_eq!(tree.leaf_of_object[object as usize] as usize, n);
            }
            // Neighbours of a row are joined, as they are where the row stands at zero.
            assert!(small >= 75, "{}: {small}", builder.name());
            assert!(tree.stats.depth <= bvh::max_depth(bounds.len()));
            assert!(scene.middle(&[300]).abs_diff_eq(DVec3::ZERO, 0.0));
        }
    }

    #[test]
    fn one_cell_is_left_to_the_builder() {
        let (bounds, _) = bolts();
        let row: Vec<_> = bounds
            .iter()
            .map(|b| ObjectBounds { cell: 0, ..*b })
            .collect();
        let plain: Vec<_> = row
            .iter()
            .map(|b| Bounds {
                min: b.min,
                max: b.max,
            })
            .collect();
        let rule = &split::RULES[0];
        let expected = TreeBuilder::build(rule, &plain).unwrap();
        assert_eq!(build(rule, &row, &[DVec3::ZERO]).unwrap(), expected);
    }
}
