//! The occluders of a scene: its triangles, and beside them what has holes, stands there as an
//! instance, or hides no light.

use linelit_geometry::DVec2;
use linelit_geometry::intervals::Interval;
use linelit_scene::{AlphaGrid, Mesh, Object, Place, Scene, Wrap};
use linelit_visibility::{
    AlphaCutoff, AlphaLookup, AlphaMask, AlphaTexels, AlphaWrap, Filter, Hit, Instance, Occluders,
};
use std::collections::BTreeMap;
use std::sync::Arc;

/// The bits of masks that stand for views (camera rays, and those that mirrors and glass send on)
/// and for lights.
const VIEWS: u32 = 1;
const LIGHTS: u32 = 2;

/// What rays and lines of a scene may meet.
#[derive(Debug)]
pub(crate) struct World {
    /// What views meet.
    views: Occluders,
    /// What hides lights; `None` where it is what views meet.
    lights: Option<Occluders>,
    /// What each instance of the occluders is in the scene.
    parts: Vec<Part>,
}

/// An instance of the occluders.
#[derive(Clone, Debug)]
struct Part {
    /// The scene's instance; `None`: of its own triangles.
    instance: Option<u32>,
    /// The triangles' numbers in the lists of the scene or object.
    triangles: Arc<[u32]>,
}

/// Meshes of the same holes that all hide lights, or none does. Opaque ones are in the hierarchy
/// itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Kind {
    /// Indices of alphas.
    seen: Option<u32>,
    shadow: Option<u32>,
    casts_no_shadow: bool,
}

impl Kind {
    const OPAQUE: Self = Self {
        seen: None,
        shadow: None,
        casts_no_shadow: false,
    };

    fn of(mesh: &Mesh) -> Self {
        Self {
            seen: mesh.cutout.and_then(|holes| holes.seen),
            shadow: mesh.cutout.and_then(|holes| holes.shadow),
            casts_no_shadow: mesh.casts_no_shadow,
        }
    }
}

/// Triangles of one kind, of the scene's own or of an object.
struct Group {
    occluders: Arc<Occluders>,
    triangles: Arc<[u32]>,
    /// Whom it hides what from, and its holes to these.
    faces: Vec<Face>,
}

impl Group {
    /// The occluders' instances that stand for it at a place.
    fn instances(&self, map: [[f64; 3]; 4]) -> Vec<Instance> {
        let instance = |face: &Face| {
            // The builder of scenes refuses maps of which there is no instance.
            let part = Instance::new(Arc::clone(&self.occluders), map).ok()?;
            let part = part.with_mask(face.mask);
            Some(match &face.holes {
                Holes::None => part,
                Holes::One(mask) => part.with_filter(Arc::<AlphaMask>::clone(mask)),
                Holes::Two(both) => part.with_filter(Arc::<Both>::clone(both)),
            })
        };
        self.faces.iter().filter_map(instance).collect()
    }
}

struct Face {
    mask: u32,
    holes: Holes,
}

#[derive(Clone)]
enum Holes {
    None,
    One(Arc<AlphaMask>),
    Two(Arc<Both>),
}

/// What two masks leave.
#[derive(Debug)]
struct Both([Arc<AlphaMask>; 2]);

impl Filter for Both {
    fn hides(&self, triangle: u32, barycentric: [f64; 2]) -> bool {
        self.0.iter().all(|mask| mask.hides(triangle, barycentric))
    }

    fn hides_along(&self, triangle: u32, ends: [[f64; 2]; 2], hidden: &mut Vec<Interval>) {
        let [a, b] = self.0.each_ref().map(|mask| {
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

/// Triangles with the coordinates of their corners.
struct Geometry<'s> {
    positions: &'s [[f32; 3]],
    triangles: &'s [[u32; 3]],
    uvs: &'s [[f32; 2]],
    meshes: &'s [Mesh],
}

impl World {
    pub(crate) fn new(scene: &Scene) -> Self {
        let own = Geometry {
            positions: &scene.positions,
            triangles: &scene.triangles,
            uvs: &scene.uvs,
            meshes: &scene.meshes,
        };
        let grids = scene.alphas.iter().map(linelit_scene::Alpha::grid);
        let alphas: Vec<_> = grids.map(|grid| grid.and_then(texels)).collect();
        let (mut instances, mut parts) = (Vec::new(), Vec::new());
        let mut add = |group: &Group, map: [[f64; 3]; 4], instance| {
            let made = group.instances(map);
            parts.extend(made.iter().map(|_| Part {
                instance,
                triangles: Arc::clone(&group.triangles),
            }));
            instances.extend(made);
        };
        for (kind, meshes) in own.kinds() {
            if kind != Kind::OPAQUE {
                add(&own.group(kind, &meshes, &alphas), Instance::HERE, None);
            }
        }
        let groups = |object: &Object| -> Vec<Group> {
            let object = Geometry {
                positions: &object.positions,
                triangles: &object.triangles,
                uvs: &object.uvs,
                meshes: &object.meshes,
            };
            let kinds = object.kinds().into_iter();
            let group = |(kind, meshes): (_, Vec<_>)| object.group(kind, &meshes, &alphas);
            kinds.map(group).collect()
        };
        let groups: Vec<_> = scene.objects.iter().map(groups).collect();
        for (instance, number) in scene.instances.iter().zip(0..) {
            let map = instance.to_world;
            let m = map.matrix3;
            let map = [m.x_axis, m.y_axis, m.z_axis, map.translation].map(|v| v.to_array());
            for group in &groups[instance.object as usize] {
                add(group, map, Some(number));
            }
        }
        let all = own.opaque().with_instances(instances);
        let is_masked = all.instances().iter().any(|part| part.mask() != u32::MAX);
        Self {
            lights: is_masked.then(|| all.with_mask(LIGHTS)),
            views: if is_masked { all.with_mask(VIEWS) } else { all },
            parts,
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

    /// The triangle that a ray has met.
    pub(crate) fn place(&self, hit: &Hit) -> Place {
        let Some(part) = hit.instance.and_then(|k| self.parts.get(k as usize)) else {
            return hit.triangle.into();
        };
        Place {
            instance: part.instance,
            triangle: part.triangles[hit.triangle as usize],
        }
    }
}

impl<'s> Geometry<'s> {
    /// The meshes of each kind.
    fn kinds(&self) -> BTreeMap<Kind, Vec<&'s Mesh>> {
        let mut kinds: BTreeMap<Kind, Vec<&Mesh>> = BTreeMap::new();
        for mesh in self.meshes {
            kinds.entry(Kind::of(mesh)).or_default().push(mesh);
        }
        kinds
    }

    /// What is neither of another kind nor elsewhere, under the numbers that it has.
    fn opaque(&self) -> Occluders {
        /// No vertex: what has it is left out.
        const NONE: [u32; 3] = [u32::MAX; 3];
        let is_other = |mesh: &&Mesh| Kind::of(mesh) != Kind::OPAQUE;
        let mut others = self.meshes.iter().filter(is_other).peekable();
        if others.peek().is_none() {
            return Occluders::build(self.positions, self.triangles);
        }
        let mut triangles = self.triangles.to_vec();
        for mesh in others {
            triangles[mesh.triangles.start as usize..mesh.triangles.end as usize].fill(NONE);
        }
        Occluders::build(self.positions, &triangles)
    }

    fn group(
        &self,
        kind: Kind,
        meshes: &[&Mesh],
        alphas: &[Option<(AlphaGrid, Arc<AlphaTexels>)>],
    ) -> Group {
        let numbers = meshes.iter().flat_map(|mesh| mesh.triangles.clone());
        let numbers: Arc<[u32]> = numbers.collect();
        let triangles: Vec<_> = numbers
            .iter()
            .map(|t| self.triangles[*t as usize])
            .collect();
        let holes = |alpha: Option<u32>| {
            let (grid, texels) = alphas.get(alpha? as usize)?.as_ref()?;
            let uv = meshes.iter().flat_map(|mesh| self.coordinates(mesh, grid));
            AlphaMask::new(Arc::clone(texels), uv.collect())
                .ok()
                .map(Arc::new)
        };
        let (seen, shadow) = (holes(kind.seen), holes(kind.shadow));
        let to_views = seen.clone().map_or(Holes::None, Holes::One);
        let to_lights = match [seen, shadow] {
            [None, None] => Holes::None,
            [Some(one), None] | [None, Some(one)] => Holes::One(one),
            [Some(a), Some(b)] => Holes::Two(Arc::new(Both([a, b]))),
        };
        let faces = if kind.shadow.is_none() && !kind.casts_no_shadow {
            vec![Face {
                mask: u32::MAX,
                holes: to_views,
            }]
        } else {
            let views = Face {
                mask: VIEWS,
                holes: to_views,
            };
            let lights = Face {
                mask: LIGHTS,
                holes: to_lights,
            };
            std::iter::once(views)
                .chain((!kind.casts_no_shadow).then_some(lights))
                .collect()
        };
        Group {
            occluders: Arc::new(Occluders::build(self.positions, &triangles)),
            triangles: numbers,
            faces,
        }
    }

    /// Where the corners of a mesh's triangles are on a grid whose rows count from the top; not
    /// beyond what masks take, as the readers of files say.
    fn coordinates(&self, mesh: &Mesh, grid: &AlphaGrid) -> impl Iterator<Item = [[f64; 2]; 3]> {
        let triangles = &self.triangles[mesh.triangles.start as usize..mesh.triangles.end as usize];
        let mapping = grid.mapping;
        let size = DVec2::new(grid.width.into(), grid.height.into());
        let most = AlphaGrid::FARTHEST / size;
        triangles.iter().map(move |t| {
            mesh.corner_uvs(self.uvs, *t).map(|uv| {
                let at = mapping.apply(uv);
                let at = DVec2::new(at.x, 1.0 - at.y).clamp(-most, most);
                // Of what is not a number.
                at.to_array().map(|c| if c.is_finite() { c } else { 0.0 })
            })
        })
    }
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
