//! The graphics state: what blocks save and restore.

use super::params::Param;
use linelit_geometry::glam::DAffine3;
use linelit_scene::EmissionSpec;
use std::rc::Rc;

/// The kinds of directives that `Attribute "shape" …` sets parameters of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Target {
    Shape,
    Light,
    Material,
    Texture,
}

/// Defaults that may be set for one target.
const MAX_DEFAULTS: usize = 500;

/// Everything that `AttributeBegin` saves.
#[derive(Clone, Debug)]
pub(super) struct State {
    /// The transform from the current space to world space (before the world: to camera space).
    pub(super) ctm: DAffine3,
    pub(super) reverse: bool,
    /// Transforms are those of the shutter's end (`ActiveTransform EndTime`), which we leave out.
    pub(super) end_time_only: bool,
    /// Index of the current material; `None`: the surface is not there (`interface`).
    pub(super) material: Option<u32>,
    pub(super) emission: Option<EmissionSpec>,
    /// Defaults from `Attribute`, by target; shared because blocks copy them.
    defaults: [Rc<Vec<Rc<Param>>>; 4],
}

impl Default for State {
    fn default() -> Self {
        Self {
            ctm: DAffine3::IDENTITY,
            reverse: false,
            end_time_only: false,
            material: Some(0),
            emission: None,
            defaults: Default::default(),
        }
    }
}

impl State {
    pub(super) fn defaults(&self, target: Target) -> Rc<Vec<Rc<Param>>> {
        Rc::clone(&self.defaults[target as usize])
    }

    /// Sets defaults; false if there are too many.
    pub(super) fn add_defaults(&mut self, target: Target, params: Vec<Rc<Param>>) -> bool {
        let list = Rc::make_mut(&mut self.defaults[target as usize]);
        for param in params {
            list.retain(|p| p.name != param.name);
            list.push(param);
        }
        list.len() <= MAX_DEFAULTS
    }
}
