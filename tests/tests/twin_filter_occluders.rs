//! The shader of filter_occluders against its twin and against a set made by sorting, on random item buffers.

use hroc_format::NO_OBJECT;
use hroc_runtime::readback;
use hroc_runtime::twin::filter_occluders::filter_occluders;
use hroc_study::hard_cases::builder::Rng;
use hroc_tests::compute::{Kernel, storage, uniform};
use hroc_tests::{Gpu, gpu};

/// Multiples of the workgroup's 8 pixels, one more, one less, and lines.
const SIZES: [[u32; 2]; 12] = [
    [1, 1],
    [1, 300],
    [300, 1],
    [7, 9],
    [8, 8],
    [9, 7],
    [16, 1],
    [63, 65],
    [255, 257],
    [640, 360],
    [1023, 517],
    [1280, 720],
];
/// Word borders and one to either side.
const COUNTS: [u32; 11] = [1, 2, 31, 32, 33, 63, 64, 65, 1000, 4096, 70_001];

/// What stands in a pixel.
fn item(rng: &mut Rng, content: usize, count: u32) -> u32 {
    let random = rng.bits();
    let any = (random >> 32) as u32;
    match content {
        // Nothing but background; what a single pixel of it shows is put there later.
        0 => NO_OBJECT,
        // Most pixels repeat what others show.
        1 => any % count.min(40),
        // About the count, where the host's own ids begin, and at either end of 32 bits.
        2 => match random % 8 {
            0 => count - 1,
            1 => count,
            2 => count + 31,
            3 => u32::MAX - 1,
            4 => 0,
            5 => 1 << 31,
            _ => NO_OBJECT,
        },
        // Most ids are no object's.
        3 => any,
        _ => any % (count + 50),
    }
}

fn item_buffer(gpu: &Gpu, items: &[u32], [width, height]: [u32; 2]) -> wgpu::TextureView {
    use wgpu::util::{DeviceExt, TextureDataOrder};
    let descriptor = wgpu::TextureDescriptor {
        label: Some("item buffer"),
        size: wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::R32Uint,
        usage: wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    };
    let texture = gpu.device.create_texture_with_data(
        &gpu.queue,
        &descriptor,
        TextureDataOrder::LayerMajor,
        bytemuck::cast_slice(items),
    );
    texture.create_view(&Default::default())
}

#[test]
fn filter_occluders_agrees_with_its_twin() {
    let Some(gpu) = gpu() else { return };
    let wgsl = hroc_shaders::source("filter_occluders").unwrap();
    let kernel = Kernel::new(gpu, &wgsl, "filter_occluders", &[]);
    let (mut pixels, mut shown, mut alone) = (0, 0, 0);
    for (&size, s) in SIZES.iter().zip(0u64..) {
        for (&count, c) in COUNTS.iter().zip(0u64..) {
            // One content after the other; large images and counts come by each of them all the same.
            let content = ((s + c) % 5) as usize;
            let seed = 1000 * s + c;
            let mut rng = Rng(seed);
            let at = format!("seed {seed}, {size:?}, {count} objects, content {content}");
            let [width, height] = size.map(|n| n as usize);
            let mut items = (0..width * height)
                .map(|_| item(&mut rng, content, count))
                .collect::<Vec<_>>();
            // The last object stands in one corner and nowhere else.
            if content == 0 {
                let corners = [0, width - 1, width * (height - 1), width * height - 1];
                items[corners[(rng.bits() % 4) as usize]] = count - 1;
                alone += 1;
            }
            let words = count.div_ceil(32) as usize;
            let visible = storage(gpu, &vec![0u32; words]);
            let limits = uniform(gpu, &[count, 0, 0, 0]);
            let view = item_buffer(gpu, &items, size);
            let bound = [
                (0, wgpu::BindingResource::TextureView(&view)),
                (1, visible.as_entire_binding()),
                (2, limits.as_entire_binding()),
            ];
            kernel.run(gpu, &[&bound], size.map(|n| n.div_ceil(8)));
            let found = readback::words(&gpu.device, &gpu.queue, &visible);

            pixels += items.len();
            let twin = filter_occluders(&items, count);
            items.sort_unstable();
            items.dedup();
            items.retain(|id| *id < count);
            let ids = readback::members_of(&found).collect::<Vec<_>>();
            assert_eq!(ids, items, "{at}: shader against set");
            assert_eq!(found, twin, "{at}: shader against twin");
            shown += items.len();
        }
    }
    gpu.check().unwrap();
    eprintln!("{pixels} pixels, {shown} objects found, {alone} times one pixel alone");
    assert!(pixels > 19_000_000 && shown > 70_000 && alone > 20);
}
