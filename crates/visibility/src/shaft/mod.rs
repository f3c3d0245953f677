//! Shafts: the search for triangles between one shading point and one light, whose result is then
//! queried for many line samples and points. [`Occluders::shaft`] makes a [`Shaft`] from a
//! [`ShaftQuery`]; the modules below have its kernels.

pub(crate) mod bins;
pub(crate) mod block;
pub(crate) mod bounds;
pub(crate) mod cover;
pub(crate) mod dense;
mod find;
pub(crate) mod frame;
pub(crate) mod front;
pub(crate) mod in_front;
pub(crate) mod merge;
pub(crate) mod plane;
pub(crate) mod project;
pub(crate) mod seen;
mod sides;
pub(crate) mod sweep;
mod together;

use crate::{
    Counters, LightCorners, Occluders, Ray, Scratch, VisibleLines, brute,
    holes::filtered::{Past, PastScratch},
    node::{Child, DENSE},
    rays::ray::{self, shadow_ray},
    silhouettes::crossings::Gap,
};
use bins::GROUP;
use block::has_length;
use dense::{Answered, DenseQuery};
use find::Found;
use linelit_geometry::{DVec3, Margins, Segment, Vector3, stop};
use std::ops::Range;

/// The parameters of a shaft: a shading point, a light, and the triangles and margins that do not
/// hide the light.
#[derive(Clone, Debug)]
pub struct ShaftQuery<'a> {
    /// The shading point, already offset from its own surface.
    pub point: DVec3,
    /// The light: a polygon, or the two ends of a linear light.
    pub light: LightCorners<'a>,
    /// The indices of the light's own triangles, which do not hide it.
    pub exclude: Range<u32>,
    /// How close to the point and to the light an occluder hides nothing, as fractions of the way
    /// between the two.
    pub margins: Margins,
}

impl<'a> ShaftQuery<'a> {
    /// Creates a query for a light to which none of the triangles belongs, with the default
    /// margins.
    #[must_use]
    pub fn new(point: impl Vector3, light: impl Into<LightCorners<'a>>) -> Self {
        Self {
            point: point.dvec3(),
            light: light.into(),
            exclude: 0..0,
            margins: Margins::DEFAULT,
        }
    }

    /// Excludes the triangles with these indices, which are the light's own.
    #[must_use]
    pub fn excluding(self, exclude: Range<u32>) -> Self {
        Self { exclude, ..self }
    }
}

/// Whether occluders hide none, all, or possibly some of a light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShaftClass {
    /// No occluder is between the point and the light: every line and point of it is visible.
    Empty,
    /// The whole light is hidden.
    Blocked,
    /// Occluders are in between, or may be. This is also the class of a light that is seen edge on,
    /// has no extent or is not finite, so that no search for the light as a whole is possible.
    Partial,
}

/// A light as seen from a shading point: the result of one walk through the hierarchy, which
/// answers queries for all line samples and points of the light.
#[derive(Debug)]
pub struct Shaft<'a> {
    occluders: &'a Occluders,
    scratch: &'a mut Scratch,
    /// The index of the first of the light's own triangles, and how many there are.
    exclude: (u32, u32),
    /// The result of the search for solid triangles.
    found: Found,
    /// Whether triangles with holes are between the point and the light; they may hide a part of
    /// it.
    has_holes: bool,
}

impl Occluders {
    /// Searches for all triangles between a point and a light, those with holes included.
    pub fn shaft<'a>(&'a self, query: ShaftQuery<'_>, scratch: &'a mut Scratch) -> Shaft<'a> {
        let light = query.light;
        let mut shaft = self.own_shaft(query, scratch);
        shaft.look_for_holes(light);
        shaft.count();
        shaft
    }

    /// Searches for the solid triangles between a point and a light.
    #[inline]
    pub(crate) fn own_shaft<'a>(
        &'a self,
        query: ShaftQuery<'_>,
        scratch: &'a mut Scratch,
    ) -> Shaft<'a> {
        let seen = &mut scratch.seen;
        if !seen.light.is(query.light) {
            seen.light.set(query.light, &mut seen.frame);
        }
        seen.point = query.point;
        seen.frame.margins = query.margins;
        let Range { start, end } = query.exclude;
        let exclude = (start, end.saturating_sub(start));
        let (bvh, stack) = (&self.bvh, &mut scratch.rays.stack);
        let mut found = find::find(bvh.isa, bvh, exclude, seen, stack, &mut scratch.counters);
        if found == Found::Few && together::hide(bvh.isa, &seen.flat, &seen.frame) {
            found = Found::All;
        }
        Shaft {
            occluders: self,
            scratch,
            exclude,
            found,
            has_holes: false,
        }
    }
}

impl<'a> Shaft<'a> {
    /// Returns the buffers that the shaft borrowed.
    #[must_use]
    pub const fn into_scratch(self) -> &'a mut Scratch {
        self.scratch
    }
}

impl Shaft<'_> {
    /// Counts the shaft in the counter of its class.
    #[inline]
    fn count(&mut self) {
        let (class, dense) = (self.class(), self.is_dense());
        let counters = &mut self.scratch.counters;
        counters.shafts += 1;
        match class {
            ShaftClass::Blocked => counters.blocked_shafts += 1,
            ShaftClass::Empty => counters.empty_shafts += 1,
            ShaftClass::Partial => {
                counters.partial_shafts += 1;
                counters.dense_shafts += u64::from(dense);
                if self.found == Found::Few {
                    counters.candidates += self.scratch.seen.flat.count as u64;
                }
            }
        }
    }

    /// Whether occluders hide none, all, or possibly some of the light.
    #[inline]
    #[must_use]
    pub fn class(&self) -> ShaftClass {
        match self.found {
            Found::All => ShaftClass::Blocked,
            Found::Nothing if !self.has_holes => ShaftClass::Empty,
            _ => ShaftClass::Partial,
        }
    }

    /// The number of triangles, or pieces of clipped triangles, that may hide a part of the light;
    /// zero for an empty or blocked shaft, and a lower bound for a dense one.
    #[must_use]
    pub fn candidates(&self) -> usize {
        match self.class() {
            ShaftClass::Partial if self.is_dense() => DENSE.max(self.scratch.seen.flat.count),
            ShaftClass::Partial => self.scratch.seen.flat.count,
            ShaftClass::Empty | ShaftClass::Blocked => 0,
        }
    }

    /// Whether the shaft is dense: there are too many triangles in between to store them, or the
    /// search had no result, which is as expensive. Then [`Self::candidates`] is only a lower
    /// bound, and every few lines need a walk of their own. A shaft with triangles with holes
    /// counts as dense, too, since what they hide is not a polygon.
    #[must_use]
    pub fn is_dense(&self) -> bool {
        matches!(self.found, Found::Many | Found::Unknown) || self.has_holes
    }

    /// Returns the triangles that may hide a part of the light, as indices into the list that the
    /// occluders were built from, each once, in no particular order. Together they hide everything
    /// that is hidden. Of a closed mesh that is close to neither the shading point nor the light,
    /// the triangles that face one way are left out, since the triangles that face the other way
    /// hide as much. There are none for an empty or blocked shaft. The result is `None` for a dense
    /// shaft, which does not store all of its triangles.
    ///
    /// There are fewer triangles than [`Self::candidates`] where triangles were clipped into
    /// pieces. The order is the same on every instruction set.
    #[must_use]
    pub fn candidate_triangles(&self) -> Option<impl ExactSizeIterator<Item = u32> + '_> {
        let leaves = &self.occluders.bvh.hierarchy.leaves;
        let id = |&slot: &u32| leaves[slot as usize / 8].id[slot as usize % 8];
        Some(self.candidate_slots()?.iter().map(id))
    }

    /// Returns the corners of the [`Self::candidate_triangles`] in world space, as they were given:
    /// whole triangles, parts of which may be beyond the light or behind the shading point.
    #[must_use]
    pub fn candidate_corners(&self) -> Option<impl ExactSizeIterator<Item = [DVec3; 3]> + '_> {
        let hierarchy = &*self.occluders.bvh.hierarchy;
        let corners = |&slot: &u32| {
            let leaf = &hierarchy.leaves[slot as usize / 8];
            let world = |v: [f32; 3]| DVec3::from(v.map(f64::from)) + self.occluders.bvh.origin;
            leaf.triangle(slot as usize % 8).map(world)
        };
        Some(self.candidate_slots()?.iter().map(corners))
    }

    /// Returns the candidates projected from the shading point onto the [plane](Self::light_plane)
    /// of the light, as their corners in (p, q); `None` unless the light is partly hidden by few
    /// enough triangles to store.
    ///
    /// Each entry is the projection of a triangle or of a piece of one, in either orientation. The
    /// projections extend beyond the light; together they cover exactly what is hidden of it. An
    /// edge that two triangles of a mesh share has bit-identical ends in both projections.
    #[must_use]
    pub fn images(&self) -> Option<impl ExactSizeIterator<Item = [[f64; 2]; 3]>> {
        let is_few = self.found == Found::Few && !self.has_holes;
        is_few.then(|| self.scratch.seen.flat.get_from(0))
    }

    /// The work that queries through the shaft's [`Scratch`] have done so far, including queries of
    /// other shafts.
    #[must_use]
    pub fn counters(&self) -> &Counters {
        &self.scratch.counters
    }

    /// A distance from the shading point, in the units of the scene, beyond which there are no
    /// triangles. It is generous: 1024 times the largest coordinate of the triangles plus the
    /// largest coordinate of the point, both relative to the hierarchy's origin. Rounding errors of
    /// corners and of ray hits are proportional to it.
    #[must_use]
    pub fn reach(&self) -> f64 {
        self.occluders.bvh.reach(self.point())
    }

    /// Whether a point of the light is visible. The point is given by its position relative to the
    /// shading point.
    pub fn place_visible(&mut self, place: DVec3) -> bool {
        self.point_visible(self.point() + place)
    }

    /// Returns the slots of the candidates: leaf × 8 + lane.
    fn candidate_slots(&self) -> Option<&[u32]> {
        match self.class() {
            ShaftClass::Partial if self.is_dense() => None,
            ShaftClass::Partial => Some(self.scratch.seen.corners.slots()),
            ShaftClass::Empty | ShaftClass::Blocked => Some(&[]),
        }
    }

    /// Finds the visible intervals of lines on the light, and replaces the contents of `out` by
    /// them.
    ///
    /// Consecutive lines of one direction are answered together. A line that has no length or is
    /// not finite has no visible part.
    pub fn visible(&mut self, lines: &[Segment], out: &mut VisibleLines) {
        out.reset(lines.len());
        self.scratch.counters.line_queries += lines.len() as u64;
        if self.found != Found::All {
            self.own_visible(lines, out);
            if self.has_holes
                && out.interval_count() > 0
                && let Some((past, scratch, counters)) = self.past_holes()
            {
                past.keep_visible(lines, scratch, counters, out);
            }
        }
        self.scratch.counters.intervals += out.interval_count() as u64;
    }

    /// Finds the parts of lines that no solid triangle hides.
    #[inline]
    pub(crate) fn own_visible(&mut self, lines: &[Segment], out: &mut VisibleLines) {
        match self.found {
            Found::All => {}
            Found::Nothing => out.put_all_whole(lines.iter().map(has_length)),
            Found::Unknown => {
                for (i, line) in lines.iter().enumerate() {
                    if has_length(line) {
                        self.one(lines, i, out);
                    }
                }
            }
            Found::Few | Found::Many => {
                let mut first = 0;
                while first < lines.len() {
                    stop::check();
                    first += self.group(lines, first, out);
                }
            }
        }
    }

    /// Finds the visible parts of the lines from index `first` on that share a direction, and
    /// returns how many lines these are.
    fn group(&mut self, lines: &[Segment], first: usize, out: &mut VisibleLines) -> usize {
        let isa = self.occluders.bvh.isa;
        let dense = self.found == Found::Many;
        let (seen, all) = (&self.scratch.seen, &mut self.scratch.lines);
        let count = sweep::sweep(isa, seen, &lines[first..], first, dense, all, out);
        if dense {
            self.visible_dense(lines, first, out);
        }
        // Count at least the one line, even if it is not finite.
        count.max(1)
    }

    /// Finds the visible parts of a line as a light of its own, for lights that have no frame.
    #[cold]
    fn one(&mut self, lines: &[Segment], i: usize, out: &mut VisibleLines) {
        let ends = [lines[i].p0, lines[i].p1];
        let query = ShaftQuery {
            point: self.point(),
            light: (&ends).into(),
            exclude: self.excluded(),
            margins: self.margins(),
        };
        let mut own = self.occluders.own_shaft(query, self.scratch);
        own.count();
        match own.found {
            Found::All => {}
            Found::Nothing => out.put_whole(i),
            Found::Unknown => own.by_all(&lines[i], i, out),
            Found::Few | Found::Many => {
                own.group(&lines[..=i], i, out);
            }
        }
    }

    /// Finds the visible parts of a line by testing all triangles of the scene, for lines that have
    /// no frame either. A line that is seen end on, or is so small that rounding decides which of
    /// its parts are visible, has no visible part unless both ends are visible.
    #[cold]
    fn by_all(&mut self, line: &Segment, i: usize, out: &mut VisibleLines) {
        if !has_length(line) {
            return;
        }
        let (bvh, exclude) = (&self.occluders.bvh, self.excluded());
        let past = brute::past_all(bvh, self.point(), line, &exclude, self.margins());
        let rough = past.as_ref().is_none_or(|past| past.point_like);
        if rough && !(self.ray_reaches(line.p0) && self.ray_reaches(line.p1)) {
            return;
        }
        match past {
            Some(past) => out.put(i, past.parts.iter().map(|part| (part.lo, part.hi, true))),
            // If the line is seen end on, all of it is visible if its ends are.
            None => out.put_whole(i),
        }
    }

    /// The margins of the query.
    fn margins(&self) -> Margins {
        self.scratch.seen.frame.margins
    }

    /// The shading point, in world space.
    fn point(&self) -> DVec3 {
        self.scratch.seen.point
    }

    fn excluded(&self) -> Range<u32> {
        self.exclude.0..self.exclude.0 + self.exclude.1
    }

    /// Whether no triangle hides a point from the shading point; false if there is no ray to the
    /// point, since a coordinate overflows.
    fn ray_reaches(&mut self, target: DVec3) -> bool {
        let ray = shadow_ray(&self.occluders.bvh, self.point(), target, self.margins());
        ray.is_some_and(|ray| !self.meets(&ray))
    }

    /// Returns a leaf with a triangle that hides a point; `None` if there is no such triangle, or
    /// no ray to the point.
    fn what_hides(&mut self, target: DVec3) -> Option<Child> {
        let ray = shadow_ray(&self.occluders.bvh, self.point(), target, self.margins())?;
        let (_, leaf) = self.meets(&ray).then_some(self.scratch.rays.last)??;
        Some(leaf)
    }

    /// Whether a ray hits any solid triangle.
    fn meets(&mut self, ray: &Ray) -> bool {
        let exclude = self.excluded();
        let Scratch { rays, counters, .. } = &mut *self.scratch;
        counters.rays += 1;
        let bvh = &self.occluders.bvh;
        ray::any(bvh.isa, bvh, ray, &exclude, rays, counters)
    }

    /// Finds the visible parts of the lines of a dense shaft, a few lines at a time.
    fn visible_dense(&mut self, lines: &[Segment], first: usize, out: &mut VisibleLines) {
        let mut start = 0;
        while start < self.scratch.lines.ends.count {
            let end = self.scratch.lines.ends.count.min(start + GROUP);
            self.visible_few(start..end, lines, first, out);
            start = end;
        }
    }

    /// Finds the visible parts of a few neighbours among the lines of a dense shaft, by a walk of
    /// their own. `few` is the range of their positions in ascending order of u.
    fn visible_few(
        &mut self,
        few: Range<usize>,
        lines: &[Segment],
        first: usize,
        out: &mut VisibleLines,
    ) {
        // Bound the lines along and across their direction.
        let point = self.point() - self.occluders.bvh.origin;
        let (frame, all) = (&self.scratch.seen.frame, &mut self.scratch.lines);
        let (ends, few_lines) = (&all.ends, &mut all.lines);
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for k in few.clone() {
            let i = ends.nth(k);
            low = low.min(ends.a[i]).min(ends.b[i]);
            high = high.max(ends.a[i]).max(ends.b[i]);
        }
        if !(low < high) {
            return;
        }
        let across = [few.start, few.end - 1].map(|k| ends.u[ends.nth(k)]);
        let [least, most] = [[across[0], low], [across[1], high]];
        let around = frame.around_lines(ends.along, least, most);
        // Transform the lines to a frame of their own, with q along them, so that the coordinate
        // across is −p; the frame has a small margin.
        let share =
            |x: f64, from: f64, size: f64| (x - (from - 1e-6 * size)) / (size * (1.0 + 2e-6));
        let to_p = |u: f64| match around.corner_count {
            2 => 0.0,
            _ => share(u, across[0], across[1] - across[0]),
        };
        let to_q = |v: f64| share(v, low, high - low);
        few_lines.clear([0.0, 1.0]);
        for k in few.clone().rev() {
            let i = ends.nth(k);
            let (a, b) = (to_q(ends.a[i]), to_q(ends.b[i]));
            few_lines.push(-to_p(ends.u[i]), a, b, block::number(first, i));
        }
        // Find the box around the lines in space. The corners come from an inverted matrix, so add
        // a margin.
        let corners = frame.corners_in_space(ends.along, least, most);
        let box_of = |pick: fn(DVec3, DVec3) -> DVec3| corners.into_iter().reduce(pick);
        let [lo, hi] =
            [DVec3::min, DVec3::max].map(|pick| box_of(pick).unwrap_or_default() + point);
        // The corners are those of a matrix that was inverted.
        let room = DVec3::splat(ray::ROOM * self.reach());
        let bvh = &self.occluders.bvh;
        // Start the walk with leaves that hide much of the lines, if rays find such leaves.
        let hidden = self.seek_cover(lines, few.clone(), first);
        let query = DenseQuery {
            around: [lo - room, hi + room],
            frame: around,
            exclude: self.exclude,
            // Where such leaves were found, they soon hide the lines; where lines stay visible,
            // there are fewer silhouettes than triangles to test.
            silhouettes: !hidden && bvh.hierarchy.surfaces.serve(self.exclude),
        };
        let scratch = &mut *self.scratch;
        let (seen, all) = (&mut scratch.seen, &mut scratch.lines);
        let (dense, counters) = (&mut scratch.dense, &mut scratch.counters);
        match dense::dense(bvh.isa, bvh, &query, seen, all, dense, counters) {
            Answered::Hidden => {}
            Answered::All => sweep::finish(bvh.isa, all, out),
            Answered::ByRays => {
                self.look_through_gaps(lines);
                sweep::finish(bvh.isa, &mut self.scratch.lines, out);
            }
            Answered::Nothing => {
                for k in few {
                    let i = first + self.scratch.lines.ends.nth(k);
                    self.by_all(&lines[i], i, out);
                }
            }
        }
    }

    /// Searches for leaves that hide much of a few lines: for each line, the leaf that a ray
    /// towards a point of the line hits. The walk from front to back can skip what is behind these
    /// leaves. Returns false, with no leaves, if a ray hits nothing or hits a leaf that seems
    /// smaller than its line.
    fn seek_cover(&mut self, lines: &[Segment], few: Range<usize>, first: usize) -> bool {
        self.scratch.dense.cover.clear();
        for k in few {
            let line = &lines[first + self.scratch.lines.ends.nth(k)];
            // Alternate between two positions, so that the targets are not all on one line across.
            let target = line.at([0.3, 0.7][k % 2]);
            match self.what_hides(target) {
                Some(leaf) if self.scratch.dense.cover.contains(&leaf) => {}
                Some(leaf) if self.seems_as_large(leaf, line, target) => {
                    self.scratch.dense.cover.push(leaf);
                }
                _ => {
                    self.scratch.dense.cover.clear();
                    return false;
                }
            }
        }
        true
    }

    /// Whether a leaf before a point of a line seems as large as the line, as seen from the shading
    /// point.
    fn seems_as_large(&self, leaf: Child, line: &Segment, target: DVec3) -> bool {
        let leaf = &self.occluders.bvh.hierarchy.leaves[leaf.leaf_index()];
        let place = |corner: [f32; 3]| DVec3::from(corner.map(f64::from));
        let corners = (0..8).flat_map(|lane| leaf.triangle(lane)).map(place);
        let (lo, hi) = corners.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lo, hi), v| {
            (lo.min(v), hi.max(v))
        });
        let middle = 0.5 * (lo + hi) + self.occluders.bvh.origin - self.point();
        let ray = target - self.point();
        // Compare the sizes at the leaf's distance along the ray.
        let share = middle.dot(ray) / ray.length_squared();
        (hi - lo).length() >= share * (line.p1 - line.p0).length()
    }

    /// Sends a ray towards the middle of each gap, and hides the parts of the gap that are hidden
    /// according to the ray's answer.
    fn look_through_gaps(&mut self, lines: &[Segment]) {
        for k in 0..self.scratch.dense.crossings.gaps.len() {
            let Gap { line, middle, .. } = self.scratch.dense.crossings.gaps[k];
            let (index, lane) = (line as usize / 8, line as usize % 8);
            // Convert the middle of the gap to a parameter of the caller's line.
            let block = &self.scratch.lines.lines.blocks[index];
            let (from, to) = (block.from[lane], block.to[lane]);
            let t = (middle - from) / (to - from);
            let line = &lines[block.number[lane] as usize];
            let t = if block.reversed >> lane & 1 == 0 {
                t
            } else {
                1.0 - t
            };
            let is_visible = self.ray_reaches(line.at(t));
            for (low, high) in self.scratch.dense.crossings.hidden(k, is_visible) {
                self.scratch.lines.slots.push(index, lane, low, high);
            }
        }
    }

    /// Whether a point of the light is visible; false for a point that is not finite.
    pub fn point_visible(&mut self, light_point: DVec3) -> bool {
        self.scratch.counters.shaft_points += 1;
        if self.found == Found::All || !self.own_point_visible(light_point) {
            return false;
        }
        if !self.has_holes {
            return true;
        }
        let past = self.past_holes();
        !past.is_some_and(|(past, scratch, counters)| past.hides(light_point, scratch, counters))
    }

    /// Returns the query for triangles with holes, and the buffers for it; `None` if there are no
    /// triangles with holes.
    fn past_holes(&mut self) -> Option<(Past<'_>, &mut PastScratch, &mut Counters)> {
        let holes = self.occluders.holes.as_ref()?;
        let past = holes.past(self.point(), self.margins());
        let scratch = &mut *self.scratch;
        Some((past, &mut scratch.past_holes, &mut scratch.counters))
    }

    /// Searches for triangles with holes in the shaft.
    fn look_for_holes(&mut self, light: LightCorners<'_>) {
        if self.found == Found::All {
            return;
        }
        let Some((past, scratch, counters)) = self.past_holes() else {
            return;
        };
        let count = past.look(light, scratch, counters);
        counters.candidates += count as u64;
        self.has_holes = count > 0;
    }

    /// Whether no solid triangle hides a point.
    #[inline]
    pub(crate) fn own_point_visible(&mut self, light_point: DVec3) -> bool {
        match self.found {
            Found::All => false,
            Found::Nothing => light_point.is_finite(),
            Found::Many | Found::Unknown => self.ray_reaches(light_point),
            Found::Few => {
                let at = self.scratch.seen.frame.project(light_point - self.point());
                // The projection of a point that is not finite is not a number.
                if at[0].is_nan() && !light_point.is_finite() {
                    return false;
                }
                !sweep::hidden_point(self.occluders.bvh.isa, &self.scratch.seen.flat, at)
            }
        }
    }
}
