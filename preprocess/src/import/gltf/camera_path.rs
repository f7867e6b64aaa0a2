//! A camera of a glTF file as a camera path: at rest, or moved by the file's animations (section 3.11)
//! of its node and of those above it.
//!
//! Paths are linear between keys. Where the camera's way is not - splines, turning parents - keys are added
//! until the middle of each piece is close; where a channel jumps, there is a key right before.

use super::animation::{Animation, Sampler};
use super::document::{Document, get};
use super::{Accessors, ImportError, ImportErrorKind, Result, named, nodes};
use crate::camera_path::{CameraPath, Key, ProjectionKind};
use glam::{DAffine3, DQuat, DVec3};
use gltf::json::Root;

/// Half a piece may be off by this share of the way's extent.
const POSITION_TOLERANCE: f64 = 1e-4;
/// Likewise, radians: a tenth of a pixel at common sizes.
const ANGLE_TOLERANCE: f64 = 1e-4;
/// A piece between two keyframes is halved at most this often.
const MAX_HALVINGS: u32 = 8;
/// More keys than this make no path for a camera.
const MAX_KEYS: usize = 1 << 20;

/// Which camera, and which animation moves it.
#[derive(Clone, Copy, Debug, Default)]
pub struct CameraChoice<'a> {
    /// Name of the camera or of its node; not needed where there is one.
    pub camera: Option<&'a str>,
    /// Name of the animation; not needed where one moves the camera.
    pub animation: Option<&'a str>,
}

pub(super) fn camera_path(
    document: &Document,
    animations: &[Animation],
    accessors: &Accessors<'_>,
    choice: CameraChoice<'_>,
) -> Result<CameraPath> {
    let root = &document.root;
    let placed = nodes::place(document, None)?;
    let node = find_camera(root, &placed, choice.camera)?;
    let chain = chain(&placed, node);
    let within = |error: ImportError| error.within(named("node", node, &root.nodes[node].name));
    let samplers = find_animation(animations, &chain, choice.animation)?
        .map(|animation| {
            let open = animation.samplers(accessors, &chain);
            open.map_err(|error| error.within(animation.place()))
        })
        .transpose()?
        .unwrap_or_default();
    let mover = Mover {
        document,
        world_from_root: placed.world_from_root,
        chain: &chain,
        samplers: &samplers,
    };
    lens(root, node, mover.keys()?).map_err(within)
}

/// The node of the camera asked for.
fn find_camera(root: &Root, placed: &nodes::Placed, name: Option<&str>) -> Result<usize> {
    let mut cameras = Vec::new();
    for &(node, _) in &placed.drawn {
        if let Some(camera) = root.nodes[node].camera {
            let camera = get(root, camera, "camera")?;
            let names = [&root.nodes[node].name, &camera.name];
            cameras.push((node, names.map(|name| name.clone().unwrap_or_default())));
        }
    }
    let list = || {
        let name = |(node, names): &(usize, [String; 2])| {
            let name = names.iter().find(|name| !name.is_empty());
            name.map_or(format!("node {node}"), |name| format!("{name:?}"))
        };
        cameras.iter().map(name).collect::<Vec<_>>().join(", ")
    };
    let is_wanted = |names: &[String; 2]| name.is_none_or(|name| names.iter().any(|n| n == name));
    let fits: Vec<_> = cameras
        .iter()
        .filter(|(_, names)| is_wanted(names))
        .collect();
    let missing = |what: String| ImportError::new(ImportErrorKind::Unsupported, what);
    match (fits.as_slice(), name) {
        ([(node, _)], _) => Ok(*node),
        _ if cameras.is_empty() => {
            Err(missing("no node of the scene has a camera".into()).next("export it with a camera"))
        }
        ([], Some(name)) => {
            Err(missing(format!("has no camera {name:?}")).next(format!("name one of {}", list())))
        }
        _ => Err(missing(format!("has {} cameras that fit", fits.len()))
            .next(format!("name one of {} with --camera", list()))),
    }
}

/// The animation that moves any of the nodes.
fn find_animation<'a>(
    animations: &'a [Animation],
    chain: &[usize],
    name: Option<&str>,
) -> Result<Option<&'a Animation>> {
    let wanted = |animation: &&Animation| name.is_none_or(|name| animation.name() == name);
    let named: Vec<_> = animations.iter().filter(wanted).collect();
    if let (Some(name), true) = (name, named.is_empty()) {
        let what = format!("has no animation {name:?}");
        return Err(
            ImportError::new(ImportErrorKind::Unsupported, what).next("name one that the file has")
        );
    }
    let moving: Vec<_> = named
        .iter()
        .filter(|animation| animation.moves(chain))
        .collect();
    match moving.as_slice() {
        [] => Ok(None),
        [animation] => Ok(Some(animation)),
        several => {
            let names: Vec<_> = several.iter().map(|a| format!("{:?}", a.name())).collect();
            let what = format!("{} animations move the camera", several.len());
            Err(ImportError::new(ImportErrorKind::Unsupported, what)
                .next(format!("name one of {} with --animation", names.join(", "))))
        }
    }
}

/// The nodes from the scene's root to `node`.
fn chain(placed: &nodes::Placed, node: usize) -> Vec<usize> {
    let above = |&node: &usize| placed.parents[node];
    let mut chain: Vec<usize> = std::iter::successors(Some(node), above).collect();
    chain.reverse();
    chain
}

/// A camera's place at a moment.
type Pose = (DVec3, DQuat);

/// Moves the camera.
struct Mover<'a> {
    document: &'a Document,
    world_from_root: DAffine3,
    /// Node by node from the root.
    chain: &'a [usize],
    /// What moves them: place in the chain and sampler.
    samplers: &'a [(usize, Sampler)],
}

impl Mover<'_> {
    /// The pose at `t`, or right before it where it jumps there.
    fn pose(&self, t: f64, before: bool) -> Result<Pose> {
        let mut world = self.world_from_root;
        for (place, &node) in self.chain.iter().enumerate() {
            let transform = &self.document.transforms[node];
            let mine = self.samplers.iter().filter(|(at, _)| *at == place);
            let mut local = transform.clone();
            for (_, sampler) in mine {
                sampler.apply(&mut local, t, before);
            }
            let fault = || ImportError::malformed("its matrix is not affine");
            world *= nodes::local(&local).ok_or_else(fault)?;
        }
        if !world.is_finite() {
            return Err(ImportError::malformed(format!("it is not finite at {t} s")));
        }
        Ok((world.translation, nodes::rotation(&world)))
    }

    /// Times and poses of the path.
    fn keys(&self) -> Result<Vec<(f64, Pose)>> {
        let mut times: Vec<f64> = self.samplers.iter().flat_map(|(_, s)| s.times()).collect();
        times.sort_by(f64::total_cmp);
        times.dedup();
        let Some(&first) = times.first() else {
            return Ok(vec![(0.0, self.pose(0.0, false)?)]);
        };
        let frames = times
            .iter()
            .map(|&t| self.pose(t, false))
            .collect::<Result<Vec<_>>>()?;
        let least = frames
            .iter()
            .fold(DVec3::INFINITY, |least, p| least.min(p.0));
        let most = frames
            .iter()
            .fold(DVec3::NEG_INFINITY, |most, p| most.max(p.0));
        let tolerance = POSITION_TOLERANCE * (most - least).length();
        let mut keys = vec![(first, frames[0])];
        for (piece, frame) in times.windows(2).zip(frames.windows(2)) {
            let (from, to) = (piece[0], piece[1]);
            let end = self.pose(to, true)?;
            self.refine(
                (from, frame[0]),
                (to, end),
                tolerance,
                MAX_HALVINGS,
                &mut keys,
            )?;
            let just_before = to.next_down();
            if end != frame[1] && just_before > keys[keys.len() - 1].0 {
                keys.push((just_before, end));
            }
            keys.push((to, frame[1]));
        }
        Ok(keys)
    }

    /// Adds keys between two moments until straight pieces between them are close.
    fn refine(
        &self,
        a: (f64, Pose),
        b: (f64, Pose),
        tolerance: f64,
        halvings: u32,
        keys: &mut Vec<(f64, Pose)>,
    ) -> Result<()> {
        let t = 0.5 * (a.0 + b.0);
        if halvings == 0 || !(a.0 < t && t < b.0) {
            return Ok(());
        }
        // Not only at the middle: a spline may cross its chord there.
        let mut is_straight = true;
        for share in [0.25, 0.5, 0.75] {
            let (position, orientation) = self.pose(a.0 + share * (b.0 - a.0), false)?;
            let chord = a.1.0.lerp(b.1.0, share);
            let turned = a.1.1.slerp(b.1.1, share);
            is_straight &= (position - chord).length() <= tolerance
                && orientation.angle_between(turned) <= ANGLE_TOLERANCE;
        }
        if is_straight {
            return Ok(());
        }
        if keys.len() >= MAX_KEYS {
            let what = format!("the camera's way needs more than {MAX_KEYS} keys");
            return Err(ImportError::new(ImportErrorKind::TooLarge, what)
                .next("animate it with fewer keyframes"));
        }
        let middle = (t, self.pose(t, false)?);
        self.refine(a, middle, tolerance, halvings - 1, keys)?;
        keys.push(middle);
        self.refine(middle, b, tolerance, halvings - 1, keys)
    }
}

/// Adds what the camera itself says.
fn lens(root: &Root, node: usize, keys: Vec<(f64, Pose)>) -> Result<CameraPath> {
    let index = root.nodes[node].camera.expect("the node was chosen for it");
    let camera = get(root, index, "camera")?;
    let unusable = || ImportError::malformed(format!("camera {index} has no usable lens"));
    let (projection, extent, near, far) = match (&camera.perspective, &camera.orthographic) {
        (Some(lens), _) => (
            ProjectionKind::Perspective,
            lens.yfov,
            lens.znear,
            lens.zfar.map(f64::from),
        ),
        // A path's near plane is above 0, that of an orthographic camera may be 0.
        (None, Some(lens)) => (
            ProjectionKind::Orthographic,
            lens.ymag,
            lens.znear.max(1e-6 * lens.zfar),
            Some(f64::from(lens.zfar)),
        ),
        (None, None) => return Err(unusable()),
    };
    let start = keys[0].0;
    let key = |(t, (position, orientation)): (f64, Pose)| {
        let extent = Some(f64::from(extent));
        let is_perspective = projection == ProjectionKind::Perspective;
        Key {
            t_s: t - start,
            position: position.to_array(),
            orientation: orientation.to_array(),
            fov_y_rad: extent.filter(|_| is_perspective),
            half_height: extent.filter(|_| !is_perspective),
        }
    };
    let mut keys: Vec<_> = keys.into_iter().map(key).collect();
    // Times that were apart may have become one when the start was taken off.
    keys.dedup_by(|later, earlier| later.t_s <= earlier.t_s);
    CameraPath::new(projection, f64::from(near), far, keys)
        .map_err(|problem| ImportError::malformed(format!("camera {index}: {problem}")))
}
