//! Files of view factors: CSV tables, arrays for scipy, and View3D's text format.

use super::Found;
use flate2::Crc;
use linelit_film::{FilmError, write_atomically_by};
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// Writes all factors, in the format of the name's ending.
pub(super) fn write(path: &Path, found: &Found) -> Result<(), FilmError> {
    write_atomically_by(path, |file| {
        let mut to = BufWriter::with_capacity(1 << 20, file);
        match path.extension().and_then(|e| e.to_str()) {
            Some("npz") => npz(&mut to, found)?,
            Some("csv") => csv(&mut to, found)?,
            _ => view3d(&mut to, found)?,
        }
        to.flush()
    })
}

/// Writes one factor per line, and after each row its view of the sky, whose error is the sum of
/// the row's errors.
fn csv(to: &mut impl Write, found: &Found) -> io::Result<()> {
    let matrix = &found.matrix;
    writeln!(to, "from,to,factor,error")?;
    for (row, ends) in matrix.indptr.windows(2).enumerate() {
        for k in ends[0]..ends[1] {
            let (column, factor, error) = (matrix.indices[k], matrix.data[k], matrix.error[k]);
            writeln!(to, "{row},{column},{factor:?},{error:?}")?;
        }
        writeln!(to, "{row},-1,{:?},{:?}", matrix.sky[row], found.error(row))?;
    }
    Ok(())
}

/// Writes View3D's text file: a line with the program, its version and four numbers, the last of
/// which is the number of surfaces; the areas; the rows; and the emittances, which are 1 if the
/// input has none.
fn view3d(to: &mut impl Write, found: &Found) -> io::Result<()> {
    // Write the head and the areas.
    let (matrix, count) = (&found.matrix, found.areas.len());
    let head = format!("linelit {} 0 0 0 {count}", linelit_study::version());
    writeln!(to, "{head:<30}")?;
    let mut line = |numbers: &[f64]| {
        for (k, number) in numbers.iter().enumerate() {
            let blank = if k > 0 { " " } else { "" };
            match *number > 0.0 {
                true => write!(to, "{blank}{number:?}")?,
                false => write!(to, "{blank}0")?,
            }
        }
        writeln!(to)
    };
    line(&found.areas)?;
    // Write the rows densely; only the entries of the previous row are reset.
    let mut row = vec![0.0; count];
    for ends in matrix.indptr.windows(2) {
        let entries = ends[0]..ends[1];
        let columns = &matrix.indices[entries.clone()];
        for (column, factor) in columns.iter().zip(&matrix.data[entries]) {
            row[*column as usize] = *factor;
        }
        line(&row)?;
        columns
            .iter()
            .for_each(|column| row[*column as usize] = 0.0);
    }
    // Write the emittances.
    if found.emittances.len() == count {
        return line(&found.emittances);
    }
    line(&vec![1.0; count])
}

/// Writes arrays for `scipy.sparse.load_npz`, and in addition `error`, `sky` and `area`.
fn npz(to: &mut impl Write, found: &Found) -> io::Result<()> {
    // Write the matrix in compressed rows, as scipy names its arrays.
    let mut zip = Zip {
        to,
        at: 0,
        directory: Vec::new(),
        entries: 0,
    };
    let matrix = &found.matrix;
    let doubles = |values: &'_ [f64]| values.iter().map(|x| x.to_le_bytes()).collect::<Vec<_>>();
    let longs =
        |values: &[usize]| -> Vec<_> { values.iter().map(|n| (*n as u64).to_le_bytes()).collect() };
    let count = found.areas.len();
    zip.array("format", "|S3", true, &[*b"csr"])?;
    zip.array("shape", "<i8", false, &longs(&[count, count]))?;
    zip.array("indptr", "<i8", false, &longs(&matrix.indptr))?;
    let indices: Vec<_> = matrix
        .indices
        .iter()
        .map(|n| u64::from(*n).to_le_bytes())
        .collect();
    zip.array("indices", "<i8", false, &indices)?;
    drop(indices);
    // Write the factors, and our arrays.
    let arrays = [
        ("data", &matrix.data),
        ("error", &matrix.error),
        ("sky", &matrix.sky),
        ("area", &found.areas),
    ];
    for (name, values) in arrays {
        zip.array(name, "<f8", false, &doubles(values))?;
    }
    zip.finish()
}

/// A zip file of stored (uncompressed) entries, in the 64-bit form throughout (PKWARE's APPNOTE
/// 4.5.3).
struct Zip<'a, W> {
    to: &'a mut W,
    /// The number of bytes written so far.
    at: u64,
    /// The central directory so far.
    directory: Vec<u8>,
    entries: u64,
}

/// The date of all entries, 1 January 1980, so that equal contents give equal bytes.
const DATE: u32 = 0x21_0000;
/// The version of the format that has 64-bit sizes.
const VERSION: u16 = 45;
/// The value of a 32-bit field whose number is in a 64-bit field elsewhere.
const ELSEWHERE: u32 = u32::MAX;

impl<W: Write> Zip<'_, W> {
    /// Writes an array in numpy's format, of items of `N` bytes each, or a single item without
    /// dimensions.
    fn array<const N: usize>(
        &mut self,
        name: &str,
        kind: &str,
        is_scalar: bool,
        items: &[[u8; N]],
    ) -> io::Result<()> {
        let shape = if is_scalar {
            String::new()
        } else {
            format!("{},", items.len())
        };
        let text = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({shape}), }}");
        // Ten bytes precede the text, which is padded to end at a multiple of 64.
        let width = (text.len() + 11).next_multiple_of(64) - 11;
        let mut head = b"\x93NUMPY\x01\x00".to_vec();
        head.extend(u16::try_from(width + 1).unwrap_or(0).to_le_bytes());
        head.extend(format!("{text:<width$}\n").bytes());
        let body = items.as_flattened();
        let mut crc = Crc::new();
        crc.update(&head);
        crc.update(body);
        self.entry(&format!("{name}.npy"), crc.sum(), [&head, body])
    }

    /// Writes an entry: a local header, the data, and the entry of the central directory.
    fn entry(&mut self, name: &str, crc: u32, parts: [&[u8]; 2]) -> io::Result<()> {
        let size = (parts[0].len() + parts[1].len()) as u64;
        let sizes = [size.to_le_bytes(), size.to_le_bytes()].concat();
        let length = u16::try_from(name.len()).unwrap_or(0).to_le_bytes();
        // Version, flags, method, date, checksum and sizes are the same in both headers.
        let mut common = VERSION.to_le_bytes().to_vec();
        common.extend([0; 4]);
        for word in [DATE, crc, ELSEWHERE, ELSEWHERE] {
            common.extend(word.to_le_bytes());
        }
        common.extend(length);
        // Write the local header and the data.
        let place = self.at;
        let extra = [&[1, 0, 16, 0][..], &sizes].concat();
        let local = [
            b"PK\x03\x04",
            &common[..],
            &[20, 0],
            name.as_bytes(),
            &extra,
        ]
        .concat();
        for bytes in [&local[..], parts[0], parts[1]] {
            self.to.write_all(bytes)?;
            self.at += bytes.len() as u64;
        }
        // Add the entry to the central directory.
        let extra = [&[1, 0, 24, 0][..], &sizes, &place.to_le_bytes()].concat();
        let version = VERSION.to_le_bytes();
        self.directory
            .extend([b"PK\x01\x02", &version[..], &common, &[28, 0], &[0; 10]].concat());
        self.directory
            .extend([&ELSEWHERE.to_le_bytes(), name.as_bytes(), &extra].concat());
        self.entries += 1;
        Ok(())
    }

    /// Writes the central directory, and its end in the 64-bit and in the 32-bit form.
    fn finish(self) -> io::Result<()> {
        let (start, size) = (self.at, self.directory.len() as u64);
        self.to.write_all(&self.directory)?;
        let mut end = b"PK\x06\x06".to_vec();
        end.extend(44_u64.to_le_bytes());
        end.extend([VERSION.to_le_bytes(), VERSION.to_le_bytes()].concat());
        end.extend([0; 8]);
        for number in [self.entries, self.entries, size, start] {
            end.extend(number.to_le_bytes());
        }
        // The position of the 64-bit end, and the end for readers that do not know it.
        end.extend(b"PK\x06\x07\0\0\0\0");
        end.extend((start + size).to_le_bytes());
        end.extend(1_u32.to_le_bytes());
        end.extend(b"PK\x05\x06\0\0\0\0");
        end.extend([0xff; 12]);
        end.extend([0; 2]);
        self.to.write_all(&end)
    }
}
