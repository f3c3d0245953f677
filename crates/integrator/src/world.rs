//! The occluders of a scene, with the holes of its meshes: those that views meet, and those that
//! hide lights.

use linelit_geometry::DVec2;
use linelit_geometry::intervals::Interval;
use linelit_scene::{AlphaGrid, Mesh, Scene, Wrap};
use linelit_visibility::{
    AlphaCutoff, AlphaLookup, AlphaMask, AlphaTexels, AlphaWrap, Filter, Occluders,
};
use std::borrow::Cow;
use std::sync::Arc;

/// What rays and lines of a scene may meet. Triangles have the numbers of the scene.
#[derive(Debug)]
pub(crate) struct World {
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

impl World {
    pub(crate) fn new(scene: &Scene) -> Self {
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
        Self { views, lights }
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
