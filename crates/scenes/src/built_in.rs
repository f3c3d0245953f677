//! [`BuiltIn`], the table of the built-in scenes with their generators.

use crate::{Files, colonnade, foliage, gloss, logo, papers, rooms, spheres, window};

/// A scene that a generator of this crate makes, by its name.
#[derive(Clone, Copy, Debug)]
pub struct BuiltIn {
    /// The name by which [`Library::load`](crate::Library::load) and the command line find it.
    pub name: &'static str,
    /// A description of the scene on one line.
    pub about: &'static str,
    generator: fn() -> Files,
}

impl BuiltIn {
    /// All scenes that are listed to users.
    ///
    /// ```
    /// use linelit_scenes::BuiltIn;
    ///
    /// assert!(BuiltIn::ALL.iter().any(|scene| scene.name == "cornell-box-large"));
    /// ```
    pub const ALL: [Self; 19] = [
        Self::new(
            "cornell-box-small",
            "two blocks in a room, a small square light: nearly hard shadows",
            rooms::cornell_box,
        ),
        Self::new(
            "cornell-box-large",
            "two blocks in a room, a large square light: wide penumbrae",
            rooms::cornell_box,
        ),
        Self::new(
            "cornell-box-line",
            "two blocks in a room, a linear light",
            rooms::cornell_box,
        ),
        Self::new(
            "grid-planes-small",
            "crossed grids of bars over a plane, a small light",
            rooms::grid_planes,
        ),
        Self::new(
            "grid-planes-large",
            "crossed grids of bars over a plane, a large light behind 64 of them",
            rooms::grid_planes,
        ),
        Self::new(
            "triangle-soup-small",
            "a thousand triangles afloat in a room, a small triangular light",
            rooms::triangle_soup,
        ),
        Self::new(
            "triangle-soup-large",
            "a thousand triangles afloat in a room, a large triangular light",
            rooms::triangle_soup,
        ),
        Self::new(
            "logo-small",
            "letters on a glossy plane (Phong), a small light",
            logo::logo,
        ),
        Self::new(
            "logo-large",
            "letters on a glossy plane (Phong), a large light",
            logo::logo,
        ),
        Self::new(
            "colonnade-small",
            "arcades of a quarter of a million triangles, a small light far above",
            colonnade::colonnade,
        ),
        Self::new(
            "colonnade-large",
            "arcades of a quarter of a million triangles, under an open sky",
            colonnade::colonnade,
        ),
        Self::new(
            "colonnade-line",
            "arcades of a quarter of a million triangles, under a long linear light",
            colonnade::colonnade,
        ),
        Self::new(
            "floating-quad",
            "a quad whose edges are parallel to the light's (Salesin & Jarosz 2019, fig. 5)",
            gloss::floating_quad,
        ),
        Self::new(
            "strips",
            "occluders on five glossy strips, rough on the left, smooth on the right",
            gloss::strips,
        ),
        Self::new(
            "monoliths",
            "slabs on a glossy floor before a wide light",
            gloss::monoliths,
        ),
        Self::new(
            "plates",
            "after Veach: plates of four roughnesses under lights of four sizes, bars between",
            gloss::plates,
        ),
        Self::new(
            "window",
            "a window with a view behind blinds: a textured light",
            window::window,
        ),
        Self::new(
            "foliage",
            "a tree of 240 copies of one twig, its leaves cut out by an alpha",
            foliage::foliage,
        ),
        Self::new(
            "spheres",
            "closed bumpy spheres of 10⁴ triangles; `spheres-1e3` to `spheres-1e6`: of 10³ to 10⁶",
            || spheres::spheres("spheres", 9),
        ),
    ];

    /// The scenes `spheres` with other numbers of triangles, which are not listed.
    const SIZES: [Self; 4] = [
        Self::new(
            "spheres-1e3",
            "closed bumpy spheres of 10³ triangles",
            || spheres::spheres("spheres-1e3", 3),
        ),
        Self::new(
            "spheres-1e4",
            "closed bumpy spheres of 10⁴ triangles",
            || spheres::spheres("spheres-1e4", 9),
        ),
        Self::new(
            "spheres-1e5",
            "closed bumpy spheres of 10⁵ triangles",
            || spheres::spheres("spheres-1e5", 29),
        ),
        Self::new(
            "spheres-1e6",
            "closed bumpy spheres of 10⁶ triangles",
            || spheres::spheres("spheres-1e6", 91),
        ),
    ];

    /// The scenes of the papers' figures and claims, which are not listed.
    const OF_PAPERS: [Self; 9] = [
        Self::new("bare", "a diffuse floor under a square light", papers::bare),
        Self::new("screened", "the same behind a screen", papers::screened),
        Self::new(
            "hidden",
            "the same with a bright light that nobody sees",
            papers::hidden,
        ),
        Self::new(
            "horizon",
            "a linear light that goes through the horizon",
            papers::horizon,
        ),
        Self::new("wet", "a wet floor under a linear light", papers::wet),
        Self::new("dry", "a dry floor under a linear light", papers::dry),
        Self::new(
            "luminaires-2",
            "a room with two triangular lights",
            papers::luminaires_2,
        ),
        Self::new(
            "luminaires-32",
            "a room with 32 triangular lights",
            papers::luminaires_32,
        ),
        Self::new(
            "shining-ball",
            "a floor and a block beside a spherical light",
            papers::shining_ball,
        ),
    ];

    /// Creates an entry of the table.
    const fn new(name: &'static str, about: &'static str, generator: fn() -> Files) -> Self {
        Self {
            name,
            about,
            generator,
        }
    }

    /// Returns the built-in scene with this name; `None` if there is none. `-large` may be left out
    /// of the name: `cornell-box` means `cornell-box-large`. In addition to [`BuiltIn::ALL`], this
    /// function finds `spheres-1e3` to `spheres-1e6` and the scenes of the papers' claims.
    pub fn find(name: &str) -> Option<Self> {
        let all = || {
            Self::ALL
                .into_iter()
                .chain(Self::SIZES)
                .chain(Self::OF_PAPERS)
        };
        let find = |name: &str| all().find(|scene| scene.name == name);
        find(name).or_else(|| find(&format!("{name}-large")))
    }

    /// Returns the name of the scene's main file.
    #[must_use]
    pub fn main_file(&self) -> String {
        format!("{}.pbrt", self.name)
    }

    /// Generates the main file of the scene and all files that the main file names, perhaps
    /// together with the main files of other variants of the scene.
    #[must_use]
    pub fn files(&self) -> Files {
        (self.generator)()
    }
}
