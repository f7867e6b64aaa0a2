//! A scene before its meshes are cut: objects of certain kinds at their places. How fine each kind is cut
//! follows from how many objects there are of it and from what the whole scene should have.

use glam::{DQuat, DVec3};

use super::patch::Grain;
use super::trig::rounded;
use super::{Group, Material, Mesh, Model, Part, Shape};

/// Charts that are tried to meet the number of vertices.
const CHARTS: [usize; 10] = [1, 2, 3, 4, 5, 6, 8, 12, 20, 64];

/// What several objects are: one shape, or as many as there are variants, cut equally fine.
pub struct Kind {
    name: &'static str,
    material: usize,
    /// Triangles wanted in relation to other kinds.
    weight: f64,
    variants: usize,
    shape: Box<dyn Fn(Grain, usize) -> Shape>,
}

/// What the finished scene should have.
#[derive(Clone, Copy, Debug)]
pub struct Goal {
    /// Of all objects.
    pub triangles: f64,
    /// Of all objects.
    pub vertices: f64,
    /// Every object gets a mesh of its own, in its true size, rather than one that its kind shares.
    pub own_meshes: bool,
}

/// A scene that grows until it has all its objects. Lengths in metres, y up.
pub struct Sketch {
    name: String,
    materials: Vec<Material>,
    kinds: Vec<Kind>,
    /// Their parts refer to `uses` by number.
    groups: Vec<Group>,
    /// Kind and variant of each part.
    uses: Vec<(usize, usize)>,
    remaining: usize,
}

impl Sketch {
    /// An empty scene that will take `objects` objects.
    pub fn new(name: String, objects: usize) -> Self {
        Self {
            name,
            materials: Vec::new(),
            kinds: Vec::new(),
            groups: Vec::new(),
            uses: Vec::new(),
            remaining: objects,
        }
    }

    /// Whether all objects are there; what is added after that is left out.
    pub fn is_full(&self) -> bool {
        self.remaining == 0
    }

    /// Adds a material and returns its index.
    pub fn material(&mut self, name: &'static str, base_color: [f32; 3]) -> usize {
        self.materials.push(Material { name, base_color });
        self.materials.len() - 1
    }

    /// Adds a kind and returns its index. `shape` is given the grain and the variant.
    pub fn kind(
        &mut self,
        name: &'static str,
        material: usize,
        weight: f64,
        variants: usize,
        shape: impl Fn(Grain, usize) -> Shape + 'static,
    ) -> usize {
        self.kinds.push(Kind {
            name,
            material,
            weight,
            variants,
            shape: Box::new(shape),
        });
        self.kinds.len() - 1
    }

    /// Opens a group for the objects that follow.
    pub fn group(&mut self, name: impl Into<String>, translation: DVec3, rotation: DQuat) {
        self.groups.push(Group {
            name: name.into(),
            translation: translation.as_vec3(),
            rotation: rounded(rotation),
            parts: Vec::new(),
        });
    }

    /// Adds an object to the open group, unless the scene is full.
    pub fn part(
        &mut self,
        kind: usize,
        variant: usize,
        translation: DVec3,
        rotation: DQuat,
        scale: DVec3,
    ) {
        if self.is_full() {
            return;
        }
        self.remaining -= 1;
        let group = self.groups.last_mut().expect("a group is open");
        group.parts.push(Part {
            mesh: self.uses.len(),
            translation: translation.as_vec3(),
            rotation: rounded(rotation),
            scale: scale.as_vec3(),
        });
        let variant = variant % self.kinds[kind].variants;
        self.uses.push((kind, variant));
    }

    /// Adds an object that stands upright and is not turned.
    pub fn put(&mut self, kind: usize, translation: DVec3, scale: DVec3) {
        self.part(kind, 0, translation, DQuat::IDENTITY, scale);
    }

    /// Cuts the shapes so that the scene has what `goal` says, as far as shapes go.
    pub fn finish(self, goal: Goal) -> Model {
        let grains = self.grains(goal);
        let Self {
            name,
            materials,
            kinds,
            groups,
            uses,
            ..
        } = self;
        let mut model = Model {
            name,
            materials,
            groups,
            wide_indices: goal.own_meshes,
            ..Model::default()
        };
        model.groups.retain(|group| !group.parts.is_empty());
        // By kind and variant; filled when first used, so that no mesh is without an object.
        let mut made: Vec<Vec<Option<usize>>> =
            kinds.iter().map(|kind| vec![None; kind.variants]).collect();
        let mut meshes = Vec::new();
        for part in model.groups.iter_mut().flat_map(|group| &mut group.parts) {
            let (kind, variant) = uses[part.mesh];
            let place = &mut made[kind][variant];
            let Kind {
                name,
                material,
                shape,
                ..
            } = &kinds[kind];
            part.mesh = *place.get_or_insert_with(|| {
                meshes.push(Mesh {
                    name: if variant == 0 {
                        (*name).to_owned()
                    } else {
                        format!("{name} {variant}")
                    },
                    material: *material,
                    shape: shape(grains[kind], variant),
                });
                meshes.len() - 1
            });
        }
        if goal.own_meshes {
            let parts = model.groups.iter_mut().flat_map(|group| &mut group.parts);
            model.meshes = parts
                .enumerate()
                .map(|(i, part)| {
                    let shared = &meshes[std::mem::replace(&mut part.mesh, i)];
                    let scale = std::mem::replace(&mut part.scale, glam::Vec3::ONE);
                    let mut mesh = shared.clone();
                    mesh.shape.positions.iter_mut().for_each(|p| *p *= scale);
                    mesh
                })
                .collect();
        } else {
            model.meshes = meshes;
        }
        model
    }

    /// The grain of each kind. Simple kinds come first: they have the least choice, and what they take or
    /// leave goes to the others.
    fn grains(&self, goal: Goal) -> Vec<Grain> {
        let mut counts = vec![0.0; self.kinds.len()];
        self.uses.iter().for_each(|&(kind, _)| counts[kind] += 1.0);
        let mut order: Vec<usize> = (0..counts.len()).filter(|&i| counts[i] > 0.0).collect();
        order.sort_by(|&a, &b| self.kinds[a].weight.total_cmp(&self.kinds[b].weight));
        let mut grains = vec![
            Grain {
                triangles: 0.0,
                chart: 1
            };
            counts.len()
        ];

        let mut triangles = goal.triangles;
        let mut weight: f64 = order
            .iter()
            .map(|&i| counts[i] * self.kinds[i].weight)
            .sum();
        let mut totals = vec![0.0; counts.len()];
        for (rank, &i) in order.iter().enumerate() {
            let wanted = (triangles * self.kinds[i].weight / weight).max(1.0);
            let total = |triangles: f64| {
                let grain = Grain {
                    triangles,
                    chart: 64,
                };
                counts[i] * (self.kinds[i].shape)(grain, 0).triangle_count() as f64
            };
            // The last one has to make up for what is left.
            let tries = if rank + 1 == order.len() { 6 } else { 0 };
            let best = (-tries..=tries)
                .map(|step| wanted * (1.0 + 0.03 * f64::from(step)))
                .map(|wanted| (wanted, total(wanted)))
                .min_by(|a, b| (a.1 - triangles).abs().total_cmp(&(b.1 - triangles).abs()))
                .expect("there is a step of zero");
            (grains[i].triangles, totals[i]) = best;
            triangles -= best.1;
            weight -= counts[i] * self.kinds[i].weight;
        }

        // The kinds with most triangles first: the others can make up for them.
        order.sort_by(|&a, &b| totals[b].total_cmp(&totals[a]));
        let (mut triangles, mut vertices) = (goal.triangles, goal.vertices);
        for i in order {
            let wanted = (vertices / triangles.max(1.0)) * totals[i];
            let with = |chart: usize| {
                let grain = Grain { chart, ..grains[i] };
                counts[i] * (self.kinds[i].shape)(grain, 0).vertex_count() as f64
            };
            // Larger charts have fewer vertices: the best lies on one side or the other of this.
            let after = CHARTS.partition_point(|&chart| with(chart) > wanted);
            let (chart, count) = CHARTS[after.saturating_sub(1)..(after + 1).min(CHARTS.len())]
                .iter()
                .map(|&chart| (chart, with(chart)))
                .min_by(|a, b| (a.1 - wanted).abs().total_cmp(&(b.1 - wanted).abs()))
                .expect("there are charts");
            grains[i].chart = chart;
            triangles -= totals[i];
            vertices -= count;
        }
        grains
    }
}
