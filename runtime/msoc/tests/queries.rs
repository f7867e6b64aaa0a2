//! Boxes, spheres, traversal and occluder choice, against what they are made of.

use hroc_msoc::{
    Aabb, Candidate, Depth, Hierarchy, IDENTITY, Isa, Mode, Msoc, Node, Occluder, OccluderChoice,
    OccluderMesh, Options, Rect, Visibility, generate,
};

/// At the origin, looking along -z; 90 degrees, reversed infinite, near 0.1.
const PERSPECTIVE: [[f32; 4]; 4] = [
    [1.0, 0.0, 0.0, 0.0],
    [0.0, 1.0, 0.0, 0.0],
    [0.0, 0.0, 0.0, -1.0],
    [0.0, 0.0, 0.1, 0.0],
];

/// Looks along -z at -10..10, depth 0 to 100, reversed.
const ORTHOGRAPHIC: [[f32; 4]; 4] = [
    [0.1, 0.0, 0.0, 0.0],
    [0.0, 0.1, 0.0, 0.0],
    [0.0, 0.0, 0.01, 0.0],
    [0.0, 0.0, 1.0, 1.0],
];

fn cube(centre: [f32; 3], half: f32) -> Aabb {
    Aabb {
        min: centre.map(|c| c - half),
        max: centre.map(|c| c + half),
    }
}

/// A square facing the eye.
fn wall(z: f32, half: f32) -> ([[f32; 3]; 4], [[u32; 3]; 2]) {
    let corners = [
        [-half, -half, z],
        [half, -half, z],
        [half, half, z],
        [-half, half, z],
    ];
    (corners, [[0, 1, 2], [0, 2, 3]])
}

fn with_wall(matrix: &[[f32; 4]; 4], options: Options, z: f32, half: f32) -> Msoc {
    let mut msoc = Msoc::new([256, 256], options).unwrap();
    let (positions, indices) = wall(z, half);
    let mesh = OccluderMesh {
        positions: &positions,
        indices: &indices,
    };
    let occluder = Occluder {
        mesh,
        world_from_object: IDENTITY,
    };
    msoc.rasterize(matrix, &[occluder]).unwrap();
    msoc
}

#[test]
fn boxes_and_spheres_in_front_of_beside_and_behind_a_wall() {
    use Visibility::*;
    let views = [
        (PERSPECTIVE, Depth::InverseW),
        (PERSPECTIVE, Depth::Reversed),
        (ORTHOGRAPHIC, Depth::Reversed),
    ];
    for (matrix, depth) in views {
        for mode in [Mode::Paper, Mode::INNER] {
            let options = Options {
                mode,
                depth,
                ..Options::default()
            };
            let msoc = with_wall(&matrix, options, -5.0, 3.0);
            for (centre, half, expected) in [
                ([1.0, -0.5, -7.0], 0.3, Occluded),
                ([1.0, -0.5, -7.0], 2.5, Visible),
                ([1.0, 0.5, -4.0], 0.3, Visible),
                ([4.0, 0.0, -4.8], 0.3, Visible),
                ([0.0, 0.0, 0.0], 0.5, Visible),
                ([30.0, 0.0, -6.0], 0.5, Outside),
                ([0.0, 0.0, 3.0], 1.0, Outside),
            ] {
                let seen = msoc.visible(&matrix, &[cube(centre, half)]);
                assert_eq!(seen, if expected == Visible { vec![0] } else { vec![] });
                let what = format!("{depth:?} {mode:?} {centre:?} {half}");
                assert_eq!(
                    msoc.query_box(&matrix, &cube(centre, half)),
                    expected,
                    "{what}"
                );
                assert_eq!(
                    msoc.query_sphere(&matrix, centre, half),
                    expected,
                    "{what}, sphere"
                );
            }
        }
    }
}

#[test]
fn an_occluder_does_not_hide_itself() {
    for mode in [Mode::Paper, Mode::INNER] {
        let msoc = with_wall(
            &PERSPECTIVE,
            Options {
                mode,
                ..Options::default()
            },
            -5.0,
            3.0,
        );
        let flat = Aabb {
            min: [-3.0, -3.0, -5.0],
            max: [3.0, 3.0, -5.0],
        };
        assert_eq!(msoc.query_box(&PERSPECTIVE, &flat), Visibility::Visible);
    }
}

#[test]
fn spheres_are_no_larger_than_their_boxes() {
    let mut random = fastrand::Rng::with_seed(2);
    let msoc = with_wall(&PERSPECTIVE, Options::default(), -5.0, 4.0);
    let mut only_boxes_seen = 0;
    for _ in 0..20_000 {
        let centre = [
            random.f32() * 16.0 - 8.0,
            random.f32() * 16.0 - 8.0,
            -12.0 * random.f32(),
        ];
        let radius = 0.02 + 2.0 * random.f32();
        let sphere = msoc.query_sphere(&PERSPECTIVE, centre, radius);
        let cube = msoc.query_box(&PERSPECTIVE, &cube(centre, radius));
        assert!(
            cube != Visibility::Occluded || sphere == Visibility::Occluded,
            "{centre:?} {radius}"
        );
        only_boxes_seen +=
            usize::from(cube == Visibility::Visible && sphere == Visibility::Occluded);
    }
    assert!(only_boxes_seen > 100, "{only_boxes_seen}");
}

#[test]
fn a_bad_index_is_refused() {
    let mut msoc = Msoc::new([64, 64], Options::default()).unwrap();
    let (positions, _) = wall(-5.0, 1.0);
    let mesh = OccluderMesh {
        positions: &positions,
        indices: &[[0, 1, 2], [0, 4, 1]],
    };
    let occluder = Occluder {
        mesh,
        world_from_object: IDENTITY,
    };
    let error = msoc.rasterize(&PERSPECTIVE, &[occluder]).unwrap_err();
    assert_eq!((error.triangle, error.index, error.vertices), (1, 4, 4));
}

/// Walls one behind the other, the nearest last, under a chain of nodes: node 2i is object i, node 2i + 1 has it and
/// the next.
struct Chain(Vec<Aabb>);

impl Hierarchy for Chain {
    fn root(&self) -> Option<u32> {
        (!self.0.is_empty()).then_some(if self.0.len() == 1 { 0 } else { 1 })
    }
    fn node(&self, node: u32) -> Node {
        let index = node / 2;
        let last = self.0.len() as u32 - 2;
        match node % 2 {
            0 => Node::Object(index),
            _ if index == last => Node::Children([2 * index, 2 * index + 2]),
            _ => Node::Children([2 * index, 2 * index + 3]),
        }
    }
    fn bounds(&self, node: u32) -> Aabb {
        let index = (node / 2) as usize;
        let end = if node.is_multiple_of(2) {
            index + 1
        } else {
            self.0.len()
        };
        let first = self.0[index];
        self.0[index..end].iter().fold(first, |all, one| Aabb {
            min: [0, 1, 2].map(|k| all.min[k].min(one.min[k])),
            max: [0, 1, 2].map(|k| all.max[k].max(one.max[k])),
        })
    }
}

#[test]
fn traversal_finds_the_nearest_wall_and_stops_there() {
    let depths = [-20.0, -10.0, -40.0, -4.0, -30.0, -60.0];
    let walls = depths.map(|z| wall(z, 3.5));
    let tree = Chain(
        depths
            .map(|z| Aabb {
                min: [-3.5, -3.5, z],
                max: [3.5, 3.5, z],
            })
            .into(),
    );
    let occluder = |object: u32| {
        let (positions, indices) = &walls[object as usize];
        Some(Occluder {
            mesh: OccluderMesh { positions, indices },
            world_from_object: IDENTITY,
        })
    };
    let mut msoc = Msoc::new([256, 256], Options::default()).unwrap();
    let found = msoc.traverse(&PERSPECTIVE, &tree, None, occluder).unwrap();
    assert_eq!(
        (found.visible, found.occluders, found.out_of_time),
        (vec![3], 1, false)
    );
    // Without time nothing hides, but the order stays.
    msoc.clear();
    let found = msoc
        .traverse(
            &PERSPECTIVE,
            &tree,
            Some(std::time::Duration::ZERO),
            occluder,
        )
        .unwrap();
    assert_eq!(
        (found.visible, found.occluders, found.out_of_time),
        (vec![3, 1, 0, 4, 2, 5], 0, true)
    );
    let nothing = msoc
        .traverse(&PERSPECTIVE, &Chain(Vec::new()), None, |_| None)
        .unwrap();
    assert_eq!((nothing.visible.len(), nothing.queries), (0, 0));
}

#[test]
fn occluders_are_the_large_and_cheap_ones_from_front_to_back() {
    let msoc = Msoc::new([256, 256], Options::default()).unwrap();
    let candidate = |object, z, half, triangles| Candidate {
        object,
        bounds: cube([0.0, 0.0, z], half),
        triangles,
    };
    let candidates = [
        candidate(0, -50.0, 20.0, 12),
        candidate(1, -20.0, 5.0, 12),
        candidate(2, -10.0, 0.1, 12),
        candidate(3, -10.0, 5.0, 5000),
        candidate(4, 30.0, 5.0, 12),
        candidate(5, 0.0, 1.0, 12),
    ];
    let choice = OccluderChoice {
        least_area_px: 400.0,
        triangles: 1000,
    };
    assert_eq!(
        msoc.choose_occluders(&PERSPECTIVE, candidates, &choice),
        [5, 1, 0]
    );
}

/// Of every size and place among the tiles, from one pixel to the whole image.
#[test]
fn a_rectangle_is_hidden_where_each_of_its_pixels_is() {
    let size = [150_u32, 70];
    let mut random = fastrand::Rng::with_seed(5);
    for isa in Isa::available() {
        let (mut counts, mut answers) = ([0; 2], Vec::new());
        for seed in 0..20 {
            let options = Options {
                near: 0.5,
                isa: Some(isa),
                ..Options::default()
            };
            let mut msoc = Msoc::new(size, options).unwrap();
            msoc.rasterize_clip(&generate::triangles(seed, 30, size, 0.5));
            let mut query = |x: [u32; 2], y: [u32; 2]| {
                let pixels = || (y[0]..=y[1]).flat_map(|y| (x[0]..=x[1]).map(move |x| [x, y]));
                let depths = pixels().map(|pixel| msoc.depth(pixel));
                let least = depths.fold(f32::INFINITY, f32::min);
                let ndc = |pixel: f32, axis: usize| pixel / size[axis] as f32 * 2.0 - 1.0;
                // A little more and a little less than the depth of the pixel that shows first.
                for (factor, expected) in
                    [(1.01, Visibility::Visible), (0.99, Visibility::Occluded)]
                {
                    let rect = Rect {
                        min: [ndc(x[0] as f32 + 0.1, 0), -ndc(y[1] as f32 + 0.9, 1)],
                        max: [ndc(x[1] as f32 + 0.9, 0), -ndc(y[0] as f32 + 0.1, 1)],
                        nearest_w: 1.0 / (least.max(1e-3) * factor),
                    };
                    let expected = if least == 0.0 {
                        Visibility::Visible
                    } else {
                        expected
                    };
                    assert_eq!(msoc.query_rect(&rect), expected, "{isa:?} {x:?} {y:?}");
                    msoc.query_rects(&[rect], &mut answers);
                    assert_eq!(answers, [expected], "{isa:?} {x:?} {y:?}");
                    counts[usize::from(expected == Visibility::Occluded)] += 1;
                }
            };
            for _ in 0..300 {
                let mut ends = |size: u32| {
                    let first = random.u32(..size);
                    let most = if random.bool() {
                        size
                    } else {
                        size.min(first + 24)
                    };
                    [first, random.u32(first..most)]
                };
                query(ends(size[0]), ends(size[1]));
            }
        }
        assert!(counts.iter().all(|&count| count > 1000), "{counts:?}");
    }
}
