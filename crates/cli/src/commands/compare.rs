//! `linelit compare`: how far one picture is from another.

use std::fmt;
use std::path::Path;

use linelit_film::{Document, FilmError, Image};
use serde::Serialize;

use linelit_study::stats::metrics::ImageMetrics;

/// Two pictures and the errors of the first against the second, in linear radiance.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct Comparison {
    /// The picture.
    pub picture: String,
    /// The reference.
    pub reference: String,
    /// The errors.
    #[serde(flatten)]
    pub metrics: ImageMetrics,
    /// Metadata that both files have with different values: name, picture's, reference's.
    pub differing_metadata: Vec<(String, String, String)>,
}

/// Compares two EXR or PFM files of one size. A name may end in `:LAYER` to choose a layer of an
/// EXR file (a file whose own name ends so is found first).
pub(super) fn run(picture: &Path, reference: &Path) -> Result<Comparison, FilmError> {
    let (ours, our_metadata) = read(picture)?;
    let (theirs, their_metadata) = read(reference)?;
    let metrics = ImageMetrics::compare(&ours, &theirs)?;
    let differing_metadata = our_metadata
        .iter()
        .filter_map(|(name, value)| {
            let other = their_metadata.iter().find(|(other, _)| other == name)?;
            (other.1 != *value).then(|| (name.clone(), value.clone(), other.1.clone()))
        })
        .collect();
    Ok(Comparison {
        picture: picture.display().to_string(),
        reference: reference.display().to_string(),
        metrics,
        differing_metadata,
    })
}

type Metadata = Vec<(String, String)>;

fn read(name: &Path) -> Result<(Image, Metadata), FilmError> {
    let text = name.to_string_lossy();
    if !name.exists()
        && let Some((file, layer)) = text.rsplit_once(':')
    {
        let path = Path::new(file);
        return Ok((Image::read_layer(path, Some(layer))?, metadata(path)));
    }
    Ok((Image::read(name)?, metadata(name)))
}

/// The metadata of an EXR file; none of any other.
fn metadata(path: &Path) -> Metadata {
    Document::read(path)
        .map(|d| d.metadata.into_iter().collect())
        .unwrap_or_default()
}

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let m = &self.metrics;
        writeln!(f, "picture    {}", self.picture)?;
        writeln!(f, "reference  {}", self.reference)?;
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
        for (name, ours, theirs) in &self.differing_metadata {
            write!(f, "\n{name:<10} {ours}, of the reference {theirs}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use linelit_film::write_pfm;
    use std::path::PathBuf;

    fn folder(name: &str) -> PathBuf {
        std::env::temp_dir().join(format!("linelit-compare-{name}-{}", std::process::id()))
    }

    #[test]
    fn an_exr_and_a_pfm_are_compared_by_layer() {
        let folder = folder("layers");
        let image = Image::from_fn(3, 2, |x, y| [x as f32, y as f32, 1.0]);
        let shifted = Image::from_fn(3, 2, |x, y| [x as f32 + 0.5, y as f32, 1.0]);
        let mut document = Document::new(3, 2);
        document.add_image("", &image).unwrap();
        document.add_image("other", &shifted).unwrap();
        document.set("seed", 1);
        let (a, b, c) = (
            folder.join("a.exr"),
            folder.join("b.pfm"),
            folder.join("c.exr"),
        );
        document.write(&a).unwrap();
        document.set("seed", 2);
        document.write(&c).unwrap();
        write_pfm(&b, &image).unwrap();

        let same = run(&a, &b).unwrap();
        assert!(same.metrics.mse <= 0.0 && same.differing_metadata.is_empty());
        let other = run(Path::new(&format!("{}:other", c.display())), &a).unwrap();
        // One channel of three is off by a half: MSE 1/12, mean difference 1/6 everywhere.
        assert!((other.metrics.mse - 0.25 / 3.0).abs() < 1e-15);
        assert!((other.metrics.bias - 0.5 / 3.0).abs() < 1e-15);
        assert_eq!(
            other.differing_metadata,
            [("seed".into(), "2".into(), "1".into())]
        );
        let text = other.to_string();
        assert!(
            text.contains("MSE        8.333333e-2\n")
                && text.ends_with("seed       2, of the reference 1"),
            "{text}"
        );
        let json = serde_json::to_value(&other).unwrap();
        assert!(
            json["mrse"].is_number() && json["bias"].is_number(),
            "{json}"
        );
        std::fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn sizes_and_names_are_checked() {
        let folder = folder("errors");
        let (a, b) = (folder.join("a.pfm"), folder.join("b.pfm"));
        write_pfm(&a, &Image::new(2, 3)).unwrap();
        write_pfm(&b, &Image::new(3, 2)).unwrap();
        assert_eq!(
            run(&a, &b).unwrap_err().to_string(),
            "expected 3 × 2 pixels, found 2 × 3"
        );
        let layer = format!("{}:x", a.display());
        assert!(
            run(Path::new(&layer), &b)
                .unwrap_err()
                .to_string()
                .contains("named `x`")
        );
        assert!(
            run(&folder.join("none.exr"), &b)
                .unwrap_err()
                .to_string()
                .contains("none.exr")
        );
        std::fs::remove_dir_all(folder).unwrap();
    }
}
