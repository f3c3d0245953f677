//! Lights without a mesh: point lights, spot lights and parallel light (`KHR_lights_punctual`).
//!
//! Candela are read as W/sr and lux as W/m², as all photometric units are read as radiometric ones.
//! As the extension says, the scale of a node does not stretch a light: cones stay circular.

use super::Reader;
use super::document::Raw;
use linelit_assembly::{ErrorKind, Result};
use linelit_elementary::cos;
use linelit_geometry::glam::DAffine3;
use linelit_geometry::{DVec3, Frame};
use linelit_lights::{DistantLight, Falloff, Light, PointLight, Profile, ProfileKind, Sphere};
use serde::Deserialize;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};
use std::sync::Arc;

/// The name of the extension.
pub(super) const LIGHTS: &str = "KHR_lights_punctual";

/// The extension's list at the top level of the file.
#[derive(Default, Deserialize)]
#[serde(default)]
struct Lights<'a> {
    #[serde(borrow)]
    lights: Vec<Raw<'a>>,
}

/// The extension of a node, which refers to a light by its index.
#[derive(Deserialize)]
struct Placed {
    light: usize,
}

/// A light in the list.
#[derive(Deserialize)]
#[serde(default)]
pub(super) struct Punctual {
    r#type: String,
    color: [f64; 3],
    intensity: f64,
    range: Option<f64>,
    spot: Spot,
}

impl Default for Punctual {
    fn default() -> Self {
        Self {
            r#type: String::new(),
            color: [1.0; 3],
            intensity: 1.0,
            range: None,
            spot: Spot::default(),
        }
    }
}

/// The angles of a spot light, in radians.
#[derive(Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct Spot {
    inner_cone_angle: f64,
    outer_cone_angle: f64,
}

impl Default for Spot {
    fn default() -> Self {
        Self {
            inner_cone_angle: 0.0,
            outer_cone_angle: FRAC_PI_4,
        }
    }
}

impl<'a> Reader<'a> {
    /// Reads the list of lights, to which nodes refer by their indices. A black light is `None` in
    /// this list.
    pub(super) fn read_lights(&mut self) -> Result<()> {
        let doc = self.doc;
        let Some(top) = doc.lists.extensions.get(LIGHTS).copied() else {
            return Ok(());
        };
        for place in doc.read::<Lights<'_>>(top)?.lights {
            let light: Punctual = doc.read(place)?;
            let bad = |key: &str, what: &str| {
                let at = doc.find(place, &[key]);
                let message = format!("`{key}` of a light is {what}");
                Err(doc.error(ErrorKind::OutOfRange, message, at, ""))
            };
            // Check the emission.
            let color = DVec3::from(light.color);
            if color.min_element() < 0.0 || !color.is_finite() {
                return bad("color", "negative or not finite");
            }
            let emitted = color * light.intensity;
            if !(light.intensity >= 0.0 && emitted.is_finite()) {
                return bad("intensity", "negative or not finite");
            }
            // Warn about a range, which is not supported, and about black lights.
            if light.range.is_some() {
                let message =
                    "the `range` of a light is left out: it falls off with the distance alone";
                let at = doc.at(doc.find(place, &["range"]));
                self.base.suspicious(message, "left out", at)?;
            }
            let emits = emitted != DVec3::ZERO;
            if !emits {
                let message = "a light emits nothing";
                let at = doc.at_start(place);
                self.base.suspicious(message, "left out", at)?;
            }
            self.lights.push((place, emits.then_some(light)));
        }
        Ok(())
    }

    /// Adds the light that a node's extension refers to.
    pub(super) fn place_light(&mut self, raw: Raw<'a>, to_world: DAffine3) -> Result<()> {
        let doc = self.doc;
        let index = doc.read::<Placed>(raw)?.light;
        let Some((place, light)) = self.lights.get(index) else {
            let message = format!("`light` refers to number {index} of `lights`");
            let label = format!("there are {}, counted from 0", self.lights.len());
            let at = doc.find(raw, &["light"]);
            return Err(doc.error(ErrorKind::BadMesh, message, at, &label));
        };
        let Some(light) = light else {
            self.base.has_lights = true;
            return Ok(());
        };
        let (place, light) = (*place, self.light_of(light, place, to_world)?);
        self.base.add_light(light, doc.at_start(place))
    }

    /// Makes a light of an entry of the list, and checks its type, cone and direction.
    fn light_of(&self, light: &Punctual, place: Raw<'a>, to_world: DAffine3) -> Result<Light> {
        let doc = self.doc;
        let bad = |key: &str, what: &str| {
            let at = doc.find(place, &[key]);
            let message = format!("`{key}` of a light is {what}");
            doc.error(ErrorKind::OutOfRange, message, at, "")
        };
        let emitted = DVec3::from(light.color) * light.intensity;
        // Find the direction in which the light shines, −z of its node.
        let along = to_world.transform_vector3(-DVec3::Z).normalize_or_zero();
        let point = |profile: Option<Profile>| {
            Light::Point(PointLight {
                position: to_world.translation,
                intensity: emitted,
                profile: profile.map(Arc::new),
            })
        };
        if along == DVec3::ZERO && light.r#type != "point" {
            let message = "the transform of a light leaves it no direction";
            return Err(doc.error(ErrorKind::BadTransform, message, place, ""));
        }
        Ok(match light.r#type.as_str() {
            "point" => point(None),
            "spot" => {
                // Check the cone; angles may be rounded to 32 bits or to five digits.
                let Spot {
                    inner_cone_angle: inner,
                    outer_cone_angle: outer,
                } = &light.spot;
                let above = |bound: f64| bound * (1.0 + 1e-5);
                if !(0.0 <= *inner && *inner <= above(*outer) && *outer <= above(FRAC_PI_2)) {
                    return Err(bad("spot", "no cone: inner angle ≤ outer angle ≤ π/2"));
                }
                let outer = outer.min(FRAC_PI_2);
                let kind = ProfileKind::Cone {
                    cos_inner: cos(inner.min(outer)),
                    cos_outer: cos(outer),
                    falloff: Falloff::Quadratic,
                };
                point(Some(Profile::new(kind, Frame::from_normal(along))))
            }
            "directional" => Light::Distant(DistantLight {
                direction: -along,
                irradiance: emitted,
                scene: Sphere {
                    center: DVec3::ZERO,
                    radius: 0.0,
                },
            }),
            _ => return Err(bad("type", "none of `point`, `spot` and `directional`")),
        })
    }
}
