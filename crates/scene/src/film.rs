//! What the file says about the picture.

/// Reconstruction filters that pbrt knows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FilterKind {
    /// Constant over its support.
    Box,
    /// Falls linearly to zero.
    Triangle,
    /// A truncated Gaussian.
    Gaussian,
    /// Mitchell and Netravali.
    Mitchell,
    /// Lanczos-windowed sinc.
    Sinc,
}

/// A reconstruction filter and its support.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Filter {
    /// Its shape.
    pub kind: FilterKind,
    /// Half its width in pixels, across and down.
    pub radius: [f64; 2],
}

impl Default for Filter {
    /// A box of one pixel.
    fn default() -> Self {
        Self {
            kind: FilterKind::Box,
            radius: [0.5, 0.5],
        }
    }
}

/// Size, crop, file name, filter and scale of the picture.
#[derive(Clone, Debug, PartialEq)]
pub struct FilmSettings {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Pixels to render, `[x0, x1, y0, y1]`, half open, from the top left corner.
    pub crop: [u32; 4],
    /// Where the file wants the picture written, if it says so.
    pub filename: Option<String>,
    /// The reconstruction filter.
    pub filter: Filter,
    /// Factor from radiance to the values of the picture: pbrt-v3's `scale` of a film, pbrt-v4's
    /// imaging ratio.
    pub scale: f64,
}

impl FilmSettings {
    /// A film without crop, with a box filter.
    pub fn new(width: u32, height: u32) -> Self {
        Self {
            width,
            height,
            crop: [0, width, 0, height],
            filename: None,
            filter: Filter::default(),
            scale: 1.0,
        }
    }
}

impl Default for FilmSettings {
    /// 1280 × 720 pixels, as in pbrt-v4.
    fn default() -> Self {
        Self::new(1280, 720)
    }
}
