//! `AreaLightSource`, the emission of shapes, and the reading of all spectra as linear RGB.

use super::Loader;
use super::lexer::{Lexer, Token};
use super::params::{Param, Params, Type};
use super::state::Target;
use crate::color;
use linelit_assembly::{ErrorKind, Result, shorten};
use linelit_geometry::DVec3;
use linelit_lights::{LightSpace, Profile, ProfileKind};
use linelit_scene::{EmissionSpec, ImageTexture, LUMINANCE, Texture, TextureFilter, Wrap};
use std::sync::Arc;

/// The types that a parameter may have if it is a spectrum.
pub(super) const SPECTRUM: &[Type] = &[
    Type::Rgb,
    Type::Xyz,
    Type::Blackbody,
    Type::Spectrum,
    Type::Float,
];

impl Loader {
    /// Executes `AreaLightSource "diffuse" …`.
    pub(super) fn area_light(&mut self, lexer: &mut Lexer, token: Token) -> Result<()> {
        self.needs_world(lexer, token)?;
        let (name, mut params) = self.named_params(lexer, token, "area light")?;
        params.add_defaults(&self.state.defaults(Target::Light));
        self.base.has_lights = true;
        if name != "diffuse" && name != "area" {
            return Err(params.unknown("area light", &name, ["diffuse"]));
        }
        // Read the radiance; linelit's own options decide the number of samples.
        params.ignore(&["samples", "nsamples", "xsamples", "ysamples"]);
        let mut radiance = self.spectrum(&params, "L", DVec3::ONE, true)?;
        // pbrt-v4 has a number here, pbrt-v3 a spectrum.
        radiance *= self.spectrum(&params, "scale", DVec3::ONE, false)?;
        let image = self.emission_image(&params)?;
        let mut power = params.float("power")?.filter(|p| *p > 0.0);
        if let (Some(power), Some(image)) = (&mut power, &image) {
            // The power is for the mean luminance of the whole image, as in pbrt-v4.
            let mean = image.data.mean().dot(LUMINANCE);
            if mean <= 0.0 {
                radiance = DVec3::ZERO;
            }
            *power /= mean;
        }
        let two_sided = params.bool_or("twosided", false)?;
        if radiance.min_element() < 0.0 {
            let label = "must not be negative";
            return Err(params.error(ErrorKind::OutOfRange, "negative radiance", label));
        }
        let profile = self.emission_profile(&params)?;
        self.warn_unused(&params)?;
        // Set the emission of the following shapes, if it is not black.
        if radiance == DVec3::ZERO {
            self.state.emission = None;
            let message = "an area light emits nothing";
            return self
                .base
                .suspicious(message, "radiance is zero", params.at());
        }
        let builder = &mut self.base.builder;
        let map = image.map(|image| builder.add_emission_map(Arc::new(Texture::Image(image))));
        self.state.emission = Some(EmissionSpec {
            radiance,
            two_sided,
            power,
            map,
            profile,
        });
        Ok(())
    }

    /// Reads the profile of an emission, an extension of linelit: `focus`, a power of the cosine;
    /// `coneangle` with `conedeltaangle`, the cone of a spot light; or `iesfile`. A profile is
    /// about the normal, turns with the shape, and does not change its power. The result is the
    /// index of the profile in the builder.
    fn emission_profile(&mut self, params: &Params) -> Result<Option<u32>> {
        // Read the profile, of which there may be one. `cone` reads `conedeltaangle` itself.
        params.ignore(&["conedeltaangle"]);
        let cone = params
            .float("coneangle")?
            .map(|_| self.cone(params))
            .transpose()?;
        let mut kinds = [cone, self.ies(params)?, None];
        if let Some(focus) = params.float("focus")? {
            if focus < 0.0 {
                let message = format!("`focus` of {} is negative", params.owner);
                return Err(params.range_error(&["focus"], message, "must not be negative"));
            }
            kinds[2] = Some(ProfileKind::CosinePower(focus));
        }
        let mut kinds = kinds.into_iter().flatten();
        let Some(kind) = kinds.next() else {
            return Ok(None);
        };
        if kinds.next().is_some() {
            let owner = &params.owner;
            let message = format!("{owner} has several of `focus`, `coneangle` and `iesfile`");
            return Err(params.error(ErrorKind::OutOfRange, message, "one of them"));
        }
        // Add it, and warn about light that would leave behind the surface.
        let profile = Profile::new(kind, LightSpace::WORLD);
        let behind = profile.part_behind();
        let added = self.base.builder.add_profile(profile);
        if added.is_some() && behind > 0.0 {
            let percent = 100.0 * behind;
            let message = format!(
                "{percent:.3} % of the light of the IES file leaves above 90°, behind the surface"
            );
            let label = "left out: what is in front gets all of the power";
            self.base.suspicious(message, label, params.at())?;
        }
        added.map(Some).ok_or_else(|| {
            let message = format!("{} emits in no direction", params.owner);
            params.error(
                ErrorKind::OutOfRange,
                message,
                "nothing leaves in front of it",
            )
        })
    }

    /// Reads the image over the emitter that pbrt-v4 has.
    fn emission_image(&mut self, params: &Params) -> Result<Option<Arc<ImageTexture>>> {
        let Some(param) = params.text("filename")? else {
            return Ok(None);
        };
        let name = &param.strings()[0];
        let Some(data) = self.base.image(name, true, param.at_value(0))? else {
            return Ok(None);
        };
        // The filter for camera rays that see the light is an extension: pbrt-v4 does not filter.
        let filter = match params.string("filter")? {
            Some(_) => self.texture_filter(params)?,
            None => TextureFilter::default(),
        };
        Ok(Some(Arc::new(ImageTexture {
            wrap: [Wrap::Clamp; 2],
            filter,
            ..ImageTexture::new(data)
        })))
    }

    /// Reads a spectrum as linear RGB.
    ///
    /// `emits` says that it belongs to a light. A black body without a scale factor and a sampled
    /// spectrum then get luminance one, as in pbrt-v4. With a factor, `blackbody L [ T scale ]` is
    /// pbrt-v3's, and its spectrum has the peak `scale`.
    pub(super) fn spectrum(
        &mut self,
        params: &Params,
        name: &'static str,
        default: DVec3,
        emits: bool,
    ) -> Result<DVec3> {
        match params.find(name, SPECTRUM)? {
            Some(param) => self.spectrum_value(params, param, emits),
            None => Ok(default),
        }
    }

    /// Returns the value of a spectrum parameter as linear RGB.
    pub(super) fn spectrum_value(
        &mut self,
        params: &Params,
        param: &Param,
        emits: bool,
    ) -> Result<DVec3> {
        // Convert the values by their type, and refuse a wrong number of them.
        let wrong = |what: &str| Err(params.wrong_count(param, format_args!("takes {what}")));
        match (param.ty, param.numbers()) {
            (Type::Rgb, &[r, g, b]) => Ok(DVec3::new(r, g, b)),
            (Type::Rgb, _) => wrong("3 values"),
            (Type::Xyz, &[x, y, z]) => Ok(color::xyz_to_rgb(DVec3::new(x, y, z)).max(DVec3::ZERO)),
            (Type::Xyz, _) => wrong("3 values"),
            (Type::Float, &[v]) => Ok(DVec3::splat(v)),
            (Type::Float, _) => wrong("1 value"),
            (Type::Blackbody, &[kelvin, ref rest @ ..]) if rest.len() <= 1 => {
                if !(1.0..=1e7).contains(&kelvin) {
                    let message = format!("a black body of {kelvin} K");
                    let label = "expected a temperature in kelvin";
                    let at = param.at_value(0);
                    return Err(at.error(ErrorKind::OutOfRange, message, label));
                }
                let unit_luminance = emits && rest.is_empty();
                let scale = rest.first().copied().unwrap_or(1.0);
                Ok(color::blackbody_to_rgb(kelvin, unit_luminance) * scale)
            }
            (Type::Blackbody, _) => wrong("a temperature and at most one factor"),
            _ => self.sampled_spectrum(params, param, emits),
        }
    }

    /// Reads a `spectrum` that has samples, or the name of a spectrum or a file.
    fn sampled_spectrum(&mut self, params: &Params, param: &Param, emits: bool) -> Result<DVec3> {
        // Replace named spectra, which are not supported, by white or grey.
        if let [name] = param.strings() {
            let message = format!("the spectrum `{}` is not supported", shorten(name));
            let (value, label) = match name.as_str() {
                // Standard illuminants are close to white, the colour (1, 1, 1).
                n if n.starts_with("stdillum-") || n.starts_with("illum-") => {
                    (1.0, "read as white")
                }
                _ => (0.5, "read as grey, 0.5"),
            };
            self.base.unsupported(message, label, param.at())?;
            return Ok(DVec3::splat(value));
        }
        // Read pairs of ascending wavelengths and values.
        let numbers = param.numbers();
        let samples: Vec<(f64, f64)> = numbers.chunks_exact(2).map(|c| (c[0], c[1])).collect();
        if numbers.is_empty() || !numbers.len().is_multiple_of(2) {
            let message = format!(
                "spectrum `{}` of {} has {} numbers, not pairs of wavelength and value",
                param.name,
                params.owner,
                numbers.len()
            );
            return Err(param.bad(message, "expected pairs"));
        }
        if let Some(k) = samples.windows(2).position(|w| w[0].0 >= w[1].0) {
            let message = format!("the wavelengths of spectrum `{}` do not ascend", param.name);
            let at = param.at_value(2 * k + 2);
            let label = "not greater than the one before";
            return Err(at.error(ErrorKind::OutOfRange, message, label));
        }
        // Convert them to RGB, of luminance one for lights.
        let message = format!(
            "spectrum `{}` of {} is reduced to linear RGB",
            param.name, params.owner
        );
        self.base
            .suspicious(message, "sampled spectrum", param.at())?;
        let rgb = color::sampled_to_rgb(&samples);
        let luminance = rgb.dot(LUMINANCE);
        Ok(if emits && luminance > 0.0 {
            rgb / luminance
        } else {
            rgb
        })
    }
}
