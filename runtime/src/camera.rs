//! Cameras and depth conventions.

use glam::{DMat4, DQuat, DVec3, DVec4};

/// How depth is stored. It decides the clear value, the comparison and the projection matrix.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum DepthConvention {
    /// Near plane 0, far plane 1; nearer is smaller. In perspective nearly all depths are close to 1, where f32 is
    /// coarse: at 60 m with the near plane at 5 mm a step of it is 45 mm, and tests must take for visible
    /// what lies several metres behind what shows. Every method culls less.
    Standard,
    /// Near plane 1, far plane 0; nearer is larger. Keeps f32 precision in the distance: at 60 m tests look a third
    /// of a millimetre behind what shows. Use it in perspective.
    #[default]
    Reversed,
}

impl DepthConvention {
    /// Every convention.
    pub const ALL: [Self; 2] = [Self::Standard, Self::Reversed];

    /// What the depth buffer holds where nothing was drawn.
    pub const fn clear_value(self) -> f32 {
        match self {
            Self::Standard => 1.0,
            Self::Reversed => 0.0,
        }
    }

    /// The comparison of passes that draw geometry: strictly nearer, so that of two surfaces at the
    /// same depth the one drawn first stays.
    pub const fn nearer(self) -> wgpu::CompareFunction {
        match self {
            Self::Standard => wgpu::CompareFunction::Less,
            Self::Reversed => wgpu::CompareFunction::Greater,
        }
    }

    /// The comparison of passes that only ask what lies behind the map.
    pub const fn nearer_or_equal(self) -> wgpu::CompareFunction {
        match self {
            Self::Standard => wgpu::CompareFunction::LessEqual,
            Self::Reversed => wgpu::CompareFunction::GreaterEqual,
        }
    }

    /// The pipeline constants of shaders that import `common/depth` of hroc-shaders, as `common/bounds` and `object` do.
    pub const fn constants(self) -> [(&'static str, f64); 1] {
        match self {
            Self::Standard => [("REVERSED_DEPTH", 0.0)],
            Self::Reversed => [("REVERSED_DEPTH", 1.0)],
        }
    }

    /// `standard` or `reversed`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Standard => "standard",
            Self::Reversed => "reversed",
        }
    }
}

/// The shape of the view volume.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// A pyramid.
    Perspective {
        /// Full vertical field of view, radians, in (0, pi).
        fov_y_rad: f64,
    },
    /// A box.
    Orthographic {
        /// Half the height of the box, world units.
        half_height: f64,
    },
}

/// Where a frame is seen from. Right-handed, y up; the camera looks along its own -z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// In the source's coordinates (not yet relative to the scene's origin): f64 keeps it exact in a
    /// world of any size.
    pub position: DVec3,
    /// Unit quaternion from camera to world axes.
    pub orientation: DQuat,
    /// Perspective or orthographic.
    pub projection: Projection,
    /// Distance of the near plane; above 0.
    pub near: f64,
    /// Distance of the far plane; `None`: infinite (orthographic: just behind the scene).
    pub far: Option<f64>,
    /// By how much the image is shifted, pixels, right and down: the subpixel jitter of temporal
    /// antialiasing. Zero for none.
    pub jitter_px: [f64; 2],
}

/// The orientation of a camera that looks along `direction` with `up` upward in the image. Neither needs to
/// be a unit vector; where they are parallel, any upward direction is taken.
pub fn look_to(direction: DVec3, up: DVec3) -> DQuat {
    let back = -direction.normalize_or(DVec3::NEG_Z);
    let right = up
        .cross(back)
        .try_normalize()
        .unwrap_or_else(|| back.any_orthonormal_vector());
    DQuat::from_mat3(&glam::DMat3::from_cols(right, back.cross(right), back))
}

/// A camera that no frame can be drawn with.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum CameraError {
    /// NaN or infinity in a field.
    #[error("camera {0} is not finite")]
    NotFinite(&'static str),
    /// The quaternion's length is far from 1.
    #[error("camera orientation has length {0}, not 1")]
    Orientation(f64),
    /// Field of view outside (0, pi).
    #[error("camera field of view {0} rad is not between 0 and pi")]
    FieldOfView(f64),
    /// Orthographic volume without height.
    #[error("orthographic half height {0} is not above 0")]
    HalfHeight(f64),
    /// Near or far out of order.
    #[error("camera planes near {near}, far {far} do not satisfy 0 < near < far")]
    Planes {
        /// Near plane distance.
        near: f64,
        /// Far plane distance.
        far: f64,
    },
    /// A render target of zero pixels.
    #[error("render target of {0}x{1} pixels")]
    Size(u32, u32),
}

/// Camera axes and projection coefficients in f64, world relative to an origin.
#[derive(Clone, Copy, Debug)]
pub(crate) struct View {
    pub eye: DVec3,
    pub right: DVec3,
    pub up: DVec3,
    pub forward: DVec3,
    /// Perspective: tangents of half the fields of view. Orthographic: half extents.
    pub half_width: f64,
    pub half_height: f64,
    /// Where the middle of the image lies, right and up, in the units of the halves; 0 without jitter.
    pub middle: [f64; 2],
    pub perspective: bool,
    pub near: f64,
    /// Infinite allowed in perspective.
    pub far: f64,
    /// clip z = z_scale * view depth + z_offset.
    pub z_scale: f64,
    pub z_offset: f64,
}

impl Camera {
    /// `clip_from_world` in f64 for world relative to `origin`, a target of `size` pixels and a scene
    /// that reaches `scene_radius` from `origin` (it places the far plane of an orthographic camera
    /// that has none). A host's own shaders use its f32 rounding.
    ///
    /// # Errors
    /// If the camera or the size is degenerate.
    pub fn clip_from_world(
        &self,
        depth: DepthConvention,
        size: [u32; 2],
        origin: DVec3,
        scene_radius: f64,
    ) -> Result<DMat4, CameraError> {
        Ok(self
            .view(depth, size, origin, scene_radius)?
            .clip_from_world())
    }

    pub(crate) fn view(
        &self,
        depth: DepthConvention,
        size: [u32; 2],
        origin: DVec3,
        scene_radius: f64,
    ) -> Result<View, CameraError> {
        if size[0] == 0 || size[1] == 0 {
            return Err(CameraError::Size(size[0], size[1]));
        }
        for (name, finite) in [
            ("position", self.position.is_finite()),
            ("orientation", self.orientation.is_finite()),
            ("near plane", self.near.is_finite()),
            ("far plane", self.far.is_none_or(f64::is_finite)),
            ("jitter", self.jitter_px.iter().all(|px| px.is_finite())),
        ] {
            if !finite {
                return Err(CameraError::NotFinite(name));
            }
        }
        let length = self.orientation.length();
        if (length - 1.0).abs() > 1e-3 {
            return Err(CameraError::Orientation(length));
        }
        let orientation = self.orientation.normalize();
        let eye = self.position - origin;
        let aspect = f64::from(size[0]) / f64::from(size[1]);
        let (perspective, half_height) = match self.projection {
            Projection::Perspective { fov_y_rad } => {
                if !(fov_y_rad > 0.0 && fov_y_rad < std::f64::consts::PI) {
                    return Err(CameraError::FieldOfView(fov_y_rad));
                }
                (true, (0.5 * fov_y_rad).tan())
            }
            Projection::Orthographic { half_height } => {
                if !(half_height > 0.0 && half_height.is_finite()) {
                    return Err(CameraError::HalfHeight(half_height));
                }
                (false, half_height)
            }
        };
        let near = self.near;
        let far = match self.far {
            Some(far) => far,
            None if perspective => f64::INFINITY,
            None => (near + 1.0).max(2.0 * (near + eye.length() + scene_radius)),
        };
        if !(near > 0.0 && near < far) {
            return Err(CameraError::Planes { near, far });
        }
        // Standard perspective: D = z_scale + z_offset / w with D(near) = 0, D(far) = 1; orthographic:
        // D = z_scale * depth + z_offset. Reversed swaps the two ends.
        let (z_scale, z_offset) = match (perspective, depth) {
            (true, DepthConvention::Standard) if far.is_infinite() => (1.0, -near),
            (true, DepthConvention::Standard) => (far / (far - near), -far * near / (far - near)),
            (true, DepthConvention::Reversed) if far.is_infinite() => (0.0, near),
            (true, DepthConvention::Reversed) => (-near / (far - near), far * near / (far - near)),
            (false, DepthConvention::Standard) => (1.0 / (far - near), -near / (far - near)),
            (false, DepthConvention::Reversed) => (-1.0 / (far - near), far / (far - near)),
        };
        Ok(View {
            eye,
            right: orientation * DVec3::X,
            up: orientation * DVec3::Y,
            forward: orientation * DVec3::NEG_Z,
            half_width: half_height * aspect,
            half_height,
            // An image shifted to the right shows what lies to the left.
            middle: [
                -self.jitter_px[0] * 2.0 * half_height * aspect / f64::from(size[0]),
                self.jitter_px[1] * 2.0 * half_height / f64::from(size[1]),
            ],
            perspective,
            near,
            far,
            z_scale,
            z_offset,
        })
    }
}

impl View {
    pub(crate) fn clip_from_world(&self) -> DMat4 {
        let depth = self.forward.extend(-self.forward.dot(self.eye));
        let z = depth * self.z_scale + DVec4::W * self.z_offset;
        let w = if self.perspective { depth } else { DVec4::W };
        let row = |axis: DVec3, half: f64, middle: f64| {
            axis.extend(-axis.dot(self.eye)) / half - w * (middle / half)
        };
        let [x, y] = self.middle;
        DMat4::from_cols(
            row(self.right, self.half_width, x),
            row(self.up, self.half_height, y),
            z,
            w,
        )
        .transpose()
    }

    /// From the view's axis to the middle of the image, at unit depth or in world.
    pub(crate) fn shift(&self) -> DVec3 {
        self.right * self.middle[0] + self.up * self.middle[1]
    }

    /// How far the image reaches from the view's axis, right and up, in the units of the halves.
    pub(crate) fn reach_across(&self) -> [f64; 2] {
        [
            self.half_width + self.middle[0].abs(),
            self.half_height + self.middle[1].abs(),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(projection: Projection, far: Option<f64>) -> Camera {
        Camera {
            position: DVec3::new(1.0, 2.0, 3.0),
            orientation: DQuat::from_euler(glam::EulerRot::YXZ, 0.3, -0.2, 0.1),
            projection,
            near: 0.5,
            far,
            jitter_px: [0.0; 2],
        }
    }

    #[test]
    fn jitter_shifts_the_image() {
        let size = [640, 360];
        for projection in [
            Projection::Perspective { fov_y_rad: 1.0 },
            Projection::Orthographic { half_height: 4.0 },
        ] {
            let still = camera(projection, None);
            let shifted = Camera {
                jitter_px: [0.25, -3.0],
                ..still
            };
            let at = |camera: Camera| {
                let depth = DepthConvention::Reversed;
                let clip = camera
                    .clip_from_world(depth, size, DVec3::ZERO, 10.0)
                    .unwrap();
                let p = clip * DVec4::new(-0.5, 1.0, -2.0, 1.0);
                [p.x / p.w * 320.0, -p.y / p.w * 180.0]
            };
            let (a, b) = (at(still), at(shifted));
            assert!((b[0] - a[0] - 0.25).abs() < 1e-9 && (b[1] - a[1] + 3.0).abs() < 1e-9);
        }
    }

    #[test]
    fn the_planes_land_on_their_depths() {
        for depth in DepthConvention::ALL {
            for projection in [
                Projection::Perspective { fov_y_rad: 1.0 },
                Projection::Orthographic { half_height: 4.0 },
            ] {
                let camera = camera(projection, Some(80.0));
                let clip = camera
                    .clip_from_world(depth, [640, 360], DVec3::ZERO, 10.0)
                    .unwrap();
                let forward = camera.orientation * DVec3::NEG_Z;
                for (distance, standard) in [(0.5, 0.0), (80.0, 1.0)] {
                    let p = clip * (camera.position + forward * distance).extend(1.0);
                    let expected = if depth == DepthConvention::Standard {
                        standard
                    } else {
                        1.0 - standard
                    };
                    assert!(
                        (p.z / p.w - expected).abs() < 1e-12,
                        "{depth:?} {projection:?} {distance}: {}",
                        p.z / p.w
                    );
                    assert!(p.x.abs() < 1e-12 && p.y.abs() < 1e-12);
                }
            }
        }
    }

    #[test]
    fn degenerate_cameras_are_refused() {
        let good = camera(Projection::Perspective { fov_y_rad: 1.0 }, None);
        let view = |c: Camera, size| {
            c.view(DepthConvention::Reversed, size, DVec3::ZERO, 1.0)
                .err()
        };
        assert_eq!(view(good, [1, 1]), None);
        assert_eq!(view(good, [0, 4]), Some(CameraError::Size(0, 4)));
        assert!(matches!(
            view(Camera { near: 0.0, ..good }, [4, 4]),
            Some(CameraError::Planes { .. })
        ));
        assert!(matches!(
            view(
                Camera {
                    near: f64::NAN,
                    ..good
                },
                [4, 4]
            ),
            Some(CameraError::NotFinite(_))
        ));
        assert!(matches!(
            view(
                Camera {
                    far: Some(0.1),
                    ..good
                },
                [4, 4]
            ),
            Some(CameraError::Planes { .. })
        ));
        let wide = Projection::Perspective { fov_y_rad: 3.2 };
        assert!(matches!(
            view(
                Camera {
                    projection: wide,
                    ..good
                },
                [4, 4]
            ),
            Some(CameraError::FieldOfView(_))
        ));
        assert!(matches!(
            view(
                Camera {
                    orientation: DQuat::from_xyzw(0.0, 0.0, 0.0, 2.0),
                    ..good
                },
                [4, 4]
            ),
            Some(CameraError::Orientation(_))
        ));
    }
}
