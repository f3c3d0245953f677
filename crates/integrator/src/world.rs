//! What rays of a scene meet: the occluders with the holes of its meshes, those that views meet and
//! those that hide lights, and the surfaces there.

use crate::point::SURFACE_OFFSET;
use crate::{ShadingPoint, Workspace};
use linelit_geometry::intervals::Interval;
use linelit_geometry::{DVec2, DVec3};
use linelit_lights::Light;
use linelit_scene::{AlphaGrid, Bounce, Mesh, RayDifferential, Response, Scene, Surface, Wrap};
use linelit_visibility::{
    AlphaCutoff, AlphaLookup, AlphaMask, AlphaTexels, AlphaWrap, Filter, Hit, Occluders, Ray,
};
use std::borrow::Cow;
use std::sync::Arc;

/// What rays and lines of a scene may meet, and what surfaces are there. Triangles have the numbers
/// of the scene.
#[derive(Debug)]
pub(crate) struct World<'s> {
    pub(crate) scene: &'s Scene,
    /// Whether the scene has textures, so that the footprint of a pixel matters.
    has_textures: bool,
    /// What views (camera rays, and those that mirrors and glass send on) meet.
    views: Occluders,
    /// What hides lights; `None` where it is what views meet.
    lights: Option<Occluders>,
}

/// What a mesh is to rays of one kind.
enum Stand {
    Solid,
    /// With holes by one mask or two.
    Holed(Vec<AlphaMask>),
    Absent,
}

/// The masks of the meshes with holes, by their triangles.
#[derive(Debug)]
struct Masks(Vec<Masked>);

/// A mesh with holes.
#[derive(Debug)]
struct Masked {
    /// Its first triangle.
    first: u32,
    /// A place hides what is behind it if it does by all of them.
    masks: Vec<AlphaMask>,
}

impl Masks {
    /// The masks of a triangle, and its number in its mesh.
    fn at(&self, triangle: u32) -> (&[AlphaMask], u32) {
        let next = self.0.partition_point(|mesh| mesh.first <= triangle);
        let mesh = &self.0[next - 1];
        (&mesh.masks, triangle - mesh.first)
    }
}

impl Filter for Masks {
    fn hides(&self, triangle: u32, barycentric: [f64; 2]) -> bool {
        let (masks, triangle) = self.at(triangle);
        masks.iter().all(|mask| mask.hides(triangle, barycentric))
    }

    fn hides_along(&self, triangle: u32, ends: [[f64; 2]; 2], hidden: &mut Vec<Interval>) {
        let (masks, triangle) = self.at(triangle);
        let [a, b] = masks else {
            for mask in masks {
                mask.hides_along(triangle, ends, hidden);
            }
            return;
        };
        let [a, b] = [a, b].map(|mask| {
            let mut hidden = Vec::new();
            mask.hides_along(triangle, ends, &mut hidden);
            hidden
        });
        for a in &a {
            let with_a = |b: &Interval| Interval::new(a.lo.max(b.lo), a.hi.min(b.hi));
            let both = b.iter().map(with_a);
            hidden.extend(both.filter(|both| both.lo < both.hi));
        }
    }
}

/// The texels of each alpha of a scene.
type Alphas = [Option<(AlphaGrid, Arc<AlphaTexels>)>];

impl<'s> World<'s> {
    pub(crate) fn new(scene: &'s Scene) -> Self {
        let grids = scene.alphas.iter().map(linelit_scene::Alpha::grid);
        let alphas: Vec<_> = grids.map(|grid| grid.and_then(texels)).collect();
        let holes = |mesh: &Mesh, by: &[Option<u32>]| {
            let masks = by.iter().flatten();
            let masks: Vec<_> = masks
                .filter_map(|k| mask(scene, mesh, *k, &alphas))
                .collect();
            if masks.is_empty() {
                Stand::Solid
            } else {
                Stand::Holed(masks)
            }
        };
        let views = occluders(scene, |mesh| {
            holes(mesh, &[mesh.cutout.and_then(|c| c.seen)])
        });
        let has_shadow = |mesh: &Mesh| mesh.cutout.is_some_and(|c| c.shadow.is_some());
        let differs = |mesh: &Mesh| mesh.casts_no_shadow || has_shadow(mesh);
        let lights = scene.meshes.iter().any(differs).then(|| {
            occluders(scene, |mesh| match mesh.cutout {
                _ if mesh.casts_no_shadow => Stand::Absent,
                None => Stand::Solid,
                Some(cutout) => holes(mesh, &[cutout.seen, cutout.shadow]),
            })
        });
        Self {
            scene,
            has_textures: scene.has_textures(),
            views,
            lights,
        }
    }

    /// What views meet.
    pub(crate) const fn views(&self) -> &Occluders {
        &self.views
    }

    /// What hides lights.
    pub(crate) const fn hiding(&self) -> &Occluders {
        match &self.lights {
            Some(lights) => lights,
            None => &self.views,
        }
    }

    /// The surface that the view meets next from a mirror or through glass.
    pub(crate) fn follow(
        &self,
        point: &ShadingPoint,
        bounce: &Bounce,
        workspace: &mut Workspace,
    ) -> Option<ShadingPoint> {
        let direction = bounce.direction;
        // Points are lifted to the viewer's side; what goes through leaves on the other.
        let behind = direction.dot(point.geometric_normal) < 0.0;
        let lift = if behind { 2.0 * point.lift } else { 0.0 };
        let ray = Ray {
            origin: point.position - point.geometric_normal * lift,
            direction,
            t_min: 0.0,
            t_max: f64::INFINITY,
        };
        let hit = self
            .views
            .closest_hit(&ray, &mut workspace.buffers.scratch)?;
        Some(self.surface_point(&hit, direction, bounce.beside.as_ref()))
    }

    /// The point at which the camera ray through the centre of a pixel meets the scene.
    pub(crate) fn shading_point(
        &self,
        pixel: [u32; 2],
        workspace: &mut Workspace,
    ) -> Option<ShadingPoint> {
        self.shading_point_at(pixel, [0.5, 0.5], 1.0, workspace)
    }

    /// The same of a place in the pixel, which stands for a part of it `spacing` wide.
    pub(crate) fn shading_point_at(
        &self,
        pixel: [u32; 2],
        offset: [f64; 2],
        spacing: f64,
        workspace: &mut Workspace,
    ) -> Option<ShadingPoint> {
        let at = [0, 1].map(|k| f64::from(pixel[k]) + offset[k]);
        let (hit, direction) = self.camera_hit(at, workspace)?;
        Some(self.seen_at(at, &hit, direction, spacing))
    }

    /// The surface that the camera ray through a place of the film meets, and the ray's direction.
    pub(crate) fn camera_hit(
        &self,
        [x, y]: [f64; 2],
        workspace: &mut Workspace,
    ) -> Option<(Hit, DVec3)> {
        let camera = self.scene.camera.ray(x, y);
        let ray = Ray {
            origin: camera.origin,
            direction: camera.direction,
            t_min: 0.0,
            t_max: f64::INFINITY,
        };
        let scratch = &mut workspace.buffers.scratch;
        Some((self.views.closest_hit(&ray, scratch)?, camera.direction))
    }

    /// What the camera ray through a place of the film has met.
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

    fn surface_point(
        &self,
        hit: &Hit,
        direction: DVec3,
        beside: Option<&RayDifferential>,
    ) -> ShadingPoint {
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

    fn emitted(&self, surface: &Surface, outgoing: DVec3) -> DVec3 {
        let light = surface.light.map(|i| &self.scene.lights[i as usize]);
        match light.map(|l| (l, &*l.light)) {
            Some((light, Light::Area(area))) => {
                light.shown(surface.footprint(), area.polygon.normal().dot(outgoing))
            }
            // Lines have no surface to look at; what is round in a scene is triangles.
            Some((
                _,
                Light::Linear(_) | Light::Sphere(_) | Light::Disk(_) | Light::Cylinder(_),
            ))
            | None => DVec3::ZERO,
        }
    }
}

/// The occluders of a scene whose meshes are what `stand` says.
fn occluders(scene: &Scene, stand: impl Fn(&Mesh) -> Stand) -> Occluders {
    /// No vertex: a triangle that has it is left out.
    const NONE: [u32; 3] = [u32::MAX; 3];
    let mut solid = Cow::Borrowed(&scene.triangles[..]);
    let (mut holed, mut masks) = (Vec::new(), Vec::new());
    for mesh in &scene.meshes {
        let numbers = mesh.triangles.start as usize..mesh.triangles.end as usize;
        match stand(mesh) {
            Stand::Solid => continue,
            Stand::Absent => {}
            Stand::Holed(by) => {
                holed.resize(scene.triangles.len(), NONE);
                holed[numbers.clone()].copy_from_slice(&scene.triangles[numbers.clone()]);
                let first = mesh.triangles.start;
                masks.push(Masked { first, masks: by });
            }
        }
        solid.to_mut()[numbers].fill(NONE);
    }
    let solid = Occluders::build(&scene.positions, &solid);
    if masks.is_empty() {
        return solid;
    }
    let holed = Occluders::build(&scene.positions, &holed);
    solid.with_holes(holed, Arc::new(Masks(masks)))
}

/// A mesh's holes by an alpha, if that has texels.
fn mask(scene: &Scene, mesh: &Mesh, alpha: u32, alphas: &Alphas) -> Option<AlphaMask> {
    let (grid, texels) = alphas.get(alpha as usize)?.as_ref()?;
    let uvs = coordinates(scene, mesh, grid).collect();
    AlphaMask::new(Arc::clone(texels), uvs).ok()
}

/// Where the corners of a mesh's triangles are on a grid whose rows count from the top; not
/// beyond what masks take, as the readers of files say.
fn coordinates(
    scene: &Scene,
    mesh: &Mesh,
    grid: &AlphaGrid,
) -> impl Iterator<Item = [[f64; 2]; 3]> {
    let numbers = mesh.triangles.start as usize..mesh.triangles.end as usize;
    let mapping = grid.mapping;
    let size = DVec2::new(grid.width.into(), grid.height.into());
    let most = AlphaGrid::FARTHEST / size;
    scene.triangles[numbers].iter().map(move |t| {
        mesh.corner_uvs(&scene.uvs, *t).map(|uv| {
            let at = mapping.apply(uv);
            let at = DVec2::new(at.x, 1.0 - at.y).clamp(-most, most);
            // Of what is not a number.
            at.to_array().map(|c| if c.is_finite() { c } else { 0.0 })
        })
    })
}

/// The texels of a grid, and what is left of it.
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

/// `v`, turned to the side of `reference`.
fn towards(v: DVec3, reference: DVec3) -> DVec3 {
    if v.dot(reference) < 0.0 { -v } else { v }
}
