//! The graphics state of pbrt, which blocks save and restore: the current transform, material and
//! emission, and default parameters.

use super::params::Param;
use linelit_geometry::glam::DAffine3;
use linelit_scene::EmissionSpec;
use std::rc::Rc;

/// The kinds of directives for which `Attribute "shape" …` and the like set default parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Target {
    Shape,
    Light,
    Material,
    Texture,
}

/// The largest number of default parameters for one target.
const MAX_DEFAULTS: usize = 500;

/// The state that `AttributeBegin` saves and `AttributeEnd` restores.
#[derive(Clone, Debug)]
pub(super) struct State {
    /// The current transformation matrix, from the current space to world space; before
    /// `WorldBegin`, to camera space.
    pub(super) ctm: DAffine3,
    /// Whether `ReverseOrientation` is on.
    pub(super) reverse: bool,
    /// Whether transforms are for the end of the shutter time (`ActiveTransform EndTime`); they are
    /// ignored, as motion is not supported.
    pub(super) end_time_only: bool,
    /// The index of the current material; `None` for `interface`, which has no surface.
    pub(super) material: Option<u32>,
    /// The emission of shapes, after `AreaLightSource`.
    pub(super) emission: Option<EmissionSpec>,
    /// The default parameters from `Attribute`, by target; shared because blocks copy the state.
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
    /// Returns the default parameters for a kind of directive.
    pub(super) fn defaults(&self, target: Target) -> Rc<Vec<Rc<Param>>> {
        Rc::clone(&self.defaults[target as usize])
    }

    /// Sets default parameters, in place of earlier ones of the same names; returns false if there
    /// are too many.
    pub(super) fn add_defaults(&mut self, target: Target, params: Vec<Rc<Param>>) -> bool {
        let list = Rc::make_mut(&mut self.defaults[target as usize]);
        for param in params {
            list.retain(|p| p.name != param.name);
            list.push(param);
        }
        list.len() <= MAX_DEFAULTS
    }
}
