//! Picture files in formats that linelit reads and does not write.

/// Returns the bytes of a TGA file with 24 bits per pixel, uncompressed, with the top row first.
///
/// ```
/// let file = linelit_testkit::pictures::tga([1, 1], &[[1, 2, 3]]);
/// assert_eq!(file[18..], [3, 2, 1]);
/// ```
///
/// # Panics
/// If a side is longer than 65535, the format's limit.
#[must_use]
pub fn tga(size: [u32; 2], rgb: &[[u8; 3]]) -> Vec<u8> {
    let side = |n| {
        u16::try_from(n)
            .expect("at most 65535 pixels")
            .to_le_bytes()
    };
    let [[w0, w1], [h0, h1]] = size.map(side);
    let mut file = vec![0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, w0, w1, h0, h1, 24, 0x20];
    file.extend(rgb.iter().flat_map(|[r, g, b]| [*b, *g, *r]));
    file
}

/// Returns the bytes of a PFM file in colour, little-endian. `rgb` has the rows from the top one
/// on, which the file stores last.
///
/// ```
/// let file = linelit_testkit::pictures::pfm([1, 1], &[[1.0; 3]]);
/// assert_eq!(file[..13], *b"PF\n1 1\n-1.0\n\0");
/// ```
#[must_use]
pub fn pfm([width, height]: [u32; 2], rgb: &[[f32; 3]]) -> Vec<u8> {
    let mut file = format!("PF\n{width} {height}\n-1.0\n").into_bytes();
    for row in rgb.chunks_exact(width as usize).rev() {
        file.extend(row.iter().flatten().flat_map(|value| value.to_le_bytes()));
    }
    file
}
