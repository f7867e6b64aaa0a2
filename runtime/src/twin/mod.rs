//! CPU twins of the stages that decide anything: the same steps in f32, in the same order, in a file of the
//! same name as the WGSL. They serve tests (shader against twin against an f64 oracle) and replays.

pub mod batch_occlusion_test;
pub mod bounds;
pub mod extract_groups;
pub mod filter_occluders;
pub mod pack;

/// Whether `id` is in a set of one bit per member.
pub fn contains(set: &[u32], id: u32) -> bool {
    set[(id >> 5) as usize] & (1 << (id & 31)) != 0
}

/// Puts `id` into a set of one bit per member; whether it was there before.
pub fn insert(set: &mut [u32], id: u32) -> bool {
    let was = contains(set, id);
    set[(id >> 5) as usize] |= 1 << (id & 31);
    was
}
