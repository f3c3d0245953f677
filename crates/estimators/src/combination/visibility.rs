//! What a combination knows of visibility: from one shaft, or by a traversal for each question.

use crate::Queries;
use linelit_geometry::{DVec3, LIGHT_MARGIN, Segment};
use linelit_visibility::{Occluders, Ray, Scratch, Shaft, ShaftClass, ShaftQuery, VisibleLines};
use std::ops::Range;

/// Answers for one shading point and one light.
pub(super) enum Visibility<'a> {
    /// One shaft answers everything.
    OneShaft(Shaft<'a>),
    /// Each line and each point has a traversal of its own, as published.
    SeparateRays(SeparateRays<'a>),
}

/// Traversals for single questions.
pub(super) struct SeparateRays<'a> {
    occluders: &'a Occluders,
    scratch: &'a mut Scratch,
    point: DVec3,
    exclude: Range<u32>,
}

impl<'a> Visibility<'a> {
    /// Gets ready to answer; one shaft looks into the hierarchy at once.
    pub(super) fn new(
        occluders: &'a Occluders,
        queries: Queries,
        query: ShaftQuery<'_>,
        scratch: &'a mut Scratch,
    ) -> Self {
        match queries {
            Queries::OneShaft => Self::OneShaft(occluders.shaft(query, scratch)),
            Queries::SeparateRays => Self::SeparateRays(SeparateRays {
                occluders,
                scratch,
                point: query.point,
                exclude: query.exclude,
            }),
        }
    }

    /// What is known before anything is asked.
    pub(super) fn class(&self) -> ShaftClass {
        match self {
            Self::OneShaft(shaft) => shaft.class(),
            Self::SeparateRays(_) => ShaftClass::Partial,
        }
    }

    /// Whether so much stands in between that it was not kept.
    pub(super) fn is_dense(&self) -> bool {
        matches!(self, Self::OneShaft(shaft) if shaft.is_dense())
    }

    /// The visible parts of lines on the light.
    pub(super) fn visible(&mut self, lines: &[Segment], out: &mut VisibleLines) {
        let rays = match self {
            Self::OneShaft(shaft) => return shaft.visible(lines, out),
            Self::SeparateRays(rays) => rays,
        };
        out.clear();
        let mut one = VisibleLines::new();
        for line in lines {
            // The shaft towards a line is a triangle: less to search than towards the whole light.
            let ends = [line.p0, line.p1];
            let query = ShaftQuery {
                point: rays.point,
                light: (&ends).into(),
                exclude: rays.exclude.clone(),
            };
            let mut shaft = rays.occluders.shaft(query, rays.scratch);
            shaft.visible(std::slice::from_ref(line), &mut one);
            out.append(&one);
        }
    }

    /// Whether a point of the light is visible.
    pub(super) fn point_visible(&mut self, on_light: DVec3) -> bool {
        match self {
            Self::OneShaft(shaft) => shaft.point_visible(on_light),
            Self::SeparateRays(rays) => {
                let ray = Ray {
                    origin: rays.point,
                    direction: on_light - rays.point,
                    t_min: 0.0,
                    t_max: 1.0 - LIGHT_MARGIN,
                };
                let SeparateRays {
                    occluders,
                    scratch,
                    exclude,
                    ..
                } = rays;
                !occluders.any_hit(&ray, exclude, scratch)
            }
        }
    }
}
