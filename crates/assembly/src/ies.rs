//! The reader of photometric files of luminaires: IES LM-63 of 1986, 1991, 1995, 2002 and 2019,
//! with photometry of type C.

use crate::diagnostics::{ErrorKind, Result, SceneError, Source, Span, Warnings, shorten};
use linelit_lights::{ProfileError, ProfileTable};

/// A number of the file, with its position.
#[derive(Clone, Copy)]
struct Number {
    value: f64,
    span: Span,
}

/// The numbers after the header, which are read one after another.
struct Numbers<'a> {
    source: &'a Source,
    at: usize,
}

impl Numbers<'_> {
    /// Reads the next number; `what` describes it in messages.
    fn next(&mut self, what: &str) -> Result<Number> {
        let bytes = self.source.bytes();
        let is_blank = |b: &u8| b.is_ascii_whitespace() || *b == b',';
        let rest = &bytes[self.at..];
        let Some(start) = rest.iter().position(|b| !is_blank(b)) else {
            let message = format!("the IES file ends before {what}");
            let end = bytes.len();
            let at = Span::new(end.saturating_sub(1), end);
            return Err(self.source.error(ErrorKind::Truncated, message, at, ""));
        };
        let start = self.at + start;
        let length = bytes[start..].iter().position(is_blank);
        let span = Span::new(start, length.map_or(bytes.len(), |n| start + n));
        self.at = span.end;
        let text = self.source.text(span);
        match text.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(Number { value, span }),
            _ => {
                let message = format!("{what} is `{}`, not a number", shorten(&text));
                Err(self.source.error(ErrorKind::Syntax, message, span, ""))
            }
        }
    }

    /// Reads a count, which is at least `least`. Each counted number takes at least two bytes of
    /// the file, by which the count is limited.
    fn count(&mut self, what: &str, least: f64) -> Result<usize> {
        let Number { value, span } = self.next(what)?;
        let most = (self.source.bytes().len() / 2) as f64;
        if value.fract() != 0.0 || !(value >= least && value <= most) {
            let message = format!("{what} is {value}");
            return Err(self.source.error(ErrorKind::OutOfRange, message, span, ""));
        }
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "between zero and the length of the file"
        )]
        let count = value as usize;
        Ok(count)
    }

    /// Reads `count` numbers.
    fn list(&mut self, count: usize, what: &str) -> Result<Vec<Number>> {
        (0..count).map(|_| self.next(what)).collect()
    }
}

/// Reads the intensities of a luminaire in candela. They are multiplied by the multiplier and the
/// ballast factor and, before the edition of 2019, by the number after it, which was the
/// ballast-lamp factor; in 2019 that number is a code for the origin of the file.
///
/// Angles are in the profile's frame: vertical angles from its axis, along which the luminaire
/// shines, and horizontal angles from its x axis towards y = z × x. Looking along the axis, as from
/// behind the luminaire, they run clockwise; looking up at it, counter-clockwise. (The standard's
/// figures are read both ways; Radiance's `ies2rad` turns this way, too.) Angles that the file
/// leaves to symmetry are filled in. The size of the luminous opening is ignored: the luminaire is
/// a point, or the shape that gets the profile.
///
/// # Errors
/// The file is cut off or does not follow the format, its photometry is of type A or B, counts or
/// angles do not fit, or an intensity is negative. The error has the position. Factors of a tilted
/// lamp are a warning.
pub fn read(source: &Source, warnings: &mut Warnings) -> Result<ProfileTable> {
    // Read the numbers before the angles: of the lamp, of the photometry and of its units.
    let mut numbers = Numbers {
        source,
        at: tilt(source, warnings)?,
    };
    numbers.next("the number of lamps")?;
    numbers.next("the lumens of a lamp")?;
    let multiplier = numbers.next("the multiplier")?;
    let rows = numbers.count("the number of vertical angles", 1.0)?;
    let columns = numbers.count("the number of horizontal angles", 1.0)?;
    let kind = numbers.next("the photometric type")?;
    if (kind.value - 1.0).abs() > 0.0 {
        let message = "photometry of types A and B is not supported";
        let label = "expected 1, type C";
        return Err(source.error(ErrorKind::Unsupported, message, kind.span, label));
    }
    for what in ["the units", "the width", "the length", "the height"] {
        numbers.next(what)?;
    }
    let ballast = numbers.next("the ballast factor")?;
    let lamp = numbers.next("the ballast-lamp factor")?.value;
    let lamp = if edition(source) >= 2019 { 1.0 } else { lamp };
    numbers.next("the input watts")?;
    // Read the angles and the intensities.
    let vertical = numbers.list(rows, "a vertical angle")?;
    let horizontal = numbers.list(columns, "a horizontal angle")?;
    let factor = multiplier.value * ballast.value * lamp;
    let mut candela = Vec::with_capacity(columns);
    for _ in 0..columns {
        candela.push(numbers.list(rows, "an intensity")?);
    }
    // Repeat columns by symmetry, and make the table.
    let order = unfolded(source, &horizontal)?;
    let values = order.iter().flat_map(|(_, column)| &candela[*column]);
    #[allow(clippy::cast_possible_truncation, reason = "profiles are f32")]
    let values = values.map(|n| (n.value * factor) as f32).collect();
    let radians = |degrees: f64| degrees.to_radians();
    let table = ProfileTable::new(
        vertical.iter().map(|n| radians(n.value)).collect(),
        order.iter().map(|(degrees, _)| radians(*degrees)).collect(),
        values,
    );
    // Point errors at the angle or the intensity.
    table.map_err(|why| {
        let span = match why {
            ProfileError::Angle(k) => vertical.get(k).map(|n| n.span),
            ProfileError::Value(k) => order
                .get(k / rows)
                .map(|(_, column)| candela[*column][k % rows].span),
            ProfileError::Count => None,
        };
        let span = span.unwrap_or(vertical[0].span);
        source.error(
            ErrorKind::OutOfRange,
            format!("in the IES file, {why}"),
            span,
            "",
        )
    })
}

/// Returns the year of the edition in the first line, such as `LM-63-2019`; 0 if the line has none.
fn edition(source: &Source) -> u32 {
    let bytes = source.bytes();
    let end = bytes.iter().position(|b| is_line_end(*b));
    let line = source.text(Span::new(0, end.unwrap_or(bytes.len())));
    let year = line.split_once("LM-63-").map_or("", |(_, rest)| rest);
    let digits = year.bytes().take_while(u8::is_ascii_digit).count();
    year[..digits].parse().unwrap_or(0)
}

/// Returns whether a byte ends a line.
const fn is_line_end(byte: u8) -> bool {
    matches!(byte, b'\n' | b'\r')
}

/// Reads the line of the lamp's tilt and, if they are in the file, its factors, which are ignored
/// with a warning. The result is the offset after them.
fn tilt(source: &Source, warnings: &mut Warnings) -> Result<usize> {
    let bytes = source.bytes();
    let mut start = 0;
    while start < bytes.len() {
        // Look for the line `TILT=…`.
        let line = bytes[start..].iter().position(|b| is_line_end(*b));
        let end = line.map_or(bytes.len(), |n| start + n + 1);
        let span = Span::new(start, end);
        let text = source.text(span);
        start = end;
        let Some((name, tilt)) = text.split_once('=') else {
            continue;
        };
        // `trim` does not remove a byte order mark, as that is not a blank.
        if !name
            .trim_start_matches('\u{feff}')
            .trim()
            .eq_ignore_ascii_case("TILT")
        {
            continue;
        }
        // Skip the factors.
        let mut numbers = Numbers { source, at: end };
        match tilt.trim().to_ascii_uppercase().as_str() {
            "NONE" => {}
            "INCLUDE" => {
                numbers.next("the lamp's geometry")?;
                let count = numbers.count("the number of tilts", 0.0)?;
                numbers.list(count, "an angle of tilt")?;
                numbers.list(count, "a factor of tilt")?;
                let place = |e: SceneError| e.at(source.at(span), "left out");
                let message = "the factors of a tilted lamp are not supported";
                warnings.warn(ErrorKind::Unsupported, message, place)?;
            }
            _ => {
                let message = format!("the tilt of another file, `{}`", shorten(tilt.trim()));
                return Err(source.error(ErrorKind::Unsupported, message, span, ""));
            }
        }
        return Ok(numbers.at);
    }
    let message = "no IES file: it has no line that begins with `TILT=`";
    Err(source.error(
        ErrorKind::Syntax,
        message,
        Span::new(0, bytes.len().min(1)),
        "",
    ))
}

/// Returns the horizontal angles in [0, 360) degrees in ascending order, each with the index of its
/// column in the file. Columns that the file leaves to symmetry are repeated.
fn unfolded(source: &Source, angles: &[Number]) -> Result<Vec<(f64, usize)>> {
    // Check that the angles ascend.
    let (first, last) = (angles[0], angles[angles.len() - 1]);
    let ascend = |pair: &&[Number]| pair[1].value <= pair[0].value;
    if let Some(pair) = angles.windows(2).find(ascend) {
        let message = "the horizontal angles of an IES file do not ascend";
        return Err(source.error(ErrorKind::OutOfRange, message, pair[1].span, ""));
    }
    // Find the planes of symmetry from the first and the last angle. By a plane at the angle m, the
    // angle a has the same column as 2 m − a.
    let mirrors: &[f64] = match (first.value, last.value) {
        (0.0, 0.0) | (0.0, 360.0) => &[],
        (0.0, 90.0) => &[90.0, 180.0],
        (0.0, 180.0) => &[180.0],
        (90.0, 270.0) => &[270.0],
        _ => {
            let message = format!("horizontal angles from {} to {}", first.value, last.value);
            let label = "expected 0, 0 to 90, 0 to 180, 90 to 270 or 0 to 360";
            return Err(source.error(ErrorKind::OutOfRange, message, last.span, label));
        }
    };
    // Mirror the angles, and sort them.
    let mut all: Vec<(f64, usize)> = angles.iter().map(|n| n.value).zip(0..).collect();
    for mirror in mirrors {
        let again: Vec<_> = all.iter().map(|(a, k)| (2.0 * mirror - a, *k)).collect();
        all.extend(again);
    }
    for (angle, _) in &mut all {
        *angle = angle.rem_euclid(360.0);
    }
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    all.dedup_by(|a, b| a.0 <= b.0);
    Ok(all)
}
