//! What cases are built from: seeded numbers, two meshes, boxes, cameras.

use glam::{DAffine3, DQuat, DVec3};
use hroc_preprocess::scene::{AlphaMode, SourceFile, SourceMesh, SourceObject, SourceScene};
use hroc_runtime::camera::look_to;
use hroc_runtime::{Camera, Projection};

/// splitmix64: small, seeded, the same everywhere.
#[derive(Clone, Debug)]
pub struct Rng(pub u64);

impl Rng {
    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Uniform in `lo..hi`.
    pub fn within(&mut self, lo: f64, hi: f64) -> f64 {
        lo + (hi - lo) * (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Between `lo` and `hi`, every order of magnitude as likely as the next.
    pub fn magnitude(&mut self, lo: f64, hi: f64) -> f64 {
        self.within(lo.ln(), hi.ln()).exp()
    }

    /// A point of the cube `-r..r`.
    pub fn point(&mut self, r: f64) -> DVec3 {
        DVec3::new(self.within(-r, r), self.within(-r, r), self.within(-r, r))
    }

    /// A random rotation.
    pub fn rotation(&mut self) -> DQuat {
        DQuat::from_euler(
            glam::EulerRot::YXZ,
            self.within(-3.2, 3.2),
            self.within(-1.5, 1.5),
            self.within(-3.2, 3.2),
        )
    }
}

/// The cube -1..1, twelve triangles, eight vertices.
pub fn cube() -> SourceMesh {
    let positions = (0..8)
        .map(|i| [0, 1, 2].map(|axis| if i >> axis & 1 == 1 { 1.0 } else { -1.0 }))
        .collect();
    let faces: [[u32; 4]; 6] = [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
    ];
    let indices = faces
        .iter()
        .flat_map(|f| [f[0], f[1], f[2], f[0], f[2], f[3]])
        .collect();
    SourceMesh {
        positions,
        indices,
        ..Default::default()
    }
}

/// A ball of about `4 * n * n` triangles and radius 1.
pub fn ball(n: u32) -> SourceMesh {
    let mut positions = Vec::new();
    for row in 0..=n {
        let polar = std::f32::consts::PI * row as f32 / n as f32;
        for column in 0..=2 * n {
            let turn = std::f32::consts::PI * column as f32 / n as f32;
            positions.push([
                polar.sin() * turn.cos(),
                polar.cos(),
                polar.sin() * turn.sin(),
            ]);
        }
    }
    let stride = 2 * n + 1;
    let quad = |row: u32, column: u32| {
        let a = row * stride + column;
        [a, a + 1, a + stride, a + 1, a + stride + 1, a + stride]
    };
    let indices = (0..n)
        .flat_map(|row| (0..2 * n).flat_map(move |column| quad(row, column)))
        .collect();
    SourceMesh {
        positions,
        indices,
        ..Default::default()
    }
}

/// Collects objects into a source scene.
#[derive(Debug, Default)]
pub struct Builder(SourceScene);

impl Builder {
    /// A builder with `meshes`.
    pub fn new(meshes: Vec<SourceMesh>) -> Self {
        let files = vec![SourceFile {
            name: "generated".to_owned(),
            hash: 0,
        }];
        Self(SourceScene {
            name: "generated".to_owned(),
            files,
            meshes,
            ..Default::default()
        })
    }

    /// A builder whose mesh 0 is the cube, for [`boxed`](Self::boxed).
    pub fn of_boxes() -> Self {
        Self::new(vec![cube()])
    }

    /// Adds an object.
    pub fn object(&mut self, mesh: usize, world_from_object: DAffine3) {
        let node = self.0.objects.len();
        let base_color = [0.4 + 0.05 * (node % 10) as f32, 0.6, 0.8, 1.0];
        self.0.objects.push(SourceObject {
            mesh,
            world_from_object,
            base_color,
            alpha: Default::default(),
            double_sided: false,
            name: String::new(),
            file: 0,
            node,
            primitive: 0,
        });
    }

    /// How the alpha of the object added last is used.
    pub fn with_alpha(&mut self, alpha: AlphaMode) {
        if let Some(object) = self.0.objects.last_mut() {
            object.alpha = alpha;
        }
    }

    /// Adds an object of this scale, rotation and place.
    pub fn placed(&mut self, mesh: usize, scale: DVec3, rotation: DQuat, at: DVec3) {
        self.object(
            mesh,
            DAffine3::from_scale_rotation_translation(scale, rotation, at),
        );
    }

    /// Adds mesh 0, the cube, as an axis-aligned box with these half extents.
    pub fn boxed(&mut self, center: DVec3, half: DVec3) {
        self.placed(0, half, DQuat::IDENTITY, center);
    }

    /// Adds mesh 0, the cube, as the axis-aligned box from `lo` to `hi`.
    pub fn span(&mut self, lo: [f64; 3], hi: [f64; 3]) {
        let (lo, hi) = (DVec3::from_array(lo), DVec3::from_array(hi));
        self.boxed((lo + hi) / 2.0, (hi - lo) / 2.0);
    }

    /// The scene.
    pub fn build(self) -> SourceScene {
        self.0
    }
}

/// A camera at `position` looking at `target`.
pub fn looking(position: DVec3, target: DVec3) -> Camera {
    let orientation = look_to(target - position, DVec3::Y);
    Camera {
        position,
        orientation,
        projection: Projection::Perspective { fov_y_rad: 1.0 },
        near: 0.05,
        far: None,
        jitter_px: [0.0; 2],
    }
}

/// Length in world that a pixel has at this distance from a [`looking`] camera, `height` pixels high.
pub fn pixel_at(distance: f64, height: u32) -> f64 {
    2.0 * 0.5f64.tan() * distance / f64::from(height)
}

/// A half turn on the spot in `frames` frames.
pub fn turning(position: DVec3, frames: usize) -> Vec<Camera> {
    (0..frames)
        .map(|i| {
            let angle = std::f64::consts::PI * i as f64 / frames as f64;
            looking(
                position,
                position + DVec3::new(angle.cos(), 0.05, angle.sin()),
            )
        })
        .collect()
}

/// An orthographic camera along -z whose pixels are the unit squares of the plane: the one in the left bottom
/// corner of an image of `size` begins at `(left, bottom)`.
pub fn unit_pixels(left: f64, bottom: f64, size: [u32; 2]) -> Camera {
    let [width, height] = size.map(f64::from);
    Camera {
        position: DVec3::new(left + width / 2.0, bottom + height / 2.0, 10.0),
        orientation: DQuat::IDENTITY,
        projection: Projection::Orthographic {
            half_height: height / 2.0,
        },
        near: 0.5,
        far: Some(100.0),
        jitter_px: [0.0; 2],
    }
}
