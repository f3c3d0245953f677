//! Pictures that a unit leaves, as bytes.

use crate::engine;
use anyhow::{Result, ensure};
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

/// A picture as bytes have it.
#[derive(Serialize, Deserialize)]
struct Kept {
    name: String,
    samples: u32,
    seconds: f64,
    mrse: f64,
    size: [u32; 2],
    rgb: Vec<[f32; 3]>,
}

/// Pictures as bytes.
pub(super) fn to_bytes(pictures: Vec<Shown>) -> Vec<u8> {
    let kept = |p: Shown| Kept {
        name: p.name,
        samples: p.samples,
        seconds: p.seconds,
        mrse: p.mrse,
        size: [p.image.width, p.image.height],
        rgb: p.image.rgb,
    };
    let kept: Vec<Kept> = pictures.into_iter().map(kept).collect();
    engine::to_bytes(&kept)
}

/// The pictures in some bytes.
pub(super) fn from_bytes(bytes: &[u8]) -> Result<Vec<Shown>> {
    let picture = |kept: Kept| {
        let [width, height] = kept.size;
        let pixels = width as usize * height as usize;
        ensure!(kept.rgb.len() == pixels, "a picture lacks pixels");
        Ok(Shown {
            name: kept.name,
            samples: kept.samples,
            seconds: kept.seconds,
            mrse: kept.mrse,
            image: Image {
                width,
                height,
                rgb: kept.rgb,
            },
        })
    };
    let kept: Vec<Kept> = engine::from_bytes(bytes)?;
    kept.into_iter().map(picture).collect()
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
        let bytes = to_bytes(vec![shown("a\nb", 3), shown("c", 1)]);
        let again = from_bytes(&bytes).unwrap();
        assert_eq!(to_bytes(again.clone()), bytes);
        assert_eq!(
            (again[0].name.as_str(), again[1].image.rgb[1][1]),
            ("a\nb", 1.0)
        );
        assert!(from_bytes(&bytes[..bytes.len() - 1]).is_err());
        assert!(from_bytes(b"\x01").is_err());
    }
}
