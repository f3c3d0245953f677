//! `LightSource`: light sources without a shape, which are points, spots, goniometric lights,
//! parallel light and environments.

use super::Loader;
use super::lexer::{Lexer, Token};
use super::params::{Params, Type};
use super::state::Target;
use linelit_assembly::{ErrorKind, Result, Source, ies, shorten};
use linelit_geometry::{ConvexPolygon, DVec3, Frame, predicates};
use linelit_lights::{
    Falloff, Light, LightSpace, PointLight, Profile, ProfileKind, ProfileMap, Sky, SkyEmission,
    SkyFilter, SkyImage, SkyMapping, Sphere,
};
use linelit_scene::{ImageData, LUMINANCE};
use std::f64::consts::PI;
use std::sync::Arc;

/// The ball around the scene that lights get before the scene's size is known: of radius zero, at
/// the origin.
const NO_SCENE: Sphere = Sphere {
    center: DVec3::ZERO,
    radius: 0.0,
};

/// The smallest half angle of a sun, in radians; a smaller sun becomes parallel light. The rounding
/// of unit vectors, 10⁻¹⁶, moves the border of a sun of this size by 10⁻⁸ of its radius.
const NARROWEST: f64 = 1e-8;

/// The light types of pbrt that are left out, with a warning.
const LEFT_OUT: [&str; 1] = ["projection"];

/// All light types of pbrt, for suggestions.
const TYPES: [&str; 6] = [
    "point",
    "spot",
    "goniometric",
    "distant",
    "infinite",
    "projection",
];

impl Loader {
    /// Executes `LightSource "point" …`.
    pub(super) fn light_source(&mut self, lexer: &mut Lexer, token: Token) -> Result<()> {
        // Read the parameters.
        self.needs_world(lexer, token)?;
        let (name, mut params) = self.named_params(lexer, token, "light source")?;
        self.base.has_lights = true;
        if LEFT_OUT.contains(&name.as_str()) {
            let message = format!("light source `{}` is not supported", shorten(&name));
            return self.base.unsupported(message, "left out", params.at());
        }
        params.add_defaults(&self.state.defaults(Target::Light));
        params.ignore(&["samples", "nsamples"]);
        // Make the light, and add it unless it is black.
        let light = match name.as_str() {
            "point" | "spot" | "goniometric" => self.point_light(&name, &params)?,
            "distant" => self.distant_light(&params)?,
            "infinite" => self.infinite_light(&params)?,
            _ => return Err(params.unknown("light source", &name, TYPES)),
        };
        self.warn_unused(&params)?;
        match light {
            Some(light) => self.base.add_light(light, params.at()),
            None => {
                let message = format!("{} emits nothing", params.owner);
                self.base.suspicious(message, "left out", params.at())
            }
        }
    }

    /// Reads a spectrum of a light, times its `scale`, which must not be negative.
    fn light_spectrum(&mut self, params: &Params, name: &'static str) -> Result<DVec3> {
        let value = self.spectrum(params, name, DVec3::ONE, true)?;
        let value = value * self.spectrum(params, "scale", DVec3::ONE, false)?;
        if value.min_element() < 0.0 || !value.is_finite() {
            let message = format!("`{name}` of {} is negative or not finite", params.owner);
            return Err(params.error(ErrorKind::OutOfRange, message, "must not be negative"));
        }
        Ok(value)
    }

    /// Reads a point parameter and transforms it to world space.
    fn world_point(&self, params: &Params, name: &'static str, usual: DVec3) -> Result<DVec3> {
        let point = params.fixed::<3>(name, &[Type::Point3])?;
        let point = point.map_or(usual, DVec3::from_array);
        let world = self.state.ctm.transform_point3(point);
        if world.is_finite() {
            return Ok(world);
        }
        let message = format!("`{name}` of {} is not finite", params.owner);
        Err(params.error(ErrorKind::OutOfRange, message, "after its transform"))
    }

    /// Returns the unit vector from the parameter `from` to the parameter `to`, before the current
    /// transform.
    fn direction(&self, params: &Params) -> Result<DVec3> {
        let point = |name: &'static str, usual: DVec3| -> Result<DVec3> {
            let point = params.fixed::<3>(name, &[Type::Point3])?;
            Ok(point.map_or(usual, DVec3::from_array))
        };
        let (from, to) = (point("from", DVec3::ZERO)?, point("to", DVec3::Z)?);
        predicates::normalize(to - from).ok_or_else(|| {
            let message = format!("`from` and `to` of {} are one point", params.owner);
            params.error(ErrorKind::OutOfRange, message, "no direction")
        })
    }

    /// Returns the space of a light under the current transform.
    fn light_space(&self, params: &Params) -> Result<LightSpace> {
        LightSpace::new(self.state.ctm.matrix3).ok_or_else(|| {
            let message = format!("the transform of {} flattens directions", params.owner);
            params.error(ErrorKind::BadTransform, message, "")
        })
    }

    /// Reads a point, a spot or a goniometric light; `None` if it is black.
    fn point_light(&mut self, name: &str, params: &Params) -> Result<Option<Light>> {
        let intensity = self.light_spectrum(params, "I")?;
        let power = params.float("power")?.filter(|p| *p > 0.0);
        let position = self.world_point(params, "from", DVec3::ZERO)?;
        let profile = match name {
            "spot" => Some(self.spot(params)?),
            "goniometric" => self.goniometer(params)?,
            _ => self.luminaire(params)?,
        };
        // Scale to the power as pbrt-v4 does, which ignores the transform and takes the mean
        // luminance of an image.
        let mean = profile.as_ref().map_or(DVec3::ONE, Profile::mean);
        let mean = mean.dot(LUMINANCE) / LUMINANCE.element_sum();
        let factor = power.map_or(1.0, |power| power / (4.0 * PI * mean));
        let emits = intensity != DVec3::ZERO && mean > 0.0;
        Ok(emits.then(|| {
            Light::Point(PointLight {
                position,
                intensity: intensity * factor,
                profile: profile.map(Arc::new),
            })
        }))
    }

    /// Reads the profile of a spot light, a cone about the direction from `from` to `to`.
    fn spot(&mut self, params: &Params) -> Result<Profile> {
        let space = LightSpace::from(Frame::from_normal(self.direction(params)?));
        let space = space.within(&self.light_space(params)?);
        Ok(Profile::new(self.cone(params)?, space))
    }

    /// Reads the cone of `coneangle` and `conedeltaangle`. Between its two angles, the intensity
    /// falls by a smooth step in the cosine in version 4, and by a fourth power in version 3.
    pub(super) fn cone(&mut self, params: &Params) -> Result<ProfileKind> {
        let total = params.float_or("coneangle", 30.0)?;
        let delta = params.float_or("conedeltaangle", 5.0)?;
        if !(0.0..=180.0).contains(&total) || !(delta >= 0.0) {
            let message = format!("the cone of {} has no such angle", params.owner);
            let label = "`coneangle` is between 0 and 180, `conedeltaangle` not negative";
            return Err(params.range_error(&["coneangle", "conedeltaangle"], message, label));
        }
        // Find the inner angle as pbrt does, which takes the cosine of their difference even where
        // that is negative.
        let inner = (total - delta).abs().min(total);
        if delta > total && total > 0.0 {
            let message = format!("`conedeltaangle` of {} is above `coneangle`", params.owner);
            let label = match delta > 2.0 * total {
                true => "its light ends sharply, as in pbrt-v3".to_owned(),
                false => format!("within {inner}° its light is even, as in pbrt"),
            };
            self.base.suspicious(message, &label, params.at())?;
        }
        // Make the cone.
        let cosine = |degrees: f64| linelit_elementary::cos(degrees.to_radians());
        let (cos_outer, cos_inner) = (cosine(total), cosine(inner));
        let falloff = match self.view.is_v4 {
            true => Falloff::Smooth,
            false => Falloff::Quartic,
        };
        Ok(ProfileKind::Cone {
            cos_inner,
            cos_outer,
            falloff,
        })
    }

    /// Reads the IES file of a point light, an extension of linelit; its axis is the direction from
    /// `from` to `to`.
    fn luminaire(&mut self, params: &Params) -> Result<Option<Profile>> {
        let Some(kind) = self.ies(params)? else {
            // A point light without a file has no direction, and `to` may be its position.
            params.ignore(&["to"]);
            return Ok(None);
        };
        let frame = Frame::from_normal_and_tangent(self.direction(params)?, DVec3::X);
        let space = LightSpace::from(frame).within(&self.light_space(params)?);
        Ok(Some(Profile::new(kind, space)))
    }

    /// Reads the table of an IES file, if `iesfile` names one.
    pub(super) fn ies(&mut self, params: &Params) -> Result<Option<ProfileKind>> {
        let Some(param) = params.text("iesfile")? else {
            return Ok(None);
        };
        let file = self.base.open(&param.strings()[0], param.at_value(0))?;
        let source = Source::new(file.path, file.bytes);
        let table = ies::read(&source, &mut self.base.warnings)?;
        Ok(Some(ProfileKind::Table(Arc::new(table))))
    }

    /// Reads the image of a goniometric light. The y axis of the light's space is the z axis of the
    /// image. Version 3 uses its colours, version 4 the mean of its channels.
    fn goniometer(&mut self, params: &Params) -> Result<Option<Profile>> {
        let Some((data, mapping)) = self.directions_image(params)? else {
            return Ok(None);
        };
        let size = [data.width() as usize, data.height() as usize];
        let map = match mapping {
            SkyMapping::EqualArea => {
                // Look up the nearest pixel of the mean, as version 4 does.
                let mean = |[r, g, b]: [f32; 3]| (r + g + b) / 3.0;
                let map = ProfileMap::octahedral(size[0], pixels(&data).map(mean).collect());
                map.map(ProfileMap::nearest)
            }
            SkyMapping::Equirectangular => {
                ProfileMap::equirectangular(size, pixels(&data).flatten().collect())
            }
        };
        let map = map.map_err(|why| {
            let message = format!("the image of {}: {why}", params.owner);
            params.error(ErrorKind::OutOfRange, message, "")
        })?;
        let [x, y, z] = [DVec3::X, DVec3::Z, DVec3::Y];
        let space = LightSpace::from(Frame { x, y, z }).within(&self.light_space(params)?);
        Ok(Some(Profile::new(ProfileKind::Map(Arc::new(map)), space)))
    }

    /// Reads parallel light, or with `angle` a sun; `None` if it is black.
    fn distant_light(&mut self, params: &Params) -> Result<Option<Light>> {
        // Read the irradiance and the direction.
        let mut irradiance = self.light_spectrum(params, "L")?;
        if let Some(lux) = params.float("illuminance")?.filter(|lux| *lux > 0.0) {
            irradiance *= lux;
        }
        let along = self.state.ctm.transform_vector3(self.direction(params)?);
        let direction = predicates::normalize(-along).ok_or_else(|| {
            let message = format!("the transform of {} leaves it no direction", params.owner);
            params.error(ErrorKind::BadTransform, message, "")
        })?;
        // Spread the irradiance over the directions of a sun.
        let half_angle = 0.5 * self.angle(params)?.to_radians();
        Ok((irradiance != DVec3::ZERO).then(|| {
            if half_angle <= NARROWEST {
                return Light::distant(direction, irradiance);
            }
            let sine = linelit_elementary::sin(half_angle);
            Light::sun(direction, half_angle, irradiance / (PI * sine * sine))
        }))
    }

    /// Reads the angular diameter of a sun in degrees, an extension of linelit; zero for parallel
    /// light.
    fn angle(&self, params: &Params) -> Result<f64> {
        let angle = params.float_or("angle", 0.0)?;
        if (0.0..=180.0).contains(&angle) {
            return Ok(angle);
        }
        let message = format!("`angle` of {} is {angle}", params.owner);
        Err(params.range_error(&["angle"], message, "between 0 and 180 degrees"))
    }

    /// Reads an environment, constant or from an image; `None` if it is black.
    fn infinite_light(&mut self, params: &Params) -> Result<Option<Light>> {
        let mut radiance = self.light_spectrum(params, "L")?;
        let illuminance = params.float("illuminance")?.filter(|lux| *lux > 0.0);
        let portal = self.portal(params)?;
        let image = self.directions_image(params)?;
        let emission = match image {
            None => {
                radiance *= illuminance.map_or(1.0, |lux| lux / PI);
                SkyEmission::Constant(radiance)
            }
            Some((data, mapping)) => {
                // Choose the filter: version 4 looks up the nearest pixel, but interpolates behind
                // a portal.
                let space = self.light_space(params)?;
                let size = [data.width() as usize, data.height() as usize];
                let filter = match mapping {
                    SkyMapping::EqualArea if portal.is_none() => SkyFilter::Nearest,
                    _ => SkyFilter::Linear,
                };
                let image = |space: LightSpace, scale: DVec3| {
                    let pixels = pixels(&data).collect();
                    let image = SkyImage::placed(filter, mapping, size, pixels, space, scale);
                    image.map_err(|why| {
                        let message = format!("the image of {}: {why}", params.owner);
                        params.error(ErrorKind::OutOfRange, message, "")
                    })
                };
                if let Some(lux) = illuminance {
                    // Scale to the illuminance of the upper half of the image, without the
                    // transform. (pbrt-v4's program counts each pixel half, and so gives twice the
                    // illuminance.)
                    let sky = image(LightSpace::WORLD, radiance)?;
                    let upper = sky.irradiance(DVec3::Z).dot(LUMINANCE);
                    radiance *= if upper > 0.0 { lux / upper } else { 0.0 };
                }
                let sky = image(space, radiance)?;
                radiance = sky.mean();
                SkyEmission::Image(Arc::new(sky))
            }
        };
        Ok((radiance != DVec3::ZERO).then_some(Light::Sky(Sky {
            emission,
            portal,
            scene: NO_SCENE,
        })))
    }

    /// Reads the portal of an environment: four corners in world space, to which the current
    /// transform is not applied, as in pbrt-v4.
    fn portal(&self, params: &Params) -> Result<Option<ConvexPolygon>> {
        let Some(corners) = params.fixed::<12>("portal", &[Type::Point3])? else {
            return Ok(None);
        };
        let polygon = ConvexPolygon::new(corners.as_chunks::<3>().0).map_err(|why| {
            let message = format!("the portal of {}: {why}", params.owner);
            params.error(
                ErrorKind::OutOfRange,
                message,
                "no flat convex quadrilateral",
            )
        })?;
        Ok(Some(polygon))
    }

    /// Reads the image of a light over directions, if it has one: `filename` of version 4 with the
    /// equal-area mapping, or `mapname` of version 3 with longitude and latitude.
    fn directions_image(
        &mut self,
        params: &Params,
    ) -> Result<Option<(Arc<ImageData>, SkyMapping)>> {
        let (param, mapping) = match (params.text("filename")?, params.text("mapname")?) {
            (Some(param), _) => (param, SkyMapping::EqualArea),
            (None, Some(param)) => (param, SkyMapping::Equirectangular),
            (None, None) => return Ok(None),
        };
        // Load it, and check that an equal-area map is square.
        let data = self
            .base
            .image(&param.strings()[0], true, param.at_value(0))?;
        let Some(data) = data else {
            return Ok(None);
        };
        if mapping == SkyMapping::EqualArea && data.width() != data.height() {
            let (width, height) = (data.width(), data.height());
            let message = format!("an equal-area map is square, this is {width} x {height}");
            let error = param
                .at_value(0)
                .error(ErrorKind::OutOfRange, message, "named here");
            return Err(error.help("`mapname` takes an image by longitude and latitude"));
        }
        Ok(Some((data, mapping)))
    }
}

/// Returns the linear values of an image, row by row.
#[allow(clippy::cast_possible_truncation, reason = "images are f32")]
fn pixels(image: &ImageData) -> impl Iterator<Item = [f32; 3]> {
    let size = [image.width(), image.height()];
    (0..size[1]).flat_map(move |y| {
        (0..size[0]).map(move |x| image.pixel(x, y).to_array().map(|v| v as f32))
    })
}
