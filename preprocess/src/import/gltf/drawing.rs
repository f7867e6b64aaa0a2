//! Nodes as objects and cameras of the scene.

use super::document::get;
use super::primitive::{self, Place, Primitives, Skipped};
use super::{ImportError, ImportErrorKind, MAX_OBJECTS, Result};
use super::{extensions, material, named, nodes, skin};
use crate::import::Import;
use crate::scene::{SourceCamera, SourceMesh, SourceObject};
use glam::DAffine3;
use gltf::json::{Camera, Index, Node, Root};
use std::sync::Arc;

/// Turns nodes into objects and cameras.
pub(super) struct Drawing<'a> {
    root: &'a Root,
    primitives: Primitives<'a>,
    skipped: Skipped,
    /// Skinned nodes drawn without their skin.
    unskinned: usize,
    /// Skinned nodes with instances.
    instanced_skins: usize,
    /// Instances of such nodes that could not be placed.
    undrawn_instances: usize,
    first: First,
}

/// How much of the scene came from the files before this one.
#[derive(Clone, Copy)]
pub(super) struct First {
    /// Meshes.
    pub(super) mesh: usize,
    /// Names of materials.
    pub(super) material: usize,
}

impl<'a> Drawing<'a> {
    /// Nothing drawn yet.
    pub(super) fn new(root: &'a Root, primitives: Primitives<'a>, first: First) -> Self {
        Self {
            root,
            primitives,
            skipped: Skipped::default(),
            unskinned: 0,
            instanced_skins: 0,
            undrawn_instances: 0,
            first,
        }
    }

    /// Reads the meshes of the nodes that were drawn. `within` names the place of an error.
    pub(super) fn decode(
        self,
        within: impl Fn(Place, ImportError) -> ImportError + Sync,
    ) -> Result<Vec<SourceMesh>> {
        self.primitives.decode(within)
    }

    /// Adds what a node shows to the scene.
    pub(super) fn node(
        &mut self,
        import: &mut Import<'_>,
        placed: &nodes::Placed,
        index: usize,
        world_from_node: DAffine3,
    ) -> Result<()> {
        let node = &self.root.nodes[index];
        if let Some(camera) = node.camera {
            self.camera(import, node, camera, world_from_node)?;
        }
        let Some(mesh_index) = node.mesh else {
            return Ok(());
        };
        let mesh = get(self.root, mesh_index, "mesh")?;
        let place = || named("mesh", mesh_index.value(), &mesh.name);

        let skin = self.skin(placed, node)?;
        let mut instances = self.instances(node)?;
        let world_from_object = match &skin {
            Some(joints) => joints.world_from_vertices(),
            None => world_from_node,
        };
        if let (Some(joints), Some(instances)) = (&skin, &mut instances) {
            self.place_skinned(instances, joints, world_from_node);
        } else {
            for node_from_instance in instances.iter_mut().flatten() {
                *node_from_instance = world_from_node * *node_from_instance;
            }
        }
        let mut placed_instances = instances.iter().flatten();
        if let Some(number) = placed_instances.position(|placed| !placed.is_finite()) {
            let what = format!("the transform of instance {number} is not finite");
            return Err(ImportError::malformed(what));
        }
        let weights = node.weights.as_ref().or(mesh.weights.as_ref());

        // Read every primitive once, before the instances multiply it.
        let mut parts = Vec::new();
        let mut materials = Vec::new();
        for (primitive_index, primitive) in mesh.primitives.iter().enumerate() {
            let place = || format!("{}, primitive {primitive_index}", place());
            let deform = primitive::Deform {
                weights,
                skin: skin.as_ref().map(|joints| (index, joints)),
            };
            let mesh = self
                .primitives
                .read(
                    primitive,
                    Place {
                        node: index,
                        mesh: mesh_index.value(),
                        primitive: primitive_index,
                    },
                    deform,
                    &mut self.skipped,
                )
                .map_err(|error| error.within(place()))?;
            let Some(mesh) = mesh else { continue };
            let look = material::look(self.root, primitive.material)
                .map_err(|error| error.within(place()))?;
            let material = primitive.material;
            materials.push(material.map(|material| self.first.material + material.value()));
            parts.push((primitive_index, self.first.mesh + mesh, look));
        }

        let name = [&node.name, &mesh.name]
            .into_iter()
            .flatten()
            .find(|name| !name.is_empty());
        let name = name.map(String::as_str).unwrap_or_default();
        let file = import.file;
        let objects = &mut import.scene.objects;
        let count = parts
            .len()
            .saturating_mul(instances.as_ref().map_or(1, Vec::len));
        if objects.len().saturating_add(count) > MAX_OBJECTS {
            let what = format!("the scene has more than {MAX_OBJECTS} objects");
            return Err(ImportError::new(ImportErrorKind::TooLarge, what));
        }
        let first_object = objects.len();
        let mut draw = |world_from_object: DAffine3, name: &str| {
            objects.extend(parts.iter().map(|&(primitive, mesh, look)| SourceObject {
                mesh,
                world_from_object,
                base_color: look.base_color,
                alpha: look.alpha,
                double_sided: look.double_sided,
                name: name.to_owned(),
                file,
                node: index,
                primitive,
            }));
        };
        match instances {
            None => draw(world_from_object, name),
            Some(instances) => {
                for (number, world_from_instance) in instances.into_iter().enumerate() {
                    draw(world_from_instance, &format!("{name}[{number}]"));
                }
            }
        }
        // Each instance has all primitives in turn.
        let drawn = first_object..import.scene.objects.len();
        for (object, material) in drawn.zip(materials.iter().cycle()) {
            if let Some(material) = *material {
                import.scene.materials.set(object, material as u32);
            }
        }
        Ok(())
    }

    /// The transforms of a node's instances; `None` for a node that is drawn once.
    fn instances(&self, node: &Node) -> Result<Option<Vec<DAffine3>>> {
        const NAME: &str = "EXT_mesh_gpu_instancing";
        let Some(extensions) = &node.extensions else {
            return Ok(None);
        };
        extensions::read(&extensions.others, &[NAME])?
            .map(|instancing| nodes::instances(self.primitives.accessors(), &instancing))
            .transpose()
            .map_err(|error| error.within(NAME))
    }

    /// Turns the transforms of a skinned node's instances, each within the node, into those of its objects.
    ///
    /// glTF says nothing about skins and instances together: a skin ignores its node's transform, an instance is
    /// placed by it. Here the skin poses the vertices first, then the instance moves them within the node, as it moves
    /// those of a mesh without a skin. A node that flattens everything has no such space; one object is left.
    fn place_skinned(
        &mut self,
        instances: &mut Vec<DAffine3>,
        joints: &skin::Joints,
        world_from_node: DAffine3,
    ) {
        let world_from_vertices = joints.world_from_vertices();
        let node_from_world = world_from_node.inverse();
        self.instanced_skins += 1;
        if !node_from_world.is_finite() {
            self.undrawn_instances += instances.len().saturating_sub(1);
            instances.truncate(1);
            instances.fill(world_from_vertices);
            return;
        }
        for instance in instances {
            *instance = world_from_node * *instance * node_from_world * world_from_vertices;
        }
    }

    /// The joint matrices of a skinned node; `None` for others and where the skin cannot be applied.
    fn skin(&mut self, placed: &nodes::Placed, node: &Node) -> Result<Option<Arc<skin::Joints>>> {
        let Some(index) = node.skin else {
            return Ok(None);
        };
        let skin = get(self.root, index, "skin")?;
        let joints = skin::joints(self.primitives.accessors(), skin, placed)
            .map_err(|error| error.within(named("skin", index.value(), &skin.name)))?;
        self.unskinned += usize::from(joints.is_none());
        Ok(joints.map(Arc::new))
    }

    fn camera(
        &self,
        import: &mut Import<'_>,
        node: &Node,
        index: Index<Camera>,
        world_from_node: DAffine3,
    ) -> Result<()> {
        let camera = get(self.root, index, "camera")?;
        let name = [&node.name, &camera.name]
            .into_iter()
            .flatten()
            .find(|name| !name.is_empty());
        let (perspective, orthographic) =
            (camera.perspective.as_ref(), camera.orthographic.as_ref());
        let (near, far) = match (perspective, orthographic) {
            (Some(lens), _) => (lens.znear, lens.zfar.unwrap_or(f32::INFINITY)),
            (None, Some(lens)) => (lens.znear, lens.zfar),
            (None, None) => (0.0, 0.0),
        };
        let source = SourceCamera {
            name: name.cloned().unwrap_or_default(),
            position: world_from_node.translation,
            orientation: nodes::rotation(&world_from_node),
            fov_y_rad: perspective.map_or(0.0, |lens| lens.yfov),
            half_height: orthographic.map_or(0.0, |lens| lens.ymag),
            near,
            far,
        };
        if source.is_usable() {
            import.scene.cameras.push(source);
        } else {
            import.warn(format_args!("camera {index} has no usable lens; left out"));
        }
        Ok(())
    }

    /// Tells what was left out or read in part.
    pub(super) fn warn(&self, import: &mut Import<'_>) {
        self.skipped
            .warnings()
            .into_iter()
            .for_each(|warning| import.warn(warning));
        if self.unskinned > 0 {
            import.warn(format_args!(
                "skinned nodes with joints outside the scene, drawn under their own transform: {}",
                self.unskinned
            ));
        }
        if self.instanced_skins > 0 {
            import.warn(format_args!(
                "skinned nodes with EXT_mesh_gpu_instancing, which glTF leaves undefined, posed once and then drawn at \
                 every instance: {}",
                self.instanced_skins
            ));
        }
        if self.undrawn_instances > 0 {
            import.warn(format_args!(
                "instances of skinned nodes whose transform has no inverse, left out: {}",
                self.undrawn_instances
            ));
        }
    }
}
