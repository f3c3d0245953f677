//! The report of view factors: sums of rows, errors, the matrix as a picture, and the facets with
//! their view of the sky.

use super::{Factors, Found};
use anyhow::Result;
use linelit_film::{Exposure, HeatMap, Image, srgb_decode};
use linelit_geometry::DVec3;
use linelit_study::report::{Cell, Picture, Report, Section, Table};
use linelit_study::short_name;

/// The largest width and height of the picture of the matrix, in pixels.
const MATRIX: usize = 512;
/// The smallest factor that the picture of the matrix shows, relative to the largest factor;
/// smaller ones have the darkest colour.
const DECADES: f64 = 1e-6;
/// The width and height of the picture of the facets, in pixels.
const VIEW: [u32; 2] = [960, 720];
/// The direction to the viewer: from the south-west, some 40° above the horizon.
const TOWARDS: DVec3 = DVec3::new(-0.5, -0.75, 0.75);
/// The number of rows that the table of errors lists.
const LISTED: usize = 12;

/// Returns the page of the report.
pub(super) fn page(factors: &Factors, found: &Found, seconds: f64) -> Result<Report> {
    let name = short_name(&factors.name);
    let count = found.areas.len();
    // Say how much was computed.
    let summary = format!(
        "{count} facets, {} factors that are not zero, in {seconds:.1} s; each row to a tolerance \
         of {:e}.",
        found.matrix.data.len(),
        factors.args.tolerance
    );
    // Show the sums and errors of rows, the kinds of pairs, the matrix, and the view of the sky.
    let sections = vec![
        Section {
            title: "Rows".to_owned(),
            lead: "What a facet sends to others, and to the sky: what no facet receives."
                .to_owned(),
            tables: vec![sums(found), errors(found)],
            ..Section::default()
        },
        Section {
            title: "Pairs".to_owned(),
            lead: "How pairs of facets were settled.".to_owned(),
            tables: vec![pairs(found)],
            ..Section::default()
        },
        Section {
            title: "Matrix".to_owned(),
            lead: "Factors by row and column, the first row on top, on a logarithmic scale."
                .to_owned(),
            pictures: vec![matrix(found)?],
            ..Section::default()
        },
        Section {
            title: "Sky".to_owned(),
            lead: "The facets, from above (z is up), by the share of the sky in their view."
                .to_owned(),
            pictures: vec![sky(factors, found)?],
            ..Section::default()
        },
    ];
    // Put the page together, with the settings that are not on the command line.
    let title = format!("View factors of {name}");
    let mut report = Report::new(&title, vec![summary], sections);
    let moved = format!("{:.1e} at most", factors.facets.displacement());
    report.facts.extend([
        ("sides".to_owned(), factors.args.sides.to_string()),
        ("moved by rounding".to_owned(), moved),
    ]);
    Ok(report)
}

/// Returns the table of the minimum, mean and maximum of the sums and errors of rows.
fn sums(found: &Found) -> Table {
    let rows = 0..found.areas.len();
    let with_sky = |row| found.sum(row) + found.matrix.sky[row];
    // Collect each quantity, row by row of the matrix.
    let kinds: [(&str, Vec<f64>); 4] = [
        (
            "sum of a row",
            rows.clone().map(|row| found.sum(row)).collect(),
        ),
        ("sky", found.matrix.sky.clone()),
        (
            "sum and sky: 1 without obstructions",
            rows.clone().map(with_sky).collect(),
        ),
        (
            "errors of a row",
            rows.map(|row| found.error(row)).collect(),
        ),
    ];
    // Summarize it in a line of the table.
    let lines = kinds.into_iter().map(|(name, values)| {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let least = values.iter().copied().fold(f64::INFINITY, f64::min);
        let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let mut cells = vec![Cell::text(name)];
        cells.extend([least, mean, most].map(|x| Cell::number(shown(x))));
        cells
    });
    Table::new("", ["", "least", "mean", "most"], lines)
}

/// Formats a number with six decimals, or by a power of ten if six decimals would not show it.
fn shown(value: f64) -> String {
    match value.abs() {
        small if small > 0.0 && small < 1e-3 => format!("{value:.2e}"),
        _ => format!("{value:.6}"),
    }
}

/// Returns the table of the rows with the largest errors.
fn errors(found: &Found) -> Table {
    let mut rows: Vec<_> = (0..found.areas.len())
        .map(|row| (found.error(row), row))
        .collect();
    rows.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    rows.truncate(LISTED);
    let lines = rows.into_iter().map(|(error, row)| {
        let numbers = [
            error,
            found.sum(row),
            found.matrix.sky[row],
            found.areas[row],
        ];
        let mut cells = vec![Cell::number(row.to_string())];
        cells.extend(numbers.map(|x| Cell::number(shown(x))));
        cells
    });
    let heads = ["facet, from 0", "errors", "sum", "sky", "area"];
    Table::new("The rows of the largest errors.", heads, lines)
}

/// Returns the table of pairs by how they were classified.
fn pairs(found: &Found) -> Table {
    let all = found.pairs.iter().sum::<u64>().max(1) as f64;
    let names = [
        "do not face each other",
        "hidden: nothing of one is seen from the other",
        "clear: nothing in between",
        "partly hidden",
    ];
    let lines = names.iter().zip(found.pairs).map(|(name, count)| {
        let share = format!("{:.2} %", 100.0 * count as f64 / all);
        vec![
            Cell::text(*name),
            Cell::number(count.to_string()),
            Cell::number(share),
        ]
    });
    Table::new("", ["", "pairs", "share"], lines)
}

/// Returns the picture of the matrix. A pixel shows one factor, or the mean of several.
#[allow(
    clippy::cast_possible_truncation,
    reason = "colours, and counts up to MATRIX"
)]
fn matrix(found: &Found) -> Result<Picture> {
    // Sum the factors in the bin of each pixel.
    let count = found.areas.len();
    let side = count.min(MATRIX);
    let bin = |k: usize| k * side / count;
    let mut sums = vec![0.0; side * side];
    let mut in_bin = vec![0_u32; side];
    for (row, ends) in found.matrix.indptr.windows(2).enumerate() {
        in_bin[bin(row)] += 1;
        for k in ends[0]..ends[1] {
            sums[bin(row) * side + bin(found.matrix.indices[k] as usize)] += found.matrix.data[k];
        }
    }
    // Divide by the numbers of rows and columns of the bin, and colour the means.
    for (k, sum) in sums.iter_mut().enumerate() {
        *sum /= f64::from(in_bin[k / side]) * f64::from(in_bin[k % side]);
    }
    let high = sums.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    let map = HeatMap {
        low: DECADES * high,
        high,
        logarithmic: true,
    };
    let values: Vec<f32> = sums.iter().map(|x| *x as f32).collect();
    let caption = match count > side {
        true => format!(
            "Means of {:.1} × {0:.1} factors.",
            count as f64 / side as f64
        ),
        false => "A pixel a factor.".to_owned(),
    };
    let side = side as u32;
    Ok(Picture::of_scalars(side, side, &values, map, &caption)?)
}

/// Returns the picture of the facets, coloured by their view of the sky; facets that only hide
/// others are grey.
fn sky(factors: &Factors, found: &Found) -> Result<Picture> {
    let [width, height] = VIEW;
    let seen = View::of(factors).draw(factors);
    let map = HeatMap {
        low: 0.0,
        high: 1.0,
        logarithmic: false,
    };
    let at = |x: u32, y: u32| seen[(y * width + x) as usize];
    // Draw lines between facets if most facets are larger than some pixels.
    let lines = found.areas.len() < (width * height / 256) as usize;
    let image = Image::from_fn(width, height, |x, y| {
        let Some(facet) = at(x, y) else {
            return [1.0; 3];
        };
        let differs = |x: u32, y: u32| x < width && y < height && at(x, y) != Some(facet);
        let share = found.matrix.sky.get(facet as usize);
        let colour = share.map_or([150; 3], |share| map.colour(*share));
        let light = if lines && (differs(x + 1, y) || differs(x, y + 1)) {
            0.5
        } else {
            1.0
        };
        #[allow(clippy::cast_possible_truncation, reason = "a colour")]
        colour.map(|byte| (light * srgb_decode(f64::from(byte) / 255.0)) as f32)
    });
    let caption = "The share of the sky; facets that turn away from the viewer are not shown.";
    let picture = Picture::exposed(&image, Exposure::default(), caption)?;
    Ok(Picture {
        scale: Some(map),
        ..picture
    })
}

/// A parallel projection from above.
struct View {
    /// The directions to the right, downwards, and towards the viewer.
    axes: [DVec3; 3],
    /// The upper left corner in the plane of the picture, and the number of pixels per unit of
    /// length.
    corner: [f64; 2],
    scale: f64,
}

impl View {
    /// Returns the view that shows all facets.
    fn of(factors: &Factors) -> Self {
        let towards = TOWARDS.normalize();
        let right = DVec3::Z.cross(towards).normalize();
        let axes = [right, right.cross(towards), towards];
        // Find the bounding box of the vertices along the first two axes.
        let mut ends = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
        for vertex in factors.mesh.polygons.iter().flatten() {
            let vertex = DVec3::from_array(factors.mesh.vertices[*vertex as usize]);
            for (end, axis) in ends.iter_mut().zip(axes) {
                let along = axis.dot(vertex);
                *end = [end[0].min(along), end[1].max(along)];
            }
        }
        // Fit the box into the picture.
        let [width, height] = VIEW.map(f64::from);
        let [across, down] = ends.map(|[low, high]| (high - low).max(f64::MIN_POSITIVE));
        let scale = 0.96 * (width / across).min(height / down);
        let middle = ends.map(|[low, high]| 0.5 * (low + high));
        let corner = [
            middle[0] - 0.5 * width / scale,
            middle[1] - 0.5 * height / scale,
        ];
        Self {
            axes,
            corner,
            scale,
        }
    }

    /// Returns the facet in each pixel: the nearest of the facets that face the viewer, by a depth
    /// buffer.
    fn draw(&self, factors: &Factors) -> Vec<Option<u32>> {
        let area = (VIEW[0] * VIEW[1]) as usize;
        let (mut seen, mut depths) = (vec![None; area], vec![f64::NEG_INFINITY; area]);
        let project = |vertex: &u32| {
            let vertex = DVec3::from_array(factors.mesh.vertices[*vertex as usize]);
            let [x, y, z] = self.axes.map(|axis| axis.dot(vertex));
            let [left, top] = self.corner;
            DVec3::new(self.scale * (x - left), self.scale * (y - top), z)
        };
        for (facet, polygon) in (0_u32..).zip(&factors.mesh.polygons) {
            let corners: Vec<DVec3> = polygon.iter().map(project).collect();
            for k in 2..corners.len() {
                let triangle = [corners[0], corners[k - 1], corners[k]];
                fill(triangle, factors.args.sides == 2, |pixel, depth| {
                    if depth > depths[pixel] {
                        depths[pixel] = depth;
                        seen[pixel] = Some(facet);
                    }
                });
            }
        }
        seen
    }
}

/// Calls a function with each pixel whose centre a triangle covers, and the depth there.
fn fill([a, b, c]: [DVec3; 3], both_sides: bool, mut each: impl FnMut(usize, f64)) {
    let cross =
        |p: DVec3, q: DVec3, r: DVec3| (q.x - p.x) * (r.y - p.y) - (q.y - p.y) * (r.x - p.x);
    let area = cross(a, b, c);
    // The second axis points down, so that counter-clockwise triangles have a negative area.
    if area == 0.0 || (area > 0.0 && !both_sides) {
        return;
    }
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "clamped to the picture"
    )]
    // Visit the pixels in the bounding box of the triangle.
    let pixels = |of: fn(&DVec3) -> f64, size: u32| {
        let values = [of(&a), of(&b), of(&c)];
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        let high = values.iter().copied().fold(0.0, f64::max);
        let end = f64::from(size);
        (low - 0.5).clamp(0.0, end) as u32..(high + 0.5).clamp(0.0, end) as u32
    };
    let rows = pixels(|p| p.y, VIEW[1]);
    let columns = pixels(|p| p.x, VIEW[0]);
    for y in rows {
        for x in columns.clone() {
            let at = DVec3::new(f64::from(x) + 0.5, f64::from(y) + 0.5, 0.0);
            // Barycentric coordinates are all positive inside, and interpolate the depth.
            let [u, v, w] = [cross(b, c, at), cross(c, a, at), cross(a, b, at)].map(|e| e / area);
            if u.min(v).min(w) >= 0.0 {
                each((y * VIEW[0] + x) as usize, u * a.z + v * b.z + w * c.z);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::FactorArgs;
    use linelit_viewfactors::files::Mesh;

    /// A square that faces up sees only the sky; one below it that faces down is not in the
    /// picture, which is white elsewhere.
    #[test]
    fn facets_are_drawn_by_their_sky() {
        let args = FactorArgs {
            tolerance: 1e-3,
            sides: 1,
        };
        let square = |z: f64| [[0.0, 0.0, z], [1.0, 0.0, z], [1.0, 1.0, z], [0.0, 1.0, z]];
        let mesh = Mesh {
            vertices: [square(0.0), square(-0.01)].concat(),
            polygons: vec![vec![0, 1, 2, 3], vec![7, 6, 5, 4]],
            senders: 2,
            ..Mesh::default()
        };
        let factors = Factors::new("squares", mesh, &args).unwrap();
        let found = factors.at_once().unwrap();
        let picture = sky(&factors, &found).unwrap();
        let decoded = linelit_film::decode_picture("sky.png", &picture.png);
        let linelit_film::Pixels::Bytes(image) = decoded.unwrap().unwrap().pixels else {
            panic!("not of bytes");
        };
        let [width, height] = VIEW;
        let at = |x: u32, y: u32| image.rgb[(y * width + x) as usize];
        assert_eq!(at(width / 2, height / 2), linelit_film::heat_colour(1.0));
        assert_eq!(at(2, 2), [255; 3]);
        let colours: std::collections::BTreeSet<_> = image.rgb.iter().collect();
        assert_eq!(colours.len(), 3, "the square, its edge, and white");
    }

    #[test]
    fn small_numbers_keep_their_digits() {
        assert_eq!(
            [0.0, 0.25, -1e-9].map(shown),
            ["0.000000", "0.250000", "-1.00e-9"]
        );
    }
}
