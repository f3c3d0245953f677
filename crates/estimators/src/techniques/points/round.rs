//! What draws points of spheres, disks and cylinders.

use super::bsdf::Directions;
use super::ltc::DiskLobes;
use super::{DrawPoints, Drawn, LightPoint};
use crate::light::Shape;
use crate::point_block::Columns;
use crate::techniques::point_techniques;
use crate::techniques::points::PointDensity;
use crate::{PointBy, ShadingPoint};
use linelit_bsdf::{Reflection, TransformedCosines};
use linelit_geometry::DVec3;
use linelit_lights::{
    CylinderArea, CylinderLines, CylinderView, Disk, DiskArea, DiskChords, DiskCone, SphereCap,
    SphereCone, SphereProjected,
};

/// Who looks at a round light.
pub(crate) struct Viewer<'a> {
    /// The shading point.
    pub position: DVec3,
    /// Its shading normal.
    pub normal: DVec3,
    /// What it reflects, if that is known and a technique asks for it.
    pub cosines: Option<&'a TransformedCosines>,
}

impl<'a> Viewer<'a> {
    pub(crate) fn new<R>(point: &ShadingPoint<R>, cosines: Option<&'a TransformedCosines>) -> Self {
        Self {
            position: point.position,
            normal: point.normal,
            cosines,
        }
    }

    /// What draws points of a disk by the lobes of the reflection, where it can.
    pub(crate) fn lobes(&self, disk: &Disk) -> Option<RoundPoints> {
        let cosines = self.cosines.filter(|cosines| !cosines.lobes().is_empty())?;
        DiskLobes::new(disk, self.position, cosines).map(RoundPoints::from)
    }
}

/// The enumeration of what draws points of round lights.
macro_rules! sources {
    ($($variant:ident: $type:ty,)+) => {
        /// What draws points of a sphere, a disk or a cylinder, ready for a shading point.
        #[derive(Clone, Copy, Debug)]
        #[allow(clippy::large_enum_variant, reason = "a few of them live in a buffer or on the stack")]
        pub(crate) enum RoundPoints {
            $($variant($type),)+
        }

        $(impl From<$type> for RoundPoints {
            fn from(source: $type) -> Self {
                Self::$variant(source)
            }
        })+

        impl<S: Shape> DrawPoints<S> for RoundPoints {
            #[inline]
            fn draw<R: Reflection>(
                &self,
                u: [f64; 2],
                surface: &S,
                point: &ShadingPoint<R>,
            ) -> Drawn {
                match self {
                    $(Self::$variant(source) => source.draw(u, surface, point),)+
                }
            }

            fn draw_columns(&self, rows: usize, columns: &mut Columns) -> Option<bool> {
                match self {
                    $(Self::$variant(source) => {
                        DrawPoints::<S>::draw_columns(source, rows, columns)
                    })+
                }
            }

            #[inline]
            fn density<R: Reflection>(&self, at: &LightPoint, point: &ShadingPoint<R>) -> f64 {
                match self {
                    $(Self::$variant(source) => DrawPoints::<S>::density(source, at, point),)+
                }
            }
        }
    };
}

sources! {
    Cap: SphereCap,
    Cone: SphereCone,
    Projected: SphereProjected,
    DiskArea: DiskArea,
    DiskCone: DiskCone,
    Chords: DiskChords,
    CylinderArea: CylinderArea,
    CylinderLines: CylinderLines,
    Directions: Directions,
    Lobes: DiskLobes,
}

impl RoundPoints {
    /// Points of a technique on what a shading point with these horizons sees of a cylinder.
    pub(crate) fn on_cylinder(by: PointBy, seen: &CylinderView, horizons: &[DVec3; 2]) -> Self {
        point_techniques! { dispatch [by, technique => technique.on_cylinder(seen, horizons)] }
    }
}
