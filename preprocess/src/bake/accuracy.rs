//! How far a bake is from its source. The bake measures this itself, and the baked file keeps it in an optional section.

use crate::scene::{SourceMesh, SourceObject};
use glam::{DAffine3, DMat3, DVec3};
use hroc_format::{BakedScene, Mesh, Object, OpenError, SectionName};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// The section of a baked file that holds an [`Accuracy`] as one JSON object.
pub const ACCURACY: SectionName = SectionName::new("accuracy");

/// A displacement of more than this share of an object's size is worth a warning: an object that fills a picture of
/// 1000 pixels moves by a tenth of a pixel. Rounding to f32 in a cell stays below 2^-12 only where it must, and far
/// below 1e-6 otherwise; positions of 16 bits stay below 2.7e-5.
const LARGE_DISPLACEMENT: f64 = 1e-4;
/// A relative change of a mesh's area above this is worth a warning. Displacements of a share `d` of the size of a
/// triangle change its area by about `2 d`. Rounding to f32 changes a mesh by less than 1e-6 unless its triangles are
/// much smaller than the mesh; positions of 16 bits change finely tessellated meshes by more, which the bound for
/// them allows.
const LARGE_AREA_CHANGE: f64 = 1e-6;
/// The bound on the relative change of area for quantized meshes.
const LARGE_AREA_CHANGE_QUANTIZED: f64 = 1e-2;

/// How far a bake is from its source. Lengths are in the source's units.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Accuracy {
    /// Version of this record: 1.
    pub schema: u32,
    /// The object whose vertices moved farthest; `None` for an empty scene.
    pub farthest: Option<Displacement>,
    /// The object whose vertices moved farthest in relation to its size.
    pub farthest_by_size: Option<Displacement>,
    /// Of the stored meshes, each counted once.
    pub triangles: TriangleChanges,
    /// Of the stored meshes, each counted once, in their sources' object spaces.
    pub area: AreaChange,
}

/// An upper bound of the distances between an object's baked vertices and where its source puts them. A baked vertex
/// is the sum of the origin of the object's cell and the product of matrix and position, evaluated in f64 from the
/// stored numbers. The bound is the displacement of the corners of the mesh's box by the rounded matrix, plus the
/// largest displacement of a position within the mesh. The first is exact for a vertex in such a corner, and
/// at most 3.5 times that of some vertex, since the box is tight.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Displacement {
    /// The object's id.
    pub object: usize,
    /// Its name.
    pub name: String,
    /// The bound.
    pub displacement: f64,
    /// The longest edge of the object's box along the axes of its mesh.
    pub size: f64,
    /// `displacement / size`; `None` for an object without size.
    pub share_of_size: Option<f64>,
}

/// What became of the source's triangles. The bake adds none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct TriangleChanges {
    /// Triangles of the source's meshes.
    pub source: u64,
    /// Triangles stored.
    pub baked: u64,
    /// Triangles left out because two of their corners coincide as stored.
    pub dropped_coincident_corners: u64,
    /// Triangles that have an area in the source, but none as stored: rounding put their corners on one line.
    pub flattened: u64,
}

/// The area before and after.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct AreaChange {
    /// Of the source's meshes.
    pub source: f64,
    /// Of the meshes stored.
    pub baked: f64,
    /// The largest relative change of a mesh's area.
    pub largest_change: f64,
    /// The mesh with that change.
    pub mesh: usize,
}

/// What a bake did to one mesh.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct MeshChange {
    /// The largest displacement of a position, in the source's object space.
    displacement: f64,
    /// From stored positions to the source's object space.
    scale: f64,
    area: [f64; 2],
    triangles: TriangleChanges,
}

impl MeshChange {
    /// Measures `mesh`, whose positions were `original` before the bake rounded them. `import_error` is how far they
    /// were moved before that. Vertices and triangles are still in the order of the source.
    pub(super) fn measure(
        original: &[[f32; 3]],
        mesh: &SourceMesh,
        source_from_mesh: &DAffine3,
        import_error: f64,
    ) -> Self {
        let before = |vertex: u32| wide(original[vertex as usize]);
        let after =
            |vertex: u32| source_from_mesh.transform_point3(wide(mesh.positions[vertex as usize]));
        let unchanged = *source_from_mesh == DAffine3::IDENTITY && original == mesh.positions;
        let mut change = Self {
            displacement: import_error,
            scale: source_from_mesh.matrix3.x_axis.length(),
            ..Self::default()
        };
        if !unchanged {
            let moved = (0..original.len() as u32).map(|v| (after(v) - before(v)).length_squared());
            change.displacement += moved.fold(0.0, f64::max).sqrt();
        }
        for corners in mesh.indices.as_chunks::<3>().0 {
            let source = area(corners.map(before));
            let baked = if unchanged {
                source
            } else {
                area(corners.map(after))
            };
            change.area[0] += source;
            change.area[1] += baked;
            change.triangles.flattened += u64::from(source > 0.0 && baked == 0.0);
        }
        change.triangles.source = mesh.indices.len() as u64 / 3;
        change
    }

    /// Notes the triangles of the finished mesh.
    pub(super) fn finished(mut self, mesh: &SourceMesh) -> Self {
        let triangles = &mut self.triangles;
        triangles.baked = mesh.indices.len() as u64 / 3;
        triangles.dropped_coincident_corners = triangles.source.saturating_sub(triangles.baked);
        self
    }

    fn relative_area_change(&self) -> f64 {
        let [source, baked] = self.area;
        match source > 0.0 {
            true => (baked - source).abs() / source,
            false => 0.0,
        }
    }
}

fn wide(position: [f32; 3]) -> DVec3 {
    DVec3::from(position.map(f64::from))
}

fn area([a, b, c]: [DVec3; 3]) -> f64 {
    0.5 * (b - a).cross(c - a).length()
}

/// What was baked, and from what.
pub(super) struct Baked<'a> {
    /// Their transforms take stored positions to the source's world.
    pub(super) sources: &'a [SourceObject],
    pub(super) objects: &'a [Object],
    pub(super) meshes: &'a [Mesh],
    pub(super) changes: &'a [MeshChange],
}

impl Accuracy {
    /// Puts the measures together. `cell_origin` is where the zero of an object's coordinates lies.
    pub(super) fn measure(
        baked: &Baked<'_>,
        cell_origin: impl Fn(&Object) -> DVec3 + Sync,
    ) -> Self {
        let of_object = |object: usize| {
            let (displacement, size) = baked.displacement(object, &cell_origin);
            (
                object,
                displacement,
                share(displacement, size).unwrap_or(0.0),
            )
        };
        // The first of several equal ones, however the work is shared out.
        let farther = |a: (usize, f64), b: (usize, f64)| match b.1.total_cmp(&a.1) {
            std::cmp::Ordering::Greater => b,
            std::cmp::Ordering::Equal if b.0 < a.0 => b,
            _ => a,
        };
        let none = (usize::MAX, -1.0);
        let (farthest, by_size) = (0..baked.objects.len())
            .into_par_iter()
            .map(of_object)
            .map(|(object, displacement, share)| ((object, displacement), (object, share)))
            .reduce(
                || (none, none),
                |a, b| (farther(a.0, b.0), farther(a.1, b.1)),
            );
        let described = |(object, _): (usize, f64)| {
            let source = baked.sources.get(object)?;
            let (displacement, size) = baked.displacement(object, &cell_origin);
            Some(Displacement {
                object,
                name: source.name.clone(),
                displacement,
                size,
                share_of_size: share(displacement, size),
            })
        };
        let mut accuracy = Self {
            schema: 1,
            farthest: described(farthest),
            farthest_by_size: described(by_size),
            triangles: TriangleChanges::default(),
            area: AreaChange::default(),
        };
        for (mesh, change) in baked.changes.iter().enumerate() {
            accuracy.add(mesh, change);
        }
        accuracy
    }

    fn add(&mut self, mesh: usize, change: &MeshChange) {
        let triangles = &mut self.triangles;
        triangles.source += change.triangles.source;
        triangles.baked += change.triangles.baked;
        triangles.dropped_coincident_corners += change.triangles.dropped_coincident_corners;
        triangles.flattened += change.triangles.flattened;
        self.area.source += change.area[0];
        self.area.baked += change.area[1];
        let relative = change.relative_area_change();
        if relative > self.area.largest_change {
            self.area.largest_change = relative;
            self.area.mesh = mesh;
        }
    }

    /// Reads the record of a baked file; `None` if the file has none, or one of another version.
    ///
    /// # Errors
    /// If the section is damaged.
    pub fn of(baked: &BakedScene) -> Result<Option<Self>, OpenError> {
        let section = baked.section(ACCURACY)?;
        let record = section.and_then(|json| serde_json::from_slice::<Self>(json).ok());
        Ok(record.filter(|record| record.schema == 1))
    }

    /// The record as the section holds it.
    pub fn to_json(&self) -> Vec<u8> {
        // Cannot fail: the record holds numbers, strings and lists.
        serde_json::to_vec(self).unwrap_or_default()
    }

    /// The record as text, for people.
    pub fn lines(&self) -> Vec<String> {
        let mut lines = Vec::new();
        let places = [
            ("largest displacement", &self.farthest),
            ("largest displacement by size", &self.farthest_by_size),
        ];
        for (what, place) in places {
            if let Some(place) = place {
                let share = place.share_of_size.unwrap_or(0.0);
                lines.push(format!(
                    "{what}: at most {:.3e}, {share:.1e} of the size of object {} {:?}",
                    place.displacement, place.object, place.name
                ));
            }
        }
        let (triangles, area) = (&self.triangles, &self.area);
        lines.push(format!(
            "triangles: {} in the source, {} baked, {} dropped with coincident corners, {} flattened",
            triangles.source,
            triangles.baked,
            triangles.dropped_coincident_corners,
            triangles.flattened
        ));
        lines.push(format!(
            "area: {} in the source, {} baked; at most {:.1e} of a mesh's area changed",
            area.source, area.baked, area.largest_change
        ));
        lines
    }

    /// What the user should know about.
    pub fn warnings(&self, quantized: bool) -> Vec<String> {
        let mut warnings = Vec::new();
        if let Some(worst) = &self.farthest_by_size
            && let Some(share) = worst
                .share_of_size
                .filter(|&share| share > LARGE_DISPLACEMENT)
        {
            warnings.push(format!(
                "object {} {:?}: rounding moves its vertices by up to {:.3e}, {share:.1e} of its size; an object this \
                 small is too far from the rest of the scene for f32",
                worst.object, worst.name, worst.displacement
            ));
        }
        let bound = match quantized {
            true => LARGE_AREA_CHANGE_QUANTIZED,
            false => LARGE_AREA_CHANGE,
        };
        if self.area.largest_change > bound {
            warnings.push(format!(
                "mesh {}: rounding changes its area by {:.1e} of it",
                self.area.mesh, self.area.largest_change
            ));
        }
        if self.triangles.flattened > 0 {
            warnings.push(format!(
                "triangles that have no area as stored, but have one in the source: {}",
                self.triangles.flattened
            ));
        }
        warnings
    }
}

fn share(displacement: f64, size: f64) -> Option<f64> {
    (size > 0.0).then(|| displacement / size)
}

impl Baked<'_> {
    /// The bound of [`Displacement`] for an object, and its size.
    fn displacement(&self, object: usize, cell_origin: &impl Fn(&Object) -> DVec3) -> (f64, f64) {
        let stored = &self.objects[object];
        let source = &self.sources[object].world_from_object;
        let mesh = stored.mesh as usize;
        let (mesh, change) = (&self.meshes[mesh], &self.changes[mesh]);
        let rows = stored.world_from_object;
        let column = |k: usize| DVec3::new(rows[0][k].into(), rows[1][k].into(), rows[2][k].into());
        // The difference of the two maps is affine, so its length is largest in a corner of the box.
        let error = DAffine3 {
            matrix3: DMat3::from_cols(column(0), column(1), column(2)) - source.matrix3,
            translation: column(3) - (source.translation - cell_origin(stored)),
        };
        let (min, max) = (wide(mesh.min), wide(mesh.max));
        let corner = |bits: usize| {
            let pick = |axis: usize| {
                if bits >> axis & 1 == 0 {
                    min[axis]
                } else {
                    max[axis]
                }
            };
            DVec3::new(pick(0), pick(1), pick(2))
        };
        let by_matrix = (0..8).map(|bits| error.transform_point3(corner(bits)).length_squared());
        let by_matrix = by_matrix.fold(0.0, f64::max).sqrt();
        let within_mesh = change.displacement / change.scale * norm_bound(&source.matrix3);
        let axes = source.matrix3;
        let edges = (max - min)
            * DVec3::new(
                axes.x_axis.length(),
                axes.y_axis.length(),
                axes.z_axis.length(),
            );
        (by_matrix + within_mesh, edges.max_element())
    }
}

/// An upper bound of the factor by which a map lengthens vectors, exact for rotations and scalings: the square root
/// of Gershgorin's bound on the eigenvalues of the transpose times the map.
fn norm_bound(map: &DMat3) -> f64 {
    let square = map.transpose() * *map;
    let sum = |column: DVec3| column.abs().element_sum();
    let columns = [square.x_axis, square.y_axis, square.z_axis];
    columns.map(sum).into_iter().fold(0.0, f64::max).sqrt()
}
