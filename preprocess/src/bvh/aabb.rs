//! Boxes as the builder handles them: four lanes, of which the last has no meaning.

use bytemuck::{Pod, Zeroable};
use glam::Vec4;
use hroc_format::Bounds;

/// An axis-aligned box.
#[derive(Clone, Copy, Debug)]
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

    /// The edge lengths.
    #[inline]
    pub fn extent(self) -> Vec4 {
        self.max - self.min
    }

    /// The axis (0, 1, 2) on which the box is longest; the first of equals.
    #[inline]
    pub fn longest_axis(self) -> usize {
        let extent = self.extent();
        let axis = if extent.y > extent.x { 1 } else { 0 };
        if extent.z > extent[axis] { 2 } else { axis }
    }
}

/// What bounds are multiplied by for the builder: a power of two, which rounds nothing, that brings the
/// largest coordinate of a scene to about 2^44. There no area times a number of objects leaves f32, and
/// only areas 2^100 times smaller than the scene's vanish.
#[derive(Clone, Copy, Debug)]
pub struct Scale {
    factor: f32,
    inverse: f32,
}

impl Scale {
    /// The one for these bounds, which are finite.
    pub fn new(bounds: &[Bounds]) -> Self {
        // On each axis by itself and without the care for NaN of `f32::max`, which a vector unit can do.
        let greater = |a: f32, b: f32| if a > b { a } else { b };
        let largest = bounds.iter().fold([0.0; 3], |largest: [f32; 3], b| {
            std::array::from_fn(|axis| greater(largest[axis], greater(b.max[axis], -b.min[axis])))
        });
        let largest = largest.into_iter().fold(0.0, greater);
        // Biased exponents: that of 2^44 is 171, 1 to 253 have an inverse.
        let exponent = (largest.to_bits() >> 23) as i32;
        let exponent = (127 + 171 - exponent).clamp(1, 253);
        let power = |exponent: i32| f32::from_bits((exponent as u32) << 23);
        Self {
            factor: power(exponent),
            inverse: power(254 - exponent),
        }
    }

    /// Whether all bounds come back bit for bit. Those of huge scenes may not: their small coordinates
    /// fall among the subnormal numbers.
    #[inline]
    pub fn is_exact(self) -> bool {
        self.factor >= 1.0
    }
}

/// An object on its way into the tree: its id and its bounds, scaled. 32 bytes, moved around as a whole
/// so that every pass over a node reads memory in order.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(16))]
pub struct ObjectBox {
    min: [f32; 3],
    /// [`Self::TAG`] and the object.
    tagged_id: u32,
    max: [f32; 3],
    zero: u32,
}

impl ObjectBox {
    /// The id lies in a lane of a vector of floats. Most would be subnormal, and arithmetic on those
    /// takes a processor ten times as long, even if nobody looks at the result: this makes them normal.
    const TAG: u32 = 1 << 30;

    /// Pairs an object with its bounds.
    #[inline]
    pub fn new(id: u32, bounds: &Bounds, scale: Scale) -> Self {
        Self {
            min: bounds.min.map(|x| x * scale.factor),
            tagged_id: id ^ Self::TAG,
            max: bounds.max.map(|x| x * scale.factor),
            zero: 0,
        }
    }

    /// The object.
    #[inline]
    pub fn id(&self) -> u32 {
        self.tagged_id ^ Self::TAG
    }

    /// The object's bounds as they were before they were scaled, if the scale is exact.
    #[inline]
    pub fn unscaled(&self, scale: Scale) -> Bounds {
        Bounds {
            min: self.min.map(|x| x * scale.inverse),
            max: self.max.map(|x| x * scale.inverse),
        }
    }

    /// The object's bounds, scaled.
    #[inline]
    pub fn aabb(&self) -> Aabb {
        let [min, max] = bytemuck::cast(*self);
        Aabb { min, max }
    }

    /// Twice the centre of the bounds: it orders objects as well as the centre, for one addition.
    #[inline]
    pub fn middle(&self) -> Vec4 {
        let Aabb { min, max } = self.aabb();
        min + max
    }

    /// One coordinate of [`Self::middle`].
    #[inline]
    pub fn middle_on(&self, axis: usize) -> f32 {
        self.min[axis] + self.max[axis]
    }
}

/// Bounds of the objects' [`ObjectBox::middle`].
#[inline]
pub fn middle_bounds(objects: &[ObjectBox]) -> Aabb {
    let grow = |all: Aabb, object: &ObjectBox| all.grow(object.middle());
    objects.iter().fold(Aabb::EMPTY, grow)
}
