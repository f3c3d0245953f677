//! The pixels that a study measures, and their notation on the command line.

use std::fmt;
use std::str::FromStr;

/// The resolution of an image, written `WxH`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Resolution {
    /// The width in pixels.
    pub width: u32,
    /// The height in pixels.
    pub height: u32,
}

/// The largest number of pixels that an image may have.
const MAX_PIXELS: u64 = 1 << 28;

impl FromStr for Resolution {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let expected = || format!("`{text}` is not WIDTHxHEIGHT, such as 640x480");
        let (w, h) = text.split_once('x').ok_or_else(expected)?;
        let width: u32 = w.trim().parse().map_err(|_| expected())?;
        let height: u32 = h.trim().parse().map_err(|_| expected())?;
        let count = u64::from(width) * u64::from(height);
        if count == 0 || count > MAX_PIXELS {
            return Err(format!(
                "`{text}` has {count} pixels; expected 1 to {MAX_PIXELS}"
            ));
        }
        Ok(Self { width, height })
    }
}

/// The pixels that a study measures, written `WxH` or `x,y;x,y;…`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Pixels {
    /// All pixels of an image of this resolution.
    Grid(Resolution),
    /// Single pixels, at the scene's own resolution.
    List(Vec<[u32; 2]>),
}

impl FromStr for Pixels {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text.contains('x') {
            return text.parse().map(Self::Grid);
        }
        let expected = || format!("`{text}` is neither WxH nor x,y;x,y;…");
        let pixel = |t: &str| -> Option<[u32; 2]> {
            let (x, y) = t.split_once(',')?;
            Some([x.trim().parse().ok()?, y.trim().parse().ok()?])
        };
        let pixels: Option<Vec<_>> = text
            .split(';')
            .filter(|t| !t.trim().is_empty())
            .map(pixel)
            .collect();
        match pixels {
            Some(list) if !list.is_empty() => Ok(Self::List(list)),
            _ => Err(expected()),
        }
    }
}

impl fmt::Display for Pixels {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Grid(r) => write!(f, "{}x{}", r.width, r.height),
            Self::List(list) => {
                let texts: Vec<String> = list.iter().map(|[x, y]| format!("{x},{y}")).collect();
                f.write_str(&texts.join(";"))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_are_checked() {
        assert_eq!(
            "3,4;5,6".parse::<Pixels>().unwrap(),
            Pixels::List(vec![[3, 4], [5, 6]])
        );
        assert_eq!("8x4".parse::<Pixels>().unwrap().to_string(), "8x4");
        assert!("0x4".parse::<Pixels>().is_err());
        assert!("99999x99999".parse::<Pixels>().is_err());
    }
}
