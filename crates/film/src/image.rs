//! A picture in linear radiance.

use std::path::Path;

use crate::picture::Picture;
use crate::{FilmError, FormatError, Placement, error, pfm};

/// A picture of linear radiance, W/(m²·sr) per channel, rows from top to bottom.
///
/// Storage is `f32`: each value is within half an ulp, 2⁻²⁴ ≈ 6e-8 relative, of what was computed.
/// `rgb` holds `width · height` pixels; writers check it, readers guarantee it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Image {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Row-major pixels: red, green, blue.
    pub rgb: Vec<[f32; 3]>,
}

impl Image {
    /// A black picture.
    #[must_use]
    pub fn new(width: u32, height: u32) -> Self {
        Self {
            width,
            height,
            rgb: vec![[0.0; 3]; area(width, height)],
        }
    }

    /// A picture from a function of the pixel's column and row.
    ///
    /// ```
    /// use linelit_film::Image;
    /// let ramp = Image::from_fn(4, 1, |x, _| [x as f32; 3]);
    /// assert_eq!(ramp.get(3, 0), [3.0; 3]);
    /// ```
    #[must_use]
    pub fn from_fn(width: u32, height: u32, mut pixel: impl FnMut(u32, u32) -> [f32; 3]) -> Self {
        let mut rgb = Vec::with_capacity(area(width, height));
        for y in 0..height {
            for x in 0..width {
                rgb.push(pixel(x, y));
            }
        }
        Self { width, height, rgb }
    }

    /// The pixel in column `x` of row `y`.
    ///
    /// # Panics
    /// Outside of the picture.
    #[must_use]
    pub fn get(&self, x: u32, y: u32) -> [f32; 3] {
        self.rgb[self.index(x, y)]
    }

    /// Sets the pixel in column `x` of row `y`.
    ///
    /// # Panics
    /// Outside of the picture.
    pub fn set(&mut self, x: u32, y: u32, value: [f32; 3]) {
        let index = self.index(x, y);
        self.rgb[index] = value;
    }

    fn index(&self, x: u32, y: u32) -> usize {
        assert!(
            x < self.width && y < self.height,
            "pixel ({x}, {y}) of {} × {}",
            self.width,
            self.height
        );
        y as usize * self.width as usize + x as usize
    }

    /// The mean over all pixels, summed in `f64` in storage order; zero for an empty picture.
    #[must_use]
    pub fn mean(&self) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for pixel in &self.rgb {
            for (total, value) in sum.iter_mut().zip(pixel) {
                *total += f64::from(*value);
            }
        }
        let count = self.rgb.len().max(1) as f64;
        sum.map(|total| total / count)
    }

    /// Reads an EXR or PFM file, told apart by its first bytes, not its name.
    ///
    /// From an EXR file it takes the layer without a name, if that has colour (`R`, `G`, `B`) or
    /// luminance (`Y`), or else the one named `estimate`, or else the only one that has colour, or
    /// the only channel of the file, if it is no depth; where several layers may be meant, none is
    /// taken. [`Image::read_layer`] picks another. Colours of other primaries than Rec. 709's (the
    /// attribute `chromaticities`) are converted by way of CIE XYZ, without chromatic adaptation.
    /// The pixels are those of the data window, wherever in the picture that lies
    /// ([`Document::placement`](crate::Document::placement)).
    ///
    /// # Errors
    /// When the file cannot be read, is neither, or has no layer that is its picture by itself.
    pub fn read(path: &Path) -> Result<Self, FilmError> {
        Self::read_layer(path, None)
    }

    /// Reads one layer of an EXR file by its name; a PFM file has only the unnamed one.
    ///
    /// # Errors
    /// When the file cannot be read, is neither EXR nor PFM, or has no such layer.
    pub fn read_layer(path: &Path, layer: Option<&str>) -> Result<Self, FilmError> {
        let bytes = crate::atomic::read(path)?;
        if bytes.starts_with(b"P") {
            let image = pfm::decode(&bytes, usize::MAX).map_err(|e| FilmError::format(path, e))?;
            return match layer {
                None | Some("") => Ok(image),
                Some(wanted) => Err(FilmError::MissingLayer {
                    path: path.to_owned(),
                    wanted: Some(wanted.to_owned()),
                    available: vec![String::new()],
                }),
            };
        }
        let picture = Picture::open(&bytes).map_err(|e| FilmError::format(path, e))?;
        let available = picture.layers();
        let found = picture.decode(layer, usize::MAX);
        let found = found.map_err(|e| FilmError::format(path, e))?;
        found.ok_or_else(|| FilmError::MissingLayer {
            path: path.to_owned(),
            wanted: layer.map(str::to_owned),
            available,
        })
    }

    /// The image in the bytes of an EXR file (the layer that [`Image::read`] takes) or a PFM file,
    /// if it takes at most `limit` bytes of memory, 12 for each pixel: asked before anything is
    /// unpacked.
    ///
    /// # Errors
    /// When the bytes are neither, hold no colour, or ask for more memory.
    pub fn from_bytes(bytes: &[u8], limit: usize) -> Result<Self, FormatError> {
        Self::placed(bytes, limit).map(|(image, _)| image)
    }

    /// The same, and its place in a larger picture.
    pub(crate) fn placed(
        bytes: &[u8],
        limit: usize,
    ) -> Result<(Self, Option<Placement>), FormatError> {
        if bytes.starts_with(b"P") {
            return Ok((pfm::decode(bytes, limit)?, None));
        }
        let picture = Picture::open(bytes)?;
        let (available, placement) = (picture.layers(), picture.placement()?);
        let none = || FormatError::new("EXR", error::layer(None), error::list(&available));
        let image = picture.decode(None, limit)?.ok_or_else(none)?;
        Ok((image, placement))
    }

    pub(crate) fn check(&self) -> Result<(), FilmError> {
        if self.rgb.is_empty() || self.rgb.len() != area(self.width, self.height) {
            return Err(FilmError::Invalid(format!(
                "{} × {} pixels were announced, {} are there",
                self.width,
                self.height,
                self.rgb.len()
            )));
        }
        Ok(())
    }
}

pub(crate) fn area(width: u32, height: u32) -> usize {
    width as usize * height as usize
}
