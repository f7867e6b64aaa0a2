//! Objects that the host moves, adds and removes.
//!
//! They have ids after those of the bake and are in no tree: each is tested as a group of its own (the hybrid of
//! the paper's section 6). In all else they are like the others: what was visible in the last frame is drawn
//! first and occludes. An object of the bake can be hidden, or taken out of the tree to be moved.
//!
//! ```no_run
//! # fn example(device: &wgpu::Device, queue: &wgpu::Queue, baked: &hroc_format::BakedScene) -> Result<(), Box<dyn std::error::Error>> {
//! use glam::{DAffine3, DVec3};
//! use hroc_runtime::{DeviceProfile, Scene};
//! use hroc_runtime::moving::{MovingObject, MovingObjects};
//!
//! let profile = DeviceProfile::probe(device, queue);
//! let mut scene = Scene::upload_with_moving(device, &profile, baked.scene(), 100)?;
//! let mut moving = MovingObjects::new(baked.scene(), &scene);
//! let car = moving.insert(MovingObject { mesh: 3, ..Default::default() })?;
//! // Every frame:
//! moving.place(car, DAffine3::from_translation(DVec3::new(1.0, 0.0, 2.0)))?;
//! moving.flush(queue, &mut scene);
//! # Ok(())
//! # }
//! ```

use glam::{DAffine3, DVec3};
use hroc_format::{
    ArchivedObject, ArchivedObjectBounds, ArchivedScene, Object, ObjectBounds, object_flags,
};

use crate::frame_uniform::CELL_SLOTS;
use crate::scene::{Scene, classes};
use crate::twin::contains;

/// What an object by itself can make the GPU err, in units of the sum of its products: as the bake allows.
const LOCAL_ULPS: f64 = 10.0 / (1 << 23) as f64;
/// An object stays in its cell up to this distance from its zero, in units of its size; as in the bake.
const FARTHEST: f64 = 4096.0;

/// An object to insert.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MovingObject {
    /// Index of a mesh of the bake.
    pub mesh: u32,
    /// In the source's coordinates, f64.
    pub world_from_object: DAffine3,
    /// Linear RGBA, 8 bits each, red in the lowest byte.
    pub base_color: u32,
    /// [`object_flags`].
    pub flags: u32,
}

impl Default for MovingObject {
    fn default() -> Self {
        Self {
            mesh: 0,
            world_from_object: DAffine3::IDENTITY,
            base_color: 0xffff_ffff,
            flags: 0,
        }
    }
}

/// A change that cannot be made; nothing was changed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MovingError {
    /// All places are taken.
    #[error("all {0} places for moving objects are taken; upload the scene with more")]
    Full(u32),
    /// No such mesh.
    #[error("mesh {mesh} does not exist; the scene has {count}")]
    NoSuchMesh {
        /// Index asked for.
        mesh: u32,
        /// Meshes in the scene.
        count: usize,
    },
    /// NaN, infinity, or beyond f32.
    #[error("the transform has an element that f32 cannot hold")]
    NotFinite,
    /// No moving object has this id.
    #[error("no moving object has the id {0}")]
    NotMoving(u32),
    /// No object of the bake has this id.
    #[error("no object of the bake has the id {0}")]
    NotBaked(u32),
}

/// Cells for objects that are far from all cells of the bake.
const SPARE_CELLS: usize = CELL_SLOTS - hroc_format::MAX_CELLS;

/// The moving objects of one scene. Changes take effect with the next [`flush`](Self::flush).
#[derive(Clone, Debug)]
pub struct MovingObjects {
    origin: DVec3,
    /// Those of the bake, then [`SPARE_CELLS`] of our own.
    cells: Vec<DVec3>,
    /// Objects in each cell of our own.
    users: [u32; SPARE_CELLS],
    static_count: u32,
    /// Of the bake alone.
    static_reach: f64,
    static_radius: f64,
    mesh_bounds: Vec<[DVec3; 2]>,
    /// By place; an empty one has its bounds inside out.
    objects: Vec<Object>,
    bounds: Vec<ObjectBounds>,
    free: Vec<u32>,
    opaque: Vec<u32>,
    blended: Vec<u32>,
    /// What the bake alone has in each class.
    baked_classes: [Vec<u32>; 2],
    moved: bool,
    reclassed: bool,
}

fn archived_object(object: &Object) -> ArchivedObject {
    ArchivedObject {
        world_from_object: object.world_from_object.map(|row| row.map(Into::into)),
        mesh: object.mesh.into(),
        base_color: object.base_color.into(),
        flags: object.flags.into(),
        cell: object.cell.into(),
    }
}

pub(crate) fn archived_bounds(bounds: &ObjectBounds) -> ArchivedObjectBounds {
    ArchivedObjectBounds {
        min: bounds.min.map(Into::into),
        cell: bounds.cell.into(),
        max: bounds.max.map(Into::into),
        reserved: bounds.reserved.into(),
    }
}

/// Of a place with no object in it: inside out, as the shaders ask.
pub(crate) const NO_BOUNDS: ObjectBounds = ObjectBounds {
    min: [f32::MAX; 3],
    cell: 0,
    max: [f32::MIN; 3],
    reserved: 0,
};

impl MovingObjects {
    /// No moving objects yet, over a scene uploaded with places for them.
    pub fn new(baked: &ArchivedScene, scene: &Scene) -> Self {
        let shape = &scene.shape;
        let capacity = shape.moving_capacity() as usize;
        let mesh_bounds = baked.meshes.iter();
        // A GPU decodes quantized positions to within two units in the last place; all lie in the unit cube.
        let decoding = match scene.quantized {
            true => f64::from(f32::EPSILON) * 2.0,
            false => 0.0,
        };
        let [opaque, blended] = classes(baked, shape.object_words());
        Self {
            origin: shape.origin,
            cells: {
                let own = std::iter::repeat_n(shape.origin, SPARE_CELLS);
                let baked = baked.cell_origins().into_iter().map(DVec3::from);
                baked.chain(own).collect()
            },
            users: [0; SPARE_CELLS],
            static_count: shape.static_count,
            static_reach: shape.reach,
            static_radius: shape.radius,
            mesh_bounds: mesh_bounds
                .map(|mesh| {
                    let [min, max] = [mesh.min, mesh.max]
                        .map(|corner| DVec3::from_array(corner.map(|x| f64::from(x.to_native()))));
                    [min - decoding, max + decoding]
                })
                .collect(),
            objects: vec![Object::default(); capacity],
            bounds: vec![NO_BOUNDS; capacity],
            free: (0..capacity as u32).rev().collect(),
            baked_classes: [opaque.clone(), blended.clone()],
            opaque,
            blended,
            moved: false,
            reclassed: false,
        }
    }

    /// Adds an object; its id.
    ///
    /// # Errors
    /// If there is no place or no such mesh, or the transform is not finite.
    pub fn insert(&mut self, object: MovingObject) -> Result<u32, MovingError> {
        if object.mesh as usize >= self.mesh_bounds.len() {
            return Err(MovingError::NoSuchMesh {
                mesh: object.mesh,
                count: self.mesh_bounds.len(),
            });
        }
        let Some(&place) = self.free.last() else {
            return Err(MovingError::Full(self.objects.len() as u32));
        };
        let (rows, bounds) = self.rows_and_bounds(object.mesh, object.world_from_object, None)?;
        self.free.pop();
        self.objects[place as usize] = Object {
            world_from_object: rows,
            mesh: object.mesh,
            base_color: object.base_color,
            flags: object.flags & object_flags::ALL,
            cell: bounds.cell,
        };
        self.bounds[place as usize] = bounds;
        self.moved = true;
        let id = self.static_count + place;
        self.set_class(id, Some(object.flags & object_flags::BLENDED != 0));
        Ok(id)
    }

    /// Moves an object.
    ///
    /// # Errors
    /// If it is none of the moving ones, or the transform is not finite.
    pub fn place(&mut self, id: u32, world_from_object: DAffine3) -> Result<(), MovingError> {
        let place = self.taken_place(id)?;
        let Object { mesh, cell, .. } = self.objects[place];
        let (rows, bounds) = self.rows_and_bounds(mesh, world_from_object, Some(cell))?;
        self.objects[place].world_from_object = rows;
        self.objects[place].cell = bounds.cell;
        self.bounds[place] = bounds;
        self.moved = true;
        Ok(())
    }

    /// Removes an object. Its id may be given to another one later.
    ///
    /// # Errors
    /// If it is none of the moving ones.
    pub fn remove(&mut self, id: u32) -> Result<(), MovingError> {
        let place = self.taken_place(id)?;
        self.leave(self.objects[place].cell);
        self.bounds[place] = NO_BOUNDS;
        self.free.push(place as u32);
        self.moved = true;
        self.set_class(id, None);
        Ok(())
    }

    /// Hides an object of the bake, or shows it again.
    ///
    /// # Errors
    /// If the bake has no such object.
    pub fn set_hidden(&mut self, id: u32, hidden: bool) -> Result<(), MovingError> {
        if id >= self.static_count {
            return Err(MovingError::NotBaked(id));
        }
        let is_blended = contains(&self.baked_classes[1], id);
        self.set_class(id, (!hidden).then_some(is_blended));
        Ok(())
    }

    /// Takes an object of the bake out of the tree, so that it can be moved: hides it and puts a moving one in
    /// its place, whose id is returned.
    ///
    /// # Errors
    /// If the bake has no such object or there is no place.
    pub fn take(&mut self, baked: &ArchivedScene, id: u32) -> Result<u32, MovingError> {
        let object = baked
            .objects
            .get(id as usize)
            .ok_or(MovingError::NotBaked(id))?;
        let [x, y, z] = object
            .world_from_object
            .map(|row| row.map(|x| f64::from(x.to_native())));
        let column = |i: usize| DVec3::new(x[i], y[i], z[i]);
        let cell = self.cells[object.cell.to_native() as usize];
        let world_from_object =
            DAffine3::from_cols(column(0), column(1), column(2), column(3) + cell);
        let taken = self.insert(MovingObject {
            mesh: object.mesh.to_native(),
            world_from_object,
            base_color: object.base_color.to_native(),
            flags: object.flags.to_native(),
        })?;
        self.set_hidden(id, true)?;
        Ok(taken)
    }

    /// The id of the first place: ids of moving objects begin here.
    pub fn first_id(&self) -> u32 {
        self.static_count
    }

    /// Number of moving objects.
    pub fn len(&self) -> usize {
        self.objects.len() - self.free.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Writes the changes to the GPU and into `scene`, for the frames that are encoded from now on. Uploads 96
    /// bytes per place if anything moved.
    pub fn flush(&mut self, queue: &wgpu::Queue, scene: &mut Scene) {
        if self.moved {
            let first = u64::from(self.static_count);
            let objects = self.objects.iter().map(archived_object).collect::<Vec<_>>();
            let bounds = self.bounds.iter().map(archived_bounds).collect::<Vec<_>>();
            let objects = hroc_format::bytes_of(&objects);
            let bounds = hroc_format::bytes_of(&bounds);
            queue.write_buffer(&scene.objects, first * size_of::<Object>() as u64, objects);
            queue.write_buffer(
                &scene.object_bounds,
                first * size_of::<ObjectBounds>() as u64,
                bounds,
            );
            let far = |bounds: &ObjectBounds| {
                let zero = self.cells[bounds.cell as usize] - self.origin;
                let corner = |corner: [f32; 3]| DVec3::from(corner.map(f64::from)) + zero;
                corner(bounds.min).abs().max(corner(bounds.max).abs())
            };
            let present = self.bounds.iter().filter(|bounds| **bounds != NO_BOUNDS);
            let (mut reach, mut radius) = (self.static_reach, self.static_radius);
            for far in present.map(far) {
                reach = reach.max(far.element_sum());
                radius = radius.max(far.length());
            }
            (scene.shape.reach, scene.shape.radius) = (reach, radius);
            if *scene.shape.cells != *self.cells {
                scene.shape.cells = self.cells.as_slice().into();
            }
        }
        if self.reclassed {
            queue.write_buffer(&scene.opaque, 0, bytemuck::cast_slice(&self.opaque));
            queue.write_buffer(&scene.blended, 0, bytemuck::cast_slice(&self.blended));
            scene.has_blended |= self.blended.iter().any(|word| *word != 0);
            scene.revision += 1;
        }
        (self.moved, self.reclassed) = (false, false);
    }

    /// Writes everything, changed or not: after [`new`](Self::new) on a scene that others have changed.
    pub fn rewrite(&mut self, queue: &wgpu::Queue, scene: &mut Scene) {
        (self.moved, self.reclassed) = (true, true);
        self.flush(queue, scene);
    }

    fn taken_place(&self, id: u32) -> Result<usize, MovingError> {
        let place = id
            .checked_sub(self.static_count)
            .map(|place| place as usize);
        place
            .filter(|&place| self.bounds.get(place).is_some_and(|b| *b != NO_BOUNDS))
            .ok_or(MovingError::NotMoving(id))
    }

    /// Blended, opaque, or not there.
    fn set_class(&mut self, id: u32, blended: Option<bool>) {
        let (word, bit) = ((id >> 5) as usize, 1 << (id & 31));
        self.opaque[word] &= !bit;
        self.blended[word] &= !bit;
        match blended {
            Some(true) => self.blended[word] |= bit,
            Some(false) => self.opaque[word] |= bit,
            None => {}
        }
        self.reclassed = true;
    }

    /// The cell for an object with this box in the source's coordinates: the one it is in while that is near enough,
    /// else the nearest one, or one of our own where all are too far.
    fn cell_for(&self, [min, max]: [DVec3; 2], current: Option<u32>) -> (u32, DVec3) {
        let far = |zero: DVec3| (min - zero).abs().max((max - zero).abs()).max_element();
        let farthest = FARTHEST * (max - min).max_element();
        let zero = |cell: u32| self.cells[cell as usize];
        if let Some(cell) = current.filter(|&cell| far(zero(cell)) <= farthest) {
            return (cell, zero(cell));
        }
        let baked = self.cells.len() - SPARE_CELLS;
        let in_use = |cell: &usize| *cell < baked || self.users[cell - baked] > 0;
        let nearest = (0..self.cells.len())
            .filter(in_use)
            .min_by(|&a, &b| far(self.cells[a]).total_cmp(&far(self.cells[b])))
            .unwrap_or(0);
        let free = (baked..self.cells.len()).find(|cell| !in_use(cell));
        match free.filter(|_| far(self.cells[nearest]) > farthest) {
            Some(own) => {
                // On a grid, so that the offset from the eye has few bits.
                let step = (max - min).max_element().log2().floor().exp2();
                let middle = (min + (max - min) * 0.5) / step;
                let snapped = middle.round() * step;
                let zero = if snapped.is_finite() { snapped } else { min };
                (own as u32, zero)
            }
            None => (nearest as u32, self.cells[nearest]),
        }
    }

    fn enter(&mut self, cell: u32, zero: DVec3) {
        let baked = self.cells.len() - SPARE_CELLS;
        if let Some(own) = (cell as usize).checked_sub(baked) {
            self.cells[cell as usize] = zero;
            self.users[own] += 1;
        }
    }

    fn leave(&mut self, cell: u32) {
        let baked = self.cells.len() - SPARE_CELLS;
        if let Some(own) = (cell as usize).checked_sub(baked) {
            self.users[own] -= 1;
        }
    }

    /// The rows for the GPU, and bounds that contain every vertex as the GPU computes it with them, in a cell that the
    /// object then is in. `current`: the one it was in.
    fn rows_and_bounds(
        &mut self,
        mesh: u32,
        world_from_object: DAffine3,
        current: Option<u32>,
    ) -> Result<([[f32; 4]; 3], ObjectBounds), MovingError> {
        let matrix = world_from_object.matrix3;
        let [lo, hi] = self.mesh_bounds[mesh as usize];
        let middle = world_from_object.transform_point3((lo + hi) * 0.5);
        let half = (hi - lo) * 0.5;
        let across = matrix.x_axis.abs() * half.x
            + matrix.y_axis.abs() * half.y
            + matrix.z_axis.abs() * half.z;
        let (cell, zero) = self.cell_for([middle - across, middle + across], current);
        let translation = world_from_object.translation - zero;
        let mut bounds = ObjectBounds { cell, ..NO_BOUNDS };
        let mut rows = [[0.0; 4]; 3];
        for axis in 0..3 {
            let row = matrix.row(axis).extend(translation[axis]).as_vec4();
            rows[axis] = row.to_array();
            let row = row.as_dvec4();
            let (mut least, mut most, mut local) = (row.w, row.w, 0.0);
            for i in 0..3 {
                let ends = [row[i] * lo[i], row[i] * hi[i]];
                least += ends[0].min(ends[1]);
                most += ends[0].max(ends[1]);
                local += ends[0].abs().max(ends[1].abs());
            }
            let error = LOCAL_ULPS * local + f64::from(f32::MIN_POSITIVE);
            bounds.min[axis] = ((least - error) as f32).next_down();
            bounds.max[axis] = ((most + error) as f32).next_up();
        }
        let elements = rows.as_flattened().iter();
        if !elements
            .chain(&bounds.min)
            .chain(&bounds.max)
            .all(|x| x.is_finite())
        {
            return Err(MovingError::NotFinite);
        }
        if let Some(current) = current {
            self.leave(current);
        }
        self.enter(cell, zero);
        Ok((rows, bounds))
    }
}
