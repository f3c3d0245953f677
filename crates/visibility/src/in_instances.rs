//! Instances between a point and a light: what is visible past them.
//!
//! An affine map takes lines to lines and keeps their parameters. So point, light and lines are
//! brought to the coordinates of each instance in between, and what is visible there of a line is
//! so here; what is visible past all is what is visible past each. What the walks through the first
//! few of them have found is kept, as that of the occluders' own triangles is.

use crate::{
    Between, Counters, Instance, LightCorners, Scratch, Shaft, ShaftClass, ShaftQuery,
    VisibleLines, collect,
    filtered::{Past, Room},
    instances::Instances,
    shaft::Outlook,
};
use linelit_geometry::{ConvexPolygon, DVec3, Margins, Segment};

/// Instances whose shafts are kept; those of more are walked anew for each question.
const KEPT: usize = 16;

/// What is known of the instances in a shaft, and room to ask them.
#[derive(Debug, Default)]
pub(crate) struct InInstances {
    /// Those that may hide a part.
    within: Vec<Within>,
    /// One for each that is kept, and one for all others.
    scratches: Vec<Scratch>,
    light: Vec<DVec3>,
    lines: Vec<Segment>,
    visible: VisibleLines,
    common: VisibleLines,
    room: Room,
}

/// An instance in a shaft.
#[derive(Clone, Copy, Debug)]
struct Within {
    number: u32,
    outlook: View,
}

/// What was found there.
#[derive(Clone, Copy, Debug)]
enum View {
    /// Triangles without holes.
    Solid(Outlook),
    /// Triangles that a filter cuts holes into, seen from this point.
    Filtered(DVec3),
}

/// What is found between a point and a light in an instance.
enum Look {
    /// Nothing.
    Empty,
    /// A triangle that hides the light as a whole.
    Blocked,
    /// As many triangles, which may hide a part.
    Partial(View, usize),
}

impl Instance {
    /// Looks between a point and a light of the world; what is found is in `scratch`.
    fn look(
        &self,
        point: DVec3,
        light: LightCorners<'_>,
        margins: Margins,
        scratch: &mut Scratch,
    ) -> Look {
        // What is remembered is of other triangles.
        scratch.last = None;
        let mut corners = [DVec3::ZERO; ConvexPolygon::CAPACITY];
        for (corner, v) in corners.iter_mut().zip(light.corners()) {
            *corner = self.bring(*v);
        }
        let point = self.bring(point);
        let Some(light) = LightCorners::new(&corners[..light.corners().len()]) else {
            return Look::Empty;
        };
        if let Some(past) = self.past(point, margins) {
            scratch.light.set(light, &mut scratch.frame);
            return match past.look(scratch) {
                0 => Look::Empty,
                count => Look::Partial(View::Filtered(point), count),
            };
        }
        let query = ShaftQuery {
            margins,
            ..ShaftQuery::new(point, light)
        };
        let shaft = self.occluders.own_shaft(query, scratch);
        match shaft.class() {
            ShaftClass::Empty => Look::Empty,
            ShaftClass::Blocked => Look::Blocked,
            ShaftClass::Partial => Look::Partial(View::Solid(shaft.outlook()), shaft.candidates()),
        }
    }

    /// What is past its filter, if it has one, from a point in its coordinates.
    fn past(&self, point: DVec3, margins: Margins) -> Option<Past<'_>> {
        Some(Past {
            occluders: &self.occluders,
            filter: &**self.filter.as_ref()?,
            point,
            margins,
        })
    }
}

impl Counters {
    /// Takes over the work on triangles and boxes: what was asked is counted elsewhere.
    fn take_work(&mut self, other: &mut Self) {
        self.node_tests += other.node_tests;
        self.triangle_tests += other.triangle_tests;
        self.candidates += other.candidates;
        self.filtered += other.filtered;
        *other = Self::default();
    }
}

impl Shaft<'_> {
    /// Finds the instances in the shaft.
    pub(crate) fn look_into(&mut self, instances: &Instances, light: LightCorners<'_>) {
        if self.class == ShaftClass::Blocked {
            return;
        }
        let mut all = self.scratch.instances.take().unwrap_or_default();
        let InInstances {
            within,
            scratches,
            light: corners,
            ..
        } = &mut *all;
        within.clear();
        corners.clear();
        corners.extend_from_slice(light.corners());
        collect::between::<true>(
            instances.boxes.isa,
            &instances.boxes,
            &self.point,
            self.scratch,
        );
        let between = Between::new(self.point, light);
        let margins = self.margins();
        let leaves = &instances.boxes.hierarchy.leaves;
        for k in 0..self.scratch.found.len() {
            let slot = self.scratch.found[k] as usize;
            let number = leaves[slot / 8].id[slot % 8];
            let instance = &instances.list[number as usize];
            let [low, high] = instances.bounds[number as usize];
            if instance.mask & self.occluders.mask == 0 || !between.may_meet(low, high) {
                continue;
            }
            let place = within.len().min(KEPT);
            if scratches.len() == place {
                scratches.push(Scratch::new());
            }
            let found = instance.look(self.point, light, margins, &mut scratches[place]);
            let counters = &mut self.scratch.counters;
            counters.instances += 1;
            counters.take_work(&mut scratches[place].counters);
            match found {
                Look::Empty => {}
                Look::Blocked => {
                    self.class = ShaftClass::Blocked;
                    break;
                }
                Look::Partial(outlook, count) => {
                    counters.candidates += count as u64;
                    within.push(Within { number, outlook });
                }
            }
        }
        self.instances = !within.is_empty();
        if self.instances && self.class == ShaftClass::Empty {
            self.class = ShaftClass::Partial;
        }
        self.scratch.instances = Some(all);
    }

    /// Keeps of lines on the light what is visible past the instances, too.
    pub(crate) fn past_instances(&mut self, lines: &[Segment], out: &mut VisibleLines) {
        let margins = self.margins();
        self.each_instance(|counters, k, instance, all| {
            if out.interval_count() == 0 {
                return false;
            }
            all.lines.clear();
            all.lines
                .extend(lines.iter().map(|line| instance.bring_line(line)));
            let scratch = &mut all.scratches[k.min(KEPT)];
            match all.within[k].outlook {
                View::Solid(outlook) => {
                    all.visible.reset(lines.len());
                    let mut shaft = instance.occluders.again(outlook, scratch);
                    shaft.own_visible(&all.lines, &mut all.visible);
                }
                View::Filtered(point) => {
                    if let Some(past) = instance.past(point, margins) {
                        past.visible(&all.lines, scratch, &mut all.room, &mut all.visible);
                    }
                }
            }
            counters.take_work(&mut scratch.counters);
            out.keep_common(&all.visible, &mut all.common);
            true
        });
    }

    /// Whether any of the instances hides a point of the light.
    pub(crate) fn instance_hides(&mut self, target: DVec3) -> bool {
        let mut hides = false;
        let margins = self.margins();
        self.each_instance(|counters, k, instance, all| {
            let target = instance.bring(target);
            let scratch = &mut all.scratches[k.min(KEPT)];
            hides = match all.within[k].outlook {
                View::Solid(outlook) => {
                    let mut shaft = instance.occluders.again(outlook, scratch);
                    !shaft.own_point_visible(target)
                }
                View::Filtered(point) => instance
                    .past(point, margins)
                    .is_some_and(|past| past.hides(target, scratch)),
            };
            counters.take_work(&mut scratch.counters);
            !hides
        });
        hides
    }

    /// Asks one instance in the shaft after the other, until `ask` says that that is enough: those
    /// that are not kept are looked at anew.
    fn each_instance(
        &mut self,
        mut ask: impl FnMut(&mut Counters, usize, &Instance, &mut InInstances) -> bool,
    ) {
        let Some(mut all) = self.scratch.instances.take() else {
            return;
        };
        let instances = self.occluders.instances();
        let margins = self.margins();
        for k in 0..all.within.len() {
            let instance = &instances[all.within[k].number as usize];
            self.scratch.counters.instances += 1;
            if k >= KEPT {
                let corners = LightCorners::new(&all.light);
                let scratch = &mut all.scratches[KEPT];
                corners.map(|light| instance.look(self.point, light, margins, scratch));
            }
            if !ask(&mut self.scratch.counters, k, instance, &mut all) {
                break;
            }
        }
        self.scratch.instances = Some(all);
    }
}
