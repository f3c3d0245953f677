//! The lights of a scene together, and the tables by which some of them are chosen.

use crate::{LightChoice, Luminaire};
use linelit_selection::{Discrete, LightRanges, LightTree};
use std::sync::OnceLock;

/// The lights of a scene, and the tables by which one is chosen for a sample.
#[derive(Clone, Debug, Default)]
pub struct Luminaires {
    /// The lights; those that are sampled for themselves come first, each in the order of indices.
    lights: Vec<Luminaire>,
    /// More than all indices: light i of the shading point p on a path has the random numbers of
    /// the pair p · indices + i.
    pub(crate) indices: u32,
    pub(crate) tables: Tables,
}

/// Lights from this number on are left out in groups; of fewer, each is looked at.
const MANY: usize = 8;

/// Tables for choosing among lights that are the same for all shading points; each is built when it
/// is first needed.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tables {
    pub uniform: OnceLock<Option<Discrete>>,
    pub power: OnceLock<Option<Discrete>>,
    pub tree: OnceLock<LightTree>,
    /// Groups of the lights, by which a point leaves out many at once.
    pub groups: OnceLock<LightRanges>,
}

impl Luminaires {
    /// The lights of a scene. `indices` is more than all of their indices ([`Luminaire::index`]),
    /// or is taken as the least such number; lights that emit nothing may have some of them.
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

    /// The lights.
    #[must_use]
    pub fn as_slice(&self) -> &[Luminaire] {
        &self.lights
    }

    /// Changes the light of an index; returns whether there is one.
    pub fn change(&mut self, index: u32, change: impl FnOnce(&mut Luminaire)) -> bool {
        let found = self.lights.iter_mut().find(|light| light.index == index);
        let exists = found.map(change).is_some();
        self.sort();
        exists
    }

    /// The lights that are sampled for themselves, and those of which one is chosen.
    pub(crate) fn split(&self, choice: LightChoice) -> (&[Luminaire], &[Luminaire]) {
        match choice {
            LightChoice::All => (&self.lights, &[]),
            _ => (self.lights).split_at(self.lights.partition_point(|light| light.is_apart)),
        }
    }

    /// Groups of all lights, by which a point leaves out many at once; `None` where the `count` of
    /// those that it samples is small, and each is looked at.
    pub(crate) fn groups(&self, count: usize) -> Option<&LightRanges> {
        let lights = || self.lights.iter().map(|light| &*light.light);
        let groups = || LightRanges::new(lights());
        (count >= MANY).then(|| self.tables.groups.get_or_init(groups))
    }

    /// Puts the lights in order, with new tables.
    fn sort(&mut self) {
        self.lights
            .sort_by_key(|light| (!light.is_apart, light.index));
        self.tables = Tables::default();
    }
}
