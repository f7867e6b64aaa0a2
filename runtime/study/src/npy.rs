//! NumPy's array file, version 1.0: images as `numpy.load` reads them.

use bytemuck::Pod;

/// An element type that NumPy knows.
pub trait Element: Pod {
    /// NumPy's name for it.
    const DESCR: &'static str;
}

impl Element for f32 {
    const DESCR: &'static str = "<f4";
}

impl Element for u32 {
    const DESCR: &'static str = "<u4";
}

/// The file of `image`, `size` = [width, height], rows from the top: an array of shape [height, width].
pub fn file<T: Element>(image: &[T], [width, height]: [u32; 2]) -> Vec<u8> {
    let header = format!(
        "{{'descr': '{}', 'fortran_order': False, 'shape': ({height}, {width}), }}",
        T::DESCR
    );
    // Magic, version and length take 10 bytes; the data begin at a multiple of 64.
    let padded = (10 + header.len() + 1).next_multiple_of(64) - 10;
    let mut file = b"\x93NUMPY\x01\x00".to_vec();
    file.extend((padded as u16).to_le_bytes());
    file.extend(header.bytes());
    file.resize(10 + padded - 1, b' ');
    file.push(b'\n');
    // Hosts are little-endian, as hroc-format asserts.
    file.extend(bytemuck::cast_slice::<T, u8>(image));
    file
}

#[cfg(test)]
mod tests {
    #[test]
    fn header_and_data_are_as_numpy_writes_them() {
        let file = super::file(&[1.0f32, 2.0, 3.0, 4.0, 5.0, 6.0], [3, 2]);
        // numpy.save of numpy.arange(1, 7, dtype='<f4').reshape(2, 3) begins so.
        let mut head =
            b"\x93NUMPY\x01\x00v\x00{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }"
                .to_vec();
        head.resize(127, b' ');
        head.push(b'\n');
        assert_eq!(file[..128], head);
        assert_eq!(
            file[128..],
            bytemuck::cast_slice::<f32, u8>(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0])[..]
        );
        assert!(
            super::file(&[7u32], [1, 1])
                .windows(5)
                .any(|w| w == b"'<u4'")
        );
    }
}
