//! Pictures that a unit leaves, as bytes.

use anyhow::{Context as _, Result};
use linelit_film::Image;
use serde::{Deserialize, Serialize};

/// A picture, how it is called, what it took and how wrong it is.
#[derive(Clone, Debug)]
pub(super) struct Shown {
    /// A few words.
    pub(super) name: String,
    /// Light samples; 0 where the name says it.
    pub(super) samples: u32,
    /// Processor seconds.
    pub(super) seconds: f64,
    /// Mean relative squared error; NaN where it was not asked for.
    pub(super) mrse: f64,
    /// Linear radiance.
    pub(super) image: Image,
}

/// What stands before the pixels, as JSON.
#[derive(Serialize, Deserialize)]
struct Head {
    name: String,
    samples: u32,
    /// Bits of the numbers.
    seconds: u64,
    mrse: u64,
    width: u32,
    height: u32,
}

/// Pictures as bytes: a line of JSON that says of each what it is, then the pixels.
pub(super) fn to_bytes(pictures: &[Shown]) -> Result<Vec<u8>> {
    let head = |p: &Shown| Head {
        name: p.name.clone(),
        samples: p.samples,
        seconds: p.seconds.to_bits(),
        mrse: p.mrse.to_bits(),
        width: p.image.width,
        height: p.image.height,
    };
    let heads: Vec<Head> = pictures.iter().map(head).collect();
    let mut bytes = serde_json::to_vec(&heads)?;
    bytes.push(b'\n');
    for value in pictures.iter().flat_map(|p| p.image.rgb.iter().flatten()) {
        bytes.extend(value.to_le_bytes());
    }
    Ok(bytes)
}

/// The pictures in some bytes.
pub(super) fn from_bytes(bytes: &[u8]) -> Result<Vec<Shown>> {
    let end = bytes.iter().position(|b| *b == b'\n');
    let (head, pixels) = bytes.split_at(end.context("no pictures")?);
    let heads: Vec<Head> = serde_json::from_slice(head)?;
    let (values, _) = pixels[1..].as_chunks::<4>();
    let mut values = values.iter().map(|v| f32::from_le_bytes(*v));
    let picture = |head: Head| {
        let count = head.width as usize * head.height as usize;
        let mut pixel = || Some([values.next()?, values.next()?, values.next()?]);
        let rgb: Option<Vec<[f32; 3]>> = (0..count).map(|_| pixel()).collect();
        Ok(Shown {
            name: head.name,
            samples: head.samples,
            seconds: f64::from_bits(head.seconds),
            mrse: f64::from_bits(head.mrse),
            image: Image {
                width: head.width,
                height: head.height,
                rgb: rgb.context("a picture lacks pixels")?,
            },
        })
    };
    heads.into_iter().map(picture).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_come_back_as_they_were() {
        let shown = |name: &str, width| Shown {
            name: name.to_owned(),
            samples: 7,
            seconds: 0.1,
            mrse: f64::NAN,
            #[allow(clippy::cast_precision_loss, reason = "small numbers")]
            image: Image::from_fn(width, 2, |x, y| [x as f32, y as f32, 0.1]),
        };
        let bytes = to_bytes(&[shown("a\nb", 3), shown("c", 1)]).unwrap();
        let again = from_bytes(&bytes).unwrap();
        assert_eq!(to_bytes(&again).unwrap(), bytes);
        assert_eq!(
            (again[0].name.as_str(), again[1].image.rgb[1][1]),
            ("a\nb", 1.0)
        );
        assert!(from_bytes(&bytes[..bytes.len() - 1]).is_err());
        assert!(from_bytes(b"[]").is_err());
    }
}
