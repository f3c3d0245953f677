//! `linelit compare`: measures how much two pictures differ.

use super::image::is_png;
use crate::args::{CompareArgs, UsageError};
use crate::output::{Output, note};
use anyhow::{Context as _, Result, bail};
use linelit_elementary::exp2;
use linelit_film::{
    Decoded, Document, Exposure, HeatMap, Image, IntegerImage, Pixels, Placement, Tile,
    decode_picture, srgb_decode,
};
use linelit_study::stats::metrics::{ImageMetrics, MRSE_EPSILON};
use serde::Serialize;
use std::fmt;
use std::path::Path;

/// The errors of a picture against a reference, in linear radiance.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Comparison {
    /// The picture.
    picture: String,
    /// The reference.
    reference: String,
    /// The first column and the one after the last, then the rows, if only a part was compared.
    crop: Option<[i64; 4]>,
    /// The errors over all channels.
    #[serde(flatten)]
    metrics: ImageMetrics,
    /// The errors of red, green and blue.
    channels: [ChannelMetrics; 3],
    /// The metadata that both files have with different values: the name, the value in the picture
    /// and the value in the reference.
    differing_metadata: Vec<(String, String, String)>,
}

/// The errors of one channel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
struct ChannelMetrics {
    mse: f64,
    rmse: f64,
    mrse: f64,
    bias: f64,
    mean: f64,
    reference_mean: f64,
}

/// Compares two pictures of equal size, or the parts that they have in common; prints how much they
/// differ, and writes the requested maps.
///
/// # Errors
/// If a picture cannot be read, the two have different sizes or no pixel in common, or output
/// cannot be printed or written.
pub fn run(args: &CompareArgs, out: &mut Output) -> Result<()> {
    // Refuse to overwrite the pictures.
    let maps = [&args.difference, &args.error_map];
    for map in maps.into_iter().flatten() {
        if [&args.image, &args.reference].contains(&map) {
            let text = format!("{} would be written over what is compared", map.display());
            return Err(UsageError(text).into());
        }
        linelit_film::check_writable(map)?;
    }
    // Read both pictures, and take the pixels that they have in common.
    let (ours, theirs) = (Picture::read(&args.image)?, Picture::read(&args.reference)?);
    if ours.is_encoded != theirs.is_encoded {
        note(format_args!(
            "note: one of the pictures has integers, which hold nothing above white"
        ));
    }
    let common = ours.common(&theirs)?;
    let [picture, reference] = [&ours, &theirs].map(|picture| picture.part(common));
    let [width, height] = ours.full;
    let window = match args.crop {
        Some(crop) => common.meet(crop.window(width, height).into()),
        None => Some(common),
    };
    let Some(window) = window else {
        bail!("the pictures have no pixel of that --crop in common");
    };
    let [picture, reference] = [picture, reference].map(|image| common.cut(&image, window));
    // Compare them.
    let whole = Window::from(Tile::whole(width, height));
    let comparison = Comparison {
        picture: args.image.display().to_string(),
        reference: args.reference.display().to_string(),
        crop: (args.crop.is_some() || window != whole).then_some(window.columns_and_rows()),
        metrics: ImageMetrics::compare(&picture, &reference)?,
        channels: channels(&picture, &reference)?,
        differing_metadata: differing(&ours.metadata, &theirs.metadata),
    };
    // Write the maps and print the figures.
    let placement = (window != whole).then_some(Placement {
        origin: window.corner(),
        full: ours.full,
        corner: ours.corner,
    });
    let maps = Maps { args, placement };
    maps.write(&picture, &reference)?;
    if args.json {
        writeln!(out, "{}", serde_json::to_string(&comparison)?)?;
    } else {
        writeln!(out, "{comparison}")?;
    }
    Ok(())
}

/// A rectangle of pixels in the coordinates of a whole picture: the first column and the one after
/// the last, then the rows. EXR files may have pixels outside the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Window {
    x: [i64; 2],
    y: [i64; 2],
}

impl From<Tile> for Window {
    fn from(tile: Tile) -> Self {
        Self {
            x: [tile.x0, tile.x1].map(i64::from),
            y: [tile.y0, tile.y1].map(i64::from),
        }
    }
}

impl Window {
    /// Returns the intersection of two windows, if it is not empty.
    fn meet(self, other: Self) -> Option<Self> {
        let span = |[a, b]: [i64; 2], [c, d]: [i64; 2]| [a.max(c), b.min(d)];
        let (x, y) = (span(self.x, other.x), span(self.y, other.y));
        (x[0] < x[1] && y[0] < y[1]).then_some(Self { x, y })
    }

    /// Returns the part of this window's image that lies in another window, which is within this
    /// one.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "distances within an image"
    )]
    fn cut(self, image: &Image, part: Self) -> Image {
        let [x0, y0] = [part.x[0] - self.x[0], part.y[0] - self.y[0]].map(|d| d as u32);
        let [width, height] = [part.x, part.y].map(|[from, to]| (to - from) as u32);
        Image::from_fn(width, height, |x, y| image.get(x0 + x, y0 + y))
    }

    /// Returns the first column and the one after the last, then the rows.
    const fn columns_and_rows(self) -> [i64; 4] {
        [self.x[0], self.x[1], self.y[0], self.y[1]]
    }

    /// Returns the first column and row.
    fn corner(self) -> [i32; 2] {
        [self.x[0], self.y[0]].map(|n| i32::try_from(n).unwrap_or(i32::MAX))
    }
}

impl fmt::Display for Window {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x0, x1, y0, y1] = self.columns_and_rows();
        write!(f, "columns {x0} to {x1}, rows {y0} to {y1}")
    }
}

/// Compares the channels one by one.
fn channels(picture: &Image, reference: &Image) -> Result<[ChannelMetrics; 3]> {
    let of = |k: usize| -> Result<ChannelMetrics> {
        let grey = |image: &Image| Image {
            rgb: image.rgb.iter().map(|pixel| [pixel[k]; 3]).collect(),
            ..*image
        };
        let m = ImageMetrics::compare(&grey(picture), &grey(reference))?;
        Ok(ChannelMetrics {
            mse: m.mse,
            rmse: m.rmse,
            mrse: m.mrse,
            bias: m.bias,
            mean: m.mean,
            reference_mean: m.reference_mean,
        })
    };
    Ok([of(0)?, of(1)?, of(2)?])
}

/// Returns the metadata that both files have with different values.
fn differing(ours: &Metadata, theirs: &Metadata) -> Vec<(String, String, String)> {
    let both = ours.iter().filter_map(|(name, value)| {
        let other = theirs.iter().find(|(other, _)| other == name)?;
        (other.1 != *value).then(|| (name.clone(), value.clone(), other.1.clone()))
    });
    both.collect()
}

/// The writer of the requested maps of a comparison.
struct Maps<'a> {
    args: &'a CompareArgs,
    /// The placement of the part that was compared, if it is not the whole picture.
    placement: Option<Placement>,
}

impl Maps<'_> {
    /// Writes the difference and the error map, if they are requested.
    fn write(&self, picture: &Image, reference: &Image) -> Result<()> {
        let args = self.args;
        let per_pixel = |value: &dyn Fn([f32; 3], [f32; 3]) -> [f32; 3]| Image {
            rgb: (picture.rgb.iter().zip(&reference.rgb))
                .map(|(p, r)| value(*p, *r))
                .collect(),
            ..*picture
        };
        if let Some(path) = &args.difference {
            let difference = per_pixel(&|p, r| [0, 1, 2].map(|k| p[k] - r[k]));
            if is_png(path) {
                let gain = exp2(args.exposure);
                // Map zero to the middle of the encoded range, so that differences of either sign
                // have half of it.
                let around =
                    |v: f32| srgb_decode((0.5 + 0.5 * f64::from(v) * gain).clamp(0.0, 1.0));
                #[allow(clippy::cast_possible_truncation, reason = "between 0 and 1")]
                let rgb = difference.rgb.iter().map(|p| p.map(|v| around(v) as f32));
                let shown = Image {
                    rgb: rgb.collect(),
                    ..difference
                };
                linelit_film::write_png(path, &shown, Exposure::default())?;
            } else {
                let mut document = self.document(&difference);
                document.add_image("", &difference)?;
                document.write(path)?;
            }
        }
        if let Some(path) = &args.error_map {
            // Show four powers of ten below the worst error.
            let error = per_pixel(&|p, r| [relative_square(p, r); 3]);
            let worst = scalar(&error).into_iter().filter(|v| v.is_finite());
            let high = f64::from(worst.fold(0.0f32, f32::max));
            let high = if high > 0.0 { high } else { 1.0 };
            let colours = HeatMap {
                low: 1e-4 * high,
                high,
                logarithmic: true,
            };
            self.write_scalar(path, &error, colours)?;
        }
        Ok(())
    }

    /// Returns an empty EXR document of the part that was compared.
    fn document(&self, image: &Image) -> Document {
        Document {
            placement: self.placement,
            ..Document::new(image.width, image.height)
        }
    }

    /// Writes one number per pixel, as it is or in false colours with a note about their scale.
    fn write_scalar(&self, path: &Path, image: &Image, colours: HeatMap) -> Result<()> {
        if is_png(path) {
            let png = colours.encode_png(image.width, image.height, &scalar(image))?;
            linelit_film::write_atomically(path, &png)?;
            let HeatMap { low, high, .. } = colours;
            note(format_args!(
                "{}: {low:.3e} is darkest, {high:.3e} brightest",
                path.display()
            ));
        } else {
            let mut document = self.document(image);
            document.add_scalar("", scalar(image))?;
            document.write(path)?;
        }
        Ok(())
    }
}

/// Returns the mean over channels of the relative squared error.
#[allow(clippy::cast_possible_truncation, reason = "the map is f32")]
fn relative_square(p: [f32; 3], r: [f32; 3]) -> f32 {
    let of = |k: usize| {
        let (p, r) = (f64::from(p[k]), f64::from(r[k]));
        (p - r) * (p - r) / (r * r + MRSE_EPSILON)
    };
    ((of(0) + of(1) + of(2)) / 3.0) as f32
}

/// Returns the first channel of an image, pixel by pixel.
fn scalar(image: &Image) -> Vec<f32> {
    image.rgb.iter().map(|[v, ..]| *v).collect()
}

/// Metadata of an EXR file: names and values.
type Metadata = Vec<(String, String)>;

/// A picture from a file.
struct Picture {
    /// The pixels in linear radiance.
    image: Image,
    /// The window of the whole picture that `image` has.
    window: Window,
    /// The size of the whole picture, and the coordinates that the file gives its first pixel.
    full: [u32; 2],
    corner: [i32; 2],
    metadata: Metadata,
    /// Whether the file had integers, encoded as sRGB.
    is_encoded: bool,
}

impl Picture {
    /// Reads a picture. A name that ends in `:LAYER` chooses a layer of an EXR file, unless a file
    /// has this whole name.
    fn read(name: &Path) -> Result<Self> {
        let text = name.to_string_lossy();
        let extension = name.extension().unwrap_or_default().to_ascii_lowercase();
        if ["png", "tga", "jpg", "jpeg"]
            .iter()
            .any(|known| extension == *known)
        {
            return Self::of_bytes(name);
        }
        // Separate the layer from the name of an EXR file.
        let (path, layer) = match text.rsplit_once(':') {
            Some((file, layer)) if !name.exists() => (Path::new(file), Some(layer)),
            _ => (name, None),
        };
        // Read it with its metadata and placement.
        let image = Image::read_layer(path, layer)?;
        let mut picture = Self::whole(image);
        if let Ok(document) = Document::read(path) {
            picture.metadata = document.metadata.into_iter().collect();
            if let Some(placement) = document.placement {
                picture.place(placement);
            }
        }
        Ok(picture)
    }

    /// Creates a picture of an image that is the whole picture.
    fn whole(image: Image) -> Self {
        let (width, height) = (image.width, image.height);
        Self {
            image,
            window: Tile::whole(width, height).into(),
            full: [width, height],
            corner: [0, 0],
            metadata: Metadata::new(),
            is_encoded: false,
        }
    }

    /// Sets the position of the image in the whole picture.
    fn place(&mut self, placement: Placement) {
        let span = |from: i32, size: u32| [i64::from(from), i64::from(from) + i64::from(size)];
        let ([x, y], image) = (placement.origin, &self.image);
        self.window = Window {
            x: span(x, image.width),
            y: span(y, image.height),
        };
        (self.full, self.corner) = (placement.full, placement.corner);
    }

    /// Returns the pixels that two parts of the same picture have in common.
    fn common(&self, reference: &Self) -> Result<Window> {
        // Refuse parts of pictures of different sizes. Whole pictures of different sizes get the
        // usual message.
        if (self.full, self.corner) != (reference.full, reference.corner) {
            let is_whole = |p: &Self| p.window == Tile::whole(p.full[0], p.full[1]).into();
            if is_whole(self) && is_whole(reference) && self.corner == reference.corner {
                ImageMetrics::compare(&self.image, &reference.image)?;
            }
            let window = |p: &Self| {
                let ([w, h], [x, y]) = (p.full, p.corner);
                format!("{w} × {h} pixels from {x}, {y} on")
            };
            bail!(
                "the pictures are parts of different ones: their display windows are {}, and of the \
                 reference {}",
                window(self),
                window(reference)
            );
        }
        let common = self.window.meet(reference.window);
        common.with_context(|| {
            format!(
                "the pictures have no pixel in common: one has {}, the reference {}",
                self.window, reference.window
            )
        })
    }

    /// Returns the picture's pixels in a window, which has to be within the picture's own window.
    fn part(&self, window: Window) -> Image {
        self.window.cut(&self.image, window)
    }

    /// Reads a PNG, TGA or JPEG picture.
    fn of_bytes(path: &Path) -> Result<Self> {
        let failed = || format!("cannot read {}", path.display());
        let bytes = std::fs::read(path).with_context(failed)?;
        let decoded = decode_picture(&path.to_string_lossy(), &bytes);
        let Decoded { pixels, warning } = decoded
            .context("no picture of a known kind")
            .and_then(|decoded| Ok(decoded?))
            .with_context(failed)?;
        if let Some(warning) = warning {
            note(format_args!("warning: {}: {warning}", path.display()));
        }
        let (image, is_encoded) = match pixels {
            Pixels::Linear(image) => (image, false),
            Pixels::Bytes(picture) => (linear(&picture, 255.0), true),
            Pixels::Words(picture) => (linear(&picture, 65535.0), true),
        };
        Ok(Self {
            is_encoded,
            ..Self::whole(image)
        })
    }
}

/// Returns the linear values of sRGB-encoded integers, the largest of which is white.
fn linear<T: Copy + Into<f64>>(picture: &IntegerImage<T>, white: f64) -> Image {
    #[allow(clippy::cast_possible_truncation, reason = "between 0 and 1")]
    let value = |v: T| srgb_decode(v.into() / white) as f32;
    Image {
        width: picture.width,
        height: picture.height,
        rgb: picture.rgb.iter().map(|pixel| pixel.map(value)).collect(),
    }
}

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let m = &self.metrics;
        // What was compared.
        writeln!(f, "picture    {}", self.picture)?;
        writeln!(f, "reference  {}", self.reference)?;
        if let Some([x0, x1, y0, y1]) = self.crop {
            let (x, y) = ([x0, x1], [y0, y1]);
            writeln!(f, "part       {}", Window { x, y })?;
        }
        writeln!(f, "pixels     {}", m.pixels)?;
        if m.skipped > 0 {
            writeln!(f, "skipped    {} pixels that are not finite", m.skipped)?;
        }
        // The errors over all channels, then of each channel.
        writeln!(
            f,
            "mean       {:.6e}, of the reference {:.6e}",
            m.mean, m.reference_mean
        )?;
        writeln!(f, "MSE        {:.6e}", m.mse)?;
        writeln!(f, "RMSE       {:.6e}", m.rmse)?;
        writeln!(f, "MRSE       {:.6e}", m.mrse)?;
        writeln!(
            f,
            "bias       {:.6e} ± {:.1e} (z {:.2})",
            m.bias, m.bias_stderr, m.bias_z
        )?;
        let [x, y] = m.largest_at;
        write!(f, "largest    {:.6e} at {x},{y}", m.largest)?;
        for (name, c) in ["red", "green", "blue"].into_iter().zip(&self.channels) {
            let (mse, mrse, bias) = (c.mse, c.mrse, c.bias);
            write!(
                f,
                "\n{name:<10} MSE {mse:.3e}, MRSE {mrse:.3e}, bias {bias:.3e}"
            )?;
        }
        // Metadata that differ.
        for (name, ours, theirs) in &self.differing_metadata {
            write!(f, "\n{name:<10} {ours}, of the reference {theirs}")?;
        }
        Ok(())
    }
}
