//! [`Scene`] and its queries: the direct light at points, and the visible parts of lights.
//!
//! A query checks its input, lifts the point off its surface, and hands it to `linelit_direct`
//! together with the occluders, the lights and the settings. Queries of many points run on all
//! threads, each with memory of its own that it uses again and again.

use crate::Error;
use crate::builder::{LARGEST, SceneBuilder, Settings};
use linelit_bsdf::{Bsdf, Lambert};
use linelit_direct::{Illumination, Luminaire, Luminaires, SampleNames, Unknown, Workspace};
use linelit_estimators::{Measure, SURFACE_OFFSET, ShadingPoint};
use linelit_geometry::{DVec3, Segment, Vector3, predicates, stop};
use linelit_lights::Sphere;
use linelit_visibility::{Occluders, Ray, ShaftQuery, VisibleLines};
use rayon::prelude::*;
use std::cell::Cell;
use std::f64::consts::PI;
use std::sync::Arc;

/// A diffuse reflection with albedo 1, whose reflected radiance is the irradiance over π.
pub(crate) const WHITE: Bsdf = Bsdf::Lambert(Lambert { albedo: DVec3::ONE });

/// A scene of triangles and lights that computes how much light reaches a point, and which parts of
/// a light the point sees.
///
/// ```
/// use linelit::{Scene, lights::Light};
/// // A lamp of one square metre, two metres up, and a triangle that hides a part of it.
/// let lamp = Light::rectangle([-0.5, -0.5, 2.0], [0., 1., 0.], [1., 0., 0.], [10.0; 3])?;
/// let positions = [[-0.2, -0.1, 1.0], [0.25, -0.05, 1.0], [0.0, 0.2, 1.1]];
/// let scene = Scene::builder(&positions, &[[0, 1, 2]]).light(lamp).build()?;
/// let [irradiance, ..] = scene.irradiance([0.0; 3], [0.0, 0.0, 1.0])?;
/// assert!((irradiance - 1.738_571).abs() < 1e-6, "{irradiance}");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// Every answer is a function of the scene, the seed and the point alone: neither the order of the
/// points, nor their division into calls, nor the number of threads changes a bit. The random
/// numbers of a point are derived from the seed and the bits of its position and normal;
/// [`Scene::with_seed`] gives independent ones. A scene is cheap to clone, as clones share the
/// hierarchy.
///
/// Lengths may be in any unit. So may the radiance that lights emit: below a sky of radiance 1 in
/// all directions, the irradiance is π in that unit. Scenes may be between 2⁻¹¹⁰ and 2⁵⁰ in size.
#[derive(Clone, Debug)]
pub struct Scene {
    pub(crate) occluders: Occluders,
    /// The number of triangles.
    pub(crate) triangles: usize,
    /// A ball around all triangles.
    pub(crate) ball: Sphere,
    /// The points from which it is measured how much hides each light, and the points from which
    /// the directions of lines are chosen.
    pub(crate) places: Arc<[Vec<ShadingPoint>; 2]>,
    pub(crate) lights: Arc<Luminaires>,
    pub(crate) settings: Settings,
}

/// The boundary of a visible part: closed rings of corners in space.
pub type Rings = Vec<Vec<[f64; 3]>>;

thread_local! {
    /// The memory that this thread's queries use again and again.
    static WORKSPACE: Cell<Option<Box<Workspace>>> = const { Cell::new(None) };
}

/// Calls `work` with the workspace of this thread, or with a new one where that is in use (in a
/// nested call) or was lost because an earlier call was stopped by unwinding.
fn with_workspace<T>(work: impl FnOnce(&mut Workspace) -> T) -> T {
    let mut workspace = WORKSPACE.take().unwrap_or_default();
    let found = work(&mut workspace);
    WORKSPACE.set(Some(workspace));
    found
}

impl Scene {
    /// Begins a scene of triangles, each of which is given by the indices of its three vertices.
    /// Triangles cast shadows from both sides.
    ///
    /// [`Scene::builder_from`] takes vertices in double precision.
    pub fn builder<'a>(positions: &'a [[f32; 3]], triangles: &'a [[u32; 3]]) -> SceneBuilder<'a> {
        SceneBuilder::new(positions, triangles)
    }

    /// Begins a scene as [`Scene::builder`] does, with vertices of any type.
    ///
    /// Vertices in double precision are rounded to `f32` once, relative to the centre of all
    /// vertices that triangles use ([`Occluders::origin`]), so that a scene loses no precision by
    /// being far from the origin of its coordinates. Lights and points are not rounded.
    /// [`Occluders::rounding`] has the distances by which vertices moved, and its
    /// [`is_coarse`](linelit_geometry::Rounding::is_coarse) says whether they are large compared
    /// with the scene's details.
    ///
    /// ```
    /// use linelit::{Light, Scene};
    /// // The scene above, on a map.
    /// let at = |p: [f64; 3]| [p[0] + 500_000.0, p[1] + 5_400_000.0, p[2]];
    /// let corner = at([-0.5, -0.5, 2.0]);
    /// let lamp = Light::rectangle(corner, [0., 1., 0.], [1., 0., 0.], [10.0; 3])?;
    /// let positions = [[-0.2, -0.1, 1.0], [0.25, -0.05, 1.0], [0.0, 0.2, 1.1]].map(at);
    /// let scene = Scene::builder_from(&positions, &[[0, 1, 2]]).light(lamp).build()?;
    /// assert!(!scene.occluders().rounding().is_coarse());
    /// let [irradiance, ..] = scene.irradiance(at([0.0; 3]), [0.0, 0.0, 1.0])?;
    /// assert!((irradiance - 1.738_571).abs() < 1e-6, "{irradiance}");
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn builder_from<'a, V: Vector3 + Copy + Sync>(
        positions: &'a [V],
        triangles: &'a [[u32; 3]],
    ) -> SceneBuilder<'a, V> {
        SceneBuilder::new(positions, triangles)
    }

    /// Returns this scene with another seed: two seeds give independent estimates.
    #[must_use]
    pub fn with_seed(&self, seed: u64) -> Self {
        let mut scene = self.clone();
        scene.settings.seed = seed;
        scene
    }

    /// Returns the hierarchy of the scene's triangles.
    #[must_use]
    pub const fn occluders(&self) -> &Occluders {
        &self.occluders
    }

    /// Returns the irradiance at a point of a surface from all lights, with the shadows of all
    /// triangles, in W/m² for each channel. The normal may have any length but zero.
    ///
    /// # Errors
    /// A point that is not finite or beyond 2⁶⁰; a normal that is zero or not finite.
    pub fn irradiance(&self, point: impl Vector3, normal: impl Vector3) -> Result<[f64; 3], Error> {
        let point = self.point(0, point.dvec3(), normal.dvec3(), None, WHITE)?;
        Ok((self.light(&point) * PI).to_array())
    }

    /// Returns the irradiance at each of many points, on all threads of the rayon pool.
    ///
    /// # Errors
    /// Slices of different lengths; the first point or normal that is not valid. The values in
    /// `out` are then not specified.
    pub fn irradiances<V: Vector3 + Copy + Sync>(
        &self,
        points: &[V],
        normals: &[V],
        out: &mut [[f64; 3]],
    ) -> Result<(), Error> {
        same_length("normals", points, normals)?;
        same_length("results", points, out)?;
        over(out, |i| {
            let point = self.point(i, points[i].dvec3(), normals[i].dvec3(), None, WHITE)?;
            Ok((self.light(&point) * PI).to_array())
        })
    }

    /// Returns the radiance that a point of a surface reflects in the direction `outgoing`, in
    /// W/(m² sr) for each channel, from the direct light of all lights. The viewer has to be on the
    /// side of the normal, where reflections are defined.
    ///
    /// # Errors
    /// A point that is not finite or beyond 2⁶⁰; a normal or a direction to the viewer that is zero
    /// or not finite.
    pub fn radiance(
        &self,
        point: impl Vector3,
        normal: impl Vector3,
        bsdf: &Bsdf,
        outgoing: impl Vector3,
    ) -> Result<[f64; 3], Error> {
        let (point, normal, outgoing) = (point.dvec3(), normal.dvec3(), outgoing.dvec3());
        let point = self.point(0, point, normal, Some(outgoing), bsdf.clone())?;
        Ok(self.light(&point).to_array())
    }

    /// Returns the radiance that each of many points reflects by its own BSDF, on all threads.
    ///
    /// # Errors
    /// The errors of [`Scene::radiance`], with the index of the point, and slices of different
    /// lengths.
    pub fn radiances<V: Vector3 + Copy + Sync>(
        &self,
        points: &[V],
        normals: &[V],
        bsdfs: &[Bsdf],
        outgoing: &[V],
        out: &mut [[f64; 3]],
    ) -> Result<(), Error> {
        same_length("normals", points, normals)?;
        same_length("reflections", points, bsdfs)?;
        same_length("outgoing directions", points, outgoing)?;
        same_length("results", points, out)?;
        over(out, |i| {
            let to_viewer = Some(outgoing[i].dvec3());
            let (point, normal) = (points[i].dvec3(), normals[i].dvec3());
            let point = self.point(i, point, normal, to_viewer, bsdfs[i].clone())?;
            Ok(self.light(&point).to_array())
        })
    }

    /// Returns the fraction of a light that a point sees between the triangles, from 0 to 1, exact
    /// but for rounding. `light` is the index of the light, and `measure` says whether the fraction
    /// is by area, by solid angle or by irradiance.
    ///
    /// It does not matter to which side or in which directions the light emits. A sphere is seen
    /// as the flat disk of its outline, and [`Measure::Area`] is the area of that disk. The result
    /// is NaN where the measure of the whole light is zero: for a point in the plane of the light,
    /// on it or inside a sphere, and for a light below the horizon of the normal of
    /// [`Measure::Cosine`]. [`SceneBuilder::surface_offset`] does not move the point.
    ///
    /// # Errors
    /// A point or normal that is not valid, a light that does not exist, [`Error::NotExact`] for a
    /// cylinder, a sky and the solid angle of a line, and [`Error::Pierced`] for a sphere that a
    /// triangle reaches into.
    pub fn visible_fraction(
        &self,
        point: impl Vector3,
        light: usize,
        measure: Measure,
    ) -> Result<f64, Error> {
        self.fraction(0, point.dvec3(), light, measure)
    }

    /// Returns the fraction of a light that each of many points sees, on all threads. `measure` is
    /// called with the index of a point and returns the measure for that point, such as the cosine
    /// with its normal.
    ///
    /// # Errors
    /// The errors of [`Scene::visible_fraction`], with the index of the point.
    pub fn visible_fractions<V: Vector3 + Copy + Sync>(
        &self,
        points: &[V],
        light: usize,
        measure: impl Fn(usize) -> Measure + Sync,
        out: &mut [f64],
    ) -> Result<(), Error> {
        same_length("results", points, out)?;
        over(out, |i| {
            self.fraction(i, points[i].dvec3(), light, measure(i))
        })
    }

    /// Returns the parts of a segment that a point sees between the triangles, for each point
    /// `points[i]` and segment `lines[i]`, on all threads. The parts are intervals of the segment's
    /// parameter, which is 0 at its first end and 1 at its second, in ascending order.
    ///
    /// ```
    /// use linelit::Scene;
    /// let positions = [[0.0, -1.0, 1.0], [3.0, 0.0, 1.0], [0.0, 1.0, 1.0]];
    /// let scene = Scene::builder(&positions, &[[0, 1, 2]]).build()?;
    /// let lines = [[[-0.5, 0.0, 2.0], [0.5, 0.0, 2.0]]];
    /// let visible = scene.visible_intervals(&[[0.0; 3]], &lines)?;
    /// assert_eq!((visible.line(0)[0].lo, visible.line(0)[0].hi), (0.0, 0.5));
    /// # Ok::<(), linelit::Error>(())
    /// ```
    ///
    /// # Errors
    /// Slices of different lengths; the first point, or line with an end, that is not valid.
    pub fn visible_intervals<V: Vector3 + Copy + Sync>(
        &self,
        points: &[V],
        lines: &[[V; 2]],
    ) -> Result<VisibleLines, Error> {
        same_length("lines", points, lines)?;
        // Find the visible parts on all threads, in chunks of points.
        let mut each = vec![VisibleLines::new(); points.len().div_ceil(CHUNK)];
        over(&mut each, |k| {
            let mut visible = VisibleLines::new();
            for i in k * CHUNK..points.len().min((k + 1) * CHUNK) {
                stop::check();
                let point = check_point(i, points[i].dvec3())?;
                let [from, to] = lines[i].map(|end| check_point(i, end.dvec3()));
                let line = Segment::new(from?, to?);
                with_workspace(|workspace| {
                    let Workspace { buffers, lines, .. } = workspace;
                    let ends = [line.p0, line.p1];
                    let mut query = ShaftQuery::new(point, &ends);
                    query.margins = self.settings.margins.unwrap_or_default();
                    let mut shaft = self.occluders.shaft(query, &mut buffers.scratch);
                    shaft.visible(&[line], lines);
                    visible.append(lines);
                });
            }
            Ok(visible)
        })?;
        // Join the chunks in their order.
        let mut all = VisibleLines::new();
        each.iter().for_each(|part| all.append(part));
        Ok(all)
    }

    /// Returns the visible part of a polygon, a disk or a sphere, given by its index among the
    /// lights, as rings of corners. As the point sees them, outer rings run counter-clockwise and
    /// rings around holes clockwise. A sphere is seen as the flat disk of its outline; from inside
    /// it there are no rings.
    ///
    /// On the rim of disks and spheres, neighbouring corners are at most a 256th of the circle
    /// apart, so that the chords between them are within 7.6e-5 of the radius from their arcs.
    ///
    /// # Errors
    /// A point that is not finite, a light that does not exist, [`Error::NotExact`] for a light
    /// that is neither a polygon, a disk nor a sphere, and [`Error::Pierced`] for a sphere that a
    /// triangle reaches into.
    pub fn visible_polygons(&self, point: impl Vector3, light: usize) -> Result<Rings, Error> {
        self.rings(0, point.dvec3(), light)
    }

    /// Returns the visible part of a light from each of many points, on all threads.
    ///
    /// # Errors
    /// The errors of [`Scene::visible_polygons`], with the index of the point.
    pub fn visible_polygons_each<V: Vector3 + Copy + Sync>(
        &self,
        points: &[V],
        light: usize,
    ) -> Result<Vec<Rings>, Error> {
        let mut found = vec![Rings::new(); points.len()];
        over(&mut found, |i| self.rings(i, points[i].dvec3(), light))?;
        Ok(found)
    }

    /// Returns the visible part of a light from the point with the index `i`.
    fn rings(&self, i: usize, point: DVec3, light: usize) -> Result<Rings, Error> {
        let point = check_point(i, point)?;
        let luminaire = self.light_number(light)?;
        let rings =
            with_workspace(|workspace| luminaire.visible_rings(&self.occluders, point, workspace));
        let rings = rings.map_err(|reason| unknown(reason, i, light))?;
        let ring = |ring: Vec<DVec3>| ring.into_iter().map(|p| p.to_array()).collect();
        Ok(rings.into_iter().map(ring).collect())
    }

    /// Checks the point with the index `i` and its directions, and returns the shading point,
    /// lifted off its surface. Without a direction to the viewer it is seen along the normal.
    pub(crate) fn point(
        &self,
        i: usize,
        point: DVec3,
        normal: DVec3,
        outgoing: Option<DVec3>,
        bsdf: Bsdf,
    ) -> Result<ShadingPoint, Error> {
        let point = check_point(i, point)?;
        let normal = predicates::normalize(normal).ok_or(Error::Normal(i))?;
        let outgoing = match outgoing {
            None => normal,
            Some(outgoing) => predicates::normalize(outgoing).ok_or(Error::Outgoing(i))?,
        };
        let largest = point.abs().max_element();
        let lift = || SURFACE_OFFSET * largest + self.out_of_its_triangle(point, normal);
        let offset = self.settings.offset.unwrap_or_else(lift);
        let position = point + normal * offset;
        Ok(ShadingPoint::new(position, normal, outgoing, bsdf))
    }

    /// Returns the distance that lifts a point out of the triangle on which it was before vertices
    /// were rounded. The distance is zero unless rounding moved vertices and a triangle is above
    /// the point by at most twice the largest distance by which rounding moved a vertex.
    fn out_of_its_triangle(&self, point: DVec3, normal: DVec3) -> f64 {
        let room = 2.0 * self.occluders.rounding().displacement;
        if room <= 0.0 {
            return 0.0;
        }
        let ray = Ray {
            t_max: room,
            ..Ray::new(point, normal)
        };
        let is_under = with_workspace(|workspace| {
            let scratch = &mut workspace.buffers.scratch;
            self.occluders.any_hit(&ray, &(0..0), scratch)
        });
        if is_under { room } else { 0.0 }
    }

    /// Returns the radiance that a point reflects of the direct light of all lights.
    fn light(&self, point: &ShadingPoint) -> DVec3 {
        let settings = &self.settings;
        let illumination = Illumination {
            occluders: &self.occluders,
            lights: &self.lights,
            settings: linelit_direct::Settings {
                sampler: settings.sampler,
                seed: settings.seed,
                ..linelit_direct::Settings::new(&settings.estimator, settings.samples)
            },
        };
        let names = SampleNames::of_pixel(key(point));
        with_workspace(|workspace| illumination.radiance(point, names, workspace))
    }

    /// Returns the fraction of a light that the point with the index `i` sees, by a measure whose
    /// normal may have any length.
    fn fraction(
        &self,
        i: usize,
        point: DVec3,
        light: usize,
        measure: Measure,
    ) -> Result<f64, Error> {
        let point = check_point(i, point)?;
        let measure = match measure {
            Measure::Cosine(n) => {
                Measure::Cosine(predicates::normalize(n).ok_or(Error::Normal(i))?)
            }
            measure => measure,
        };
        let luminaire = self.light_number(light)?;
        let fraction = with_workspace(|workspace| {
            luminaire.visible_fraction(&self.occluders, point, measure, workspace)
        });
        fraction.map_err(|reason| unknown(reason, i, light))
    }

    /// Returns the light with this index, or an error that states the number of lights.
    fn light_number(&self, light: usize) -> Result<&Luminaire, Error> {
        let all = self.lights.as_slice();
        let lights = all.len();
        all.get(light).ok_or(Error::NoLight { light, lights })
    }
}

/// Returns the error for a point and a light whose visible part has no exact form.
const fn unknown(reason: Unknown, point: usize, light: usize) -> Error {
    match reason {
        Unknown::Shape => Error::NotExact(light),
        Unknown::Pierced => Error::Pierced { point, light },
    }
}

/// Fills `out[i]` with `value(i)` on all threads. If several values are errors, the error with the
/// least `i` is returned.
fn over<T: Send>(
    out: &mut [T],
    value: impl Fn(usize) -> Result<T, Error> + Sync,
) -> Result<(), Error> {
    let fill = |first: usize, chunk: &mut [T]| {
        let mut each = (first..).zip(chunk).map(|(i, out)| {
            stop::check();
            *out = value(i)?;
            Ok(())
        });
        each.find_map(|done: Result<(), Error>| done.err())
    };
    let first_error = match out.len() <= CHUNK {
        // Waking other threads takes longer than a few points do.
        true => fill(0, out),
        false => {
            // Once stopped, each piece of work unwinds by itself: there are a thousand at most.
            let least = 1 + out.len() / (CHUNK << 10);
            let chunks = out.par_chunks_mut(CHUNK).enumerate().with_min_len(least);
            let errors = chunks.filter_map(|(k, chunk)| fill(k * CHUNK, chunk));
            errors.find_first(|_| true)
        }
    };
    first_error.map_or(Ok(()), Err)
}

/// The number of points that a thread takes at a time.
const CHUNK: usize = 64;

/// Refuses a slice that does not have the same length as the slice of points; `of` names it in the
/// message.
pub(crate) fn same_length<A, B>(of: &'static str, points: &[A], other: &[B]) -> Result<(), Error> {
    let (points, found) = (points.len(), other.len());
    match points == found {
        true => Ok(()),
        false => Err(Error::Length { of, points, found }),
    }
}

/// Returns the point with the index `i`, or an error if it is not finite or beyond 2⁶⁰.
fn check_point(i: usize, point: DVec3) -> Result<DVec3, Error> {
    let is_valid = point.is_finite() && point.abs().max_element() <= LARGEST;
    is_valid.then_some(point).ok_or(Error::Point(i))
}

/// Returns the key from which the random numbers of a point follow: a hash of the bits of its
/// position and normal.
fn key(point: &ShadingPoint) -> [u32; 2] {
    let numbers = point
        .position
        .to_array()
        .into_iter()
        .chain(point.normal.to_array());
    let hash = numbers.fold(0_u64, |hash, x| {
        // Mix in the next number by the finalizer of SplitMix64. Adding zero makes minus zero plus
        // zero, as both are the same coordinate.
        let mut z = hash
            .wrapping_add((x + 0.0).to_bits())
            .wrapping_add(0x9e37_79b9_7f4a_7c15);
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    });
    #[allow(clippy::cast_possible_truncation, reason = "both halves")]
    let halves = [hash as u32, (hash >> 32) as u32];
    halves
}
