//! Animations (section 3.11), as far as they move nodes. They are read from the JSON apart from the rest:
//! the `gltf` crate refuses files whose channels have targets that it does not know.

use super::accessor::Accessors;
use super::document::{Document, Transform};
use super::{ImportError, Result};
use glam::DQuat;
use gltf::json::accessor::Type;
use gltf::json::{Accessor, Index};
use serde::Deserialize;

/// More keyframes than this are refused.
const MAX_KEYFRAMES: usize = 1 << 20;

/// An animation as it stands in the file.
#[derive(Deserialize)]
pub(super) struct Animation {
    #[serde(default)]
    name: String,
    #[serde(default)]
    channels: Vec<Channel>,
    #[serde(default)]
    samplers: Vec<JsonSampler>,
}

#[derive(Deserialize)]
struct Channel {
    sampler: usize,
    target: Target,
}

#[derive(Deserialize)]
struct Target {
    node: Option<usize>,
    path: String,
}

#[derive(Deserialize)]
struct JsonSampler {
    input: Index<Accessor>,
    output: Index<Accessor>,
    interpolation: Option<String>,
}

/// What of a node a sampler moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Property {
    Translation,
    Rotation,
    Scale,
}

impl Property {
    fn of(path: &str) -> Option<Self> {
        match path {
            "translation" => Some(Self::Translation),
            "rotation" => Some(Self::Rotation),
            "scale" => Some(Self::Scale),
            // Weights and what extensions name move no node.
            _ => None,
        }
    }
}

/// All animations of the document, whose JSON is `json`.
pub(super) fn read(document: &Document, json: &[u8]) -> Result<Vec<Animation>> {
    #[derive(Deserialize)]
    struct Animations {
        #[serde(default)]
        animations: Vec<Animation>,
    }
    let read: Animations = document
        .read(json)
        .map_err(|error| ImportError::malformed(format!("its animations: {error}")))?;
    Ok(read.animations)
}

impl Animation {
    pub(super) fn name(&self) -> &str {
        &self.name
    }

    /// For error messages.
    pub(super) fn place(&self) -> String {
        format!("animation {:?}", self.name)
    }

    /// Channels that move a node of the chain: its place there, the property, the sampler.
    fn moving(&self, chain: &[usize]) -> impl Iterator<Item = (usize, Property, usize)> {
        self.channels.iter().filter_map(|channel| {
            let node = channel.target.node?;
            let place = chain.iter().position(|&other| other == node)?;
            Some((place, Property::of(&channel.target.path)?, channel.sampler))
        })
    }

    /// Whether it moves any of the nodes.
    pub(super) fn moves(&self, chain: &[usize]) -> bool {
        self.moving(chain).next().is_some()
    }

    /// The samplers that move nodes of the chain, with the node's place there.
    pub(super) fn samplers(
        &self,
        accessors: &Accessors<'_>,
        chain: &[usize],
    ) -> Result<Vec<(usize, Sampler)>> {
        let open = |(place, property, index): (usize, Property, usize)| {
            let sampler = self.samplers.get(index).ok_or_else(|| {
                ImportError::malformed(format!("refers to sampler {index}, which does not exist"))
            })?;
            let sampler = Sampler::open(accessors, sampler, property)
                .map_err(|error| error.within(format_args!("sampler {index}")))?;
            Ok((place, sampler))
        };
        self.moving(chain).map(open).collect()
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Interpolation {
    Step,
    Linear,
    CubicSpline,
}

/// The way of one property through time.
pub(super) struct Sampler {
    property: Property,
    interpolation: Interpolation,
    /// Seconds, ascending, at least one.
    times: Vec<f64>,
    /// One per time; for splines three: tangent in, value, tangent out. Lane 3 is that of rotations.
    values: Vec<[f64; 4]>,
}

impl Sampler {
    fn open(accessors: &Accessors<'_>, json: &JsonSampler, property: Property) -> Result<Self> {
        let interpolation = match json.interpolation.as_deref() {
            None | Some("LINEAR") => Interpolation::Linear,
            Some("STEP") => Interpolation::Step,
            Some("CUBICSPLINE") => Interpolation::CubicSpline,
            Some(other) => {
                return Err(ImportError::malformed(format!(
                    "has the unknown interpolation {other:?}"
                )));
            }
        };
        let input = accessors.open(json.input, Type::Scalar)?;
        let count = input.count();
        if count == 0 || count > MAX_KEYFRAMES {
            return Err(ImportError::malformed(format!(
                "has {count} keyframes, not 1 to {MAX_KEYFRAMES}"
            )));
        }
        let times: Vec<f64> = (0..count)
            .map(|i| f64::from(input.floats::<1>(i)[0]))
            .collect();
        if !times.iter().all(|t| t.is_finite()) || !times.is_sorted_by(|a, b| a < b) {
            return Err(ImportError::malformed("its times do not ascend"));
        }
        let per_time = match interpolation {
            Interpolation::CubicSpline => 3,
            _ => 1,
        };
        let shape = match property {
            Property::Rotation => Type::Vec4,
            _ => Type::Vec3,
        };
        let output = accessors.open(json.output, shape)?;
        if output.count() != per_time * count {
            return Err(ImportError::malformed(format!(
                "has {} values for {count} keyframes, not {}",
                output.count(),
                per_time * count
            )));
        }
        let value = |i: usize| match property {
            Property::Rotation => output.floats::<4>(i).map(f64::from),
            _ => {
                let [x, y, z] = output.floats::<3>(i).map(f64::from);
                [x, y, z, 0.0]
            }
        };
        Ok(Self {
            property,
            interpolation,
            times,
            values: (0..output.count()).map(value).collect(),
        })
    }

    /// When its keyframes are.
    pub(super) fn times(&self) -> impl Iterator<Item = f64> {
        self.times.iter().copied()
    }

    /// Sets the property to its value at `t`, or right before it where it jumps there.
    pub(super) fn apply(&self, node: &mut Transform, t: f64, before: bool) {
        let value = self.at(t, before);
        let [x, y, z, _] = value;
        match self.property {
            Property::Translation => node.translation = Some([x, y, z]),
            Property::Scale => node.scale = Some([x, y, z]),
            Property::Rotation => node.rotation = Some(value),
        }
    }

    /// Before the first keyframe the first value, after the last one the last.
    fn at(&self, t: f64, before: bool) -> [f64; 4] {
        let last = self.times.len() - 1;
        let is_past = |&time: &f64| if before { time < t } else { time <= t };
        let passed = self.times.partition_point(is_past);
        let value = |i: usize| match self.interpolation {
            Interpolation::CubicSpline => self.values[3 * i + 1],
            _ => self.values[i],
        };
        if passed == 0 {
            return value(0);
        }
        let from = passed - 1;
        if from == last {
            return value(last);
        }
        let (a, b) = (value(from), value(from + 1));
        let duration = self.times[from + 1] - self.times[from];
        let s = ((t - self.times[from]) / duration).min(1.0);
        match self.interpolation {
            Interpolation::Step => a,
            Interpolation::Linear if self.property == Property::Rotation => {
                let [a, b] = [a, b].map(unit);
                a.slerp(b, s).to_array()
            }
            Interpolation::Linear => std::array::from_fn(|lane| a[lane] + (b[lane] - a[lane]) * s),
            Interpolation::CubicSpline => {
                let (leave, arrive) = (self.values[3 * from + 2], self.values[3 * from + 3]);
                let (s2, s3) = (s * s, s * s * s);
                std::array::from_fn(|lane| {
                    (2.0 * s3 - 3.0 * s2 + 1.0) * a[lane]
                        + duration * (s3 - 2.0 * s2 + s) * leave[lane]
                        + (3.0 * s2 - 2.0 * s3) * b[lane]
                        + duration * (s3 - s2) * arrive[lane]
                })
            }
        }
    }
}

/// A quaternion of unit length; a zero one rotates nothing.
fn unit(q: [f64; 4]) -> DQuat {
    let q = DQuat::from_array(q);
    if q.length_squared() > 0.0 {
        q.normalize()
    } else {
        DQuat::IDENTITY
    }
}
