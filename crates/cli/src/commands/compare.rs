//! `linelit compare`: how far one picture is from another.

use crate::args::{CompareArgs, UsageError};
use crate::output::{Output, note};
use anyhow::{Context as _, Result};
use linelit_elementary::exp2;
use linelit_film::{
    Decoded, Document, Exposure, Flip, HeatMap, Image, IntegerImage, Pixels, Tile, decode_picture,
    srgb_decode,
};
use linelit_study::stats::metrics::{ImageMetrics, MRSE_EPSILON};
use serde::Serialize;
use std::fmt;
use std::path::Path;

/// Two pictures and the errors of the first against the second, in linear radiance.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Comparison {
    /// The picture.
    picture: String,
    /// The reference.
    reference: String,
    /// First and last but one of columns and rows, where a part was compared.
    crop: Option<[u32; 4]>,
    /// The errors.
    #[serde(flatten)]
    metrics: ImageMetrics,
    /// Those of red, green and blue.
    channels: [ChannelMetrics; 3],
    /// Mean of FLIP, if it was asked for.
    flip: Option<f64>,
    /// Metadata that both files have with different values: name, picture's, reference's.
    differing_metadata: Vec<(String, String, String)>,
}

/// Errors of one channel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
struct ChannelMetrics {
    mse: f64,
    rmse: f64,
    mrse: f64,
    bias: f64,
    mean: f64,
    reference_mean: f64,
}

/// Compares two pictures of one size, prints by how much they differ, and writes the maps that are
/// asked for.
///
/// # Errors
/// If a picture cannot be read, the two differ in size, or something cannot be printed or written.
pub fn run(args: &CompareArgs, out: &mut Output) -> Result<()> {
    let maps = [&args.difference, &args.error_map, &args.flip_map];
    for map in maps.into_iter().flatten() {
        if [&args.image, &args.reference].contains(&map) {
            let text = format!("{} would be written over what is compared", map.display());
            return Err(UsageError(text).into());
        }
        linelit_film::check_writable(map)?;
    }
    let (ours, theirs) = (Picture::read(&args.image)?, Picture::read(&args.reference)?);
    if ours.is_encoded != theirs.is_encoded {
        note(format_args!(
            "note: one of the pictures has integers, which hold nothing above white"
        ));
    }
    let [picture, reference] = [&ours.image, &theirs.image];
    // Of the whole pictures, as one sees them; the sizes are checked here.
    let flip = (args.flip || args.flip_map.is_some()).then(|| seen(picture, reference, args));
    let flip = flip.transpose()?;
    ImageMetrics::compare(picture, reference)?;
    let (width, height) = (picture.width, picture.height);
    let whole = Tile {
        x0: 0,
        x1: width,
        y0: 0,
        y1: height,
    };
    let window = args.crop.map_or(whole, |crop| crop.window(width, height));
    let [picture, reference] = [picture, reference].map(|image| part(image, window));
    let flip = flip.map(|map| part(&map, window));
    let comparison = Comparison {
        picture: args.image.display().to_string(),
        reference: args.reference.display().to_string(),
        crop: args
            .crop
            .map(|_| [window.x0, window.x1, window.y0, window.y1]),
        metrics: ImageMetrics::compare(&picture, &reference)?,
        channels: channels(&picture, &reference)?,
        flip: flip.as_ref().map(|map| map.mean()[0]),
        differing_metadata: differing(&ours.metadata, &theirs.metadata),
    };
    write_maps(args, &picture, &reference, flip.as_ref())?;
    if args.json {
        writeln!(out, "{}", serde_json::to_string(&comparison)?)?;
    } else {
        writeln!(out, "{comparison}")?;
    }
    Ok(())
}

/// FLIP of each pixel, in all channels.
fn seen(picture: &Image, reference: &Image, args: &CompareArgs) -> Result<Image> {
    let exposure = Exposure {
        stops: args.exposure,
    };
    let [ours, theirs] =
        [picture, reference].map(|image| linelit_film::ToneCurve::Clip.apply(image, exposure));
    let map = Flip::default().map(&ours, &theirs)?;
    Ok(Image {
        rgb: map.into_iter().map(|v| [v; 3]).collect(),
        ..*picture
    })
}

/// A part of a picture.
fn part(image: &Image, window: Tile) -> Image {
    Image::from_fn(window.width(), window.height(), |x, y| {
        image.get(window.x0 + x, window.y0 + y)
    })
}

fn channels(picture: &Image, reference: &Image) -> Result<[ChannelMetrics; 3]> {
    let of = |k: usize| -> Result<ChannelMetrics> {
        let grey = |image: &Image| Image {
            rgb: image.rgb.iter().map(|pixel| [pixel[k]; 3]).collect(),
            ..*image
        };
        let m = ImageMetrics::compare(&grey(picture), &grey(reference))?;
        let ImageMetrics {
            mse,
            rmse,
            mrse,
            bias,
            mean,
            reference_mean,
            ..
        } = m;
        Ok(ChannelMetrics {
            mse,
            rmse,
            mrse,
            bias,
            mean,
            reference_mean,
        })
    };
    Ok([of(0)?, of(1)?, of(2)?])
}

fn differing(ours: &Metadata, theirs: &Metadata) -> Vec<(String, String, String)> {
    let both = ours.iter().filter_map(|(name, value)| {
        let other = theirs.iter().find(|(other, _)| other == name)?;
        (other.1 != *value).then(|| (name.clone(), value.clone(), other.1.clone()))
    });
    both.collect()
}

fn write_maps(
    args: &CompareArgs,
    picture: &Image,
    reference: &Image,
    flip: Option<&Image>,
) -> Result<()> {
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
            // Half of the encoded range to either side, so that as much more and as much less are
            // as far from the middle.
            let around = |v: f32| srgb_decode((0.5 + 0.5 * f64::from(v) * gain).clamp(0.0, 1.0));
            #[allow(clippy::cast_possible_truncation, reason = "between 0 and 1")]
            let rgb = difference.rgb.iter().map(|p| p.map(|v| around(v) as f32));
            let shown = Image {
                rgb: rgb.collect(),
                ..difference
            };
            linelit_film::write_png(path, &shown, Exposure::default())?;
        } else {
            let mut document = Document::new(difference.width, difference.height);
            document.add_image("", &difference)?;
            document.write(path)?;
        }
    }
    if let Some(path) = &args.error_map {
        let error = per_pixel(&|p, r| [relative_square(p, r); 3]);
        let worst = scalar(&error).into_iter().filter(|v| v.is_finite());
        let high = f64::from(worst.fold(0.0f32, f32::max));
        let high = if high > 0.0 { high } else { 1.0 };
        write_scalar(
            path,
            &error,
            HeatMap {
                low: 1e-4 * high,
                high,
                logarithmic: true,
            },
        )?;
    }
    if let (Some(path), Some(map)) = (&args.flip_map, flip) {
        write_scalar(
            path,
            map,
            HeatMap {
                low: 0.0,
                high: 1.0,
                logarithmic: false,
            },
        )?;
    }
    Ok(())
}

/// The mean over channels of the relative squared error.
#[allow(clippy::cast_possible_truncation, reason = "the map is f32")]
fn relative_square(p: [f32; 3], r: [f32; 3]) -> f32 {
    let of = |k: usize| {
        let (p, r) = (f64::from(p[k]), f64::from(r[k]));
        (p - r) * (p - r) / (r * r + MRSE_EPSILON)
    };
    ((of(0) + of(1) + of(2)) / 3.0) as f32
}

fn scalar(image: &Image) -> Vec<f32> {
    image.rgb.iter().map(|[v, ..]| *v).collect()
}

/// One number a pixel: as it is, or in colours whose scale is said.
fn write_scalar(path: &Path, image: &Image, colours: HeatMap) -> Result<()> {
    let (width, height) = (image.width, image.height);
    if is_png(path) {
        let png = colours.encode_png(width, height, &scalar(image))?;
        linelit_film::write_atomically(path, &png)?;
        let HeatMap { low, high, .. } = colours;
        note(format_args!(
            "{}: {low:.3e} is darkest, {high:.3e} brightest",
            path.display()
        ));
    } else {
        let mut document = Document::new(width, height);
        document.add_scalar("", scalar(image))?;
        document.write(path)?;
    }
    Ok(())
}

fn is_png(path: &Path) -> bool {
    path.extension().is_some_and(|e| e == "png")
}

type Metadata = Vec<(String, String)>;

/// A picture from a file.
struct Picture {
    /// Linear.
    image: Image,
    metadata: Metadata,
    /// Whether it had integers, encoded as sRGB.
    is_encoded: bool,
}

impl Picture {
    /// A name may end in `:LAYER` to choose a layer of an EXR file (a file whose own name ends so
    /// is found first).
    fn read(name: &Path) -> Result<Self> {
        let text = name.to_string_lossy();
        let extension = name.extension().unwrap_or_default().to_ascii_lowercase();
        if ["png", "tga", "jpg", "jpeg"]
            .iter()
            .any(|known| extension == *known)
        {
            return Self::of_bytes(name);
        }
        let (path, layer) = match text.rsplit_once(':') {
            Some((file, layer)) if !name.exists() => (Path::new(file), Some(layer)),
            _ => (name, None),
        };
        let document = Document::read(path).map(|d| d.metadata.into_iter().collect());
        Ok(Self {
            image: Image::read_layer(path, layer)?,
            metadata: document.unwrap_or_default(),
            is_encoded: false,
        })
    }

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
        let metadata = Metadata::new();
        Ok(Self {
            image,
            metadata,
            is_encoded,
        })
    }
}

/// The linear values of sRGB-encoded integers, the largest of which is white.
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
        writeln!(f, "picture    {}", self.picture)?;
        writeln!(f, "reference  {}", self.reference)?;
        if let Some([x0, x1, y0, y1]) = self.crop {
            writeln!(f, "part       columns {x0} to {x1}, rows {y0} to {y1}")?;
        }
        writeln!(f, "pixels     {}", m.pixels)?;
        if m.skipped > 0 {
            writeln!(f, "skipped    {} pixels that are not finite", m.skipped)?;
        }
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
        if let Some(flip) = self.flip {
            write!(f, "\nFLIP       {flip:.6}")?;
        }
        for (name, ours, theirs) in &self.differing_metadata {
            write!(f, "\n{name:<10} {ours}, of the reference {theirs}")?;
        }
        Ok(())
    }
}
