//! The values on the command line: how they are parsed, and the messages about words that are not
//! understood.

use clap::builder::{PathBufValueParser, PossibleValue, PossibleValuesParser, TypedValueParser};
use linelit_film::Tile;
use linelit_formats::nearest;
use linelit_integrator::{Estimator, LightChoice, Spheres};
use linelit_samplers::SamplerKind;
use linelit_simd::InstructionSet;
use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

/// The largest number of samples of a light for one shading point that the command line accepts:
/// they are all in memory at once.
pub const MOST_SAMPLES: i64 = linelit_estimators::MOST_SAMPLES as i64;

/// The largest number of threads for each core that the command line accepts, on machines where
/// this is more than [`ALWAYS_THREADS`] in all. More than one thread for each core only wait for
/// each other.
const THREADS_OF_CORE: usize = 4;
/// The number of threads that the command line accepts on any machine.
const ALWAYS_THREADS: usize = 64;

/// A value on the command line that may be an element of a list ([`List`]).
pub trait Word: Sized {
    /// Parses a word as a value of this type.
    ///
    /// # Errors
    /// A text that says why the word is not valid, with the nearest valid word if there is a
    /// similar one.
    fn read(text: &str) -> Result<Self, String>;
}

impl Word for u32 {
    fn read(text: &str) -> Result<Self, String> {
        text.parse().map_err(|e| format!("{e}"))
    }
}

impl Word for SamplerKind {
    fn read(text: &str) -> Result<Self, String> {
        let names = Self::ALL.map(Self::name);
        let said = |e| did_you_mean(format!("{e}"), text, names);
        text.parse().map_err(said)
    }
}

impl Word for Estimator {
    fn read(text: &str) -> Result<Self, String> {
        text.parse::<Self>().map_err(|error| {
            let message = error.to_string();
            match error.unknown() {
                Some((word, names)) => did_you_mean(message, word, names.iter().copied()),
                None => message,
            }
        })
    }
}

/// Returns a message about a word, to which the nearest of the `known` words is added if one is
/// similar.
fn did_you_mean(
    message: String,
    word: &str,
    known: impl IntoIterator<Item = &'static str>,
) -> String {
    match nearest(word, known) {
        Some(near) => format!("{message}; did you mean `{near}`?"),
        None => message,
    }
}

/// Returns a parser of values by their names. `about` gives the line about each value in `--help`,
/// which does not list values for which the line is empty.
fn one_of<V: Clone + fmt::Display + Send + Sync + 'static>(
    values: &[V],
    about: impl Fn(&V) -> &'static str,
) -> impl TypedValueParser<Value = V> {
    let all = values.to_vec();
    let possible = values.iter().map(|value| {
        let about = about(value);
        let possible = PossibleValue::new(value.to_string());
        if about.is_empty() {
            possible.hide(true)
        } else {
            possible.help(about)
        }
    });
    let known = move |text: String| {
        let found = all.iter().find(|value| value.to_string() == text);
        found.cloned().ok_or("clap lets no other through")
    };
    PossibleValuesParser::new(possible).try_map(known)
}

/// Returns the parser of sampling patterns.
pub(crate) fn sampler() -> impl TypedValueParser<Value = SamplerKind> {
    one_of(&SamplerKind::ALL, |kind| about_sampler(*kind))
}

/// Returns a line about a sampling pattern.
#[must_use]
pub const fn about_sampler(kind: SamplerKind) -> &'static str {
    match kind {
        SamplerKind::Independent => "uniform random numbers: variance 1/N always",
        SamplerKind::Auto => "`sobol` for powers of two, else `multijitter`",
        SamplerKind::Stratified => "a jittered sample in each of N strata or cells",
        SamplerKind::MultiJitter => "one sample in each cell and in each stratum of either axis",
        SamplerKind::Sobol => "Owen-scrambled Sobol' nets; best for powers of two",
        SamplerKind::SobolBurley => "the sequence of the sobol_burley crate, to compare with",
        SamplerKind::Halton => "Owen-scrambled Halton points; for any N alike",
        SamplerKind::UniformJitter => "evenly spaced, one random shift for all (a lattice in 2-D)",
        SamplerKind::BlueNoise => {
            "uniform-jitter by a blue-noise tile: errors differ from pixel to pixel"
        }
        SamplerKind::BlueNoiseIndependent => "blue noise for each sample, without strata: 1/N",
        SamplerKind::ZSobol => "one Sobol' sequence for the whole image, along a Z-order curve",
    }
}

/// Returns the parser of the strategies for selecting lights.
pub(crate) fn light_choice() -> impl TypedValueParser<Value = LightChoice> {
    const ALL: [LightChoice; 7] = [
        LightChoice::All,
        LightChoice::Uniform,
        LightChoice::Power,
        LightChoice::Estimate,
        LightChoice::Exact,
        LightChoice::Tree,
        LightChoice::Centre,
    ];
    one_of(&ALL, |choice| match choice {
        LightChoice::All => "all lights, each with as many samples",
        LightChoice::Uniform => "for each sample one, all alike",
        LightChoice::Power => "one, by the power that it emits",
        LightChoice::Estimate => "one, by unshadowed light from a random point of each",
        LightChoice::Exact => "one, by the unshadowed light of each in closed form",
        LightChoice::Tree => "one, by a hierarchy of the lights: for thousands of them",
        // This choice is wrong on purpose, for a paper's figure, and so is not listed.
        LightChoice::Centre => "",
    })
}

/// Returns the parser of how emissive spheres, disks and cylinders are treated.
pub(crate) fn spheres() -> impl TypedValueParser<Value = Spheres> {
    one_of(
        &[Spheres::Exact, Spheres::Facets],
        |spheres| match spheres {
            Spheres::Exact => "as they are, where they are whole, emit outwards and no image",
            Spheres::Facets => "as the triangles that the camera sees",
        },
    )
}

/// Parses a number of doublings of brightness, from −100 to 100.
///
/// # Errors
/// What is expected.
pub(crate) fn stops(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(stops) if (-100.0..=100.0).contains(&stops) => Ok(stops),
        _ => Err("expected a number of doublings from -100 to 100".to_owned()),
    }
}

/// Returns the parser of a path whose name must end in one of these extensions (without the dot).
pub(crate) fn path_ending(
    endings: &'static [&'static str],
) -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().try_map(move |path| {
        let ending = path.extension().and_then(|e| e.to_str());
        if ending.is_some_and(|e| endings.contains(&e)) {
            return Ok(path);
        }
        let list: Vec<String> = endings.iter().map(|e| format!(".{e}")).collect();
        Err(format!("the name must end in {}", list.join(" or ")))
    })
}

/// Parses a number of threads, which must not be more than the machine can use.
pub(crate) fn threads(text: &str) -> Result<usize, String> {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let most = ALWAYS_THREADS.max(THREADS_OF_CORE * cores);
    match text.parse::<usize>() {
        Ok(threads) if threads <= most => Ok(threads),
        Ok(_) => Err(format!("at most {most} threads on {cores} cores")),
        Err(e) => Err(e.to_string()),
    }
}

/// Parses a positive number of seconds.
///
/// # Errors
/// What is expected.
pub fn seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(seconds) if seconds > 0.0 && seconds.is_finite() => Ok(seconds),
        _ => Err("expected a positive number of seconds".to_owned()),
    }
}

/// Parses a tolerance, a number above 0 and below 1.
pub(crate) fn tolerance(text: &str) -> Result<f64, String> {
    let found = text.parse::<f64>().ok();
    let found = found.filter(|tolerance| *tolerance > 0.0 && *tolerance < 1.0);
    found.ok_or_else(|| "expected a number between 0 and 1".to_owned())
}

/// Parses the name of an instruction set that this processor has.
///
/// # Errors
/// A text that names the instruction sets that the processor has.
pub fn instruction_set(text: &str) -> Result<InstructionSet, String> {
    let set: InstructionSet = text.parse().map_err(|e| format!("{e}"))?;
    if set.is_available() {
        return Ok(set);
    }
    let all = InstructionSet::ALL.into_iter();
    let names: Vec<_> = all
        .filter(|s| s.is_available())
        .map(|s| s.to_string())
        .collect();
    Err(format!(
        "this processor has no {set}; it has {}",
        names.join(", ")
    ))
}

/// `K=ESTIMATOR`: the estimator of one light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightEstimator {
    /// The index of the light in the scene, from 0.
    pub light: u32,
    /// The estimator for the light.
    pub estimator: Estimator,
}

impl FromStr for LightEstimator {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.split_once('=');
        let light = parts.and_then(|(k, e)| Some((k.trim().parse().ok()?, e)));
        let Some((light, estimator)) = light else {
            return Err(format!(
                "`{text}` is not LIGHT=ESTIMATOR, such as 0=point-bsdf"
            ));
        };
        let estimator = Estimator::read(estimator)?;
        Ok(Self { light, estimator })
    }
}

/// A crop window in fractions of the image: x0, x1, y0, y1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crop(pub [f64; 4]);

impl Crop {
    /// Returns the pixels that the crop window covers in a picture of this size, at least one. As
    /// in pbrt, both ends are rounded up.
    #[must_use]
    pub fn window(self, width: u32, height: u32) -> Tile {
        let Self([x0, x1, y0, y1]) = self;
        let span = |lo: f64, hi: f64, size: u32| {
            #[allow(clippy::cast_possible_truncation, reason = "fractions of a u32")]
            let pixel = |f: f64| ((f64::from(size) * f).ceil() as u32).min(size);
            let first = pixel(lo).min(size.saturating_sub(1));
            (first, pixel(hi).max(first + 1))
        };
        let ((x0, x1), (y0, y1)) = (span(x0, x1, width), span(y0, y1, height));
        Tile { x0, x1, y0, y1 }
    }
}

impl FromStr for Crop {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let expected =
            || format!("`{text}` is not X0,X1,Y0,Y1 with 0 <= X0 < X1 <= 1 and likewise Y");
        let numbers: Vec<f64> = text
            .split(',')
            .map(|t| t.trim().parse::<f64>())
            .collect::<Result<_, _>>()
            .map_err(|_| expected())?;
        let [x0, x1, y0, y1] = <[f64; 4]>::try_from(numbers).map_err(|_| expected())?;
        let ok = |a: f64, b: f64| (0.0..=1.0).contains(&a) && (0.0..=1.0).contains(&b) && a < b;
        if ok(x0, x1) && ok(y0, y1) {
            Ok(Self([x0, x1, y0, y1]))
        } else {
            Err(expected())
        }
    }
}

/// A list separated by commas outside brackets.
#[derive(Clone, Debug, PartialEq)]
pub struct List<T>(pub Vec<T>);

/// Numbers of samples: positive, ascending, none above [`MOST_SAMPLES`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SampleCounts(pub Vec<u32>);

impl FromStr for SampleCounts {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let List(counts) = text.parse::<List<u32>>()?;
        if counts.first() == Some(&0) || !counts.windows(2).all(|w| w[0] < w[1]) {
            return Err("the numbers must be positive and ascending".to_owned());
        }
        match counts.last() {
            Some(most) if i64::from(*most) > MOST_SAMPLES => {
                Err(format!("{most} is more than {MOST_SAMPLES}"))
            }
            _ => Ok(Self(counts)),
        }
    }
}

impl<T: Word> FromStr for List<T> {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parsed: Result<Vec<T>, String> = split_outside_brackets(text)
            .map(|t| T::read(t).map_err(|e| format!("`{t}`: {e}")))
            .collect();
        match parsed? {
            list if list.is_empty() => Err("the list is empty".to_owned()),
            list => Ok(Self(list)),
        }
    }
}

fn split_outside_brackets(text: &str) -> impl Iterator<Item = &str> {
    let mut depth = 0i32;
    let comma = move |c: char| {
        depth += i32::from(c == '[') - i32::from(c == ']');
        c == ',' && depth == 0
    };
    text.split(comma).map(str::trim).filter(|t| !t.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_split_outside_brackets() {
        let list: List<Estimator> =
            "point-area,line-area[orientation=fixed:0.5,offset=uniform],exact"
                .parse()
                .unwrap();
        assert_eq!(list.0.len(), 3);
        assert!("".parse::<List<u32>>().is_err());
        assert_eq!("1, 4,16".parse::<List<u32>>().unwrap().0, [1, 4, 16]);
        assert!("1,x".parse::<List<u32>>().unwrap_err().contains("`x`"));
    }

    #[test]
    fn near_misses_are_answered_with_the_word_that_is_near() {
        let said = |text| Estimator::read(text).unwrap_err();
        for (text, near) in [
            ("line-analitic", "line-analytic"),
            ("point-area+line-aera", "line-area"),
            ("line-area[ofset=uniform]", "offset"),
            ("line-area[offset=unifrom]", "uniform"),
            ("point-area[visibility=shfat]", "shaft"),
            ("point-bsdf[mis=blance]", "balance"),
            ("point-linear[technique=lct]", "ltc"),
            ("point-linear[technique=ltc,mis=optmal]", "optimal"),
        ] {
            let end = format!("; did you mean `{near}`?");
            assert!(said(text).ends_with(&end), "{}", said(text));
        }
        // Nothing is near, or something else is wrong.
        for text in ["bananas", "line-area[", "point-area:0"] {
            assert!(!said(text).contains("did you mean"), "{}", said(text));
        }
        let list = "sobol,haltn".parse::<List<SamplerKind>>().unwrap_err();
        assert!(list.ends_with("; did you mean `halton`?"), "{list}");
    }
}
