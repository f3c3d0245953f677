//! [`Document`]: a picture with named layers and metadata, the contents of an EXR file.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::path::Path;

use crate::image::area;
use crate::{Compression, FilmError, Image, openexr};

/// The values of one channel, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub enum Samples {
    /// Real numbers. Numbers of 16 bits in a file are converted exactly.
    Float(Vec<f32>),
    /// Whole numbers, such as counts of rays.
    Count(Vec<u32>),
}

impl Samples {
    /// Returns the number of values.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Self::Float(values) => values.len(),
            Self::Count(values) => values.len(),
        }
    }

    /// Returns whether there are no values.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the value at `index` as `f64`, without rounding; `None` beyond the last value.
    #[must_use]
    pub fn get(&self, index: usize) -> Option<f64> {
        match self {
            Self::Float(values) => values.get(index).copied().map(f64::from),
            Self::Count(values) => values.get(index).copied().map(f64::from),
        }
    }
}

/// One channel of a layer, for example `R`.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// The name within the layer.
    pub name: String,
    /// The values of the channel.
    pub samples: Samples,
}

/// A group of channels. The layer without a name is the main picture, which viewers show first.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Layer {
    /// The name of the layer, empty for the main picture.
    pub name: String,
    /// The channels of the layer.
    pub channels: Vec<Channel>,
}

impl Layer {
    /// Returns the values of the channel with this name, if there is one.
    #[must_use]
    pub fn channel(&self, name: &str) -> Option<&Samples> {
        self.channels
            .iter()
            .find(|channel| channel.name == name)
            .map(|channel| &channel.samples)
    }
}

/// The position of a cropped picture in the full one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Placement {
    /// The column and the row of the upper left pixel in the full picture.
    pub origin: [i32; 2],
    /// The width and the height of the full picture (the display window of an EXR file).
    pub full: [u32; 2],
    /// The coordinates that the file gives the full picture's upper left pixel; 0, 0 in files that
    /// linelit writes.
    pub corner: [i32; 2],
}

/// Layers of one size with metadata, as stored in an EXR file.
///
/// In the file, a layer `variance` is the channels `variance.R`, `variance.G` and `variance.B` of a
/// single part, which every EXR reader understands. Files with several parts are read, too; the
/// name of a part then precedes the names of its layers. Metadata are text attributes with the
/// prefix `linelit:`.
///
/// ```
/// use linelit_film::{Document, Image};
/// # let folder = std::env::temp_dir().join(format!("linelit-doc-exr-{}", std::process::id()));
/// let mut document = Document::new(2, 1);
/// document.add_image("", &Image::new(2, 1))?;
/// document.add_counts("segments", vec![3, 1])?;
/// document.set("samples", 64);
/// document.write(&folder.join("a.exr"))?;
///
/// let again = Document::read(&folder.join("a.exr"))?;
/// assert_eq!(again.get("samples"), Some("64"));
/// assert_eq!(again.layer("segments").unwrap().channel("Y").unwrap().get(0), Some(3.0));
/// # std::fs::remove_dir_all(&folder).unwrap();
/// # Ok::<(), linelit_film::FilmError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Document {
    /// The number of pixels in a row.
    pub width: u32,
    /// The number of rows.
    pub height: u32,
    /// The position in the full picture, if this is a part of one.
    pub placement: Option<Placement>,
    /// The matrices from the world to the camera, and from the world to the picture, in which the
    /// upper left corner is (0, 0) and the lower right corner (1, 1). They are by columns, for
    /// column vectors, and `None` if not known. In the file they are OpenEXR's `worldToCamera` and
    /// `worldToNDC`.
    pub world_to: [Option<[f32; 16]>; 2],
    /// The layers.
    pub layers: Vec<Layer>,
    /// The metadata, texts by their names, such as samples, seed, commit and estimator.
    pub metadata: BTreeMap<String, String>,
}

impl Document {
    /// Creates a document without layers.
    #[must_use]
    pub fn new(width: u32, height: u32) -> Self {
        Self {
            width,
            height,
            ..Self::default()
        }
    }

    /// Adds a layer of colours, in place of one with the same name. The empty name is the main
    /// picture.
    ///
    /// # Errors
    /// [`FilmError::Size`] when the picture does not have the size of the document.
    pub fn add_image(&mut self, name: &str, image: &Image) -> Result<(), FilmError> {
        image.check()?;
        if (image.width, image.height) != (self.width, self.height) {
            return Err(FilmError::Size {
                expected: [self.width, self.height],
                found: [image.width, image.height],
            });
        }
        let channels = ["R", "G", "B"]
            .into_iter()
            .enumerate()
            .map(|(index, channel)| Channel {
                name: channel.to_owned(),
                samples: Samples::Float(image.rgb.iter().map(|pixel| pixel[index]).collect()),
            })
            .collect();
        self.replace(name, channels);
        Ok(())
    }

    /// Adds a layer with one real channel, `Y`.
    ///
    /// # Errors
    /// [`FilmError::Invalid`] when there is not one value per pixel.
    pub fn add_scalar(&mut self, name: &str, values: Vec<f32>) -> Result<(), FilmError> {
        self.add_single(name, Samples::Float(values))
    }

    /// Adds a layer with one channel of counts, `Y`.
    ///
    /// # Errors
    /// [`FilmError::Invalid`] when there is not one value per pixel.
    pub fn add_counts(&mut self, name: &str, values: Vec<u32>) -> Result<(), FilmError> {
        self.add_single(name, Samples::Count(values))
    }

    /// Adds a layer with the single channel `Y`.
    fn add_single(&mut self, name: &str, samples: Samples) -> Result<(), FilmError> {
        self.check_length(name, samples.len())?;
        self.replace(
            name,
            vec![Channel {
                name: "Y".to_owned(),
                samples,
            }],
        );
        Ok(())
    }

    /// Refuses a channel that has not one value for each pixel.
    fn check_length(&self, name: &str, found: usize) -> Result<(), FilmError> {
        let expected = area(self.width, self.height);
        if found != expected || expected == 0 {
            return Err(FilmError::Invalid(format!(
                "layer `{name}` has {found} values for {} × {} pixels",
                self.width, self.height
            )));
        }
        Ok(())
    }

    /// Adds a layer, in place of one with the same name.
    fn replace(&mut self, name: &str, channels: Vec<Channel>) {
        self.layers.retain(|layer| layer.name != name);
        self.layers.push(Layer {
            name: name.to_owned(),
            channels,
        });
    }

    /// Returns the layer with this name, if there is one.
    #[must_use]
    pub fn layer(&self, name: &str) -> Option<&Layer> {
        self.layers.iter().find(|layer| layer.name == name)
    }

    /// Returns a layer as a picture: its channels `R`, `G` and `B`, or three times its only channel
    /// or its channel `Y`. The result is `None` if there is no such layer, or it has other
    /// channels.
    #[must_use]
    pub fn image(&self, name: &str) -> Option<Image> {
        let layer = self.layer(name)?;
        let colour = [layer.channel("R"), layer.channel("G"), layer.channel("B")];
        let [r, g, b] = match colour {
            [Some(r), Some(g), Some(b)] => [r, g, b],
            _ if layer.channels.len() == 1 => [&layer.channels[0].samples; 3],
            _ => [layer.channel("Y")?; 3],
        };
        let rgb = (0..area(self.width, self.height))
            .map(|index| Some([value(r, index)?, value(g, index)?, value(b, index)?]))
            .collect::<Option<Vec<_>>>()?;
        Some(Image {
            width: self.width,
            height: self.height,
            rgb,
        })
    }

    /// Returns the main picture: the layer that [`Image::read`] would choose in this file.
    #[must_use]
    pub fn main_image(&self) -> Option<Image> {
        let mut channels = Vec::new();
        for layer in &self.layers {
            let names = layer.channels.iter().map(|channel| &*channel.name);
            channels.extend(names.map(|name| (&*layer.name, name)));
        }
        self.image(openexr::main_layer(&channels)?)
    }

    /// Sets the metadata with this name, in place of an older value.
    pub fn set(&mut self, name: &str, value: impl Display) {
        self.metadata.insert(name.to_owned(), value.to_string());
    }

    /// Returns the metadata with this name, if there are any.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<&str> {
        self.metadata.get(name).map(String::as_str)
    }

    /// Writes an EXR file with 32 bits for each value and [`Compression::default`]. Equal documents
    /// give equal bytes.
    ///
    /// # Errors
    /// [`FilmError::Invalid`] when the document has no pixels or no layers, or a channel of a wrong
    /// size; [`FilmError::Io`] when the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), FilmError> {
        crate::write_atomically(path, &self.encode()?)
    }

    /// Returns the bytes of the document's EXR file, compressed by [`Compression::default`].
    ///
    /// # Errors
    /// [`FilmError::Invalid`], in the same cases as for [`Document::write`].
    pub fn encode(&self) -> Result<Vec<u8>, FilmError> {
        self.clone().into_bytes(Compression::default())
    }

    /// Returns the bytes of the EXR file of a document that is no longer needed. In addition to its
    /// values, this takes memory for at most the same number of bytes, for the metadata, and for
    /// 128 rows for each thread of the rayon pool in which it is called. These threads share the
    /// compression.
    ///
    /// # Errors
    /// [`FilmError::Invalid`], in the same cases as for [`Document::write`].
    pub fn into_bytes(self, compression: Compression) -> Result<Vec<u8>, FilmError> {
        if self.layers.iter().all(|layer| layer.channels.is_empty()) {
            return Err(FilmError::Invalid("there is no layer".to_owned()));
        }
        for layer in &self.layers {
            for channel in &layer.channels {
                self.check_length(&layer.name, channel.samples.len())?;
            }
        }
        openexr::encode(self, compression)
    }

    /// Reads an EXR file.
    ///
    /// # Errors
    /// [`FilmError::Io`] when the file cannot be read, and [`FilmError::Format`] when it is not a
    /// valid EXR file.
    pub fn read(path: &Path) -> Result<Self, FilmError> {
        openexr::decode(&crate::atomic::read(path)?).map_err(|e| FilmError::format(path, e))
    }
}

/// Returns the value of a channel at `index`, rounded to `f32`; `None` beyond the last value.
fn value(samples: &Samples, index: usize) -> Option<f32> {
    samples.get(index).map(crate::moments::to_f32)
}
