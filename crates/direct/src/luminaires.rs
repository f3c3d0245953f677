//! This module has all lights of a scene, and the tables by which one of them is chosen at random.

use crate::{LightChoice, Luminaire};
use linelit_selection::{Discrete, LightRanges, LightTree};
use std::sync::OnceLock;

/// All lights of a scene, and the tables by which one of them is chosen for a sample.
#[derive(Clone, Debug, Default)]
pub struct Luminaires {
    /// The lights. Those that are always sampled come first; both parts are in the order of
    /// indices.
    lights: Vec<Luminaire>,
    /// A number that is greater than all indices. Light i has, at the shading point p of a path,
    /// the random numbers of the pair p · indices + i.
    pub(crate) indices: u32,
    pub(crate) tables: Tables,
}

/// The number of lights from which on groups of lights are left out at once. Fewer lights are
/// considered one by one.
const MANY: usize = 8;

/// The tables for choosing among lights that are the same for all shading points. Each is built
/// when it is first needed.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tables {
    pub uniform: OnceLock<Option<Discrete>>,
    pub power: OnceLock<Option<Discrete>>,
    pub tree: OnceLock<LightTree>,
    /// Groups of lights, with which a point can leave out many lights at once.
    pub groups: OnceLock<LightRanges>,
}

impl Luminaires {
    /// Collects the lights of a scene. `indices` should be greater than all of their indices
    /// ([`Luminaire::index`]); if it is not, the least such number is used. Some indices may belong
    /// to lights that emit nothing and are not in the list.
    #[must_use]
    pub fn new(lights: Vec<Luminaire>, indices: u32) -> Self {
        let last = lights.iter().map(|light| light.index).max();
        let above = last.map_or(0, |last| last.saturating_add(1));
        let mut all = Self {
            lights,
            indices: indices.max(above),
            tables: Tables::default(),
        };
        all.sort();
        all
    }

    /// All lights; those that are always sampled come first.
    #[must_use]
    pub fn as_slice(&self) -> &[Luminaire] {
        &self.lights
    }

    /// Changes the light with an index. Returns whether there is such a light.
    pub fn change(&mut self, index: u32, change: impl FnOnce(&mut Luminaire)) -> bool {
        let found = self.lights.iter_mut().find(|light| light.index == index);
        let exists = found.map(change).is_some();
        self.sort();
        exists
    }

    /// Splits the lights into those that are always sampled and those of which one is chosen.
    pub(crate) fn split(&self, choice: LightChoice) -> (&[Luminaire], &[Luminaire]) {
        match choice {
            LightChoice::All => (&self.lights, &[]),
            _ => (self.lights).split_at(self.lights.partition_point(|light| light.is_apart)),
        }
    }

    /// Groups of all lights, with which a point can leave out many lights at once; `None` if the
    /// `count` of lights to sample is so small that they are considered one by one.
    pub(crate) fn groups(&self, count: usize) -> Option<&LightRanges> {
        let lights = || self.lights.iter().map(|light| &*light.light);
        let groups = || LightRanges::new(lights());
        (count >= MANY).then(|| self.tables.groups.get_or_init(groups))
    }

    /// Sorts the lights, and discards the tables.
    fn sort(&mut self) {
        self.lights
            .sort_by_key(|light| (!light.is_apart, light.index));
        self.tables = Tables::default();
    }
}
