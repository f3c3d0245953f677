//! Holes of shapes, and light linking.

use super::Loader;
use super::params::{Param, Params, Type};
use super::textures::NUMBER;
use linelit_assembly::{ErrorKind, Result, shorten};
use linelit_scene::{Alpha, Cutout, Links, Texture};
use std::sync::Arc;

/// What a shape's parameters say beside what it is.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Extent {
    pub(super) cutout: Option<Cutout>,
    pub(super) links: Links,
}

/// What an alpha comes to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Holes {
    None,
    Some(u32),
    /// Nothing is there.
    All,
}

impl Loader {
    /// `alpha`, `shadowalpha`, and which lights have to do with the shape; `None` if nothing is
    /// there.
    pub(super) fn extent(&mut self, params: &Params) -> Result<Option<Extent>> {
        let seen = self.holes(params, "alpha", "alphacutoff")?;
        let shadow = self.holes(params, "shadowalpha", "shadowalphacutoff")?;
        let mut links = Links {
            lit_by: self.light_sets(params, "litby")?,
            shadows: self.light_sets(params, "shadows")?,
        };
        if self.state.emission.is_some() {
            let opaque = seen == Holes::None && shadow == Holes::None;
            if !opaque || links.shadows != Links::ALL {
                let message = "a shape that emits is opaque, and hides all lights but its own";
                let label = "its alpha and `shadows` are ignored";
                self.base.unsupported(message, label, params.at())?;
            }
            links.shadows = Links::ALL;
            let cutout = None;
            return Ok(Some(Extent { cutout, links }));
        }
        if seen == Holes::All {
            let message = "a shape whose `alpha` is zero is left out";
            self.base
                .suspicious(message, "nothing is there", params.at())?;
            return Ok(None);
        }
        if shadow == Holes::All {
            links.shadows = 0;
        }
        let index = |holes| match holes {
            Holes::Some(alpha) => Some(alpha),
            Holes::None | Holes::All => None,
        };
        let (seen, shadow) = (index(seen), index(shadow));
        let cutout = (seen.is_some() || shadow.is_some()).then_some(Cutout { seen, shadow });
        Ok(Some(Extent { cutout, links }))
    }

    /// pbrt-v3 cuts a shape out where its alpha is zero. pbrt-v4 draws it by chance, as often as
    /// its alpha says; ours is there from a half on. A cutoff is an extension.
    fn holes(
        &mut self,
        params: &Params,
        name: &'static str,
        cutoff: &'static str,
    ) -> Result<Holes> {
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
        #[allow(clippy::cast_possible_truncation, reason = "numbers of masks are f32")]
        let alpha = self.base.alpha(texture, cutoff as f32, at)?;
        Ok(alpha.map_or(Holes::None, Holes::Some))
    }

    /// An extension: the names of sets of lights, `none` alone for no set; all if not given.
    fn light_sets(&mut self, params: &Params, name: &'static str) -> Result<u32> {
        let Some(param) = params.find(name, &[Type::String])? else {
            return Ok(Links::ALL);
        };
        if param.strings() == ["none"] {
            return Ok(0);
        }
        let mut sets = 0;
        for k in 0..param.strings().len() {
            sets |= 1 << self.light_set(param, k)?;
        }
        Ok(sets)
    }

    /// The number of a set of lights by its name.
    pub(super) fn light_set(&mut self, param: &Param, k: usize) -> Result<u32> {
        let name = &param.strings()[k];
        if name == "none" {
            let message = "`none` is no name of a set of lights";
            let at = param.at_value(k);
            return Err(at.error(ErrorKind::BadParameter, message, "stands alone"));
        }
        let Some(set) = self.base.builder.light_set(name) else {
            let message = format!("more than {} sets of lights", Links::MAX_SETS);
            let at = param.at_value(k);
            return Err(at.error(ErrorKind::Limit, message, "one too many"));
        };
        let place = (Arc::clone(&param.source), param.value_span(k));
        self.sets.entry(set).or_insert(place);
        Ok(set)
    }

    /// Warns about sets of lights that are empty.
    pub(super) fn warn_about_sets(&mut self) -> Result<()> {
        let mut sets: Vec<_> = std::mem::take(&mut self.sets).into_iter().collect();
        sets.sort_by_key(|(set, _)| *set);
        for (set, (source, span)) in sets {
            if self.base.builder.has_light_in(set) {
                continue;
            }
            let name = shorten(&self.base.builder.light_sets()[set as usize]);
            let message = format!("no light is in the set `{name}`");
            self.base
                .suspicious(message, "named here", source.at(span))?;
        }
        Ok(())
    }
}
