//! The functions of [`Image`] that read EXR and PFM files.

use crate::picture::Picture;
use crate::{FilmError, FormatError, Image, Placement, error, pfm};
use std::path::Path;

impl Image {
    /// Reads an EXR or PFM file. The first bytes of the file decide which of the two it is, and not
    /// its name.
    ///
    /// In an EXR file it chooses the layer without a name, if that has colour (`R`, `G`, `B`) or
    /// luminance (`Y`); otherwise the layer named `estimate`; otherwise the only layer that has
    /// colour, or the only channel of the file if that is not a depth. If several layers could be
    /// the picture, it is an error, and [`Image::read_layer`] reads one by its name.
    ///
    /// Colours with other primaries than Rec. 709 (the attribute `chromaticities`) are converted
    /// by way of CIE XYZ, without chromatic adaptation. The pixels are the pixels of the data
    /// window, at any position in the picture
    /// ([`Document::placement`](crate::Document::placement)).
    ///
    /// # Errors
    /// The file cannot be read, is neither EXR nor PFM, or has no layer that is clearly its
    /// picture.
    pub fn read(path: &Path) -> Result<Self, FilmError> {
        Self::read_layer(path, None)
    }

    /// Reads one layer of an EXR file by its name; a PFM file has only the unnamed one.
    ///
    /// # Errors
    /// The file cannot be read, is neither EXR nor PFM, or has no such layer.
    pub fn read_layer(path: &Path, layer: Option<&str>) -> Result<Self, FilmError> {
        // Read a PFM file, whose only layer has no name.
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
        // Read the layer of an EXR file.
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

    /// Reads the image in the bytes of an EXR file (the layer that [`Image::read`] chooses) or a
    /// PFM file. Before memory is allocated, it checks that the image takes at most `limit` bytes,
    /// of which each pixel takes 12.
    ///
    /// # Errors
    /// The bytes are neither EXR nor PFM, have no colour, or need more memory than `limit`.
    pub fn from_bytes(bytes: &[u8], limit: usize) -> Result<Self, FormatError> {
        Self::placed(bytes, limit).map(|(image, _)| image)
    }

    /// Reads the image, and its position in a larger picture if it is a part of one.
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
