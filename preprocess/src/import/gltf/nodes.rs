//! The node hierarchy (section 3.5): world transforms in f64, depth first, without recursion.

use super::accessor::Accessors;
use super::document::{Document, Transform, get};
use super::{ImportError, ImportErrorKind, MAX_OBJECTS, Result, extensions};
use glam::{DAffine3, DMat3, DMat4, DQuat, DVec3};
use gltf::json::accessor::Type;
use gltf::json::{Accessor, Index, Node, Root, Scene};
use serde::Deserialize;
use std::collections::BTreeMap;

/// `EXT_mesh_gpu_instancing`.
#[derive(Deserialize)]
pub(super) struct GpuInstancing {
    attributes: BTreeMap<String, Index<Accessor>>,
}

/// The nodes of the drawn scene.
pub(super) struct Placed {
    /// Node and its transform, depth first, in document order.
    pub(super) drawn: Vec<(usize, DAffine3)>,
    /// Where each node of the file lies; `None` for those outside the scene.
    pub(super) world_from_node: Vec<Option<DAffine3>>,
    /// Nodes of the scene that are not to be seen.
    pub(super) hidden: usize,
}

/// `KHR_node_visibility`: a hidden node hides what is below it.
#[derive(Deserialize)]
struct Visibility {
    visible: Option<bool>,
}

impl Visibility {
    fn of(node: &Node) -> Result<bool> {
        let Some(extensions) = &node.extensions else {
            return Ok(true);
        };
        let found: Option<Self> = extensions::read(&extensions.others, &["KHR_node_visibility"])?;
        Ok(found.and_then(|found| found.visible).unwrap_or(true))
    }
}

/// The scene that goes by `choice`: its name, else its index.
fn chosen<'a>(root: &'a Root, choice: &str) -> Result<&'a Scene> {
    let named = root
        .scenes
        .iter()
        .find(|scene| scene.name.as_deref() == Some(choice));
    let numbered = || root.scenes.get(choice.parse::<usize>().ok()?);
    named.or_else(numbered).ok_or_else(|| {
        let name = |(index, scene): (usize, &Scene)| match &scene.name {
            Some(name) => format!("{index} {name:?}"),
            None => index.to_string(),
        };
        let names: Vec<_> = root.scenes.iter().take(20).enumerate().map(name).collect();
        let next = match names.len() {
            0 => "bake it without --scene".into(),
            _ => format!("choose one of {}", names.join(", ")),
        };
        ImportError::new(ImportErrorKind::Missing, format!("has no scene {choice:?}")).next(next)
    })
}

/// Places the nodes of the chosen scene, else of the default one, else of the first one, else all roots.
pub(super) fn place(document: &Document, choice: Option<&str>) -> Result<Placed> {
    let root = &document.root;
    let nodes = &root.nodes;
    let roots = match (choice, root.scene, root.scenes.first()) {
        (Some(choice), ..) => chosen(root, choice)?.nodes.clone(),
        (None, Some(index), _) => get(root, index, "scene")?.nodes.clone(),
        (None, None, Some(scene)) => scene.nodes.clone(),
        (None, None, None) => {
            let mut is_root = vec![true; nodes.len()];
            let children = nodes.iter().flat_map(|node| node.children.iter().flatten());
            children.for_each(|child| {
                if let Some(is_root) = is_root.get_mut(child.value()) {
                    *is_root = false
                }
            });
            let roots = (0u32..).zip(is_root).filter(|(_, is_root)| *is_root);
            roots.map(|(node, _)| Index::new(node)).collect()
        }
    };
    let mut placed = Placed {
        drawn: Vec::new(),
        world_from_node: vec![None; nodes.len()],
        hidden: 0,
    };
    let mut waiting: Vec<(Index<Node>, DAffine3, bool)> = roots
        .iter()
        .rev()
        .map(|&node| (node, DAffine3::IDENTITY, true))
        .collect();
    // Every node expands at most once, so the loop ends whatever the file says about its children.
    while let Some((index, world_from_parent, parent_is_visible)) = waiting.pop() {
        let node = get(root, index, "node")?;
        let fault = |what: &str| ImportError::malformed(what).within(format_args!("node {index}"));
        let place = &mut placed.world_from_node[index.value()];
        if place.is_some() {
            return Err(fault(
                "is reached twice: it has several parents, or is its own ancestor",
            ));
        }
        // Both lists come from the same JSON array.
        let parent_from_node = local(&document.transforms[index.value()]);
        let world_from_node = world_from_parent
            * parent_from_node.ok_or_else(|| fault("its matrix is not affine"))?;
        if !world_from_node.is_finite() {
            return Err(fault("its transform is not finite"));
        }
        *place = Some(world_from_node);
        let is_visible = parent_is_visible
            && Visibility::of(node).map_err(|error| error.within(format_args!("node {index}")))?;
        if is_visible {
            placed.drawn.push((index.value(), world_from_node));
        } else {
            placed.hidden += 1;
        }
        waiting.extend(
            node.children
                .iter()
                .flatten()
                .rev()
                .map(|&child| (child, world_from_node, is_visible)),
        );
    }
    Ok(placed)
}

/// The node's transform within its parent; `None` for a projective matrix.
pub(super) fn local(node: &Transform) -> Option<DAffine3> {
    if let Some(matrix) = &node.matrix {
        let matrix = DMat4::from_cols_array(matrix);
        let affine = matrix.row(3).abs_diff_eq(glam::DVec4::W, 1e-6);
        return affine.then(|| DAffine3::from_mat4(matrix));
    }
    Some(compose(
        node.translation.unwrap_or([0.0; 3]),
        node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]),
        node.scale.unwrap_or([1.0; 3]),
    ))
}

/// Translation, rotation and scale. Quaternions are stored rounded, so they are made unit again; a
/// zero one rotates nothing.
fn compose(translation: [f64; 3], rotation: [f64; 4], scale: [f64; 3]) -> DAffine3 {
    let rotation = DQuat::from_array(rotation);
    let rotation = if rotation.length_squared() > 0.0 {
        rotation.normalize()
    } else {
        DQuat::IDENTITY
    };
    DAffine3 {
        matrix3: DMat3::from_quat(rotation) * DMat3::from_diagonal(scale.into()),
        translation: translation.into(),
    }
}

/// The rotation in `transform`, scale and shear taken out by making its axes orthonormal from -z on.
pub(super) fn rotation(transform: &DAffine3) -> DQuat {
    let z = transform.matrix3.z_axis.normalize_or(DVec3::Z);
    let x = transform
        .matrix3
        .y_axis
        .cross(z)
        .normalize_or(z.any_orthonormal_vector());
    DQuat::from_mat3(&DMat3::from_cols(x, z.cross(x), z)).normalize()
}

/// The transforms of `EXT_mesh_gpu_instancing`, each within its node.
pub(super) fn instances(
    accessors: &Accessors<'_>,
    instancing: &GpuInstancing,
) -> Result<Vec<DAffine3>> {
    let open = |name: &str, shape: Type| {
        let accessor = instancing.attributes.get(name);
        accessor
            .map(|&accessor| accessors.open(accessor, shape))
            .transpose()
    };
    let translation = open("TRANSLATION", Type::Vec3)?;
    let rotation = open("ROTATION", Type::Vec4)?;
    let scale = open("SCALE", Type::Vec3)?;
    let mut counts = [&translation, &rotation, &scale]
        .into_iter()
        .flatten()
        .map(|elements| elements.count());
    let Some(count) = counts.next() else {
        return Err(ImportError::malformed(
            "has none of TRANSLATION, ROTATION and SCALE",
        ));
    };
    if let Some(other) = counts.find(|&other| other != count) {
        return Err(ImportError::malformed(format!(
            "its attributes have {count} and {other} elements"
        )));
    }
    if count > MAX_OBJECTS {
        let what = format!("{count} instances are more than the {MAX_OBJECTS} objects of a scene");
        return Err(ImportError::new(ImportErrorKind::TooLarge, what));
    }
    let instance = |index: usize| {
        let transform = compose(
            translation
                .as_ref()
                .map_or([0.0; 3], |elements| elements.floats(index).map(f64::from)),
            rotation.as_ref().map_or([0.0, 0.0, 0.0, 1.0], |elements| {
                elements.floats(index).map(f64::from)
            }),
            scale
                .as_ref()
                .map_or([1.0; 3], |elements| elements.floats(index).map(f64::from)),
        );
        let finite = transform.is_finite().then_some(transform);
        finite.ok_or_else(|| ImportError::malformed(format!("instance {index} is not finite")))
    };
    (0..count).map(instance).collect()
}
