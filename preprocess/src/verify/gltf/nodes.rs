//! Where the nodes of the drawn scene are.

use super::super::affine::Affine;
use super::json::{Result, floats, indices, item, number, optional, point};
use serde_json::Value;

/// The nodes of the scene, depth first, and where each is; `None` for nodes outside the scene.
pub(super) struct Nodes {
    pub(super) drawn: Vec<usize>,
    pub(super) places: Vec<Option<Affine>>,
}

impl Nodes {
    pub(super) fn place(root: &Value, choice: Option<&str>) -> Result<Self> {
        let count = root["nodes"].as_array().map_or(0, Vec::len);
        let roots = roots(root, choice, count)?;
        let is_below = below(root, &roots, count)?;
        let mut nodes = Self {
            drawn: Vec::new(),
            places: vec![None; count],
        };
        let start = centre(root)?;
        let top = roots.iter().rev().filter(|&&node| !is_below[node]);
        let mut waiting: Vec<_> = top.map(|&node| (node, start, true)).collect();
        while let Some((index, above, parent_is_visible)) = waiting.pop() {
            // Listed twice: drawn once. Several parents are an error of the importer.
            if nodes.places[index].is_some() {
                continue;
            }
            let node = item(root, "nodes", index)?;
            let place = above.after(&local(node).map_err(|what| format!("node {index}: {what}"))?);
            nodes.places[index] = Some(place);
            let visibility = &node["extensions"]["KHR_node_visibility"]["visible"];
            let is_visible = parent_is_visible && *visibility != false;
            if is_visible {
                nodes.drawn.push(index);
            }
            let children = indices(node, "children")?;
            waiting.extend(
                children
                    .into_iter()
                    .rev()
                    .map(|child| (child, place, is_visible)),
            );
        }
        Ok(nodes)
    }
}

/// The nodes that the chosen scene lists; without scenes all nodes that are nobody's children.
fn roots(root: &Value, choice: Option<&str>, count: usize) -> Result<Vec<usize>> {
    let scenes = root["scenes"].as_array().map_or(&[][..], Vec::as_slice);
    let chosen = match choice {
        Some(choice) => {
            let named = scenes.iter().position(|scene| scene["name"] == choice);
            let number = named.or_else(|| choice.parse().ok());
            Some(number.ok_or_else(|| format!("there is no scene {choice:?}"))?)
        }
        None => optional(root, "scene")?.or((!scenes.is_empty()).then_some(0)),
    };
    let roots = match chosen {
        Some(chosen) => indices(item(root, "scenes", chosen)?, "nodes")?,
        None => {
            let nodes = root["nodes"].as_array().map_or(&[][..], Vec::as_slice);
            let children = nodes.iter().flat_map(|node| node["children"].as_array());
            let mut is_child = vec![false; count];
            for child in children.flatten().filter_map(number) {
                if let Some(is_child) = is_child.get_mut(child) {
                    *is_child = true;
                }
            }
            (0..count).filter(|&node| !is_child[node]).collect()
        }
    };
    match roots.iter().find(|&&node| node >= count) {
        Some(node) => Err(format!("the scene lists node {node} of {count}")),
        None => Ok(roots),
    }
}

/// Whether each node is below a node of the scene.
fn below(root: &Value, roots: &[usize], count: usize) -> Result<Vec<bool>> {
    let (mut is_below, mut is_seen) = (vec![false; count], vec![false; count]);
    let mut waiting = roots.to_vec();
    while let Some(index) = waiting.pop() {
        if std::mem::replace(&mut is_seen[index], true) {
            continue;
        }
        for child in indices(item(root, "nodes", index)?, "children")? {
            *is_below
                .get_mut(child)
                .ok_or_else(|| format!("node {index} has the child {child} of {count}"))? = true;
            waiting.push(child);
        }
    }
    Ok(is_below)
}

/// Where `CESIUM_RTC` puts the origin. Its centre has z up, the file has y up.
fn centre(root: &Value) -> Result<Affine> {
    let centre = floats::<3>(&root["extensions"]["CESIUM_RTC"], "center")?;
    let [x, y, z] = centre.unwrap_or([0.0; 3]);
    Ok(Affine::translation([x, z, -y]))
}

fn local(node: &Value) -> Result<Affine> {
    if let Some(matrix) = floats::<16>(node, "matrix")? {
        return Ok(Affine::from_columns(matrix));
    }
    let rotation = floats(node, "rotation")?.unwrap_or([0.0, 0.0, 0.0, 1.0]);
    Ok(Affine::compose(
        point(node, "translation", [0.0; 3])?,
        rotation,
        point(node, "scale", [1.0; 3])?,
    ))
}
