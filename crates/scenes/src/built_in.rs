//! The table of the built-in scenes.

use crate::{Files, colonnade, foliage, gloss, logo, rooms, window};

/// A scene that a generator makes.
#[derive(Clone, Copy, Debug)]
pub struct BuiltIn {
    /// Its name, with which [`Library::load`](crate::Library::load) and the command line find it.
    pub name: &'static str,
    /// What it shows, in a line.
    pub about: &'static str,
    generator: fn() -> Files,
}

impl BuiltIn {
    /// All of them.
    ///
    /// ```
    /// use linelit_scenes::BuiltIn;
    ///
    /// assert!(BuiltIn::ALL.iter().any(|scene| scene.name == "cornell-box-large"));
    /// ```
    pub const ALL: [Self; 18] = [
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
            "a tree of 240 instances of one twig, its leaves cut out by an alpha",
            foliage::foliage,
        ),
    ];

    const fn new(name: &'static str, about: &'static str, generator: fn() -> Files) -> Self {
        Self {
            name,
            about,
            generator,
        }
    }

    /// The scene of this name; `cornell-box` is short for `cornell-box-large`.
    pub fn find(name: &str) -> Option<Self> {
        let find = |name: &str| Self::ALL.into_iter().find(|scene| scene.name == name);
        find(name).or_else(|| find(&format!("{name}-large")))
    }

    /// The name of its main file.
    #[must_use]
    pub fn main_file(&self) -> String {
        format!("{}.pbrt", self.name)
    }

    /// Its main file and all that it names, perhaps those of its siblings, too.
    #[must_use]
    pub fn files(&self) -> Files {
        (self.generator)()
    }
}
