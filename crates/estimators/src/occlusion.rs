//! How occluded a light usually is.

use crate::{Buffers, EmissionTexture, LightSource};
use linelit_geometry::DVec3;
use linelit_lights::AreaLight;
use linelit_visibility::{Occluders, ShaftQuery};

/// A light is densely occluded if more than this share of its shafts is dense.
const DENSE: f64 = 0.2;

/// How occluded a light usually is: chooses the strategy of `hybrid`. Geometry alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OcclusionStats {
    /// Whether so much stands before the light that looking for all of it at once seldom pays.
    pub dense: bool,
    /// Triangles in between that may hide a part of the light, on average over points; none where
    /// nothing or all of it is hidden.
    pub candidates: f64,
    /// Edges that bound what is hidden, for each triangle in between: up to three if triangles are
    /// loose, few in meshes.
    pub edges: f64,
    /// The time of the closed form in that of lines, over what the table of `hybrid` says: 1 unless
    /// it was measured ([`Calibration`](crate::Calibration)).
    pub exact_cost: f64,
}

impl Default for OcclusionStats {
    /// Few triangles, all loose.
    fn default() -> Self {
        Self {
            dense: false,
            candidates: 1.0,
            edges: 3.0,
            exact_cost: 1.0,
        }
    }
}

/// Gathers the [`OcclusionStats`] of one area light from points that it is seen from.
#[derive(Clone, Copy, Debug, Default)]
pub struct OcclusionProbe {
    /// Shafts towards the light.
    shafts: u32,
    /// Those that were dense.
    dense: u32,
    /// Triangles in the shafts that were not dense.
    candidates: usize,
    /// Edges that bound what those hide.
    edges: usize,
}

impl OcclusionProbe {
    /// Asks for the shaft from `position` to the light.
    pub fn look<T: EmissionTexture>(
        &mut self,
        occluders: &Occluders,
        light: &LightSource<'_, T>,
        area: &AreaLight,
        position: DVec3,
        buffers: &mut Buffers,
    ) {
        let query = ShaftQuery {
            point: position,
            light: (&area.polygon).into(),
            exclude: light.triangles.clone(),
        };
        let shaft = occluders.shaft(query, &mut buffers.scratch);
        self.shafts += 1;
        self.dense += u32::from(shaft.is_dense());
        if let Some(images) = shaft.images() {
            let penumbra = &mut buffers.samples.penumbra;
            penumbra.boundary(images.light(), images.triangles());
            self.candidates += shaft.candidates();
            self.edges += penumbra.edge_count();
        }
    }

    /// What the shafts say.
    #[must_use]
    pub fn stats(self) -> OcclusionStats {
        let dense = f64::from(self.dense) > DENSE * f64::from(self.shafts);
        if self.candidates == 0 {
            let none = OcclusionStats::default();
            return OcclusionStats { dense, ..none };
        }
        #[allow(clippy::cast_precision_loss, reason = "a few hundred shafts")]
        let (edges, candidates) = (self.edges as f64, self.candidates as f64);
        OcclusionStats {
            dense,
            candidates: candidates / f64::from(self.shafts),
            edges: edges / candidates,
            ..OcclusionStats::default()
        }
    }
}
