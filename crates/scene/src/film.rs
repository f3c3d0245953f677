//! The settings of the picture that a scene file has: size, crop, filter and scale.

/// Size, crop, filter and scale of the picture.
#[derive(Clone, Debug, PartialEq)]
pub struct FilmSettings {
    /// The number of pixels across.
    pub width: u32,
    /// The number of pixels down.
    pub height: u32,
    /// The pixels to render, `[x0, x1, y0, y1]`, from the top left corner; `x1` and `y1` are not
    /// rendered.
    pub crop: [u32; 4],
    /// Half the width of the reconstruction filter in pixels, across and down.
    pub filter_radius: [f64; 2],
    /// The factor from radiance to the values of the picture: pbrt-v3's `scale` of a film, or
    /// pbrt-v4's imaging ratio.
    pub scale: f64,
}

impl FilmSettings {
    /// Creates the settings of a film of this size without a crop, with a reconstruction filter one
    /// pixel wide.
    pub fn new(width: u32, height: u32) -> Self {
        Self {
            width,
            height,
            crop: [0, width, 0, height],
            filter_radius: [0.5; 2],
            scale: 1.0,
        }
    }
}

impl Default for FilmSettings {
    /// Returns the settings of a film of 1280 × 720 pixels, as in pbrt-v4.
    fn default() -> Self {
        Self::new(1280, 720)
    }
}
