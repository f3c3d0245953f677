//! A picture with named layers and metadata: what an EXR file holds.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::path::Path;

use crate::image::area;
use crate::{Compression, FilmError, Image, openexr};

/// The values of one channel, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub enum Samples {
    /// Real numbers; 16-bit files are widened, which is exact.
    Float(Vec<f32>),
    /// Counts.
    Count(Vec<u32>),
}

impl Samples {
    /// Number of values.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Self::Float(values) => values.len(),
            Self::Count(values) => values.len(),
        }
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The value at `index` as `f64`, exactly.
    #[must_use]
    pub fn get(&self, index: usize) -> Option<f64> {
        match self {
            Self::Float(values) => values.get(index).copied().map(f64::from),
            Self::Count(values) => values.get(index).copied().map(f64::from),
        }
    }
}

/// One channel of a layer, `R` for example.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// The name within the layer.
    pub name: String,
    /// The values of the channel.
    pub samples: Samples,
}

/// A group of channels; the unnamed layer is what viewers show first.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Layer {
    /// The name of the layer, empty for the main picture.
    pub name: String,
    /// The channels of the layer.
    pub channels: Vec<Channel>,
}

impl Layer {
    /// The channel of that name.
    #[must_use]
    pub fn channel(&self, name: &str) -> Option<&Samples> {
        self.channels
            .iter()
            .find(|channel| channel.name == name)
            .map(|channel| &channel.samples)
    }
}

/// Position of a cropped picture within the full one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Placement {
    /// Column and row of the upper left pixel in the full picture.
    pub origin: [i32; 2],
    /// Width and height of the full picture (the display window of an EXR file).
    pub full: [u32; 2],
    /// The coordinates in the file of the full picture's upper left pixel: 0, 0 in files of ours.
    pub corner: [i32; 2],
}

/// Layers of one size with metadata, as stored in an EXR file.
///
/// In the file a layer `variance` is the channels `variance.R`, `variance.G`, `variance.B` of a
/// single part, which every EXR reader understands; files with several parts are read too, each
/// part's name before its channels' layers. Metadata are text attributes with the prefix
/// `linelit:`.
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
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// The place in the full picture, if this is a part of one.
    pub placement: Option<Placement>,
    /// The matrices from the world to the camera, and from there to the picture, whose corners are
    /// (0, 0), at the upper left, and (1, 1): by columns, for column vectors, as far as known. They
    /// are OpenEXR's `worldToCamera` and `worldToNDC`.
    pub world_to: [Option<[f32; 16]>; 2],
    /// The layers.
    pub layers: Vec<Layer>,
    /// Names and values: samples, seed, commit, estimator….
    pub metadata: BTreeMap<String, String>,
}

impl Document {
    /// A document without layers.
    #[must_use]
    pub fn new(width: u32, height: u32) -> Self {
        Self {
            width,
            height,
            ..Self::default()
        }
    }

    /// Adds a colour layer, replacing one of the same name; the empty name is the main picture.
    ///
    /// # Errors
    /// [`FilmError::Size`] when the picture's size is not the document's.
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

    fn replace(&mut self, name: &str, channels: Vec<Channel>) {
        self.layers.retain(|layer| layer.name != name);
        self.layers.push(Layer {
            name: name.to_owned(),
            channels,
        });
    }

    /// The layer of that name.
    #[must_use]
    pub fn layer(&self, name: &str) -> Option<&Layer> {
        self.layers.iter().find(|layer| layer.name == name)
    }

    /// A layer as a picture: its `R`, `G`, `B`, or its only channel (else `Y`) three times.
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

    /// The layer that [`Image::read`] takes as a picture.
    #[must_use]
    pub fn main_image(&self) -> Option<Image> {
        let mut channels = Vec::new();
        for layer in &self.layers {
            let names = layer.channels.iter().map(|channel| &*channel.name);
            channels.extend(names.map(|name| (&*layer.name, name)));
        }
        self.image(openexr::main_layer(&channels)?)
    }

    /// Sets a piece of metadata.
    pub fn set(&mut self, name: &str, value: impl Display) {
        self.metadata.insert(name.to_owned(), value.to_string());
    }

    /// A piece of metadata.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<&str> {
        self.metadata.get(name).map(String::as_str)
    }

    /// Writes an EXR file (32 bits, [`Compression::default`]); equal documents give equal bytes.
    ///
    /// # Errors
    /// [`FilmError::Invalid`] when the document has no pixels or no layers, or a channel of another
    /// size; [`FilmError::Io`] when the system refuses.
    pub fn write(&self, path: &Path) -> Result<(), FilmError> {
        crate::write_atomically(path, &self.encode()?)
    }

    /// The bytes of the EXR file.
    ///
    /// # Errors
    /// [`FilmError::Invalid`] as for [`Document::write`].
    pub fn encode(&self) -> Result<Vec<u8>, FilmError> {
        self.clone().into_bytes(Compression::default())
    }

    /// The bytes of the EXR file, for a document that is needed no more: beside its values memory
    /// is taken for at most as many bytes as they have, the metadata, and for each thread of the
    /// pool that it is called in, which share out the packing, 128 rows.
    ///
    /// # Errors
    /// [`FilmError::Invalid`] as for [`Document::write`].
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
    /// [`FilmError::Io`] or [`FilmError::Format`].
    pub fn read(path: &Path) -> Result<Self, FilmError> {
        openexr::decode(&crate::atomic::read(path)?).map_err(|e| FilmError::format(path, e))
    }
}

fn value(samples: &Samples, index: usize) -> Option<f32> {
    samples.get(index).map(crate::moments::to_f32)
}
