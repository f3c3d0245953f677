//! `line-texture`: offsets, and points along lines, in proportion to the texture of a light.

use super::{LineMeasure, LineSetup};
use crate::EmissionTexture;
use crate::techniques::points::Polygon;
use linelit_lights::{TextureAxis, TexturedLines};
use std::f64::consts::PI;

#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Texture;

impl LineMeasure for Texture {
    const NAME: &'static str = "line-texture";

    type OnPolygon<'t> = TexturedLines<'t>;

    /// Along the edges of the light unless a direction is asked for.
    fn on_polygon<'t, T: EmissionTexture>(
        self,
        part: &Polygon<'t, T>,
        setup: LineSetup,
    ) -> Option<TexturedLines<'t>> {
        let image = part.texture?.over(part.polygon)?;
        if setup.fixed {
            return TexturedLines::new(part.polygon, image, setup.fraction * PI);
        }
        let across = (2.0 * setup.fraction).rem_euclid(2.0) >= 1.0;
        let axis = if across {
            TextureAxis::V
        } else {
            TextureAxis::U
        };
        TexturedLines::along(part.polygon, image, axis)
    }

    /// Along one edge and the other, in turn.
    fn spread(self, first: f64, k: u8, _: u8) -> f64 {
        0.5 * ((2.0 * first).floor() + f64::from(k))
    }
}
