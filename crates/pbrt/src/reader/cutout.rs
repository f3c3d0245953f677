//! The alpha masks of shapes, which cut holes into what the camera sees or into shadows.

use super::Loader;
use super::params::Params;
use super::textures::NUMBER;
use linelit_assembly::{Holes, Result};
use linelit_scene::{Alpha, Cutout, Texture};

/// The parts of a shape that exist: its holes, and whether it casts a shadow.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Extent {
    pub(super) cutout: Option<Cutout>,
    pub(super) casts_no_shadow: bool,
}

impl Loader {
    /// Reads `alpha` and `shadowalpha` of a shape; `None` if all of the shape is cut away.
    pub(super) fn extent(&mut self, params: &Params) -> Result<Option<Extent>> {
        // Ignore the alpha of shapes that emit.
        let seen = self.holes(params, "alpha", "alphacutoff")?;
        let shadow = self.holes(params, "shadowalpha", "shadowalphacutoff")?;
        if self.state.emission.is_some() {
            if seen != Holes::None || shadow != Holes::None {
                let message = "a shape that emits is opaque";
                let label = "its alpha is ignored";
                self.base.unsupported(message, label, params.at())?;
            }
            return Ok(Some(Extent::default()));
        }
        // Leave out invisible shapes; a shape of which all shadow is cut away casts none.
        if seen == Holes::All {
            let message = "a shape whose `alpha` is zero is left out";
            self.base
                .suspicious(message, "nothing is there", params.at())?;
            return Ok(None);
        }
        let casts_no_shadow = shadow == Holes::All;
        let (seen, shadow) = (seen.alpha(), shadow.alpha());
        let cutout = (seen.is_some() || shadow.is_some()).then_some(Cutout { seen, shadow });
        Ok(Some(Extent {
            cutout,
            casts_no_shadow,
        }))
    }

    /// Reads one alpha parameter. pbrt-v3 cuts a shape away where its alpha is zero. pbrt-v4 makes
    /// it visible at random with a probability of alpha; here it is visible where alpha is at least
    /// one half. The parameter for the cutoff is an extension.
    fn holes(
        &mut self,
        params: &Params,
        name: &'static str,
        cutoff: &'static str,
    ) -> Result<Holes> {
        // Read the cutoff and the texture.
        let usual = if self.view.is_v4 {
            0.5
        } else {
            f64::from(Alpha::ABOVE_ZERO)
        };
        let cutoff = params.float_or(cutoff, usual)?;
        let one = Texture::number(1.0);
        let texture = self.texture_param(params, name, one, true)?;
        let Some(param) = params.find(name, NUMBER)? else {
            return Ok(Holes::None);
        };
        // A constant cuts away all of the shape or none.
        let at = param.at();
        if let Some(value) = texture.as_constant() {
            let value = value.x;
            if value > 0.0 && value < 1.0 && self.view.is_v4 {
                let message = format!("`{name}` between 0 and 1 is not supported");
                let label = "taken as 1 from 0.5 on, else as 0";
                self.base.unsupported(message, label, at)?;
            }
            return Ok(if value >= cutoff {
                Holes::None
            } else {
                Holes::All
            });
        }
        self.base.alpha(texture, cutoff, at)
    }
}
