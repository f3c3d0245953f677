//! What a combination knows of visibility: from one shaft, or by a traversal for each question.

use crate::Queries;
use crate::point_sum::bits;
use linelit_geometry::{DVec3, Segment};
use linelit_lights::CylinderView;
use linelit_visibility::{Occluders, Scratch, Shaft, ShaftClass, ShaftQuery, VisibleLines};

/// Answers for one shading point and one light.
pub(super) enum Visibility<'a> {
    /// One shaft answers everything.
    OneShaft(Shaft<'a>),
    /// One shaft towards the outline of a cylinder answers everything: lines as they are seen
    /// there, for which there is memory.
    Outline(Shaft<'a>, &'a CylinderView, Vec<Segment>),
    /// Each line and each point has a traversal of its own, as published.
    SeparateRays {
        occluders: &'a Occluders,
        scratch: &'a mut Scratch,
        query: ShaftQuery<'a>,
    },
}

impl<'a> Visibility<'a> {
    /// Gets ready to answer; one shaft looks into the hierarchy at once.
    pub(super) fn new(
        occluders: &'a Occluders,
        queries: Queries,
        query: ShaftQuery<'a>,
        scratch: &'a mut Scratch,
    ) -> Self {
        match queries {
            Queries::OneShaft => Self::OneShaft(occluders.shaft(query, scratch)),
            Queries::SeparateRays => Self::SeparateRays {
                occluders,
                scratch,
                query,
            },
        }
    }

    /// What is known before anything is asked.
    pub(super) fn class(&self) -> ShaftClass {
        match self {
            Self::OneShaft(shaft) | Self::Outline(shaft, ..) => shaft.class(),
            Self::SeparateRays { .. } => ShaftClass::Partial,
        }
    }

    /// The shaft that answers everything.
    pub(super) fn shaft_mut(&mut self) -> Option<&mut Shaft<'a>> {
        match self {
            Self::OneShaft(shaft) | Self::Outline(shaft, ..) => Some(shaft),
            Self::SeparateRays { .. } => None,
        }
    }

    /// The visible parts of lines on the light.
    pub(super) fn visible(&mut self, lines: &[Segment], out: &mut VisibleLines) {
        let (occluders, scratch, query) = match self {
            Self::OneShaft(shaft) => return shaft.visible(lines, out),
            Self::Outline(shaft, seen, flat) => {
                flat.clear();
                flat.extend(lines.iter().map(|line| seen.onto_outline(line)));
                return shaft.visible(flat, out);
            }
            Self::SeparateRays {
                occluders,
                scratch,
                query,
            } => (occluders, scratch, query),
        };
        out.clear();
        let mut one = VisibleLines::new();
        for line in lines {
            // The shaft towards a line is a triangle: less to search than towards the whole light.
            let ends = [line.p0, line.p1];
            let query = ShaftQuery {
                light: (&ends).into(),
                ..query.clone()
            };
            let mut shaft = occluders.shaft(query, scratch);
            shaft.visible(std::slice::from_ref(line), &mut one);
            out.append(&one);
        }
    }

    /// Which points of the light are visible, a bit for each of up to 64; what it is given is left
    /// changed.
    pub(super) fn points_visible(&mut self, on_light: &mut [DVec3]) -> u64 {
        match self {
            Self::OneShaft(shaft) | Self::Outline(shaft, ..) => {
                bits(on_light, |at| shaft.point_visible(*at))
            }
            Self::SeparateRays {
                occluders,
                scratch,
                query,
            } => {
                for at in on_light.iter_mut() {
                    *at -= query.point;
                }
                let fan = occluders.shadow_rays(query.point, on_light, query.margins);
                fan.all() & !occluders.any_hits(&fan, &query.exclude, scratch)
            }
        }
    }
}
