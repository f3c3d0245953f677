//! What a mix sees of a light: by one shaft, or by a traversal for each question.

use crate::pair::Pair;
use linelit_geometry::{DVec3, LIGHT_MARGIN, Segment};
use linelit_visibility::{Occluders, Ray, Scratch, Shaft, ShaftClass, ShaftQuery, VisibleLines};
use std::ops::Range;

/// Answers for one shading point and one light.
pub(super) enum Sight<'a> {
    /// One shaft answers everything.
    Shared(Shaft<'a>),
    /// Each line and each point has a traversal of its own, as published.
    Apart(Apart<'a>),
}

/// Traversals for single questions.
pub(super) struct Apart<'a> {
    occluders: &'a Occluders,
    scratch: &'a mut Scratch,
    point: DVec3,
    exclude: Range<u32>,
}

impl<'a> Sight<'a> {
    /// By what the settings say.
    pub(super) fn new(pair: &Pair<'a>, query: ShaftQuery<'a>, scratch: &'a mut Scratch) -> Self {
        let occluders = pair.occluders;
        if pair.settings.share {
            return Self::Shared(occluders.shaft(query, scratch));
        }
        Self::Apart(Apart {
            occluders,
            scratch,
            point: query.point,
            exclude: query.exclude,
        })
    }

    /// What is known before anything is asked.
    pub(super) fn class(&self) -> ShaftClass {
        match self {
            Self::Shared(shaft) => shaft.class(),
            Self::Apart(_) => ShaftClass::Partial,
        }
    }

    /// Whether so much stands in between that it was not kept.
    pub(super) fn is_dense(&self) -> bool {
        matches!(self, Self::Shared(shaft) if shaft.is_dense())
    }

    /// The visible parts of lines on the light.
    pub(super) fn visible(&mut self, lines: &[Segment], out: &mut VisibleLines) {
        let apart = match self {
            Self::Shared(shaft) => return shaft.visible(lines, out),
            Self::Apart(apart) => apart,
        };
        out.clear();
        let mut one = VisibleLines::new();
        for line in lines {
            // The shaft towards a line is a triangle: less to search than towards the whole light.
            let ends = [line.p0, line.p1];
            let query = ShaftQuery {
                point: apart.point,
                light: (&ends).into(),
                exclude: apart.exclude.clone(),
            };
            let mut shaft = apart.occluders.shaft(query, apart.scratch);
            shaft.visible(std::slice::from_ref(line), &mut one);
            out.append(&one);
        }
    }

    /// Whether a point of the light is visible.
    pub(super) fn point_visible(&mut self, on_light: DVec3) -> bool {
        match self {
            Self::Shared(shaft) => shaft.point_visible(on_light),
            Self::Apart(apart) => {
                let ray = Ray {
                    origin: apart.point,
                    direction: on_light - apart.point,
                    t_min: 0.0,
                    t_max: 1.0 - LIGHT_MARGIN,
                };
                let Apart {
                    occluders,
                    scratch,
                    exclude,
                    ..
                } = apart;
                !occluders.any_hit(&ray, exclude, scratch)
            }
        }
    }
}
