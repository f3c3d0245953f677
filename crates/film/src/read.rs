//! Pictures from EXR and PFM files.

use crate::picture::Picture;
use crate::{FilmError, FormatError, Image, Placement, error, pfm};
use std::path::Path;

impl Image {
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

    /// Reads the picture, and its place in a larger one.
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
}
