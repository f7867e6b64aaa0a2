//! Each hard case really holds the difficulty that it is named for: told from its geometry in f64 and from what
//! no culling shows of it.

use glam::{DAffine3, DVec2, DVec3};
use hroc_preprocess::scene::AlphaMode;
use hroc_runtime::{DepthConvention, FrameUniform, Noc, Projection};
use hroc_study::hard_cases::{CASES, CaseScene, Scale, case};
use hroc_tests::gpu;
use hroc_tests::host::{Frame, Host, World};

type Check = fn(&Seen);

/// The check of each case. `every_case_is_as_hard_as_it_says` sees to it that none is missing.
const CHECKS: &[(&str, Check)] = &[
    ("empty", |seen| assert!(seen.bounds.is_empty())),
    ("one-object", |seen| assert_eq!(seen.bounds.len(), 1)),
    ("two-objects", |seen| assert_eq!(seen.bounds.len(), 2)),
    ("everything-visible", |seen| {
        for i in seen.frames() {
            assert_eq!(seen.visible(i).len(), seen.bounds.len(), "frame {i}");
        }
    }),
    ("nothing-visible", |seen| {
        assert!(!seen.bounds.is_empty());
        assert!(seen.frames().all(|i| seen.visible(i).is_empty()));
    }),
    ("clutter", |seen| seen_between(seen, 0.02, 0.8)),
    ("rooms", |seen| seen_between(seen, 0.01, 0.2)),
    ("around-the-eye", around_the_eye),
    ("through-a-wall", through_a_wall),
    ("eye-in-bounds", eye_in_bounds),
    ("footprints", footprints),
    ("odd-sizes", odd_sizes),
    ("viewports", viewports),
    ("projections", projections),
    ("sub-pixel", sub_pixel),
    ("flat-and-tiny", flat_and_tiny),
    ("narrow-gaps", narrow_gaps),
    ("degenerate", |seen| narrow_triangles(seen, 1e-6)),
    ("near-degenerate", |seen| narrow_triangles(seen, 1e-2)),
    ("on-one-line", |seen| narrow_triangles(seen, 0.0)),
    ("one-pixel", one_pixel),
    ("parallel-rays", parallel_rays),
    ("edge-rays", edge_rays),
    ("snapped-grid", snapped_grid),
    ("depth-conventions", depth_conventions),
    ("own-bounds", own_bounds),
    ("coplanar", coplanar),
    ("ulp-layers", ulp_layers),
    ("far-1e3", |seen| as_the_rooms_at(seen, 1e3)),
    ("far-1e5", |seen| as_the_rooms_at(seen, 1e5)),
    ("far-1e7", |seen| as_the_rooms_at(seen, 1e7)),
    ("wide-world", wide_world),
    ("bolts-on-a-planet", bolts_on_a_planet),
    ("on-a-wide-mesh", |seen| seen_between(seen, 0.05, 0.6)),
    ("odd-transforms", odd_transforms),
    ("cancelling", cancelling),
    ("identical-boxes", identical_boxes),
    ("collinear", |seen| sizes_range_over(seen, 1e12)),
    ("huge-beside-tiny", huge_beside_tiny),
    ("sudden-crowd", sudden_crowd),
    ("still-camera", still_camera),
    ("about-turns", about_turns),
    ("teleports", teleports),
    ("two-views", two_views),
    ("resize", |seen| {
        assert!(
            seen.frames()
                .skip(1)
                .all(|i| seen.size(i) != seen.size(i - 1))
        );
    }),
    ("jitter", jitter),
    ("glass", glass),
    ("fence", fence),
    ("crossing", crossing),
    ("taken-apart", |seen| assert!(moving_objects_show(seen) > 0)),
];

#[test]
fn every_case_is_as_hard_as_it_says() {
    let listed = CHECKS.iter().map(|(name, _)| *name).collect::<Vec<_>>();
    let names = CASES.iter().map(|case| case.name).collect::<Vec<_>>();
    assert_eq!(listed, names);
    let mut failed = Vec::new();
    for (name, check) in CHECKS {
        let Some(seen) = Seen::new(name, DepthConvention::Reversed) else {
            return;
        };
        // The others are told about, too; what is wrong stands in the panic's message.
        if std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| check(&seen))).is_err() {
            failed.push(*name);
        }
    }
    assert!(failed.is_empty(), "not as hard as they say: {failed:?}");
}

/// A case at small scale, and no culling's image of each frame.
struct Seen {
    scene: CaseScene,
    world: World,
    images: Vec<Frame>,
    /// World bounds of each object.
    bounds: Vec<[DVec3; 2]>,
}

impl Seen {
    /// `None` where no GPU is wanted.
    fn new(name: &str, depth: DepthConvention) -> Option<Self> {
        Self::of((case(name).unwrap().make)(Scale::Small), depth)
    }

    /// Of a scene that is none of the cases.
    fn of(scene: CaseScene, depth: DepthConvention) -> Option<Self> {
        let gpu = gpu()?;
        let mut world = World::of_case(gpu, &scene);
        let mut host = Host::new(gpu, &world, Scale::Small.size(), depth);
        let mut noc = Noc::new(&gpu.device, &world.scene, depth);
        let images = scene
            .frames
            .iter()
            .enumerate()
            .map(|(number, frame)| {
                world.advance(gpu, number);
                host.follow(&world);
                host.render_frame(&mut noc, frame)
            })
            .collect();
        let corner = |corner: [f32; 3]| DVec3::from_array(corner.map(f64::from));
        let shape = &world.scene.shape;
        let bounds = world.baked.scene().object_bounds.iter().map(|bounds| {
            let bounds = bounds.to_native();
            let zero = shape.cells[bounds.cell as usize] - shape.origin;
            [corner(bounds.min) + zero, corner(bounds.max) + zero]
        });
        Some(Self {
            bounds: bounds.collect(),
            scene,
            world,
            images,
        })
    }

    fn frames(&self) -> std::ops::Range<usize> {
        0..self.scene.frames.len()
    }

    fn size(&self, frame: usize) -> [u32; 2] {
        self.scene.frames[frame].size.unwrap_or(Scale::Small.size())
    }

    fn visible(&self, frame: usize) -> Vec<u32> {
        self.images[frame].visible()
    }

    fn eye(&self, frame: usize) -> DVec3 {
        self.scene.frames[frame].camera.position - self.world.scene.shape.origin
    }

    fn forward(&self, frame: usize) -> DVec3 {
        self.scene.frames[frame].camera.orientation * DVec3::NEG_Z
    }

    /// View depth of the nearest and the farthest corner.
    fn depths(&self, frame: usize, bounds: &[DVec3; 2]) -> [f64; 2] {
        let depths =
            corners(bounds).map(|corner| self.forward(frame).dot(corner - self.eye(frame)));
        [
            depths.into_iter().fold(f64::INFINITY, f64::min),
            depths.into_iter().fold(f64::NEG_INFINITY, f64::max),
        ]
    }

    /// Where a point of world falls in the image, pixels from the top left; `None` behind the eye.
    fn project(&self, frame: usize, point: DVec3) -> Option<DVec2> {
        let shape = &self.world.scene.shape;
        let (camera, size) = (&self.scene.frames[frame].camera, self.size(frame));
        let clip = camera
            .clip_from_world(DepthConvention::Reversed, size, shape.origin, shape.radius)
            .unwrap();
        let p = clip * point.extend(1.0);
        let [width, height] = size.map(f64::from);
        (p.w > 0.0).then(|| {
            DVec2::new(
                (0.5 + 0.5 * p.x / p.w) * width,
                (0.5 - 0.5 * p.y / p.w) * height,
            )
        })
    }

    /// Width and height of an object's bounds in the image, pixels; `None` where they reach behind the eye.
    fn extent_px(&self, frame: usize, bounds: &[DVec3; 2]) -> Option<DVec2> {
        let mut extent = [DVec2::INFINITY, DVec2::NEG_INFINITY];
        for corner in corners(bounds) {
            let at = self.project(frame, corner)?;
            extent = [extent[0].min(at), extent[1].max(at)];
        }
        Some(extent[1] - extent[0])
    }

    /// Pixels that show the object: x, y.
    fn pixels_of(&self, frame: usize, object: u32) -> Vec<[u32; 2]> {
        let width = self.size(frame)[0];
        let pixels = self.images[frame].item.iter().zip(0u32..);
        pixels
            .filter(|(item, _)| **item == object)
            .map(|(_, i)| [i % width, i / width])
            .collect()
    }

    /// Objects whose source place satisfies `wanted`.
    fn objects(&self, wanted: impl Fn(&DAffine3) -> bool) -> Vec<u32> {
        let objects = self.scene.source.objects.iter().zip(0..);
        objects
            .filter(|(object, _)| wanted(&object.world_from_object))
            .map(|(_, id)| id)
            .collect()
    }

    fn uniform(&self, frame: usize) -> FrameUniform {
        let camera = &self.scene.frames[frame].camera;
        FrameUniform::new(
            camera,
            DepthConvention::Reversed,
            self.size(frame),
            &self.world.scene.shape,
        )
        .unwrap()
    }
}

fn corners([lo, hi]: &[DVec3; 2]) -> [DVec3; 8] {
    std::array::from_fn(|i| {
        DVec3::from_array([0, 1, 2].map(|axis| {
            if i >> axis & 1 == 1 {
                hi[axis]
            } else {
                lo[axis]
            }
        }))
    })
}

fn contains([lo, hi]: &[DVec3; 2], point: DVec3) -> bool {
    point.cmpge(*lo).all() && point.cmple(*hi).all()
}

/// In every frame this share of the objects shows.
fn seen_between(seen: &Seen, least: f64, most: f64) {
    for i in seen.frames() {
        let share = seen.visible(i).len() as f64 / seen.bounds.len() as f64;
        assert!(least < share && share < most, "frame {i}: {share}");
    }
}

fn around_the_eye(seen: &Seen) {
    for i in seen.frames() {
        let near = seen.scene.frames[i].camera.near;
        let depths = || seen.bounds.iter().map(|bounds| seen.depths(i, bounds));
        let cut = |at: f64| {
            depths()
                .filter(|[first, last]| *first < at && at < *last)
                .count()
        };
        assert!(
            cut(near) > 30 && cut(0.0) > 100,
            "frame {i}: {} cut by the near plane, {} by the eye's",
            cut(near),
            cut(0.0)
        );
    }
}

fn through_a_wall(seen: &Seen) {
    let wall = &seen.bounds[0];
    let near = seen.scene.frames[0].camera.near;
    let front = |i: usize| seen.eye(i).z - wall[1].z;
    let clipped = seen
        .frames()
        .filter(|&i| front(i) > 0.0 && front(i) < near)
        .count();
    let inside = seen
        .frames()
        .filter(|&i| contains(wall, seen.eye(i)))
        .count();
    let last = seen.frames().last().unwrap();
    assert!(
        clipped > 2 && inside > 0,
        "{clipped} with the front clipped, {inside} inside"
    );
    assert_eq!(seen.visible(0), [0], "nothing but the wall at first");
    assert!(
        !seen.visible(last).contains(&0),
        "in the end it is behind the near plane"
    );
    assert!(seen.visible(last).len() > 5);
}

fn eye_in_bounds(seen: &Seen) {
    // The first object; one ulp outside means outside of it.
    let object = seen.scene.source.objects[0].world_from_object;
    let half = object.matrix3 * DVec3::ONE;
    let reach = |i: usize| (seen.eye(i).abs() / half).max_element();
    let count = |wanted: fn(f64) -> bool| seen.frames().filter(|&i| wanted(reach(i))).count();
    assert_eq!(count(|r| r == 1.0), 3, "on a face, an edge, a corner");
    assert_eq!(count(|r| r > 1.0 && r < 1.000_001), 3, "an ulp outside");
    assert_eq!(count(|r| r < 1.0 && r > 0.999_999), 3, "an ulp inside");
    assert_eq!(count(|r| r < 1e-20), 1, "at the centre");
}

fn footprints(seen: &Seen) {
    let targets = seen.objects(|m| m.translation.z < -1.0);
    let [width, height] = seen.size(0);
    assert_eq!(
        targets.len() as u32,
        width * width,
        "two per footprint, one for those of a single texel"
    );
    for page in 0..seen.frames().len() / 2 {
        let [closed, open] = [2 * page, 2 * page + 1];
        assert!(
            seen.visible(closed).iter().all(|id| !targets.contains(id)),
            "page {page}: the gaps are closed"
        );
        let shown = &targets[page * height as usize..][..height as usize];
        for &target in shown {
            assert_eq!(
                seen.pixels_of(open, target).len(),
                1,
                "page {page}, target {target}"
            );
        }
    }
}

fn odd_sizes(seen: &Seen) {
    let targets = seen.objects(|m| m.translation.z < -1.0);
    for i in seen.frames() {
        let [width, height] = seen.size(i);
        let shown = seen
            .visible(i)
            .into_iter()
            .filter(|id| targets.contains(id))
            .collect::<Vec<_>>();
        if i % 2 == 0 {
            assert!(shown.is_empty(), "frame {i}: the wall covers everything");
            continue;
        }
        assert!(!shown.is_empty(), "frame {i}: something peeks out");
        let pixels = shown.iter().flat_map(|id| seen.pixels_of(i, *id));
        assert!(
            pixels
                .into_iter()
                .all(|[x, y]| x == width - 1 || y == height - 1),
            "frame {i}"
        );
    }
    assert!(
        seen.frames()
            .any(|i| seen.size(i).iter().all(|side| !side.is_power_of_two()))
    );
}

fn viewports(seen: &Seen) {
    let sizes = seen.frames().map(|i| seen.size(i)).collect::<Vec<_>>();
    assert!(sizes.contains(&[1, 1]));
    assert!(
        sizes.iter().any(|s| s[0] == 1 && s[1] > 64)
            && sizes.iter().any(|s| s[1] == 1 && s[0] > 64)
    );
    assert!(seen.frames().all(|i| !seen.visible(i).is_empty()));
}

fn projections(seen: &Seen) {
    let cameras = || seen.scene.frames.iter().map(|frame| frame.camera);
    let degrees = |camera: hroc_runtime::Camera| match camera.projection {
        Projection::Perspective { fov_y_rad } => fov_y_rad.to_degrees().round(),
        Projection::Orthographic { .. } => 0.0,
    };
    for wanted in [0.0, 1.0, 179.0] {
        for far in [false, true] {
            assert!(
                cameras().any(|camera| degrees(camera) == wanted && camera.far.is_some() == far),
                "{wanted} {far}"
            );
        }
    }
    // The far plane takes something away.
    assert!(
        seen.frames()
            .step_by(2)
            .any(|i| seen.visible(i).len() > seen.visible(i + 1).len())
    );
}

fn sub_pixel(seen: &Seen) {
    let small = |id: &u32, i| {
        seen.extent_px(i, &seen.bounds[*id as usize])
            .is_some_and(|e| e.max_element() < 1.0)
    };
    let thin = |id: &u32, i| {
        seen.extent_px(i, &seen.bounds[*id as usize])
            .is_some_and(|e| e.min_element() < 1.0 && e.max_element() > 3.0)
    };
    let all = 0..seen.bounds.len() as u32;
    let smalls = all.filter(|id| small(id, 0)).count();
    let visible = seen.visible(0);
    let shown = visible.iter().filter(|id| small(id, 0)).count();
    let wires = visible.iter().filter(|id| thin(id, 0)).count();
    assert!(
        smalls > 300 && shown > 8 && wires > 3,
        "{smalls} below a pixel, {shown} of them show, {wires} wires"
    );
    changes(seen);
}

/// What shows is never the same twice in a row.
fn changes(seen: &Seen) {
    for i in seen.frames().skip(1) {
        assert_ne!(seen.visible(i), seen.visible(i - 1), "frame {i}");
    }
}

fn flat_and_tiny(seen: &Seen) {
    let flat = seen.objects(|m| m.matrix3.determinant() == 0.0);
    assert_eq!(flat.len(), 60);
    let tiny = (60..seen.bounds.len()).filter(|&id| {
        seen.extent_px(0, &seen.bounds[id])
            .is_some_and(|e| e.max_element() < 0.1)
    });
    assert!(tiny.count() > 300);
    assert!(seen.frames().any(|i| {
        seen.visible(i)
            .iter()
            .filter(|id| flat.contains(id))
            .count()
            > 10
    }));
    assert!(seen.frames().any(|i| {
        seen.visible(i)
            .iter()
            .filter(|id| !flat.contains(id))
            .count()
            > 10
    }));
}

/// Most triangles of a third of the meshes have an area below this share of the square of their longest edge.
fn narrow_triangles(seen: &Seen, share: f64) {
    let scene = seen.world.baked.scene();
    let narrow_in = |mesh: &hroc_format::ArchivedMesh| {
        let first = mesh.vertex_range().start;
        let corner = |index: u32| {
            let position = scene.position(first + index as usize);
            DVec3::from_array(position.map(f64::from))
        };
        let triangles = scene.indices()[mesh.index_range()].chunks_exact(3);
        let narrow = triangles.clone().filter(|t| {
            let [a, b, c] = [corner(t[0]), corner(t[1]), corner(t[2])];
            let longest = (b - a).length().max((c - b).length()).max((a - c).length());
            (b - a).cross(c - a).length() <= 2.0 * share * longest * longest
        });
        2 * narrow.count() > triangles.count()
    };
    let narrow = scene.meshes.iter().filter(|mesh| narrow_in(mesh)).count();
    assert!(
        3 * narrow > scene.meshes.len(),
        "{narrow} of {}",
        scene.meshes.len()
    );
    assert!(seen.frames().all(|i| !seen.visible(i).is_empty()));
}

fn one_pixel(seen: &Seen) {
    // The first object is the wall.
    let small = seen.bounds.iter().skip(1).filter(|bounds| {
        seen.extent_px(0, bounds)
            .is_some_and(|extent| extent.max_element() < 4.0)
    });
    assert!(10 * small.count() > 9 * (seen.bounds.len() - 1));
    assert!(seen.frames().any(|i| seen.visible(i).len() > 20));
}

fn narrow_gaps(seen: &Seen) {
    let targets = seen.objects(|m| m.translation.z < -1.0);
    for i in seen.frames() {
        let visible = seen.visible(i);
        let shown = targets
            .iter()
            .filter(|id| visible.contains(id))
            .collect::<Vec<_>>();
        assert!(
            !shown.is_empty() && shown.len() < targets.len(),
            "frame {i}: {} of {}",
            shown.len(),
            targets.len()
        );
        let one_wide = shown.iter().filter(|id| {
            let pixels = seen.pixels_of(i, ***id);
            pixels.iter().all(|[x, _]| *x == pixels[0][0])
        });
        assert!(one_wide.count() > 20, "frame {i}: columns of one pixel");
    }
    changes(seen);
}

fn parallel_rays(seen: &Seen) {
    let mut exact = 0;
    for i in seen.frames() {
        let uniform = seen.uniform(i);
        let middle = f64::from(seen.size(i)[0]) / 2.0;
        let at = |axis: usize| {
            f64::from(uniform.ray_direction[axis])
                + middle * f64::from(uniform.ray_direction_dx[axis])
                + middle * f64::from(uniform.ray_direction_dy[axis])
        };
        assert!(
            at(0).abs() < 1e-6 && at(1).abs() < 1e-6,
            "frame {i} looks along an axis"
        );
        for bounds in &seen.bounds {
            let Some(corner) = seen.project(i, bounds[0]) else {
                continue;
            };
            exact += usize::from((corner.x - corner.x.floor() - 0.5).abs() < 1e-3);
        }
    }
    assert!(
        exact > 1000,
        "{exact} left faces on the rays of a column of pixels"
    );
}

fn edge_rays(seen: &Seen) {
    let aimed = seen.bounds.iter().filter(|bounds| {
        corners(bounds)
            .into_iter()
            .filter_map(|corner| seen.project(0, corner))
            .any(|at| {
                let off = (at - at.floor() - 0.5).abs();
                off.min_element() < 2e-3
            })
    });
    assert!(aimed.count() > seen.bounds.len() / 2);
    let flat = seen.objects(|m| m.matrix3.determinant() == 0.0);
    assert_eq!(flat.len(), seen.bounds.len() / 2);
    let visible = seen.visible(0);
    assert!(visible.len() > seen.bounds.len() / 3 && visible.len() < seen.bounds.len());
    assert!(flat.iter().any(|id| visible.contains(id)));
}

fn snapped_grid(seen: &Seen) {
    let small = seen.bounds.iter().filter(|bounds| {
        seen.extent_px(0, bounds)
            .is_some_and(|e| e.max_element() < 4.0)
    });
    assert!(small.count() > seen.bounds.len() / 2);
    assert!(seen.visible(0).len() > seen.bounds.len() / 2);
    changes(seen);
}

fn depth_conventions(seen: &Seen) {
    let other = Seen::new("depth-conventions", DepthConvention::Standard).unwrap();
    for i in seen.frames().step_by(2) {
        let visible = seen.visible(i);
        assert!(visible.len() < seen.bounds.len() * 2 / 3);
        assert_eq!(
            visible,
            seen.visible(i + 1),
            "frame {i}: reversed with a far plane"
        );
        assert_eq!(visible, other.visible(i), "frame {i}: standard");
        assert_eq!(
            visible,
            other.visible(i + 1),
            "frame {i}: standard with a far plane"
        );
    }
}

fn own_bounds(seen: &Seen) {
    for (object, bounds) in seen.scene.source.objects.iter().zip(&seen.bounds) {
        let at = object.world_from_object.translation - seen.world.scene.shape.origin;
        let off = (bounds[0] - (at - 0.5))
            .abs()
            .max((bounds[1] - (at + 0.5)).abs());
        assert!(off.max_element() < 1e-5, "{off}");
    }
    assert!(
        seen.frames()
            .all(|i| seen.visible(i).len() < seen.bounds.len() / 2)
    );
}

fn coplanar(seen: &Seen) {
    let flat = |bounds: &&[DVec3; 2]| (bounds[1] - bounds[0]).min_element() < 1e-4;
    assert_eq!(seen.bounds.iter().filter(flat).count(), seen.bounds.len());
    let floors = seen.objects(|m| m.matrix3.x_axis.x == 5.0);
    let decals = seen.objects(|m| m.matrix3.y_axis.y == 0.0 && m.matrix3.x_axis.x < 5.0);
    // Neither always wins: which is in front is a matter of rounding.
    let shown = |ids: &[u32]| {
        seen.frames()
            .filter(|&i| seen.visible(i).iter().any(|id| ids.contains(id)))
            .count()
    };
    assert!(
        shown(&floors) > 5 && shown(&decals) > 5,
        "{} {}",
        shown(&floors),
        shown(&decals)
    );
}

fn ulp_layers(seen: &Seen) {
    let mut close = 0;
    for (i, image) in seen.images.iter().enumerate() {
        let width = seen.size(i)[0] as usize;
        for (a, b) in (0..image.item.len())
            .zip(1..image.item.len())
            .filter(|(_, b)| b % width > 0)
        {
            let same = image.item[a] == image.item[b];
            let ulps = image.depth[a].to_bits().abs_diff(image.depth[b].to_bits());
            close +=
                usize::from(!same && image.depth[a] > 0.0 && image.depth[b] > 0.0 && ulps < 20_000);
        }
    }
    assert!(close > 200, "{close} borders between layers");
    // Neighbours in a stack: nearer than the resolution of depth at that distance.
    let objects = &seen.scene.source.objects;
    let apart = |pair: &[hroc_preprocess::scene::SourceObject]| {
        let turned = seen.scene.frames[0].camera.orientation * DVec3::NEG_Z;
        turned.dot(pair[1].world_from_object.translation - pair[0].world_from_object.translation)
    };
    let ulps = objects
        .windows(2)
        .filter(|pair| apart(pair) > 0.0 && apart(pair) < 1e-5);
    assert!(ulps.count() > objects.len() * 9 / 10);
}

fn as_the_rooms_at(seen: &Seen, distance: f64) {
    let rooms = Seen::new("rooms", DepthConvention::Reversed).unwrap();
    assert!(seen.scene.frames[0].camera.position.length() > distance);
    for i in seen.frames() {
        assert_eq!(seen.visible(i), rooms.visible(i), "frame {i}");
    }
}

/// The bolts keep their size to a millionth where the scene is as large as the Earth, and what shows is what shows of
/// them by themselves at zero.
fn bolts_on_a_planet(seen: &Seen) {
    use hroc_study::hard_cases::builder::{Builder, ball, cube};
    use hroc_study::hard_cases::planet::{bolts, eyes};
    let scene = seen.world.baked.scene();
    assert!(seen.world.scene.shape.radius > 6e6 && scene.cells.len() > 1);
    let mut at_zero = Builder::new(vec![cube(), ball(3)]);
    let count = scene.objects.len() - 3;
    bolts(&mut at_zero, count, DVec3::ZERO);
    let alone = CaseScene {
        source: at_zero.build(),
        frames: eyes(DVec3::ZERO).map(Into::into).collect(),
        motion: None,
    };
    let near = alone.bake().unwrap();
    let exact = near.scene().object_bounds.iter();
    let mut worst = 0.0f64;
    for (far, near) in scene.object_bounds.iter().zip(exact) {
        let (far, near) = (far.to_native(), near.to_native());
        let extent = |b: &hroc_format::ObjectBounds| {
            let corner = |corner: [f32; 3]| DVec3::from_array(corner.map(f64::from));
            corner(b.max) - corner(b.min)
        };
        let off = (extent(&far) - extent(&near)).abs().max_element();
        worst = worst.max(off / extent(&near).max_element());
    }
    assert!(worst < 3e-6, "off by {worst} of its size");
    let shown = Seen::of(alone, DepthConvention::Reversed).unwrap();
    for i in seen.frames() {
        assert_eq!(seen.visible(i), shown.visible(i), "frame {i}");
        let visible = seen.visible(i).len();
        assert!(
            visible > 30 && visible < count * 2 / 3,
            "{visible} of {count}"
        );
    }
}

fn wide_world(seen: &Seen) {
    let (size, eye) = (seen.world.scene.shape.reach, seen.eye(0));
    assert!(
        size > 35_000.0 && eye.abs().min_element() < 10.0 && eye.length() > 20_000.0,
        "{size} {eye}"
    );
    let spacing = |x: f64| f64::from((x.abs() as f32).next_up() - x.abs() as f32);
    let coarse = seen
        .bounds
        .iter()
        .filter(|[lo, hi]| (hi.x - lo.x) < 50.0 * spacing(hi.x));
    assert!(coarse.count() > 50, "objects of few steps of f32");
    let shown = seen
        .frames()
        .map(|i| seen.visible(i).len())
        .collect::<Vec<_>>();
    assert!(
        shown.iter().filter(|count| **count > 10).count() > 7,
        "{shown:?}"
    );
}

fn odd_transforms(seen: &Seen) {
    let count = |wanted: fn(f64) -> bool| seen.objects(|m| wanted(m.matrix3.determinant())).len();
    assert!(count(|d| d < 0.0) > 20 && count(|d| d == 0.0) > 5 && count(|d| d > 0.0) > 20);
    let longest = |m: &DAffine3| m.matrix3.x_axis.length().max(m.matrix3.z_axis.length());
    assert!(!seen.objects(|m| longest(m) > 1e5).is_empty());
    assert!(
        !seen
            .objects(|m| longest(m) < 1e-5 && longest(m) > 0.0)
            .is_empty()
    );
    let sheared = |m: &DAffine3| {
        m.matrix3
            .x_axis
            .normalize()
            .dot(m.matrix3.y_axis.normalize())
            .abs()
            > 0.1
    };
    assert!(!seen.objects(sheared).is_empty());
}

fn cancelling(seen: &Seen) {
    let scene = seen.world.baked.scene();
    let (mut outside, mut loosest) = (0, 0.0f64);
    for (object, bounds) in scene.objects.iter().zip(&seen.bounds).skip(1) {
        let rows = object
            .world_from_object
            .map(|row| row.map(|x| f64::from(x.to_native())));
        let size = rows.iter().map(|row| row[3].abs()).fold(0.0, f64::max);
        assert!(size < 100.0, "the bake moves the mesh to its zero: {size}");
        let mesh = &scene.meshes[object.mesh.to_native() as usize];
        let first = mesh.first_vertex.to_native() as usize;
        for position in &scene.positions[first..first + mesh.vertex_count.to_native() as usize] {
            let p = DVec3::from_array(position.map(|x| f64::from(x.to_native())));
            let at = DVec3::from_array(
                rows.map(|row| DVec3::new(row[0], row[1], row[2]).dot(p) + row[3]),
            );
            outside += usize::from(!contains(bounds, at));
            // f32 as a shader may compute it, without fusing.
            let rows = rows.map(|row| row.map(|x| x as f32));
            let p = p.as_vec3();
            let rough = DVec3::from_array(
                rows.map(|row| f64::from(row[0] * p.x + row[1] * p.y + row[2] * p.z + row[3])),
            );
            outside += usize::from(!contains(bounds, rough));
            loosest = loosest.max((rough - at).length());
        }
    }
    assert_eq!(outside, 0, "vertices outside their bounds");
    assert!(loosest < 1e-4, "f32 moves vertices by {loosest}");
    let visible = seen.visible(5).len();
    assert!(
        visible > 50 && visible < seen.bounds.len() / 2,
        "{visible} tips over the wall"
    );
}

fn identical_boxes(seen: &Seen) {
    let same = seen
        .bounds
        .iter()
        .filter(|bounds| **bounds == seen.bounds[0])
        .count();
    assert_eq!(same, seen.bounds.len() - 1);
    for bvh in seen.world.baked.scene().bvhs.iter() {
        let mut depth = vec![0; bvh.parents().len()];
        for node in 1..depth.len() {
            depth[node] = depth[bvh.parents()[node] as usize] + 1;
        }
        let deepest = depth.into_iter().max().unwrap();
        assert!(
            deepest <= 2 * seen.bounds.len().ilog2() + 8,
            "{}: {deepest}",
            bvh.split.as_str()
        );
    }
}

/// Largest to smallest object.
fn sizes_range_over(seen: &Seen, ratio: f64) {
    let size = |bounds: &[DVec3; 2]| (bounds[1] - bounds[0]).max_element();
    let source = seen
        .scene
        .source
        .objects
        .iter()
        .map(|o| o.world_from_object.matrix3.x_axis.length());
    let (lo, hi) = source.fold((f64::INFINITY, 0.0f64), |(lo, hi), x| {
        (lo.min(x), hi.max(x))
    });
    assert!(hi / lo > ratio, "{}", hi / lo);
    assert!(seen.bounds.iter().all(|bounds| size(bounds).is_finite()));
}

/// The largest show, and no border of the image cuts them: their clip coordinates overflow where they are multiplied,
/// as clippers do.
fn huge_beside_tiny(seen: &Seen) {
    sizes_range_over(seen, 1e34);
    let (mut inside, mut outside) = (0, 0);
    for i in seen.frames() {
        let uniform = seen.uniform(i);
        for (id, [lo, hi]) in (0u32..).zip(&seen.bounds) {
            if lo.abs().max(hi.abs()).max_element() < 1e19 {
                continue;
            }
            let corners = corners(&[*lo, *hi]);
            // The far plane is infinitely far.
            let planes = uniform.planes[..5].iter().map(|plane| {
                let distance = |corner: &DVec3| {
                    let [x, y, z, w] = plane.map(f64::from);
                    DVec3::new(x, y, z).dot(*corner) + w
                };
                corners
                    .iter()
                    .filter(|corner| distance(corner) > 0.0)
                    .count()
            });
            let within = planes.collect::<Vec<_>>();
            if within.contains(&0) {
                outside += 1;
                continue;
            }
            assert_eq!(within, [8; 5], "frame {i}: object {id} is cut");
            inside += usize::from(seen.visible(i).contains(&id));
        }
    }
    assert!(
        inside > 1 && outside > 4,
        "{inside} times in view, {outside} times not"
    );
}

fn sudden_crowd(seen: &Seen) {
    let counts = seen
        .frames()
        .map(|i| seen.visible(i).len())
        .collect::<Vec<_>>();
    let all = seen.bounds.len() - 1;
    assert!(
        counts.iter().all(|count| *count == 1 || *count == all),
        "{counts:?}"
    );
    assert!(
        counts
            .windows(2)
            .filter(|pair| pair[0] == 1 && pair[1] == all)
            .count()
            >= 2
    );
}

fn still_camera(seen: &Seen) {
    let cameras = seen
        .scene
        .frames
        .iter()
        .map(|frame| frame.camera)
        .collect::<Vec<_>>();
    let still = cameras
        .iter()
        .rev()
        .take_while(|camera| **camera == cameras[cameras.len() - 1])
        .count();
    assert!(still >= 6 && still < cameras.len(), "{still}");
    let last = &seen.images[cameras.len() - 1];
    assert!(
        seen.images[cameras.len() - still..]
            .iter()
            .all(|image| image.depth == last.depth && image.item == last.item)
    );
}

fn about_turns(seen: &Seen) {
    for i in seen.frames().skip(1) {
        assert!(seen.forward(i).dot(seen.forward(i - 1)) < -0.9, "frame {i}");
        let before = seen.visible(i - 1);
        let kept = seen
            .visible(i)
            .into_iter()
            .filter(|id| before.contains(id))
            .count();
        assert!(
            2 * kept < before.len(),
            "frame {i}: {kept} of {} still in view",
            before.len()
        );
    }
}

fn teleports(seen: &Seen) {
    let (mut kept, mut shown) = (0, 0);
    for i in seen.frames().skip(1) {
        let before = seen.visible(i - 1);
        shown += seen.visible(i).len();
        kept += seen
            .visible(i)
            .into_iter()
            .filter(|id| before.contains(id))
            .count();
    }
    assert!(
        shown > 20 && 3 * kept < shown,
        "{kept} of {shown} seen in the frame before"
    );
}

fn two_views(seen: &Seen) {
    assert_eq!(seen.scene.view_count(), 2);
    let frames = &seen.scene.frames;
    for i in seen.frames().skip(1) {
        assert_ne!(frames[i].view, frames[i - 1].view);
        assert_ne!(seen.size(i), seen.size(i - 1));
        assert_ne!(seen.visible(i), seen.visible(i - 1));
        let orthographic = matches!(frames[i].camera.projection, Projection::Orthographic { .. });
        assert_eq!(orthographic, frames[i].view == 1);
    }
}

fn jitter(seen: &Seen) {
    let camera = |i: usize| seen.scene.frames[i].camera;
    for i in seen.frames().skip(1) {
        let still = hroc_runtime::Camera {
            jitter_px: camera(0).jitter_px,
            ..camera(i)
        };
        assert_eq!(
            still,
            camera(0),
            "frame {i}: nothing but the jitter changes"
        );
        assert_ne!(seen.images[i].item, seen.images[i - 1].item, "frame {i}");
    }
    let far = |i: &usize| camera(*i).jitter_px.iter().any(|px| px.abs() > 8.0);
    assert!(seen.frames().filter(far).count() > 1);
}

/// Blended objects never stand in the item buffer, some show through others, some are hidden.
fn glass(seen: &Seen) {
    let blended = with_alpha(seen, AlphaMode::Blended);
    let (mut shown, mut hidden) = (0, 0);
    for i in seen.frames() {
        assert!(
            seen.visible(i).iter().all(|id| !blended.contains(id)),
            "frame {i}"
        );
        shown += seen.images[i].blended_shown.len();
        hidden += blended.len() - seen.images[i].blended_shown.len();
    }
    assert!(
        shown > 100 && hidden > 100,
        "{shown} times a blended object shows, {hidden} times not"
    );
}

/// Through the holes of masked objects others show.
fn fence(seen: &Seen) {
    let masked = with_alpha(seen, AlphaMode::Masked);
    let mut through = 0;
    for i in seen.frames() {
        let visible = seen.visible(i);
        through += masked.iter().filter(|id| visible.contains(id)).count();
    }
    assert!(through > 40, "{through} times a masked object shows");
    let walls = |id: &u32| !masked.contains(id);
    assert!(
        seen.visible(0).iter().any(walls),
        "something behind the first row shows"
    );
}

fn with_alpha(seen: &Seen, alpha: AlphaMode) -> Vec<u32> {
    let objects = seen.scene.source.objects.iter().zip(0..);
    objects
        .filter(|(object, _)| object.alpha == alpha)
        .map(|(_, id)| id)
        .collect()
}

fn moving_objects_show(seen: &Seen) -> usize {
    let first = seen.world.scene.shape.static_count;
    let counts = seen.frames().map(|i| {
        let visible = seen.visible(i);
        visible.iter().filter(|id| **id >= first).count()
    });
    let counts = counts.collect::<Vec<_>>();
    let total = counts.iter().sum();
    assert!(
        total > 2 * counts.len(),
        "moving objects that show, by frame: {counts:?}"
    );
    total
}

/// Some cars show, most are hidden; the still camera sees something else in every frame.
fn crossing(seen: &Seen) {
    let shown = moving_objects_show(seen);
    let cars = seen.world.scene.shape.moving_capacity() as usize;
    assert!(2 * shown < cars * seen.images.len(), "{shown} shown");
    let still = seen.images.len() / 2;
    for i in seen.frames().skip(still + 1) {
        assert_ne!(seen.images[i].item, seen.images[i - 1].item, "frame {i}");
    }
}
