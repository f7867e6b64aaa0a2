//! Safeguards that can be left out on purpose, to show that the tests notice.

/// What is left out. Nothing but tests wants any but [`None`](Self::None).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[doc(hidden)]
pub enum Mutant {
    /// Nothing.
    #[default]
    None,
    /// Bounds and boxes do not grow.
    Coverage,
    /// Depth is compared without tolerance.
    DepthPadding,
    /// The slab test's interval is not widened.
    SlabWidening,
    /// Boxes that touch the near plane are rasterized like others.
    NearPlane,
    /// A subtree counts as flagged once one child is.
    Pruning,
    /// The host keeps fragments whose depth is infinite or NaN.
    NotFinite,
    /// Draws beyond the expected count are not made up for.
    Fallback,
}

impl Mutant {
    /// Every mutant but none.
    pub const ALL: [Self; 7] = [
        Self::Coverage,
        Self::DepthPadding,
        Self::SlabWidening,
        Self::NearPlane,
        Self::Pruning,
        Self::NotFinite,
        Self::Fallback,
    ];

    /// For people.
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Coverage => "coverage",
            Self::DepthPadding => "depth-padding",
            Self::SlabWidening => "slab-widening",
            Self::NearPlane => "near-plane",
            Self::Pruning => "pruning",
            Self::NotFinite => "not-finite",
            Self::Fallback => "fallback",
        }
    }

    /// The constant of common/bounds.wgsl.
    pub fn constant(self) -> (&'static str, f64) {
        let number = match self {
            Self::None | Self::Fallback => 0.0,
            Self::Coverage => 1.0,
            Self::DepthPadding => 2.0,
            Self::SlabWidening => 3.0,
            Self::NearPlane => 4.0,
            Self::Pruning => 5.0,
            Self::NotFinite => 6.0,
        };
        ("BROKEN", number)
    }

    /// The mutant of the host's shaders. Most safeguards are left out of the tests of bounds alone: an image without
    /// them would be wrong for every method alike.
    pub const fn of_host(self) -> Self {
        match self {
            Self::NotFinite => self,
            _ => Self::None,
        }
    }
}
