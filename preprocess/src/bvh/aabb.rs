//! Boxes as the builder handles them: four lanes, of which the last is always zero.

use bytemuck::{Pod, Zeroable};
use glam::{BVec4A, Vec4};
use hroc_format::Bounds;

const XYZ: BVec4A = BVec4A::from_array([true, true, true, false]);

/// An axis-aligned box. Lane 3 of both corners is zero (or infinite in [`Aabb::EMPTY`]).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Smallest corner.
    pub min: Vec4,
    /// Largest corner.
    pub max: Vec4,
}

impl Aabb {
    /// The neutral element of the union.
    pub const EMPTY: Self = Self {
        min: Vec4::INFINITY,
        max: Vec4::NEG_INFINITY,
    };

    /// The smallest box that holds both.
    #[inline]
    pub fn union(self, other: Self) -> Self {
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
        }
    }

    /// The smallest box that holds this one and a point.
    #[inline]
    pub fn grow(self, point: Vec4) -> Self {
        Self {
            min: self.min.min(point),
            max: self.max.max(point),
        }
    }

    /// Half the edge lengths: whole ones overflow f32 for a box from -3e38 to 3e38.
    #[inline]
    pub fn half_extent(self) -> Vec4 {
        self.max * 0.5 - self.min * 0.5
    }

    /// The axis (0, 1, 2) on which the box is longest; the first of equals.
    #[inline]
    pub fn longest_axis(self) -> usize {
        let half = self.half_extent();
        let axis = if half.y > half.x { 1 } else { 0 };
        if half.z > half[axis] { 2 } else { axis }
    }
}

/// An object on its way into the tree: its bounds and its id, 32 bytes, moved around as a whole so
/// that every pass over a node reads memory in order.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(16))]
pub struct ObjectBox {
    min: [f32; 3],
    /// The object.
    pub id: u32,
    max: [f32; 3],
    zero: u32,
}

impl ObjectBox {
    /// Pairs an object with its bounds.
    pub fn new(id: u32, bounds: &Bounds) -> Self {
        Self {
            min: bounds.min,
            id,
            max: bounds.max,
            zero: 0,
        }
    }

    /// The object's bounds, bit for bit.
    #[inline]
    pub fn bounds(&self) -> Bounds {
        Bounds {
            min: self.min,
            max: self.max,
        }
    }

    /// The object's bounds.
    #[inline]
    pub fn aabb(&self) -> Aabb {
        let [min, max]: [Vec4; 2] = bytemuck::cast(*self);
        // The id read as a float is subnormal, and arithmetic on subnormals is slow.
        Aabb {
            min: Vec4::select(XYZ, min, Vec4::ZERO),
            max,
        }
    }

    /// The middle of the bounds. Halved before they are added: the sum could overflow.
    #[inline]
    pub fn centroid(&self) -> Vec4 {
        let aabb = self.aabb();
        aabb.min * 0.5 + aabb.max * 0.5
    }

    /// One coordinate of the centroid, in the same arithmetic.
    #[inline]
    pub fn centroid_on(&self, axis: usize) -> f32 {
        self.min[axis] * 0.5 + self.max[axis] * 0.5
    }
}
