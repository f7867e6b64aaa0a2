//! Twin of filter_occluders.wgsl.

use super::insert;

/// The objects whose ids stand in an item buffer, one bit each; ids from `object_count` on belong to the host or to
/// the background.
pub fn filter_occluders(item_buffer: &[u32], object_count: u32) -> Vec<u32> {
    let mut visible = vec![0; object_count.div_ceil(32) as usize];
    for &object in item_buffer.iter().filter(|&&object| object < object_count) {
        insert(&mut visible, object);
    }
    visible
}
