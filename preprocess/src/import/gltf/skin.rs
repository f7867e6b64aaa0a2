//! Skins (section 3.7.3): a skinned mesh is taken in the pose that the file's nodes stand in. Its vertices go straight
//! to the world, and its own node's transform does not count. They are stored from the place of the skin's first joint,
//! because the world may be too large for their precision.

use super::accessor::{Accessors, Elements};
use super::nodes::Placed;
use super::{ImportError, Result};
use crate::scene::SourceMesh;
use glam::{DAffine3, DMat3, DMat4, DVec3};
use gltf::json::accessor::Type;
use gltf::json::{Index, Node, Skin};

/// The joints of a skin.
pub(super) struct Joints {
    /// World from the space the mesh was bound in, less `origin`; at least one.
    matrices: Vec<DAffine3>,
    /// Where the first joint is.
    origin: DVec3,
}

/// One set of four joints and weights per vertex.
pub(super) struct Weights<'a> {
    pub(super) joints: Elements<'a>,
    pub(super) weights: Elements<'a>,
}

/// The joint matrices of a skin; `None` where a joint is not part of the scene.
pub(super) fn joints(
    accessors: &Accessors<'_>,
    skin: &Skin,
    placed: &Placed,
) -> Result<Option<Joints>> {
    let inverse_bind = skin
        .inverse_bind_matrices
        .map(|accessor| accessors.open(accessor, Type::Mat4));
    let inverse_bind = inverse_bind.transpose()?;
    if inverse_bind
        .as_ref()
        .is_some_and(|matrices| matrices.count() < skin.joints.len())
    {
        return Err(ImportError::malformed(
            "has fewer inverse bind matrices than joints",
        ));
    }
    let world_from_joint = |node: &Index<Node>| *placed.world_from_node.get(node.value())?;
    let joint = |(number, node): (usize, &Index<Node>)| {
        let joint_from_mesh = inverse_bind
            .as_ref()
            .map_or(DAffine3::IDENTITY, |matrices| {
                DAffine3::from_mat4(DMat4::from_cols_array(
                    &matrices.floats::<16>(number).map(f64::from),
                ))
            });
        Some((world_from_joint(node)?, joint_from_mesh))
    };
    let joints: Option<Vec<_>> = skin.joints.iter().enumerate().map(joint).collect();
    let Some((joints, &(first, _))) = joints
        .as_ref()
        .and_then(|joints| Some((joints, joints.first()?)))
    else {
        return Ok(None);
    };
    let origin = first.translation;
    let matrix = |&(mut world_from_joint, joint_from_mesh): &(DAffine3, DAffine3)| {
        world_from_joint.translation -= origin;
        world_from_joint * joint_from_mesh
    };
    Ok(Some(Joints {
        matrices: joints.iter().map(matrix).collect(),
        origin,
    }))
}

impl Joints {
    /// World from the space that the vertices are moved to.
    pub(super) fn world_from_vertices(&self) -> DAffine3 {
        DAffine3::from_translation(self.origin)
    }

    /// Moves the vertices `used` of a primitive to where the joints hold them.
    pub(super) fn apply(
        &self,
        mesh: &mut SourceMesh,
        sets: &[Weights<'_>],
        used: &[u32],
    ) -> Result<()> {
        for (at, &vertex) in used.iter().enumerate() {
            let posed_from_mesh = self.blend(sets, vertex as usize)?;
            let position = DVec3::from(mesh.positions[at].map(f64::from));
            mesh.positions[at] = posed_from_mesh.transform_point3(position).as_vec3().into();
            if let Some(normal) = mesh.normals.get_mut(at) {
                // Normals go by the cofactors, which exist even for a flattening matrix.
                let normal_map = cofactors(&posed_from_mesh.matrix3);
                *normal = (normal_map * DVec3::from(normal.map(f64::from)))
                    .as_vec3()
                    .into();
            }
        }
        Ok(())
    }

    /// The weighted mean of a vertex's joint matrices; the first joint's, if all weights are zero.
    fn blend(&self, sets: &[Weights<'_>], vertex: usize) -> Result<DAffine3> {
        let mut sum = DMat4::ZERO;
        let mut total = 0.0;
        for set in sets {
            let joints: [u32; 4] = set.joints.uints(vertex)?;
            let weights: [f32; 4] = set.weights.floats(vertex);
            for (joint, weight) in joints
                .into_iter()
                .zip(weights)
                .filter(|(_, weight)| *weight != 0.0)
            {
                let matrix = self.matrices.get(joint as usize).ok_or_else(|| {
                    let count = self.matrices.len();
                    ImportError::malformed(format!("vertex {vertex} uses joint {joint} of {count}"))
                })?;
                sum += DMat4::from(*matrix) * f64::from(weight);
                total += f64::from(weight);
            }
        }
        Ok(if total == 0.0 {
            self.matrices[0]
        } else {
            DAffine3::from_mat4(sum * (1.0 / total))
        })
    }
}

/// The determinant times the inverse transpose.
fn cofactors(matrix: &DMat3) -> DMat3 {
    let (x, y, z) = (matrix.x_axis, matrix.y_axis, matrix.z_axis);
    DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y))
}
