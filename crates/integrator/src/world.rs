//! The world of a scene has its occluders, with holes where meshes have them, both for views and
//! for shadows, and finds the surfaces that rays meet.

use crate::{ShadingPoint, Workspace};
use linelit_estimators::SURFACE_OFFSET;
use linelit_geometry::{DVec3, intervals::Interval};
use linelit_lights::Sky;
use linelit_scene::{
    Alpha, AlphaGrid, Bounce, Mesh, RayDifferential, Response, SceneDescription, Surface, Wrap,
};
use linelit_visibility::{
    AlphaCutoff, AlphaLookup, AlphaMask, AlphaTexels, AlphaWrap, Filter, Hit, Occluders, Ray,
};
use std::borrow::Cow;
use std::sync::Arc;

/// The occluders and the surfaces of a scene. Triangles have the same numbers as in the scene.
#[derive(Debug)]
pub(crate) struct World<'s> {
    pub(crate) scene: &'s SceneDescription,
    /// Whether the scene has textures, so that the footprints of pixels are needed.
    has_textures: bool,
    skies: Vec<&'s Sky>,
    /// The occluders of views: of camera rays, and of their reflections by mirrors and refractions
    /// by glass.
    pub(crate) views: Occluders,
    /// The occluders of lights. They share the hierarchy of views if both are the same.
    pub(crate) shadows: Occluders,
}

/// The masks of all meshes with holes, each with the number of the mesh's first triangle. A point
/// of a mesh hides what is behind it if it does so by all masks of the mesh.
#[derive(Debug)]
struct Masks(Vec<(u32, Vec<AlphaMask>)>);

impl Masks {
    /// The masks for a triangle, and the number of the triangle in its mesh.
    fn at(&self, triangle: u32) -> (&[AlphaMask], u32) {
        let next = self.0.partition_point(|(first, _)| *first <= triangle);
        let (first, masks) = &self.0[next - 1];
        (masks, triangle - first)
    }
}

impl Filter for Masks {
    fn hides(&self, triangle: u32, barycentric: [f64; 2]) -> bool {
        let (masks, triangle) = self.at(triangle);
        masks.iter().all(|mask| mask.hides(triangle, barycentric))
    }

    fn hides_along(&self, triangle: u32, ends: [[f64; 2]; 2], hidden: &mut Vec<Interval>) {
        let (masks, triangle) = self.at(triangle);
        let Some((first, others)) = masks.split_first() else {
            return;
        };
        // Intersect the hidden intervals of all masks.
        first.hides_along(triangle, ends, hidden);
        for mask in others {
            let (before, mut own) = (std::mem::take(hidden), Vec::new());
            mask.hides_along(triangle, ends, &mut own);
            for a in before {
                let with_a = |b: &Interval| Interval::new(a.lo.max(b.lo), a.hi.min(b.hi));
                hidden.extend(own.iter().map(with_a).filter(|both| both.lo < both.hi));
            }
        }
    }
}

/// The texels of each alpha map of a scene.
type Alphas = [Option<(AlphaGrid, Arc<AlphaTexels>)>];

impl<'s> World<'s> {
    /// Builds the world of a scene. If `for_rays` is set, the parts of the hierarchy that only
    /// shafts need are left out.
    pub(crate) fn new(scene: &'s SceneDescription, for_rays: bool) -> Self {
        // Read the masks of all meshes with holes.
        let grids = scene.alphas.iter().map(Alpha::grid);
        let alphas: Vec<_> = grids.map(|grid| grid.and_then(texels)).collect();
        let masks = |mesh: &Mesh, by: &[Option<u32>]| -> Vec<AlphaMask> {
            let by = by.iter().flatten();
            by.filter_map(|k| mask(scene, mesh, *k, &alphas)).collect()
        };
        let holes = |mesh: &Mesh| mesh.cutout.map_or([None; 2], |c| [c.seen, c.shadow]);
        // Build one hierarchy for views and shadows, or two if a mesh hides only one of them.
        let differs = |mesh: &Mesh| mesh.casts_no_shadow || holes(mesh)[1].is_some();
        let differ = scene.meshes.iter().any(differs);
        let seen = |mesh: &Mesh| Some(masks(mesh, &holes(mesh)[..1]));
        let views = occluders(scene, for_rays || differ, seen);
        let shadows = if differ {
            occluders(scene, for_rays, |mesh| {
                (!mesh.casts_no_shadow).then(|| masks(mesh, &holes(mesh)))
            })
        } else {
            views.clone()
        };
        Self {
            scene,
            has_textures: scene.has_textures(),
            skies: scene.skies().collect(),
            views,
            shadows,
        }
    }

    /// The point that the view meets next after a reflection by a mirror or a refraction by glass;
    /// `None` if it meets nothing.
    pub(crate) fn follow(
        &self,
        point: &ShadingPoint,
        bounce: &Bounce,
        workspace: &mut Workspace,
    ) -> Option<ShadingPoint> {
        let direction = bounce.direction;
        // A point is lifted to the viewer's side; a view that goes through the surface begins on
        // the other side.
        let behind = direction.dot(point.geometric_normal) < 0.0;
        let lift = if behind { 2.0 * point.lift } else { 0.0 };
        let ray = Ray::new(point.position - point.geometric_normal * lift, direction);
        let scratch = &mut workspace.direct.buffers.scratch;
        let hit = self.views.closest_hit(&ray, scratch)?;
        Some(self.surface_point(&hit, direction, bounce.beside.as_ref()))
    }

    /// The radiance of the skies that is seen along a ray from `x` in the unit direction `w`, if
    /// the ray meets no surface.
    pub(crate) fn sky(&self, x: DVec3, w: DVec3) -> DVec3 {
        self.skies.iter().map(|sky| sky.radiance(x, w)).sum()
    }

    /// The point at which the camera ray through the centre of a pixel meets the scene; `None` if
    /// it meets nothing.
    pub(crate) fn shading_point(
        &self,
        pixel: [u32; 2],
        workspace: &mut Workspace,
    ) -> Option<ShadingPoint> {
        let at = pixel.map(|c| f64::from(c) + 0.5);
        let camera = self.scene.camera.ray(at[0], at[1]);
        let ray = Ray::new(camera.origin, camera.direction);
        let scratch = &mut workspace.direct.buffers.scratch;
        let hit = self.views.closest_hit(&ray, scratch)?;
        Some(self.seen_at(at, &hit, camera.direction, 1.0))
    }

    /// The point that the camera ray through a position of the film has met. The position
    /// represents a part of its pixel that is `spacing` wide and high.
    pub(crate) fn seen_at(
        &self,
        [x, y]: [f64; 2],
        hit: &Hit,
        direction: DVec3,
        spacing: f64,
    ) -> ShadingPoint {
        let beside = (self.has_textures).then(|| self.scene.camera.differential(x, y, spacing));
        self.surface_point(hit, direction, beside.as_ref())
    }

    /// The shading point at a hit of a ray; `beside` has the neighbouring rays, for the footprint
    /// of textures.
    fn surface_point(
        &self,
        hit: &Hit,
        direction: DVec3,
        beside: Option<&RayDifferential>,
    ) -> ShadingPoint {
        // Turn the normals to the viewer's side, and lift the point off the surface.
        let surface = (self.scene).surface_over(hit.triangle, hit.barycentric, direction, beside);
        let outgoing = -direction.normalize_or_zero();
        let geometric_normal = towards(surface.geometric_normal, outgoing);
        let normal = towards(surface.shading_normal, geometric_normal);
        let lift = SURFACE_OFFSET * (surface.point.abs().max_element() + surface.extent);
        let Response { bsdf, bounces } = self.scene.response(&surface, outgoing, normal, beside);
        ShadingPoint {
            shading: linelit_estimators::ShadingPoint {
                position: surface.point + geometric_normal * lift,
                geometric_normal,
                normal,
                outgoing,
                bsdf,
            },
            material: surface.material,
            lift,
            bounces,
            emitted: self.emitted(&surface, outgoing),
        }
    }

    /// The radiance that a surface itself emits towards the viewer.
    fn emitted(&self, surface: &Surface, outgoing: DVec3) -> DVec3 {
        let light = surface.light.map(|i| &self.scene.lights[i as usize]);
        // Linear lights have no surface that could be seen, and round lights are triangles in a
        // scene.
        light.map_or(DVec3::ZERO, |light| {
            light.shown(surface.footprint(), outgoing)
        })
    }
}

/// Builds the occluders of a scene. Each mesh has the holes of some masks; for `None` the mesh is
/// left out.
fn occluders(
    scene: &SceneDescription,
    for_rays: bool,
    masks: impl Fn(&Mesh) -> Option<Vec<AlphaMask>>,
) -> Occluders {
    /// An index of no vertex: a triangle that has it is left out.
    const NONE: [u32; 3] = [u32::MAX; 3];
    // Separate the triangles of meshes with holes from all others, by number.
    let mut solid = Cow::Borrowed(&scene.triangles[..]);
    let (mut holed, mut all) = (Vec::new(), Vec::new());
    for mesh in &scene.meshes {
        let numbers = mesh.triangles.start as usize..mesh.triangles.end as usize;
        match masks(mesh) {
            Some(none) if none.is_empty() => continue,
            None => {}
            Some(masks) => {
                holed.resize(scene.triangles.len(), NONE);
                holed[numbers.clone()].copy_from_slice(&scene.triangles[numbers.clone()]);
                all.push((mesh.triangles.start, masks));
            }
        }
        solid.to_mut()[numbers].fill(NONE);
    }
    // Build the hierarchy of the triangles without holes.
    let solid = match for_rays {
        true => Occluders::build_for_rays(&scene.positions, &solid),
        false => Occluders::build(&scene.positions, &solid),
    };
    let solid = solid.moved(scene.origin);
    if all.is_empty() {
        return solid;
    }
    // Triangles with holes are tested one by one, for which a hierarchy for rays is enough.
    let holed = Occluders::build_for_rays(&scene.positions, &holed).moved(scene.origin);
    solid.with_holes(holed, Arc::new(Masks(all)))
}

/// The holes that an alpha map makes in a mesh, if the map has texels.
fn mask(scene: &SceneDescription, mesh: &Mesh, alpha: u32, alphas: &Alphas) -> Option<AlphaMask> {
    let (grid, texels) = alphas.get(alpha as usize)?.as_ref()?;
    let corners = |t: &[u32; 3]| mesh.corner_uvs(&scene.uvs, *t).map(|uv| grid.place(uv));
    let triangles = &scene.triangles[mesh.triangles.start as usize..mesh.triangles.end as usize];
    AlphaMask::new(Arc::clone(texels), triangles.iter().map(corners).collect()).ok()
}

/// The texels of an alpha map, together with the map's other properties.
fn texels(mut grid: AlphaGrid) -> Option<(AlphaGrid, Arc<AlphaTexels>)> {
    let values = std::mem::take(&mut grid.values);
    let texels = AlphaTexels::new(grid.width, grid.height, values).ok()?;
    let wrap = grid.wrap.map(|wrap| match wrap {
        Wrap::Repeat => AlphaWrap::Repeat,
        Wrap::Mirror => AlphaWrap::Mirror,
        Wrap::Black => AlphaWrap::Zero,
        Wrap::Clamp => AlphaWrap::Clamp,
    });
    let lookup = if grid.nearest {
        AlphaLookup::Nearest
    } else {
        AlphaLookup::Bilinear
    };
    let cutoff = AlphaCutoff::AtLeast(grid.cutoff);
    let texels = texels.with_wrap(wrap).with_lookup(lookup);
    Some((grid, Arc::new(texels.with_cutoff(cutoff))))
}

/// Returns `v`, or `−v` if that is on the side of `reference`.
fn towards(v: DVec3, reference: DVec3) -> DVec3 {
    if v.dot(reference) < 0.0 { -v } else { v }
}
