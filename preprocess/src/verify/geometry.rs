//! What the readers of source files deliver.

use super::affine::{Affine, Point};

/// One drawable of the source: a shape under one or several transforms.
pub(super) struct Part {
    /// glTF node, or number of the OBJ part.
    pub(super) node: u32,
    /// Primitive of the glTF mesh; 0 for OBJ.
    pub(super) primitive: u32,
    /// For messages.
    pub(super) name: String,
    /// One for each copy, in the order of the objects.
    pub(super) places: Vec<Affine>,
    /// Which shape it draws.
    pub(super) shape: usize,
}

/// Polygons.
#[derive(Default)]
pub(super) struct Shape {
    /// The vertices in use.
    pub(super) points: Vec<Point>,
    /// Their numbers, polygon after polygon.
    pub(super) corners: Vec<u32>,
    /// Where each polygon ends in `corners`; empty where all are triangles.
    pub(super) ends: Vec<u32>,
    /// The bake must compute the positions and round them, as for skins: they are no f32 numbers of the file.
    pub(super) is_computed: bool,
}

impl Shape {
    pub(super) fn polygons(&self) -> impl Iterator<Item = &[u32]> {
        let triangles = match self.ends.is_empty() {
            true => self.corners.as_slice(),
            false => &[],
        };
        let starts = std::iter::once(0).chain(self.ends.iter().copied());
        let polygons = starts.zip(&self.ends);
        let polygons = polygons.map(|(start, &end)| &self.corners[start as usize..end as usize]);
        triangles.chunks_exact(3).chain(polygons)
    }

    /// Keeps the points that are in use only. A file may have many shapes over one large list.
    pub(super) fn gather(corners: &mut [u32], mut point: impl FnMut(u32) -> Point) -> Vec<Point> {
        let mut used = corners.to_vec();
        used.sort_unstable();
        used.dedup();
        for corner in corners {
            // Found: the list is made of the corners.
            *corner = used.partition_point(|used| used < corner) as u32;
        }
        used.into_iter().map(&mut point).collect()
    }
}
