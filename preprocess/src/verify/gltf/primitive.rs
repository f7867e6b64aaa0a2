//! The triangles of a primitive.

use super::super::affine::{Affine, Point};
use super::super::geometry::Shape;
use super::accessor::Accessor;
use super::json::{Result, item, optional};
use super::{Key, Scene};
use serde_json::Value;

impl Scene<'_> {
    pub(super) fn primitive(&self, key: &Key) -> Result<Shape> {
        let mesh = item(self.root, "meshes", key.mesh)?;
        let primitive = &mesh["primitives"][key.primitive];
        self.refuse_draco(primitive)?;
        let attributes = &primitive["attributes"];
        let position = optional(attributes, "POSITION")?.ok_or("has no POSITION")?;
        let positions = self.open(position, "VEC3")?;
        let indices = match optional(primitive, "indices")? {
            Some(indices) => self.open(indices, "SCALAR")?.indices()?,
            None => (0..positions.count as u32).collect(),
        };
        if let Some(index) = indices
            .iter()
            .find(|&&index| index as usize >= positions.count)
        {
            return Err(format!("index {index} of {} vertices", positions.count));
        }
        let mut corners = triangles(optional(primitive, "mode")?.unwrap_or(4), &indices);
        let targets = self.targets(primitive, key, positions.count)?;
        let skin = match key.skinned {
            Some(node) => Some(self.skin(node, attributes, positions.count)?),
            None => None,
        };
        let is_computed = positions.is_converted() || !targets.is_empty() || skin.is_some();
        let mut fault = None;
        let points = Shape::gather(&mut corners, |vertex| {
            let vertex = vertex as usize;
            let mut point: Point = positions.floats(vertex);
            for (weight, target) in &targets {
                let by: Point = target.floats(vertex);
                (0..3).for_each(|axis| point[axis] += weight * by[axis]);
            }
            match skin.as_ref().map(|skin| skin.map(vertex)) {
                Some(Ok(map)) => map.apply(point),
                Some(Err(what)) => {
                    fault = Some(what);
                    point
                }
                None => point,
            }
        });
        match fault {
            Some(what) => Err(what),
            None => Ok(Shape {
                points,
                corners,
                ends: Vec::new(),
                is_computed,
            }),
        }
    }

    /// Opens an accessor that has an element for each of `count` vertices.
    fn parallel(&self, accessor: usize, kind: &str, count: usize) -> Result<Accessor<'_>> {
        let opened = self.open(accessor, kind)?;
        match opened.count >= count {
            true => Ok(opened),
            false => Err(format!(
                "accessor {accessor} has no element for each of {count} vertices"
            )),
        }
    }

    fn refuse_draco(&self, primitive: &Value) -> Result<()> {
        if !primitive["extensions"]["KHR_draco_mesh_compression"].is_object() {
            return Ok(());
        }
        let position = optional(&primitive["attributes"], "POSITION")?;
        for accessor in [position, optional(primitive, "indices")?]
            .into_iter()
            .flatten()
        {
            let accessor = item(self.root, "accessors", accessor)?;
            if !accessor["bufferView"].is_number() && !accessor["sparse"].is_object() {
                return Err("is compressed with Draco, which the comparison does not read".into());
            }
        }
        Ok(())
    }

    /// The displacements of positions by morph targets, with weights that are not zero.
    fn targets(
        &self,
        primitive: &Value,
        key: &Key,
        count: usize,
    ) -> Result<Vec<(f64, Accessor<'_>)>> {
        let targets = primitive["targets"].as_array().into_iter().flatten();
        let mut used = Vec::new();
        for (target, &weight) in targets.zip(&key.weights) {
            let weight = f64::from_bits(weight);
            if let Some(accessor) = optional(target, "POSITION")?
                && weight != 0.0
                && weight.is_finite()
            {
                used.push((weight, self.parallel(accessor, "VEC3", count)?));
            }
        }
        Ok(used)
    }

    fn skin(&self, node: usize, attributes: &Value, count: usize) -> Result<Skin<'_>> {
        let node = item(self.root, "nodes", node)?;
        let mut sets = Vec::new();
        for set in 0.. {
            let joints = optional(attributes, &format!("JOINTS_{set}"))?;
            let weights = optional(attributes, &format!("WEIGHTS_{set}"))?;
            let (Some(joints), Some(weights)) = (joints, weights) else {
                break;
            };
            sets.push([
                self.parallel(joints, "VEC4", count)?,
                self.parallel(weights, "VEC4", count)?,
            ]);
        }
        Ok(Skin {
            joints: self.joints(node)?.ok_or("has no joints")?,
            sets,
        })
    }
}

/// What moves the vertices of a skinned primitive.
struct Skin<'a> {
    joints: Vec<Affine>,
    sets: Vec<[Accessor<'a>; 2]>,
}

impl Skin<'_> {
    /// The weighted mean of a vertex's joints; the first joint, if all weights are zero.
    fn map(&self, vertex: usize) -> Result<Affine> {
        let (mut sum, mut total) = (Affine([[0.0; 4]; 3]), 0.0);
        for [joints, weights] in &self.sets {
            let (joints, weights) = (joints.floats::<4>(vertex), weights.floats::<4>(vertex));
            for (joint, weight) in joints.into_iter().zip(weights).filter(|(_, w)| *w != 0.0) {
                let joint = self.joints.get(joint as usize);
                sum.add_scaled(
                    joint.ok_or("a vertex uses a joint that is not there")?,
                    weight,
                );
                total += weight;
            }
        }
        if total == 0.0 {
            return Ok(self.joints[0]);
        }
        let mut mean = Affine([[0.0; 4]; 3]);
        mean.add_scaled(&sum, 1.0 / total);
        Ok(mean)
    }
}

/// The corners of triangles: of a list, a strip, whose every other triangle is turned round, or a fan.
fn triangles(mode: usize, indices: &[u32]) -> Vec<u32> {
    let count = indices.len().saturating_sub(2);
    let triangle = |i: usize| match mode {
        5 if i % 2 == 1 => [indices[i + 1], indices[i], indices[i + 2]],
        5 => [indices[i], indices[i + 1], indices[i + 2]],
        _ => [indices[0], indices[i + 1], indices[i + 2]],
    };
    match mode {
        4 => indices[..indices.len() / 3 * 3].to_vec(),
        _ => (0..count).flat_map(triangle).collect(),
    }
}
