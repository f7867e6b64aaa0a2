//! The node hierarchy (section 3.5): world transforms in f64, depth first, without recursion.

use super::accessor::Accessors;
use super::document::{Document, Transform, get, known};
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
    /// The parent of each node within the scene.
    pub(super) parents: Vec<Option<usize>>,
    /// World from the space of the scene's root nodes.
    pub(super) world_from_root: DAffine3,
    /// Nodes of the scene that are not to be seen.
    pub(super) hidden: usize,
    /// Nodes that the scene lists although other nodes of the scene have them below them, or that are listed twice.
    pub(super) listed_again: usize,
    /// Nodes of the scene that are children of nodes outside it, whose transforms do not count.
    pub(super) detached: usize,
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
    let world_from_root = DAffine3::from_translation(extensions::rtc_center(root)?);
    if !world_from_root.is_finite() {
        return Err(ImportError::malformed("its center is not finite").within(extensions::RTC));
    }
    let mut placed = Placed {
        drawn: Vec::new(),
        world_from_node: vec![None; nodes.len()],
        parents: vec![None; nodes.len()],
        world_from_root,
        hidden: 0,
        listed_again: 0,
        detached: 0,
    };
    // A scene may list only root nodes. Some exporters list every node; as viewers do, each is drawn once, in its
    // place below its parent.
    let is_below = below(root, &roots)?;
    let mut waiting: Vec<Waiting> = roots
        .iter()
        .rev()
        .filter(|root| !is_below[root.value()])
        .map(|&index| Waiting {
            index,
            parent: None,
            world_from_parent: world_from_root,
            parent_is_visible: true,
        })
        .collect();
    placed.listed_again = roots.len() - waiting.len();
    // Every node expands at most once, so the loop ends whatever the file says about its children.
    while let Some(entry) = waiting.pop() {
        let index = entry.index;
        let node = get(root, index, "node")?;
        let fault = |what: &str| ImportError::malformed(what).within(format_args!("node {index}"));
        if placed.world_from_node[index.value()].is_some() {
            if placed.parents[index.value()] == entry.parent {
                placed.listed_again += 1;
                continue;
            }
            return Err(fault(
                &placed.why_reached_again(index.value(), entry.parent),
            ));
        }
        // Both lists come from the same JSON array.
        let parent_from_node = local(&document.transforms[index.value()]);
        let world_from_node = entry.world_from_parent
            * parent_from_node.ok_or_else(|| fault("its matrix is not affine"))?;
        if !world_from_node.is_finite() {
            return Err(fault("its transform is not finite"));
        }
        placed.world_from_node[index.value()] = Some(world_from_node);
        placed.parents[index.value()] = entry.parent;
        let is_visible = entry.parent_is_visible
            && Visibility::of(node).map_err(|error| error.within(format_args!("node {index}")))?;
        if is_visible {
            placed.drawn.push((index.value(), world_from_node));
        } else {
            placed.hidden += 1;
        }
        waiting.extend(node.children.iter().flatten().rev().map(|&child| Waiting {
            index: child,
            parent: Some(index.value()),
            world_from_parent: world_from_node,
            parent_is_visible: is_visible,
        }));
    }
    let outside = nodes
        .iter()
        .zip(&placed.world_from_node)
        .filter(|(_, world)| world.is_none());
    let children = outside.flat_map(|(node, _)| node.children.iter().flatten());
    let is_placed =
        |child: &Index<Node>| matches!(placed.world_from_node.get(child.value()), Some(Some(_)));
    placed.detached = children.filter(|child| is_placed(child)).count();
    // Nodes that are listed and below others, yet below no root: they lie on a cycle.
    match roots
        .iter()
        .find(|root| placed.world_from_node[root.value()].is_none())
    {
        Some(root) => {
            Err(ImportError::malformed("is its own ancestor").within(format_args!("node {root}")))
        }
        None => Ok(placed),
    }
}

/// A node to be placed.
struct Waiting {
    index: Index<Node>,
    parent: Option<usize>,
    world_from_parent: DAffine3,
    parent_is_visible: bool,
}

/// Whether each node is a child of a node of the scene.
fn below(root: &Root, roots: &[Index<Node>]) -> Result<Vec<bool>> {
    let mut is_below = vec![false; root.nodes.len()];
    let mut is_expanded = is_below.clone();
    let mut waiting: Vec<Index<Node>> = roots.to_vec();
    while let Some(index) = waiting.pop() {
        let node = get(root, index, "node")?;
        if std::mem::replace(&mut is_expanded[index.value()], true) {
            continue;
        }
        for &child in node.children.iter().flatten() {
            get(root, child, "node")?;
            is_below[child.value()] = true;
            waiting.push(child);
        }
    }
    Ok(is_below)
}

impl Placed {
    /// Why the hierarchy is no tree: `node`, which is placed, is a child of `parent` too.
    fn why_reached_again(&self, node: usize, parent: Option<usize>) -> String {
        let ancestors = std::iter::successors(parent, |&node| self.parents[node]);
        if ancestors.into_iter().any(|ancestor| ancestor == node) {
            return "is its own ancestor".into();
        }
        let name = |parent: Option<usize>| match parent {
            Some(parent) => format!("a child of node {parent}"),
            None => "a root of the scene".into(),
        };
        let (first, second) = (name(self.parents[node]), name(parent));
        format!("is {first} and {second}, but a node has one parent")
    }
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
    // All three are optional; attributes of the application's own say how many there are too.
    let count = match (counts.next(), instancing.attributes.values().next()) {
        (Some(count), _) => count,
        (None, Some(&accessor)) => {
            let shape = known(accessors.declared(accessor)?.type_, "type")?;
            accessors.open(accessor, shape)?.count()
        }
        (None, None) => return Err(ImportError::malformed("has no attributes")),
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
