//! Reading results back: for checks, dumps and statistics. Functions submit and wait each; copies are recorded into
//! a frame's commands and waited for after they were submitted, so that a frame waits once.

/// The bytes of a buffer made with `COPY_SRC`.
///
/// # Panics
/// If the device is lost while waiting.
pub fn buffer(device: &wgpu::Device, queue: &wgpu::Queue, buffer: &wgpu::Buffer) -> Vec<u8> {
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor {
        label: Some("readback"),
    });
    let copy = BufferCopy::record(device, &mut encoder, buffer);
    queue.submit([encoder.finish()]);
    copy.wait(device)
}

/// The 32-bit words of a buffer.
pub fn words(device: &wgpu::Device, queue: &wgpu::Queue, words: &wgpu::Buffer) -> Vec<u32> {
    bytemuck::pod_collect_to_vec(&buffer(device, queue, words))
}

/// The ids in a set of one bit per object.
pub fn set(device: &wgpu::Device, queue: &wgpu::Queue, members: &wgpu::Buffer) -> Vec<u32> {
    let words = words(device, queue, members);
    members_of(&words).collect()
}

/// The ids in a set given as words.
pub fn members_of(words: &[u32]) -> impl Iterator<Item = u32> {
    words.iter().zip(0u32..).flat_map(|(&word, index)| {
        (0..32)
            .filter(move |bit| word >> bit & 1 == 1)
            .map(move |bit| index * 32 + bit)
    })
}

/// The texels of a 2D texture of four bytes per texel (`Depth32Float`, `R32Uint`, `Rgba8*`) made with
/// `COPY_SRC`: rows from the top, no padding.
///
/// # Panics
/// If the device is lost while waiting.
pub fn texture(device: &wgpu::Device, queue: &wgpu::Queue, texture: &wgpu::Texture) -> Vec<u8> {
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor {
        label: Some("readback"),
    });
    let copy = TextureCopy::record(device, &mut encoder, texture);
    queue.submit([encoder.finish()]);
    copy.wait(device)
}

/// A buffer's copy on its way to the host.
#[derive(Debug)]
pub struct BufferCopy {
    staging: wgpu::Buffer,
}

impl BufferCopy {
    /// Records the copy, so that the buffer is caught as it is at this point of the frame.
    pub fn record(
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        buffer: &wgpu::Buffer,
    ) -> Self {
        let staging = staging(device, buffer.size());
        encoder.copy_buffer_to_buffer(buffer, 0, &staging, 0, buffer.size());
        Self { staging }
    }

    /// The bytes, once the encoder was submitted.
    ///
    /// # Panics
    /// If the device is lost while waiting.
    pub fn wait(self, device: &wgpu::Device) -> Vec<u8> {
        map(device, &self.staging)
    }
}

/// A texture's copy on its way to the host.
#[derive(Debug)]
pub struct TextureCopy {
    staging: wgpu::Buffer,
    row_bytes: usize,
    padded_row_bytes: usize,
}

impl TextureCopy {
    /// Records the copy, so that the texture is caught as it is at this point of the frame.
    pub fn record(
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        texture: &wgpu::Texture,
    ) -> Self {
        let row_bytes = texture.width() * 4;
        let padded = row_bytes.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let staging = staging(device, u64::from(padded) * u64::from(texture.height()));
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(padded),
            rows_per_image: None,
        };
        encoder.copy_texture_to_buffer(
            texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &staging,
                layout,
            },
            texture.size(),
        );
        Self {
            staging,
            row_bytes: row_bytes as usize,
            padded_row_bytes: padded as usize,
        }
    }

    /// The texels, once the encoder was submitted.
    ///
    /// # Panics
    /// If the device is lost while waiting.
    pub fn wait(self, device: &wgpu::Device) -> Vec<u8> {
        let padded = map(device, &self.staging);
        padded
            .chunks_exact(self.padded_row_bytes)
            .flat_map(|row| &row[..self.row_bytes])
            .copied()
            .collect()
    }
}

fn staging(device: &wgpu::Device, size: u64) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("readback"),
        size,
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    })
}

fn map(device: &wgpu::Device, staging: &wgpu::Buffer) -> Vec<u8> {
    staging.slice(..).map_async(wgpu::MapMode::Read, |result| {
        result.expect("a staging buffer maps")
    });
    device
        .poll(wgpu::PollType::wait_indefinitely())
        .expect("the device answers");
    staging
        .slice(..)
        .get_mapped_range()
        .expect("the mapping was waited for")
        .to_vec()
}
