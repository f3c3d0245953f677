//! The reader of material libraries (MTL files).
//!
//! It reads `Kd`, `Ks`, `Ns`, `Ke`, their maps and `norm`. A material with a `Ks` above zero
//! becomes linelit's `phong`, other materials are Lambertian. `map_d` cuts holes where it is below
//! one half. Bump maps are left out with a warning, as their heights have no unit.

use super::lines::{Lines, number, numbers};
use linelit_assembly::{Assembly, ErrorKind, Holes, Location, Result, Source, Span, shorten};
use linelit_geometry::{DVec2, DVec3};
use linelit_scene::{
    Cutout, EmissionSpec, ImageData, ImageTexture, Material, MaterialKind, NormalMap, Texture,
    UvMapping, Wrap,
};
use std::collections::HashMap;
use std::sync::Arc;

/// The statements that do not affect direct light on opaque surfaces, and are ignored.
const SILENT: &[&str] = &[
    "Ka",
    "Ni",
    "illum",
    "Tf",
    "sharpness",
    "map_Ka",
    "Km",
    "map_aat",
    "Pc",
    "Pcr",
    "aniso",
    "anisor",
];

/// The material that is being read, as far as the file has described it.
#[derive(Default)]
struct Draft {
    name: String,
    kd: Option<DVec3>,
    kd_map: Option<Texture>,
    ks: DVec3,
    ks_map: Option<Texture>,
    ns: Option<f64>,
    ke: DVec3,
    ke_map: Option<Texture>,
    normals: Option<Texture>,
    /// The mask of `d` or `map_d`, as an index into the builder's alphas.
    alpha: Option<u32>,
}

/// A material of the scene with the properties that OBJ has in materials and a scene in meshes.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Entry {
    /// The index in the scene.
    pub(super) index: u32,
    pub(super) emission: Option<EmissionSpec>,
    /// The masks that cut holes into shapes of this material.
    pub(super) cutout: Option<Cutout>,
}

/// The statements, with the ignored ones, by which a file is recognised as a library.
const FIRST: &[&str] = &[
    "newmtl", "Kd", "Ks", "Ke", "Ns", "d", "Tr", "map_Kd", "norm",
];

/// Returns whether a file is empty or begins with a statement of a material library.
pub(super) fn begins(source: &Source) -> bool {
    let first = Lines::new(source).next();
    let word = first.and_then(|line| line.words.first().map(|w| source.text(*w)));
    word.is_none_or(|w| FIRST.iter().chain(SILENT).any(|known| *known == w))
}

/// Reads a library, adds its materials to the scene, and returns them by name.
pub(super) fn read(base: &mut Assembly, source: &Source) -> Result<HashMap<String, Entry>> {
    let mut materials = HashMap::new();
    let mut draft: Option<Draft> = None;
    for line in Lines::new(source) {
        let Some((&keyword, rest)) = line.words.split_first() else {
            continue;
        };
        // Finish a material where the next one begins.
        if &source.bytes()[keyword.start..keyword.end] == b"newmtl" {
            if let Some(done) = draft.take() {
                finish(base, done, &mut materials)?;
            }
            let (name, _) = line.rest(source);
            draft = Some(Draft {
                name,
                ..Draft::default()
            });
            continue;
        }
        // Read a statement of a material.
        let Some(draft) = &mut draft else {
            let message = "a material statement before `newmtl`";
            let at = source.at(keyword);
            base.warn(ErrorKind::Nesting, message, "left out", at)?;
            continue;
        };
        statement(base, source, draft, keyword, rest)?;
    }
    if let Some(done) = draft {
        finish(base, done, &mut materials)?;
    }
    Ok(materials)
}

/// Reads one statement of a material.
fn statement(
    base: &mut Assembly,
    source: &Source,
    draft: &mut Draft,
    keyword: Span,
    rest: &[Span],
) -> Result<()> {
    /// The warning about partial transparency.
    const OPAQUE: &str = "transparency is not supported: surfaces are there or not";
    let at = source.at(keyword);
    match &source.bytes()[keyword.start..keyword.end] {
        // Read colours and the exponent.
        b"Kd" => draft.kd = Some(colour(base, source, keyword, rest)?),
        b"Ks" => draft.ks = colour(base, source, keyword, rest)?,
        b"Ke" => draft.ke = colour(base, source, keyword, rest)?,
        b"Ns" => draft.ns = Some(numbers::<1>(source, keyword, rest)?[0].max(0.0)),
        // Read holes, and warn about partial transparency.
        b"map_d" => draft.alpha = alpha(base, source, keyword, rest)?,
        b"d" | b"Tr" => {
            let value = rest.last().map_or(Ok(1.0), |s| number(source, *s))?;
            let is_opaque = if source.text(keyword) == "d" {
                value >= 1.0
            } else {
                value <= 0.0
            };
            if !is_opaque {
                base.unsupported(OPAQUE, "taken as there", at)?;
            }
        }
        // Read images.
        b"map_Kd" => draft.kd_map = image(base, source, rest, true)?,
        b"map_Ks" => draft.ks_map = image(base, source, rest, true)?,
        b"map_Ke" => draft.ke_map = image(base, source, rest, true)?,
        b"norm" => draft.normals = image(base, source, rest, false)?,
        other => {
            let word = shorten(&String::from_utf8_lossy(other));
            if !SILENT.contains(&word.as_str()) {
                let message = format!("material statement `{word}` is not supported");
                base.unsupported(message, "left out", at)?;
            }
        }
    }
    Ok(())
}

/// Reads a colour: `r g b`, or one number for all three.
fn colour(base: &mut Assembly, source: &Source, keyword: Span, rest: &[Span]) -> Result<DVec3> {
    if let Some(first) = rest.first()
        && matches!(source.text(*first).as_str(), "spectral" | "xyz")
    {
        let message = "spectral and XYZ colours are not supported";
        base.unsupported(message, "replaced by 0.5", source.at(*first))?;
        return Ok(DVec3::splat(0.5));
    }
    let rgb = if rest.len() == 1 {
        numbers::<1>(source, keyword, rest).map(|[v]| DVec3::splat(v))
    } else {
        numbers::<3>(source, keyword, rest).map(DVec3::from_array)
    }?;
    if rgb.min_element() < 0.0 {
        let message = format!("negative `{}`", source.text(keyword));
        let at = source.at(keyword);
        return Err(at.error(ErrorKind::OutOfRange, message, "must not be negative"));
    }
    Ok(rgb)
}

/// Reads a map of colours or normals, such as `map_Kd [options] name`.
fn image(
    base: &mut Assembly,
    source: &Source,
    words: &[Span],
    srgb: bool,
) -> Result<Option<Texture>> {
    map(
        base,
        source,
        words,
        "replaced by its colour",
        |base, name, at| base.image(name, srgb, at),
    )
}

/// Reads `map_d [options] name`, which cuts holes where the alpha channel of the image, or its
/// luminance if it has no alpha channel, is below one half. The result is the index of the mask.
fn alpha(
    base: &mut Assembly,
    source: &Source,
    keyword: Span,
    words: &[Span],
) -> Result<Option<u32>> {
    let texture = map(base, source, words, "taken as there", |base, name, at| {
        base.alpha_image(name, at)
    })?;
    let at = source.at(keyword);
    let holes = texture.map(|texture| base.alpha(texture, 0.5, at));
    Ok(holes.transpose()?.and_then(Holes::alpha))
}

/// Reads `[options] name`. `read` loads the image of this name. `instead` is the part of the
/// warning that says what happens if the image cannot be loaded.
fn map(
    base: &mut Assembly,
    source: &Source,
    words: &[Span],
    instead: &str,
    read: impl FnOnce(&mut Assembly, &str, Location<'_>) -> Result<Option<Arc<ImageData>>>,
) -> Result<Option<Texture>> {
    let (mapping, wrap, rest) = map_options(source, words)?;
    let [first, ..] = rest else {
        return Ok(None);
    };
    let span = first.to(rest[rest.len() - 1]);
    let name = source.text(span);
    let at = source.at(span);
    let data = match read(base, &name, at) {
        Ok(data) => data,
        // Only warn about missing and broken images, which are common.
        Err(error) if matches!(error.kind(), ErrorKind::Io | ErrorKind::Syntax) => {
            base.warn(error.kind(), error.message(), instead, at)?;
            None
        }
        Err(error) => return Err(error),
    };
    Ok(data.map(|data| {
        Texture::Image(Arc::new(ImageTexture {
            mapping,
            wrap: [wrap; 2],
            ..ImageTexture::new(data)
        }))
    }))
}

/// Reads the options of a map, and returns the remaining words. Scale, offset and clamping are
/// read, other options are skipped.
fn map_options<'w>(source: &Source, words: &'w [Span]) -> Result<(UvMapping, Wrap, &'w [Span])> {
    let (mut mapping, mut wrap, mut rest) = (UvMapping::IDENTITY, Wrap::Repeat, words);
    while let [word, behind @ ..] = rest {
        // `-s`, `-o` and `-t` take one to three numbers.
        let numbers = behind.iter().take(3).map(|s| number(source, *s));
        let numbers: Vec<f64> = numbers.map_while(Result::ok).collect();
        let pair = |default| DVec2::new(numbers[0], numbers.get(1).copied().unwrap_or(default));
        let taken = match source.text(*word).as_str() {
            "-s" | "-o" | "-t" if numbers.is_empty() => 0,
            option @ ("-s" | "-o" | "-t") => {
                match option {
                    "-s" => mapping.scale = pair(1.0),
                    "-o" => mapping.offset = pair(0.0),
                    _ => {}
                }
                numbers.len()
            }
            "-clamp" => {
                if behind.first().is_some_and(|s| source.text(*s) == "on") {
                    wrap = Wrap::Clamp;
                }
                1
            }
            "-blendu" | "-blendv" | "-cc" | "-imfchan" | "-texres" | "-bm" | "-boost" => 1,
            "-mm" => 2,
            _ => break,
        };
        rest = behind.get(taken..).unwrap_or_default();
    }
    Ok((mapping, wrap, rest))
}

/// Returns the product of a map and its factor, as the format says. A black factor is replaced by
/// one: files often have it by mistake.
fn textured(map: Texture, factor: DVec3) -> Texture {
    if factor == DVec3::ZERO || factor == DVec3::ONE {
        map
    } else {
        Texture::Product(Arc::new(map), Arc::new(Texture::Constant(factor)))
    }
}

/// Adds a material to the scene when all of its statements have been read.
fn finish(base: &mut Assembly, draft: Draft, materials: &mut HashMap<String, Entry>) -> Result<()> {
    // Choose the model: Phong if there is a specular part, else Lambert.
    let kd = match draft.kd_map {
        Some(map) => textured(map, draft.kd.unwrap_or(DVec3::ONE)),
        None => Texture::Constant(draft.kd.unwrap_or(DVec3::splat(0.8))),
    };
    let kind = if draft.ks == DVec3::ZERO && draft.ks_map.is_none() {
        MaterialKind::Matte {
            kd,
            sigma: Texture::number(0.0),
        }
    } else {
        MaterialKind::Phong {
            kd,
            ks: match draft.ks_map {
                Some(map) => textured(map, draft.ks),
                None => Texture::Constant(draft.ks),
            },
            exponent: Texture::number(draft.ns.unwrap_or(0.0)),
        }
    };
    // Add the material.
    let index = base.builder.add_material(Material {
        name: draft.name.clone(),
        kind,
        bump: None,
        normal_map: draft.normals.map(|texture| NormalMap {
            texture,
            scale: 1.0,
        }),
    });
    // Note the emission and the holes for the meshes of this material. A map without `Ke` emits
    // as it is.
    let mut emission = (draft.ke != DVec3::ZERO).then_some(EmissionSpec::one_sided(draft.ke));
    if let Some(map) = draft.ke_map {
        let mut spec = emission.unwrap_or(EmissionSpec::one_sided(DVec3::ONE));
        spec.map = Some(base.builder.add_emission_map(Arc::new(map)));
        emission = Some(spec);
    }
    let cutout = draft.alpha.map(|alpha| Cutout {
        seen: Some(alpha),
        shadow: None,
    });
    let entry = Entry {
        index,
        emission,
        cutout,
    };
    materials.insert(draft.name, entry);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use linelit_assembly::LoadOptions;

    const SEED: &str = "newmtl a\nKd 0.5 .25 1e-1\nKs 1 1 1\nNs 32\nd 0.5\nmap_Kd -s 2 2 -o .5 0 0 -clamp on no such.tga\n\
        newmtl b c\nKe 1 2 3\nmap_Ke x.png\nnorm y.png\nTr 0\nillum 2\nKd spectral f.rfl\nbump -bm 2 z.png\n";

    fn attempt(bytes: &[u8]) -> Result<usize> {
        let mut base = Assembly::new(None, bytes.len(), &LoadOptions::default());
        read(&mut base, &Source::new("test.mtl", bytes.to_vec())).map(|m| m.len())
    }

    #[test]
    fn libraries_are_read_with_their_warnings() {
        assert_eq!(attempt(SEED.as_bytes()).unwrap(), 2);
    }

    #[test]
    fn broken_libraries_are_errors_or_warnings() {
        let bytes = SEED.as_bytes();
        for cut in 0..bytes.len() {
            let _ = attempt(&bytes[..cut]);
        }
        for k in 0..bytes.len() {
            for value in [0, b' ', b'\n', b'-', b'9', 0xff] {
                let mut bytes = bytes.to_vec();
                bytes[k] = value;
                let _ = attempt(&bytes);
                bytes.remove(k);
                let _ = attempt(&bytes);
            }
        }
    }
}
