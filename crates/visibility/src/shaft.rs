//! Shafts: everything between a shading point and a light.

use crate::{
    Counters, LightCorners, Occluders, Scratch, VisibleLines, block, bounds, brute,
    crossings::Gap,
    dense_shaft::{self, Answered, DenseQuery},
    front,
    images::Images,
    node::Child,
    outline::{self, Silhouette},
    ray::{self, Ray},
    sweep,
    walk::{self, Found},
};
use linelit_geometry::{DVec3, Margins, Segment, Vector3};
use std::ops::Range;

/// What to look at: a light from a shading point.
#[derive(Clone, Debug)]
pub struct ShaftQuery<'a> {
    /// The shading point, already off its own surface.
    pub point: DVec3,
    /// The light: a polygon, or the two ends of a linear light.
    pub light: LightCorners<'a>,
    /// The light's own triangles, which do not hide it.
    pub exclude: Range<u32>,
    /// How near to the point or to the light an occluder hides nothing.
    pub margins: Margins,
}

impl<'a> ShaftQuery<'a> {
    /// A view of a light that none of the triangles belongs to, with the default margins.
    #[must_use]
    pub fn new(point: impl Vector3, light: impl Into<LightCorners<'a>>) -> Self {
        Self {
            point: point.dvec3(),
            light: light.into(),
            exclude: 0..0,
            margins: Margins::DEFAULT,
        }
    }

    /// The same view of a light with triangles of its own.
    #[must_use]
    pub fn excluding(self, exclude: Range<u32>) -> Self {
        Self { exclude, ..self }
    }
}

/// How much of a light its occluders may hide.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShaftClass {
    /// Nothing is between the point and the light: every line and point of it is visible.
    Empty,
    /// The light is hidden as a whole.
    Blocked,
    /// Something is in between, or may be: also for a light seen edge on, without extent, or not
    /// finite, towards which nothing can be looked for as a whole.
    Partial,
}

/// A shading point's view of a light, found by one walk through the hierarchy for all of its
/// line samples and points.
#[derive(Debug)]
pub struct Shaft<'a> {
    pub(crate) occluders: &'a Occluders,
    pub(crate) scratch: &'a mut Scratch,
    /// The shading point, in world space.
    pub(crate) point: DVec3,
    /// First and number of the light's own triangles.
    exclude: (u32, u32),
    pub(crate) class: ShaftClass,
    /// Of the occluders' own triangles.
    own: ShaftClass,
    known: Known,
    /// Whether there are triangles with holes in between that may hide a part.
    pub(crate) has_holes: bool,
}

/// What the walk has found out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Known {
    /// All triangles that matter.
    All,
    /// That there are too many to keep.
    Dense,
    /// Nothing: each line and point has to be looked at by itself.
    Nothing,
}

/// More triangles than this make a shaft dense: its lines walk the hierarchy themselves, a few at
/// a time. Depends on the geometry alone; `docs/decisions/010-dense-shafts.md`.
pub(crate) const DENSE: usize = 224;

impl Occluders {
    /// Finds what is between a point and a light.
    pub fn shaft<'a>(&'a self, query: ShaftQuery<'_>, scratch: &'a mut Scratch) -> Shaft<'a> {
        let light = query.light;
        let mut shaft = self.own_shaft(query, scratch);
        if let Some(holes) = &self.holes {
            shaft.look_for_holes(holes, light);
        }
        shaft.count();
        shaft
    }

    /// Finds which triangles of their own are between a point and a light.
    #[inline]
    pub(crate) fn own_shaft<'a>(
        &'a self,
        query: ShaftQuery<'_>,
        scratch: &'a mut Scratch,
    ) -> Shaft<'a> {
        if !scratch.light.is(query.light) {
            scratch.light.set(query.light, &mut scratch.frame);
        }
        scratch.frame.margins = query.margins;
        let Range { start, end } = query.exclude;
        let exclude = (start, end.saturating_sub(start));
        let found = walk::find(self.isa, self, &query.point, exclude, scratch);
        let (class, known) = match found {
            Found::All => (ShaftClass::Blocked, Known::All),
            Found::Few if scratch.flat.count == 0 => (ShaftClass::Empty, Known::All),
            Found::Few => (ShaftClass::Partial, Known::All),
            Found::Many => (ShaftClass::Partial, Known::Dense),
            Found::Unknown => (ShaftClass::Partial, Known::Nothing),
        };
        Shaft {
            occluders: self,
            scratch,
            point: query.point,
            exclude,
            class,
            own: class,
            known,
            has_holes: false,
        }
    }
}

impl<'a> Shaft<'a> {
    /// The memory that the shaft was made of.
    #[must_use]
    pub const fn into_scratch(self) -> &'a mut Scratch {
        self.scratch
    }
}

impl Shaft<'_> {
    /// Counts what was found.
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
                if self.known == Known::All {
                    counters.candidates += self.scratch.flat.count as u64;
                }
            }
        }
    }

    /// How much may be hidden.
    #[inline]
    #[must_use]
    pub fn class(&self) -> ShaftClass {
        self.class
    }

    /// The number of triangles (or pieces of triangles) that may hide a part of the light; zero
    /// for an empty or blocked shaft. Of a dense shaft, a lower bound.
    #[must_use]
    pub fn candidates(&self) -> usize {
        match self.class {
            ShaftClass::Partial if self.is_dense() => DENSE.max(self.scratch.flat.count),
            ShaftClass::Partial => self.scratch.flat.count,
            ShaftClass::Empty | ShaftClass::Blocked => 0,
        }
    }

    /// Whether there are too many triangles in between to keep them (or nothing is known of them,
    /// which is as dear): then [`Self::candidates`] is what it takes to look at them, but no bound
    /// on their number, and every few lines cost a walk of their own. So it is with
    /// triangles with holes in between: what they hide is no polygon.
    #[must_use]
    pub fn is_dense(&self) -> bool {
        self.known != Known::All || self.has_holes
    }

    /// The triangles that may hide a part of the light, by their numbers in the list the
    /// occluders were built from, each once, in no particular order: together they hide all that
    /// is hidden. Of a closed mesh that neither the shading point nor the light is near, the
    /// triangles that face one way are left out, since those that face the other way hide as
    /// much. None for an empty or blocked shaft; `None` for a dense one, which does not keep
    /// them all.
    ///
    /// Fewer than [`Self::candidates`] where triangles were cut to pieces. The order is the same
    /// on every instruction set.
    #[must_use]
    pub fn candidate_triangles(&self) -> Option<impl ExactSizeIterator<Item = u32> + '_> {
        let leaves = &self.occluders.hierarchy.leaves;
        let id = |&slot: &u32| leaves[slot as usize / 8].id[slot as usize % 8];
        Some(self.candidate_slots()?.iter().map(id))
    }

    /// The corners of [`Self::candidate_triangles`] in world space, as they were given: whole
    /// triangles, of which parts may be beyond the light or behind the shading point.
    #[must_use]
    pub fn candidate_corners(&self) -> Option<impl ExactSizeIterator<Item = [DVec3; 3]> + '_> {
        let hierarchy = &*self.occluders.hierarchy;
        let corners = |&slot: &u32| {
            let leaf = &hierarchy.leaves[slot as usize / 8];
            let world = |v: [f32; 3]| DVec3::from(v.map(f64::from)) + self.occluders.origin;
            leaf.triangle(slot as usize % 8).map(world)
        };
        Some(self.candidate_slots()?.iter().map(corners))
    }

    /// The candidates as they lie before the light; `None` unless the shaft is partly hidden by
    /// few enough triangles to keep.
    #[must_use]
    pub fn images(&self) -> Option<Images<'_>> {
        (self.class == ShaftClass::Partial && !self.is_dense())
            .then(|| Images::new(&self.scratch.frame, &self.scratch.flat, 0))
    }

    /// Triangles as they lie before the light that together hide almost all that is hidden, in a
    /// dense shaft too; `None` where none are kept: nothing is known of what is in between, or
    /// there are triangles with holes, or the shaft is empty or blocked.
    ///
    /// Of a shaft that is not dense they are [all](Self::images). In a dense one, a few places
    /// seem visible that are not: whoever has found the boundary of what is visible past these asks
    /// for what is [behind](Self::behind) it.
    ///
    /// What is asked of a dense shaft's lines in between makes it forget what it kept.
    pub fn front(&mut self) -> Option<Images<'_>> {
        self.scratch.front.loose = false;
        self.in_front()
    }

    /// The same of those triangles alone that belong to no fine mesh; what is
    /// [behind](Self::behind) are such, too. What the fine meshes hide follows from their
    /// [silhouettes](Self::silhouettes). `None` where those are not known.
    pub fn loose_front(&mut self) -> Option<Images<'_>> {
        if !self.has_silhouettes() {
            return None;
        }
        self.scratch.front.loose = true;
        self.in_front()
    }

    /// Whether [silhouettes](Self::silhouettes) tell what fine meshes hide: in a dense shaft
    /// without triangles with holes, where no fine mesh has a triangle of the light.
    #[must_use]
    pub fn has_silhouettes(&self) -> bool {
        let is_dense = self.known == Known::Dense && !self.has_holes;
        is_dense && self.occluders.hierarchy.surfaces.serve(self.exclude)
    }

    fn in_front(&mut self) -> Option<Images<'_>> {
        let isa = self.occluders.isa;
        let kept = match self.known {
            _ if self.class != ShaftClass::Partial || self.has_holes => false,
            Known::Nothing => false,
            Known::All => true,
            Known::Dense => {
                front::front::<true>(isa, self.occluders, &self.point, self.exclude, self.scratch)
            }
        };
        kept.then(|| Images::new(&self.scratch.frame, &self.scratch.flat, 0))
    }

    /// More triangles, given the boundary of what seems visible past those of [`Self::front`] and
    /// all that this has returned since, as pieces from one place to another; `None` if that is
    /// what is visible. Some may have been returned before.
    pub fn behind(&mut self, boundary: impl Iterator<Item = [[f64; 2]; 2]>) -> Option<Images<'_>> {
        if self.known != Known::Dense || !self.scratch.front.look(boundary) {
            return None;
        }
        let first = self.scratch.flat.count;
        let (isa, exclude) = (self.occluders.isa, self.exclude);
        front::front::<false>(isa, self.occluders, &self.point, exclude, self.scratch);
        Some(Images::new(&self.scratch.frame, &self.scratch.flat, first))
    }

    /// After [`Self::loose_front`]: the silhouettes of fine meshes, and images of those of their
    /// triangles that are not in front of the light as a whole. Where loose triangles seem to hide
    /// the light, some are missing; elsewhere, as many layers come as go around each place.
    ///
    /// Whoever has found that there are places past all loose triangles, and of surfaces what is
    /// before those, asks for what is [behind](Self::behind) all these sides and for silhouettes
    /// again. `None` where that has returned none: nothing would be known of the meshes.
    pub fn silhouettes(&mut self) -> Option<(Images<'_>, &[Silhouette])> {
        if !self.has_silhouettes() {
            return None;
        }
        let first = self.scratch.flat.count;
        let (isa, exclude) = (self.occluders.isa, self.exclude);
        let is_known = outline::outline(isa, self.occluders, &self.point, exclude, self.scratch);
        let Scratch {
            frame,
            flat,
            silhouettes,
            ..
        } = &*self.scratch;
        is_known.then(|| (Images::new(frame, flat, first), &silhouettes[..]))
    }

    /// The work that queries through the shaft's [`Scratch`] have done, those of other shafts
    /// included.
    #[must_use]
    pub fn counters(&self) -> &Counters {
        &self.scratch.counters
    }

    /// How far triangles may reach from the shading point: rounding of their corners, and of where
    /// a ray meets them, goes by that.
    #[must_use]
    pub fn reach(&self) -> f64 {
        bounds::reach(self.occluders, self.point - self.occluders.origin)
    }

    /// Whether a point of the light is visible, given where it is relative to the shading point.
    pub fn place_visible(&mut self, place: DVec3) -> bool {
        self.point_visible(self.point + place)
    }

    /// Where the candidates are: leaf × 8 + lane.
    fn candidate_slots(&self) -> Option<&[u32]> {
        match self.class {
            ShaftClass::Partial if self.is_dense() => None,
            ShaftClass::Partial => Some(self.scratch.corners.slots()),
            ShaftClass::Empty | ShaftClass::Blocked => Some(&[]),
        }
    }

    /// The visible intervals of lines on the light, replacing what `out` held.
    ///
    /// Lines of one direction that follow each other are answered together. A line without
    /// length, or that is not finite, has no visible part.
    pub fn visible(&mut self, lines: &[Segment], out: &mut VisibleLines) {
        out.reset(lines.len());
        self.scratch.counters.line_queries += lines.len() as u64;
        if self.class != ShaftClass::Blocked {
            self.own_visible(lines, out);
            if self.has_holes {
                self.past_holes(lines, out);
            }
        }
        self.scratch.counters.intervals += out.interval_count() as u64;
    }

    /// What is visible past their own triangles.
    #[inline]
    pub(crate) fn own_visible(&mut self, lines: &[Segment], out: &mut VisibleLines) {
        match (self.own, self.known) {
            (ShaftClass::Blocked, _) => {}
            (ShaftClass::Empty, _) => out.put_all_whole(lines.iter().map(has_length)),
            (ShaftClass::Partial, Known::Nothing) => {
                for (i, line) in lines.iter().enumerate() {
                    if has_length(line) {
                        self.one(lines, i, out);
                    }
                }
            }
            (ShaftClass::Partial, Known::All | Known::Dense) => {
                let mut first = 0;
                while first < lines.len() {
                    first += self.group(lines, first, out);
                }
            }
        }
    }

    /// Answers the lines from `first` on that share a direction and tells how many they are.
    fn group(&mut self, lines: &[Segment], first: usize, out: &mut VisibleLines) -> usize {
        let isa = self.occluders.isa;
        let dense = self.known == Known::Dense;
        let rest = &lines[first..];
        let count = sweep::sweep(isa, &self.point, rest, first, dense, self.scratch, out);
        if dense {
            self.visible_dense(lines, first, out);
        }
        // None for a line that is not finite.
        count.max(1)
    }

    /// Answers a line as a light of its own.
    #[cold]
    fn one(&mut self, lines: &[Segment], i: usize, out: &mut VisibleLines) {
        let ends = [lines[i].p0, lines[i].p1];
        let query = ShaftQuery {
            point: self.point,
            light: (&ends).into(),
            exclude: self.excluded(),
            margins: self.margins(),
        };
        let mut own = self.occluders.own_shaft(query, self.scratch);
        own.count();
        match (own.class, own.known) {
            (ShaftClass::Blocked, _) => {}
            (ShaftClass::Empty, _) => out.put_whole(i),
            (ShaftClass::Partial, Known::Nothing) => own.by_all(&lines[i], i, out),
            (ShaftClass::Partial, Known::All | Known::Dense) => {
                own.group(&lines[..=i], i, out);
            }
        }
    }

    /// Answers a line by all triangles of the scene: right where nothing is quick. One that is seen
    /// end on, or so small that rounding decides its parts, has none unless both ends are visible.
    #[cold]
    fn by_all(&mut self, line: &Segment, i: usize, out: &mut VisibleLines) {
        if !has_length(line) {
            return;
        }
        let past = brute::past_all(
            self.occluders,
            self.point,
            line,
            &self.excluded(),
            self.margins(),
        );
        let rough = past.as_ref().is_none_or(|past| past.point_like);
        if rough && !(self.ray_reaches(line.p0) && self.ray_reaches(line.p1)) {
            return;
        }
        match past {
            Some(past) => out.put(i, past.parts.iter().map(|part| (part.lo, part.hi, true))),
            // End on, a part is behind what an end is behind.
            None => out.put_whole(i),
        }
    }

    /// The margins that were asked for.
    pub(crate) fn margins(&self) -> Margins {
        self.scratch.frame.margins
    }

    fn excluded(&self) -> Range<u32> {
        self.exclude.0..self.exclude.0 + self.exclude.1
    }

    /// Whether nothing is before a point; false where no ray leads there, since numbers overflow.
    fn ray_reaches(&mut self, target: DVec3) -> bool {
        let ray = bounds::shadow_ray(self.occluders, self.point, target, self.margins());
        ray.is_some_and(|ray| !self.meets(&ray))
    }

    /// A leaf with a triangle that is before a point, if a ray leads there.
    fn what_hides(&mut self, target: DVec3) -> Option<Child> {
        let ray = bounds::shadow_ray(self.occluders, self.point, target, self.margins())?;
        let (_, leaf) = self.meets(&ray).then_some(self.scratch.last)??;
        Some(leaf)
    }

    /// Whether a ray meets anything.
    fn meets(&mut self, ray: &Ray) -> bool {
        self.scratch.counters.rays += 1;
        let (isa, exclude) = (self.occluders.isa, self.excluded());
        ray::any(isa, self.occluders, ray, &exclude, self.scratch)
    }

    /// Answers the lines of a dense shaft, a few at a time.
    fn visible_dense(&mut self, lines: &[Segment], first: usize, out: &mut VisibleLines) {
        let mut start = 0;
        while start < self.scratch.ends.count {
            let end = self.scratch.ends.count.min(start + dense_shaft::GROUP);
            self.visible_few(start..end, lines, first, out);
            start = end;
        }
    }

    /// Answers a few neighbours among the lines of a dense shaft.
    fn visible_few(
        &mut self,
        few: Range<usize>,
        lines: &[Segment],
        first: usize,
        out: &mut VisibleLines,
    ) {
        let Scratch {
            frame,
            ends,
            lines: few_lines,
            ..
        } = &mut *self.scratch;
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
        // In the coordinates of the few: q along, so that across is −p; with a little room.
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
        let point = self.point - self.occluders.origin;
        let corners = frame.corners_in_space(ends.along, least, most);
        let box_of = |pick: fn(DVec3, DVec3) -> DVec3| corners.into_iter().reduce(pick);
        let [lo, hi] =
            [DVec3::min, DVec3::max].map(|pick| box_of(pick).unwrap_or_default() + point);
        // The corners are those of a matrix that was inverted.
        let room = DVec3::splat(ray::ROOM * bounds::reach(self.occluders, point));
        let isa = self.occluders.isa;
        let hidden = self.seek_cover(lines, few.clone(), first);
        let query = DenseQuery {
            point,
            lo: lo - room,
            hi: hi + room,
            exclude: self.exclude,
            // What hides much soon closes the lines; past what is open, silhouettes are fewer.
            silhouettes: !hidden && self.occluders.hierarchy.surfaces.serve(self.exclude),
        };
        match dense_shaft::dense(isa, self.occluders, &query, &around, self.scratch) {
            Answered::Hidden => {}
            Answered::All => dense_shaft::finish(isa, self.scratch, out),
            Answered::ByRays => {
                self.look_through_gaps(lines);
                dense_shaft::finish(isa, self.scratch, out);
            }
            Answered::Nothing => {
                for k in few {
                    let i = first + self.scratch.ends.nth(k);
                    self.by_all(&lines[i], i, out);
                }
            }
        }
    }

    /// Finds leaves that hide much of a few lines: what a ray towards each meets. What is behind,
    /// the walk from front to back need not look at. False, and none, if one meets nothing, or what
    /// seems smaller than its line.
    fn seek_cover(&mut self, lines: &[Segment], few: Range<usize>, first: usize) -> bool {
        self.scratch.cover.clear();
        for k in few {
            let line = &lines[first + self.scratch.ends.nth(k)];
            // Not on one line across.
            let target = line.at([0.3, 0.7][k % 2]);
            match self.what_hides(target) {
                Some(leaf) if self.scratch.cover.contains(&leaf) => {}
                Some(leaf) if self.seems_as_large(leaf, line, target) => {
                    self.scratch.cover.push(leaf);
                }
                _ => {
                    self.scratch.cover.clear();
                    return false;
                }
            }
        }
        true
    }

    /// Whether a leaf before a point of a line seems as large as the line, from the shading point.
    fn seems_as_large(&self, leaf: Child, line: &Segment, target: DVec3) -> bool {
        let leaf = &self.occluders.hierarchy.leaves[leaf.leaf_index()];
        let place = |corner: [f32; 3]| DVec3::from(corner.map(f64::from));
        let corners = (0..8).flat_map(|lane| leaf.triangle(lane)).map(place);
        let (lo, hi) = corners.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lo, hi), v| {
            (lo.min(v), hi.max(v))
        });
        let middle = 0.5 * (lo + hi) + self.occluders.origin - self.point;
        let ray = target - self.point;
        let share = middle.dot(ray) / ray.length_squared();
        (hi - lo).length() >= share * (line.p1 - line.p0).length()
    }

    /// Hides what is hidden of the gaps of a few lines, as a ray for each tells.
    fn look_through_gaps(&mut self, lines: &[Segment]) {
        for k in 0..self.scratch.crossings.gaps.len() {
            let Gap { line, middle, .. } = self.scratch.crossings.gaps[k];
            let (index, lane) = (line as usize / 8, line as usize % 8);
            let block = &self.scratch.lines.blocks[index];
            let (from, to) = (block.from[lane], block.to[lane]);
            let t = (middle - from) / (to - from);
            let line = &lines[block.number[lane] as usize];
            let t = if block.reversed >> lane & 1 == 0 {
                t
            } else {
                1.0 - t
            };
            let is_visible = self.ray_reaches(line.at(t));
            let Scratch {
                crossings,
                slots_per_line,
                ..
            } = &mut *self.scratch;
            for (low, high) in crossings.hidden(k, is_visible) {
                slots_per_line.push(index, lane, low, high);
            }
        }
    }

    /// Whether a point of the light is visible; a point that is not finite is not.
    pub fn point_visible(&mut self, light_point: DVec3) -> bool {
        self.scratch.counters.shaft_points += 1;
        self.class != ShaftClass::Blocked
            && self.own_point_visible(light_point)
            && !(self.has_holes && self.hole_hides(light_point))
    }

    /// The same past their own triangles.
    #[inline]
    pub(crate) fn own_point_visible(&mut self, light_point: DVec3) -> bool {
        match (self.own, self.known) {
            (ShaftClass::Blocked, _) => false,
            (ShaftClass::Empty, _) => light_point.is_finite(),
            (ShaftClass::Partial, Known::Dense | Known::Nothing) => self.ray_reaches(light_point),
            (ShaftClass::Partial, Known::All) => {
                let at = self.scratch.frame.project(light_point - self.point);
                // The image of what is not finite is not a number.
                if at[0].is_nan() && !light_point.is_finite() {
                    return false;
                }
                !sweep::hidden_point(self.occluders.isa, &self.scratch.flat, at)
            }
        }
    }
}

/// Whether there is anything of a line to be seen.
#[inline]
pub(crate) fn has_length(line: &Segment) -> bool {
    // Zero times what is not finite is not a number.
    let nothing = line.p0 * 0.0 + line.p1 * 0.0;
    (nothing == DVec3::ZERO) & (line.p0 != line.p1)
}
