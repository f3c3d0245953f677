//! Rules about what the code of each room may say.

use super::{House, Source};
use crate::source::lines_with;
use std::fs;

/// Crates that do no I/O, start no thread and cannot fail.
const PURE: [&str; 7] = [
    "simd", "geometry", "samplers", "lights", "bsdf", "shading", "mis",
];
/// All libraries; cli and workshop are programs.
const LIBRARIES: &[&str] = &[
    "simd",
    "geometry",
    "samplers",
    "lights",
    "bsdf",
    "shading",
    "visibility",
    "mis",
    "penumbra",
    "scene",
    "assembly",
    "pbrt",
    "formats",
    "scenes",
    "estimators",
    "integrator",
    "film",
    "study",
    "papers",
    "linelit",
    "testkit",
];
/// The crates in the path of a pixel.
const PIXEL_PATH: [&str; 11] = [
    "simd",
    "geometry",
    "samplers",
    "lights",
    "bsdf",
    "shading",
    "visibility",
    "mis",
    "penumbra",
    "estimators",
    "integrator",
];

/// Files in which `unsafe` may stand: SIMD kernels and their dispatch, each with a scalar twin that
/// tests hold it to.
const UNSAFE_ROOMS: [&str; 2] = ["crates/simd/src/x86.rs", "crates/shading/src/simd"];

/// Where `f32` may stand in the crates of f64: kernels with a stated error bound.
const F32_ROOMS: [&str; 2] = ["crates/lights/src/linear", "crates/shading/src/ltc"];

/// Foreign crates and the one room that may name each.
const NAMED_ONLY_IN: [(&str, &[&str]); 11] = [
    ("glam", &["geometry"]),
    ("obvhs", &["visibility", "workshop"]),
    ("rand", &["samplers", "study", "workshop"]),
    ("rand_pcg", &["samplers", "study", "workshop"]),
    ("sobol_burley", &["samplers"]),
    ("exr", &["film"]),
    ("png", &["film"]),
    ("zune_jpeg", &["film"]),
    ("flate2", &["film", "assembly"]),
    ("tobj", &["formats"]),
    ("gltf", &["formats"]),
];

pub(super) fn foreign_names(house: &House) -> Vec<String> {
    let mut problems = Vec::new();
    for file in house.sources.iter().filter(|s| s.shipped) {
        for (name, rooms) in NAMED_ONLY_IN {
            if !rooms.contains(&file.owner.as_str()) {
                // A path or an import; the bare word may be a variable or a module of our own.
                let mut lines = lines_with(&file.code, &format!("use {name}"));
                lines.extend(foreign_paths(&file.code, name));
                let complaint = |line| {
                    let rooms = rooms.join(" and ");
                    format!("{}:{line}: only {rooms} may name {name}", file.path)
                };
                problems.extend(lines.into_iter().map(complaint));
            } else if name != "glam" {
                let lines = lines_with(&file.code, &format!("pub use {name}"));
                let complaint = |line| {
                    format!(
                        "{}:{line}: types of {name} stay out of public APIs",
                        file.path
                    )
                };
                problems.extend(lines.into_iter().map(complaint));
            }
        }
    }
    problems
}

/// Lines with a path that begins with `name::`, outside `use` items (those are looked at by their
/// own first word, as `use linelit_geometry::{glam::Vec3}` is nobody's business).
fn foreign_paths(code: &str, name: &str) -> Vec<usize> {
    if !lines_with(code, &format!("mod {name}")).is_empty() {
        // A module of our own by that name.
        return Vec::new();
    }
    let word = format!("{name}::");
    let starts_path = |line: &str| {
        line.match_indices(&word).any(|(i, _)| {
            let before = &line[..i];
            let global = before
                .strip_suffix("::")
                .is_some_and(|b| b.is_empty() || b.ends_with([' ', '(', '<', '&']));
            global || !before.ends_with(|c: char| c.is_alphanumeric() || c == '_' || c == ':')
        })
    };
    let plain = without_use_items(code);
    let lines = plain.lines().enumerate();
    lines
        .filter(|(_, line)| starts_path(line))
        .map(|(i, _)| i + 1)
        .collect()
}

/// Blanks out `use …;`, keeping lines.
fn without_use_items(code: &str) -> String {
    let mut inside = false;
    let blank = |line: &str| {
        let word = line
            .trim_start()
            .trim_start_matches("pub ")
            .trim_start_matches("pub(crate) ");
        inside = inside || word.starts_with("use ");
        let kept = if inside { "" } else { line };
        inside = inside && !line.contains(';');
        format!("{kept}\n")
    };
    code.lines().map(blank).collect()
}

/// Words that mean an effect, who may have it, and why others may not.
const EFFECTS: [(&[&str], &[&str], &str); 6] = [
    (
        &[
            "std::fs",
            "fs::read",
            "fs::write",
            "File::open",
            "File::create",
        ],
        &["assembly", "film", "study", "testkit"],
        "only assembly, film, study and testkit touch files",
    ),
    (
        &["Instant", "SystemTime"],
        &["study", "papers"],
        "only study and papers know clocks",
    ),
    (
        &[
            "std::thread",
            "thread::spawn",
            "thread::scope",
            "ThreadPool",
            "ThreadPoolBuilder",
            "thread_local!",
        ],
        &["study"],
        "only study starts threads",
    ),
    (
        &["rayon"],
        &["study", "visibility"],
        "only study and visibility share out work among threads",
    ),
    (
        &[
            "std::env",
            "env::var",
            "env::args",
            "process::exit",
            "process::Command",
            "std::net",
        ],
        // Built-in scenes are looked for from the working folder upwards.
        &["scenes", "study"],
        "libraries know nothing of the world around them",
    ),
    (
        &[
            "println!",
            "print!",
            "eprintln!",
            "eprint!",
            "dbg!",
            "stdout()",
            "stderr()",
        ],
        &[],
        "libraries do not print",
    ),
];

/// The one file of a library that may name rayon: outside of a pool it runs everything where it is
/// called.
const POOL: &str = "crates/visibility/src/pool.rs";

pub(super) fn effects(house: &House) -> Vec<String> {
    let mut problems = Vec::new();
    for file in house.shipped(LIBRARIES) {
        for (words, rooms, why) in EFFECTS {
            if !rooms.contains(&file.owner.as_str()) {
                problems.extend(words.iter().flat_map(|word| file.complain(word, why)));
            }
        }
    }
    for file in house
        .shipped(&["visibility"])
        .filter(|file| file.path != POOL)
    {
        let why = "work is shared out by crate::pool, which starts no pool of its own";
        problems.extend(file.complain("rayon", why));
    }
    // What is known of the processor is all that is shared.
    let stateless = |file: &&Source| file.path != "crates/simd/src/isa.rs";
    for file in house.shipped(&PURE).filter(stateless) {
        for word in [
            "std::io",
            "std::path",
            "std::sync",
            "static mut",
            "Mutex",
            "RefCell",
        ] {
            problems.extend(file.complain(word, "pure crates do no I/O and share no state"));
        }
    }
    problems
}

/// Pure crates cannot fail: in public, `Result` comes only from constructors (`try_…`, or returning
/// `Result<Self, _>`) and from reading names (`FromStr`).
pub(super) fn fallibility(house: &House) -> Vec<String> {
    let mut problems = Vec::new();
    for file in house.shipped(&PIXEL_PATH) {
        for (start, _) in file.code.match_indices("pub fn ") {
            let signature = &file.code[start + "pub fn ".len()..];
            let signature = signature.split(['{', ';']).next().unwrap_or_default();
            let name = signature
                .split(['(', '<'])
                .next()
                .unwrap_or_default()
                .trim();
            let returned = signature.rsplit_once("->").map_or("", |(_, r)| r);
            let constructor = name.starts_with("try_") || returned.contains("Result<Self");
            if returned.contains("Result") && !constructor {
                let line = file.code[..start].lines().count().max(1);
                let why = "in the path of a pixel only constructors can fail";
                problems.push(format!(
                    "{}:{line}: `{name}` returns a Result; {why}",
                    file.path
                ));
            }
        }
    }
    for file in house.shipped(&PURE) {
        for word in ["unwrap()", "panic!", "unreachable!"] {
            problems.extend(file.complain(word, "pure crates cannot fail"));
        }
    }
    for file in house.shipped(&[
        "assembly",
        "pbrt",
        "formats",
        "scene",
        "film",
        "study",
        "papers",
        "cli",
        "visibility",
        "estimators",
        "integrator",
    ]) {
        problems.extend(file.complain(
            "unwrap()",
            "say with expect(\"…\") why it cannot fail, or return the error",
        ));
    }
    problems
}

/// Where pure crates may use the heap: what is built once for a light or a query's scratch, or says
/// what went wrong.
const HEAP_ROOMS: [(&str, &str); 7] = [
    (
        "crates/geometry/src/intervals/set.rs",
        "collects into a SmallVec, which spills only beyond its inline pieces",
    ),
    (
        "crates/lights/src/selection/",
        "tables and trees over all lights, built once for a scene",
    ),
    (
        "crates/geometry/src/intervals/tree.rs",
        "nodes are kept for the next query",
    ),
    (
        "crates/lights/src/image.rs",
        "tables of a textured light, built with it",
    ),
    (
        "crates/lights/src/line/by_texture.rs",
        "tables of a textured light and a direction, built with it",
    ),
    (
        "crates/lights/src/linear/profile.rs",
        "tables of a profile, built with it",
    ),
    (
        "crates/samplers/src/kind.rs",
        "the name that an error quotes",
    ),
];

/// Pure crates do not allocate per sample; so they do not allocate but in the rooms above.
pub(super) fn heap(house: &House) -> Vec<String> {
    let mut problems = Vec::new();
    for file in house.shipped(&PURE) {
        if HEAP_ROOMS
            .iter()
            .any(|(room, _)| file.path.starts_with(room))
        {
            continue;
        }
        for word in [
            "Vec<", "Vec::", "vec!", "Box", "Rc", "Arc", "String", "format!", "to_vec", "collect",
        ] {
            problems.extend(file.complain(word, "pure crates do not allocate"));
        }
    }
    problems
}

/// Where fused operations may stand although the instruction sets differ in them:
/// culling, whose verdicts have room for the rounding of either, never the ends of intervals.
const CULLING: &str = "crates/simd/src/x86.rs";

pub(super) fn numbers(house: &House) -> Vec<String> {
    let mut problems = Vec::new();
    for file in house.shipped(&["geometry", "lights", "bsdf", "shading", "mis"]) {
        if !F32_ROOMS.iter().any(|room| file.path.starts_with(room)) {
            problems.extend(file.complain("f32", "f64 in geometry, lights, shading and mis"));
        }
    }
    for file in house
        .shipped(&["simd", "visibility"])
        .filter(|file| file.path != CULLING)
    {
        for word in [
            "mul_add",
            "_mm256_fmadd_ps",
            "_mm512_fmadd_ps",
            "_mm256_fmadd_pd",
        ] {
            let why = "kernels of all instruction sets must give the same bits";
            problems.extend(file.complain(word, why));
        }
    }
    problems
}

pub(super) fn no_dyn_in_the_pixel_loop(house: &House) -> Vec<String> {
    house
        .shipped(&PIXEL_PATH)
        .flat_map(|f| f.complain("dyn", "no dynamic dispatch in the path of a pixel"))
        .collect()
}

pub(super) fn unsafe_stays_in_its_rooms(house: &House) -> Vec<String> {
    let mut problems = Vec::new();
    for file in &house.sources {
        let lines = lines_with(&file.code, "unsafe");
        let allowed = UNSAFE_ROOMS.iter().any(|room| file.path.starts_with(room));
        for line in lines {
            if !allowed {
                problems.push(format!("{}:{line}: unsafe only in SIMD kernels", file.path));
            } else if !justified(&file.text, line) {
                problems.push(format!(
                    "{}:{line}: unsafe without a SAFETY line above it",
                    file.path
                ));
            }
        }
    }
    problems
}

/// Whether a SAFETY comment (or a `# Safety` section) stands on the line or among the twelve before
/// it.
fn justified(text: &str, line: usize) -> bool {
    let first = line.saturating_sub(13);
    text.lines()
        .skip(first)
        .take(line - first)
        .any(|l| l.contains("SAFETY") || l.contains("# Safety"))
}

pub(super) fn unfinished_work(house: &House) -> Vec<String> {
    let mut problems = Vec::new();
    for file in &house.sources {
        for word in ["todo!", "unimplemented!"] {
            problems.extend(file.complain(word, "unfinished work"));
        }
        // Comments and reasons are literals, so look at the text; the words are split to not find
        // themselves.
        for (i, line) in file.text.lines().enumerate() {
            let line = line.trim();
            for word in [
                concat!("TO", "DO"),
                concat!("FIX", "ME"),
                concat!("XX", "X"),
            ] {
                if !lines_with(line, word).is_empty() {
                    problems.push(format!(
                        "{}:{}: {word} in a comment; finish it or open an issue",
                        file.path,
                        i + 1
                    ));
                }
            }
            if line.starts_with("#[ignore") && !line.starts_with("#[ignore = \"long: ") {
                problems.push(format!(
                    "{}:{}: an ignored test says `long: …` why (and runs with --long)",
                    file.path,
                    i + 1
                ));
            }
        }
    }
    problems
}

pub(super) fn size(house: &House) -> Vec<String> {
    const MOST: usize = 700;
    let long = house
        .sources
        .iter()
        .filter(|s| s.text.lines().count() > MOST);
    long.map(|s| {
        format!(
            "{}: {} lines; split it by concept (at most {MOST})",
            s.path,
            s.text.lines().count()
        )
    })
    .collect()
}

/// Crates whose comments are still to be wrapped.
const WIDE: &[&str] = &[
    "assembly",
    "pbrt",
    "bsdf",
    "estimators",
    "film",
    "formats",
    "geometry",
    "integrator",
    "penumbra",
    "scene",
    "shading",
    "testkit",
    "visibility",
];

/// Comments end at column 100; rustfmt wraps none. Rows of tables cannot be wrapped.
pub(super) fn comments(house: &House) -> Vec<String> {
    const MOST: usize = 100;
    let mut problems = Vec::new();
    let narrow = house
        .sources
        .iter()
        .filter(|s| !WIDE.contains(&s.owner.as_str()));
    for file in narrow {
        for (i, line) in file.text.lines().enumerate() {
            let text = line.trim_start();
            let row = text.starts_with("//! |") || text.starts_with("/// |");
            // Text of another file, in a literal.
            let literal = text.ends_with("\\n\\");
            let width = line.chars().count();
            if text.starts_with("//") && !row && !literal && width > MOST {
                let path = &file.path;
                problems.push(format!("{path}:{}: a comment of {width} columns", i + 1));
            }
        }
    }
    problems
}

/// Each library opens with a summary and shows an example, in its front page or the README that the
/// page includes.
pub(super) fn crate_pages(house: &House) -> Vec<String> {
    let mut problems = Vec::new();
    for file in house
        .sources
        .iter()
        .filter(|s| s.path.ends_with("/src/lib.rs"))
    {
        if !file.text.starts_with("//!") && !file.text.starts_with("#![doc") {
            problems.push(format!("{}: opens without a summary", file.path));
        }
        let readme = house
            .root
            .join("crates")
            .join(&file.owner)
            .join("README.md");
        let included = file.text.contains("include_str!(\"../README.md\")");
        let readme = if included {
            fs::read_to_string(readme).unwrap_or_default()
        } else {
            String::new()
        };
        let front = file
            .text
            .lines()
            .take_while(|l| l.starts_with("//!") || l.starts_with("#!["));
        if !front
            .chain(readme.lines())
            .any(|l| l.trim_start_matches("//! ").starts_with("```"))
        {
            problems.push(format!("{}: the front page shows no example", file.path));
        }
    }
    problems
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each rule sees the offence it is for, and nothing in comments, strings and tests.
    #[test]
    fn rules_bite() {
        type Rule = fn(&House) -> Vec<String>;
        let cases: [(Rule, &str, &str); 15] = [
            (foreign_names, "crates/scene/src/x.rs", "use glam::DVec3;"),
            (
                foreign_names,
                "crates/lights/src/x.rs",
                "let r = rand::rng();",
            ),
            (
                foreign_names,
                "crates/visibility/src/x.rs",
                "pub use obvhs::Bvh2;",
            ),
            (effects, "crates/mis/src/x.rs", "fn a() { println!(\"x\") }"),
            (
                effects,
                "crates/integrator/src/x.rs",
                "use std::time::Instant;",
            ),
            (effects, "crates/lights/src/x.rs", "use std::fs;"),
            (
                effects,
                "crates/visibility/src/x.rs",
                "fn a() { rayon::join(b, c); }",
            ),
            (
                effects,
                "crates/visibility/src/pool.rs",
                "fn a() { ThreadPoolBuilder::new(); }",
            ),
            (
                fallibility,
                "crates/shading/src/x.rs",
                "pub fn value(&self) -> Result<f64, E> { x }",
            ),
            (numbers, "crates/shading/src/x.rs", "let x: f32 = 1.0;"),
            (heap, "crates/lights/src/x.rs", "let a = vec![1.0];"),
            (
                no_dyn_in_the_pixel_loop,
                "crates/integrator/src/x.rs",
                "fn a(l: &dyn Light) {}",
            ),
            (
                unsafe_stays_in_its_rooms,
                "crates/study/src/x.rs",
                "fn a() { unsafe { b() } }",
            ),
            (
                unsafe_stays_in_its_rooms,
                "crates/visibility/src/simd/x.rs",
                "fn a() { unsafe { b() } }",
            ),
            (
                unfinished_work,
                "crates/film/src/x.rs",
                "fn a() { todo!() }",
            ),
        ];
        for (i, (rule, path, text)) in cases.into_iter().enumerate() {
            assert_eq!(rule(&House::of(path, text)).len(), 1, "case {i}: {text}");
            // Unsafe and unfinished work count in tests as well.
            if i < 12 {
                let quoted = text.replace('"', "");
                let hidden = format!(
                    "// {text}\nconst A: &str = \"{quoted}\";\n#[cfg(test)]\nmod tests {{ {text} }}"
                );
                assert!(
                    rule(&House::of(path, &hidden)).is_empty(),
                    "case {i} hidden"
                );
            }
        }
    }

    #[test]
    fn rules_let_the_right_ones_in() {
        assert!(
            foreign_names(&House::of(
                "crates/geometry/src/x.rs",
                "pub use glam::DVec3;"
            ))
            .is_empty()
        );
        assert!(
            foreign_names(&House::of(
                "crates/study/src/x.rs",
                "mod png;\npng::write();"
            ))
            .is_empty()
        );
        assert!(
            foreign_names(&House::of(
                "crates/study/src/x.rs",
                "linelit_film::png::write();"
            ))
            .is_empty()
        );
        assert!(
            fallibility(&House::of(
                "crates/geometry/src/x.rs",
                "pub fn try_new() -> Result<A, B> { c }"
            ))
            .is_empty()
        );
        let kernel = "// SAFETY: detected.\nunsafe { b() }";
        assert!(
            unsafe_stays_in_its_rooms(&House::of("crates/visibility/src/simd/x.rs", kernel))
                .is_empty()
        );
        assert!(effects(&House::of("crates/mis/tests/x.rs", "println!()")).is_empty());
        assert!(effects(&House::of(POOL, "rayon::join(a, b);")).is_empty());
    }

    #[test]
    fn long_files_are_seen() {
        assert_eq!(
            size(&House::of("crates/mis/src/x.rs", &"\n".repeat(701))).len(),
            1
        );
        assert!(size(&House::of("crates/mis/src/x.rs", &"\n".repeat(700))).is_empty());
    }
}
