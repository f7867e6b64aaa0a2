//! How often each pixel of a frame is shaded.

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use hroc_runtime::{Scene, readback};

use super::contender::Course;
use crate::drawer::ObjectDrawer;
use crate::gpu::Gpu;
use crate::results::Overdraw;

/// Cells along the longer side of a map, at most: enough to see where, small enough to keep for every contender.
const MAX_CELLS: u32 = 480;
/// Steps of a stored value per fragment.
pub(crate) const STEPS: f32 = 16.0;

/// Where fragments are counted.
pub(super) struct OverdrawTarget {
    count: wgpu::Texture,
    pub(super) drawer: ObjectDrawer,
}

impl OverdrawTarget {
    pub(super) fn new(device: &wgpu::Device, scene: &Scene, course: &Course) -> Self {
        let count = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("fragment_count"),
            size: wgpu::Extent3d {
                width: course.size[0],
                height: course.size[1],
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: ObjectDrawer::COUNT_FORMAT,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let view = count.create_view(&Default::default());
        Self {
            drawer: ObjectDrawer::counting(device, scene, &view, course.depth),
            count,
        }
    }

    /// The map of frame `frame`, once it is done.
    pub(super) fn read(&self, gpu: &Gpu, frame: u32) -> Overdraw {
        let texels = readback::texture(&gpu.device, &gpu.queue, &self.count);
        let counts = texels
            .chunks_exact(4)
            .map(|texel| count(u16::from_le_bytes([texel[0], texel[1]])))
            .collect::<Vec<_>>();
        map(&counts, [self.count.width(), self.count.height()], frame)
    }
}

/// A 16-bit float that holds a count: neither negative nor below 1 but for 0, and nothing that is no number.
fn count(bits: u16) -> u32 {
    let [exponent, mantissa] = [bits >> 10 & 31, bits & 0x3ff].map(u32::from);
    match exponent {
        0..15 => 0,
        _ => ((0x400 | mantissa) << (exponent - 15)) >> 10,
    }
}

fn map(counts: &[u32], size: [u32; 2], frame: u32) -> Overdraw {
    let cell_px = size[0].max(size[1]).div_ceil(MAX_CELLS);
    let map_size = size.map(|pixels| pixels.div_ceil(cell_px));
    let mut sums = vec![[0u32; 2]; map_size[0] as usize * map_size[1] as usize];
    for (row, y) in counts.chunks_exact(size[0] as usize).zip(0..) {
        for (count, x) in row.iter().zip(0..) {
            let cell = (y / cell_px) * map_size[0] + x / cell_px;
            let [sum, pixels] = &mut sums[cell as usize];
            *sum += count;
            *pixels += 1;
        }
    }
    let values = sums.iter().flat_map(|&[sum, pixels]| {
        let value = STEPS * sum as f32 / pixels as f32;
        // Saturates.
        (value.round() as u16).to_be_bytes()
    });
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, map_size[0], map_size[1]);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Sixteen);
    encoder.set_compression(png::Compression::High);
    let mut writer = encoder.write_header().expect("a header into memory");
    writer
        .write_image_data(&values.collect::<Vec<_>>())
        .expect("as many values as the header says");
    writer.finish().expect("the end of a file in memory");
    Overdraw {
        frame,
        fragments: counts.iter().map(|&count| u64::from(count)).sum(),
        covered_pixels: counts.iter().filter(|&&count| count > 0).count() as u64,
        map_size,
        cell_px,
        map_png_base64: BASE64_STANDARD.encode(file),
    }
}

/// The map's values, fragments per pixel, rows from the top.
///
/// # Errors
/// What is wrong with it: it may come from a file that somebody wrote.
pub fn decode(overdraw: &Overdraw) -> Result<Vec<f32>, String> {
    let file = BASE64_STANDARD
        .decode(&overdraw.map_png_base64)
        .map_err(|error| error.to_string())?;
    let mut reader = png::Decoder::new(std::io::Cursor::new(file))
        .read_info()
        .map_err(|error| error.to_string())?;
    let info = reader.info();
    if [info.width, info.height] != overdraw.map_size
        || overdraw.map_size.iter().any(|&side| side > MAX_CELLS)
        || (info.color_type, info.bit_depth) != (png::ColorType::Grayscale, png::BitDepth::Sixteen)
    {
        return Err("not a greyscale image of 16 bits and the size that is told".to_owned());
    }
    let mut bytes = vec![0; 2 * (info.width * info.height) as usize];
    reader
        .next_frame(&mut bytes)
        .map_err(|error| error.to_string())?;
    let values = bytes.chunks_exact(2);
    Ok(values
        .map(|value| f32::from(u16::from_be_bytes([value[0], value[1]])) / STEPS)
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_read_from_half_floats() {
        // 0, 1, 2, 3, 5, 1023, 2048, as IEEE 754 binary16 has them.
        let bits = [0, 0x3c00, 0x4000, 0x4200, 0x4500, 0x63fe, 0x6800];
        assert_eq!(bits.map(count), [0, 1, 2, 3, 5, 1023, 2048]);
    }

    #[test]
    fn a_map_holds_means_of_cells_and_reads_back() {
        // Cells of two pixels; the last column has one.
        let width = MAX_CELLS + 1;
        let counts = (0..2)
            .flat_map(|y| (0..width).map(move |x| x % 2 + y))
            .collect::<Vec<_>>();
        let map = map(&counts, [width, 2], 7);
        assert_eq!((map.frame, map.cell_px, map.map_size), (7, 2, [241, 1]));
        assert_eq!(map.fragments, u64::from(counts.iter().sum::<u32>()));
        assert_eq!(map.covered_pixels, 240 + 481);
        let values = decode(&map).unwrap();
        assert_eq!((values[0], values[240]), (1.0, 0.5));
        let broken = Overdraw {
            map_size: [240, 1],
            ..map
        };
        assert!(decode(&broken).is_err());
    }
}
