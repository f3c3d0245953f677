//! [`Surface`], the point where a ray meets a triangle, with its normals, tangents and texture
//! coordinates.
//!
//! The outside of a triangle follows pbrt (see [`SceneDescription::surface`]). The tangents are the
//! derivatives of the point by its texture coordinates. Bump and normal maps turn the shading
//! normal here, so that renderers need not know of them.

use crate::emission::PlaneUv;
use crate::footprint::{Footprint, RayDifferential};
use crate::material::NormalMap;
use crate::scene::{Mesh, SceneDescription, outward, to_f64};
use crate::texture::Texture;
use linelit_geometry::{DVec2, DVec3, Frame};

/// A point on a surface, with the attributes that a renderer needs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// The point in world space, on the triangle.
    pub point: DVec3,
    /// The unit normal of the triangle, on the side that the ray comes from.
    pub geometric_normal: DVec3,
    /// The unit interpolated normal after bump and normal maps, turned to the side that the ray
    /// comes from; the geometric normal if the mesh has no vertex normals.
    pub shading_normal: DVec3,
    /// The texture coordinates.
    pub uv: DVec2,
    /// The extent of the pixel around the point; zero for lookups without extent.
    pub covered: Covered,
    /// The index of the triangle in the scene's list.
    pub triangle: u32,
    /// The largest component of the triangle's edges from its first corner, a measure of its size.
    pub extent: f64,
    /// The index into the scene's materials.
    pub material: u32,
    /// The index into the scene's lights, if the triangle emits.
    pub light: Option<u32>,
    /// Whether the ray comes from the outside (for an area light: from the emitting side).
    pub outside: bool,
}

/// The changes of a surface's attributes from one pixel to the next, across and down.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Covered {
    /// The point, on the plane of the triangle.
    pub point: [DVec3; 2],
    /// The unit shading normal, without bump and normal maps.
    pub normal: [DVec3; 2],
    /// The texture coordinates.
    pub uv: [DVec2; 2],
}

impl Surface {
    /// Returns the texture coordinates and the extent over which textures are looked up.
    pub const fn footprint(&self) -> Footprint {
        let [dx, dy] = self.covered.uv;
        Footprint {
            uv: self.uv,
            dx,
            dy,
        }
    }
}

/// A triangle with the attributes of its corners.
struct SurfaceTriangle<'s> {
    mesh: &'s Mesh,
    points: [DVec3; 3],
    /// The vertex normals; zero if the mesh has none.
    normals: [DVec3; 3],
    uvs: [DVec2; 3],
}

/// The texture coordinates of the corners of a triangle whose mesh has none, as in pbrt.
const DEFAULT_UVS: [DVec2; 3] = [DVec2::ZERO, DVec2::X, DVec2::ONE];

/// The step in texture coordinates over which the slope of a bump map is measured where the pixel
/// has no extent, as in pbrt.
const BUMP_STEP: f64 = 0.0005;

impl SceneDescription {
    /// Returns the surface where a ray meets a triangle, at the barycentric weights `[b1, b2]` of
    /// its second and third corner (the first has the weight 1 − b1 − b2).
    ///
    /// Orientation follows pbrt: the outside is where the vertex normals point. For a mesh without
    /// them it is where the right-hand normal of the vertex order points, or the opposite side if
    /// [`Mesh::flipped`].
    ///
    /// Bump and normal maps are looked up without extent, and so is the footprint of textures.
    ///
    /// # Panics
    /// If there is no such triangle.
    pub fn surface(&self, triangle: u32, barycentric: [f64; 2], ray_direction: DVec3) -> Surface {
        self.surface_over(triangle, barycentric, ray_direction, None)
    }

    /// Returns the surface as [`SceneDescription::surface`] returns it, with the extent of the
    /// pixel that the neighbouring rays `beside` bound.
    ///
    /// The neighbouring rays are intersected with the plane of the triangle, on which texture
    /// coordinates and normals are extrapolated.
    ///
    /// # Panics
    /// If there is no such triangle.
    #[inline]
    pub fn surface_over(
        &self,
        triangle: u32,
        [b1, b2]: [f64; 2],
        ray_direction: DVec3,
        beside: Option<&RayDifferential>,
    ) -> Surface {
        // Find the outside, and on which side of it the ray is.
        let found = &self.facet(triangle);
        let (mesh, uvs) = (found.mesh, found.uvs);
        let weights = [1.0 - b1 - b2, b1, b2];
        let [p0, p1, p2] = found.points;
        let (e1, e2) = (p1 - p0, p2 - p0);
        let winding = winding(e1, e2);
        let interpolated = if mesh.has_normals {
            let terms = found.normals.iter().zip(weights);
            terms.fold(DVec3::ZERO, |sum, (&n, w)| sum + w * n)
        } else {
            DVec3::ZERO
        };
        let outward = outward(winding, interpolated, mesh.flipped);
        let outside = outward.dot(ray_direction) <= 0.0;
        let side = if outside { 1.0 } else { -1.0 };
        let geometric_normal = side * outward;
        // Interpolate the attributes of the corners.
        let mut surface = Surface {
            point: p0 * weights[0] + p1 * b1 + p2 * b2,
            geometric_normal,
            shading_normal: mesh
                .has_normals
                .then(|| (side * interpolated).try_normalize())
                .flatten()
                .unwrap_or(geometric_normal),
            uv: uvs[0] * weights[0] + uvs[1] * b1 + uvs[2] * b2,
            covered: Covered::default(),
            triangle,
            extent: e1.abs().max(e2.abs()).max_element(),
            material: mesh.material,
            light: self.light_of(triangle),
            outside,
        };
        // Find the extent of the pixel.
        if let Some(beside) = beside {
            let vertex_normals = found.normals.map(|n| side * n);
            let normals = (vertex_normals, interpolated.length());
            surface.covered = covered(&surface, [p0, p1, p2], uvs, normals, beside);
        }
        // Turn the shading normal by the material's map. Maps are defined on the outside, so that a
        // bump seen from behind is a dent. A normal on the wrong side of the triangle is ignored.
        let material = &self.materials[mesh.material as usize];
        if (material.bump.is_some() || material.normal_map.is_some())
            && let outer = side * surface.shading_normal
            && let Some(bent) = self.bent_normal(&surface, found, outer)
            && let Some(normal) = (side * bent).try_normalize()
            && normal.dot(geometric_normal) > 0.0
        {
            surface.shading_normal = normal;
        }
        surface
    }

    /// Returns a triangle with the attributes of its corners.
    fn facet(&self, triangle: u32) -> SurfaceTriangle<'_> {
        let mesh = &self.meshes[self.mesh_of(triangle) as usize];
        let indices = self.triangles[triangle as usize];
        let normals = if mesh.has_normals {
            indices.map(|i| to_f64(self.normals[i as usize]))
        } else {
            [DVec3::ZERO; 3]
        };
        SurfaceTriangle {
            mesh,
            points: self.corners(triangle),
            normals,
            uvs: mesh.corner_uvs(&self.uvs, indices),
        }
    }

    /// Returns the derivatives ∂p/∂u and ∂p/∂v of the points of a triangle by the texture
    /// coordinates. Where the coordinates are degenerate, they are two perpendicular unit vectors
    /// in its plane.
    ///
    /// # Panics
    /// If there is no such triangle.
    pub fn tangents(&self, triangle: u32) -> [DVec3; 2] {
        let found = self.facet(triangle);
        tangents(found.points, found.uvs)
    }

    /// Returns the normal `outer`, which is on the outside, as the bump or normal map of the
    /// material turns it; the result may have any length. `None` if the material has neither.
    fn bent_normal(
        &self,
        surface: &Surface,
        found: &SurfaceTriangle<'_>,
        outer: DVec3,
    ) -> Option<DVec3> {
        // Take the normal from a normal map, if there is no bump map.
        let SurfaceTriangle { mesh, points, .. } = *found;
        let material = &self.materials[mesh.material as usize];
        let [dp_du, dp_dv] = tangents(points, found.uvs);
        let at = surface.footprint();
        let Some(map) = &material.bump else {
            let map = material.normal_map.as_ref()?;
            return Some(mapped(map, at, [dp_du, dp_dv], outer));
        };
        // Tilt the normal by the slopes of a bump map.
        let normals = if mesh.has_normals {
            found.normals
        } else {
            [outer; 3]
        };
        let speed = if map.as_v3 && mesh.has_normals {
            v3_tangents(dp_du, outer)
        } else {
            [dp_du, dp_dv]
        };
        let change = normal_change(normals, found.uvs);
        Some(bumped(&map.height, &at, speed, outer, change))
    }
}

impl Mesh {
    /// Returns the texture coordinates of the corners of one of the mesh's triangles. `uvs` has the
    /// coordinates of all vertices of the scene, and `vertices` the triangle's indices.
    ///
    /// # Panics
    /// If an index is not below the number of vertices.
    #[must_use]
    pub fn corner_uvs(&self, uvs: &[[f32; 2]], vertices: [u32; 3]) -> [DVec2; 3] {
        if !self.has_uvs {
            return DEFAULT_UVS;
        }
        vertices.map(|i| {
            let [u, v] = uvs[i as usize];
            DVec2::new(f64::from(u), f64::from(v))
        })
    }
}

/// Returns the right-hand unit normal of a triangle, from its edges at the first corner.
fn winding(e1: DVec3, e2: DVec3) -> DVec3 {
    e1.cross(e2).normalize_or(DVec3::Z)
}

/// Returns the derivatives ∂p/∂u and ∂p/∂v; perpendicular unit vectors if the coordinates are
/// degenerate.
fn tangents(p: [DVec3; 3], uv: [DVec2; 3]) -> [DVec3; 2] {
    derivatives(p, uv).unwrap_or_else(|| {
        let frame = Frame::from_normal(winding(p[1] - p[0], p[2] - p[0]));
        [frame.x, frame.y]
    })
}

/// Returns the derivatives of the vertex normals of a triangle by the texture coordinates; zero if
/// the coordinates are degenerate.
fn normal_change(normals: [DVec3; 3], uv: [DVec2; 3]) -> [DVec3; 2] {
    derivatives(normals, uv).unwrap_or_default()
}

/// Returns the derivatives by texture coordinates of an attribute `p` of a triangle's corners, the
/// solution of `p_k − p_0 = dp_du Δu_k + dp_dv Δv_k`; `None` if the coordinates are degenerate.
fn derivatives(p: [DVec3; 3], uv: [DVec2; 3]) -> Option<[DVec3; 2]> {
    let (a, b) = (uv[1] - uv[0], uv[2] - uv[0]);
    let (e1, e2) = (p[1] - p[0], p[2] - p[0]);
    let determinant = a.perp_dot(b);
    let du = (b.y * e1 - a.y * e2) / determinant;
    let dv = (a.x * e2 - b.x * e1) / determinant;
    let regular = determinant.abs() > 1e-9 * a.length() * b.length();
    (regular && du.is_finite() && dv.is_finite()).then_some([du, dv])
}

/// Returns the extent of the pixel over a triangle around a point of it. `length` is the length of
/// the interpolated vertex normal, before it is normalised.
fn covered(
    surface: &Surface,
    corners: [DVec3; 3],
    uvs: [DVec2; 3],
    ([n0, n1, n2], length): ([DVec3; 3], f64),
    beside: &RayDifferential,
) -> Covered {
    // Intersect the neighbouring rays with the plane of the triangle.
    let plane = surface.geometric_normal;
    let points = [0, 1].map(|k| {
        let (origin, direction) = (beside.origins[k], beside.directions[k]);
        let distance = plane.dot(surface.point - origin) / plane.dot(direction);
        let change = origin + direction * distance - surface.point;
        // A ray parallel to the plane gives no extent.
        if change.is_finite() {
            change
        } else {
            DVec3::ZERO
        }
    });
    // Find the changes of the barycentric weights, and with them of the texture coordinates.
    let of_corners = PlaneUv::new(corners, [DVec2::ZERO, DVec2::X, DVec2::Y]);
    let weights = points.map(|change| of_corners.change(change));
    let uv = |w: DVec2| (uvs[1] - uvs[0]) * w.x + (uvs[2] - uvs[0]) * w.y;
    // Differentiate the normalised sum of weighted vertex normals.
    let unit = surface.shading_normal;
    let turned = |w: DVec2| {
        let change = (n1 - n0) * w.x + (n2 - n0) * w.y;
        change - unit * unit.dot(change)
    };
    let normals = weights.map(|w| turned(w) / length);
    Covered {
        point: points,
        normal: normals.map(|n| if n.is_finite() { n } else { DVec3::ZERO }),
        uv: weights.map(uv),
    }
}

/// Returns the normal of the surface that is displaced by a height d along its normal n (Blinn
/// 1978; Pharr, Jakob and Humphreys, *Physically Based Rendering*, 3rd edition, §9.3): the cross
/// product of ∂p'/∂u = ∂p/∂u + n ∂d/∂u + d ∂n/∂u and likewise ∂p'/∂v. The slopes ∂d/∂u and ∂d/∂v
/// are pbrt's forward differences over half the pixel, of the mean heights over the footprint.
fn bumped(
    height: &Texture,
    at: &Footprint,
    [dp_du, dp_dv]: [DVec3; 2],
    normal: DVec3,
    [dn_du, dn_dv]: [DVec3; 2],
) -> DVec3 {
    /// The smallest step in texture coordinates over which a slope is measured: below it, rounding
    /// in the difference of two heights would be visible.
    const LEAST: f64 = 1e-8;
    // Measure the slopes.
    let step = 0.5 * (at.dx.abs() + at.dy.abs());
    let step = [step.x, step.y].map(|step| if step > LEAST { step } else { BUMP_STEP });
    let here = height.evaluate_number(*at);
    let slope =
        |by: DVec2, step: f64| (height.evaluate_number(at.shifted(by * step)) - here) / step;
    // Take the normal of the displaced surface, on the side of the old one.
    let u = dp_du + normal * slope(DVec2::X, step[0]) + dn_du * here;
    let v = dp_dv + normal * slope(DVec2::Y, step[1]) + dn_dv * here;
    let cross = u.cross(v);
    if cross.dot(normal) < 0.0 {
        -cross
    } else {
        cross
    }
}

/// Returns the unit tangents that pbrt-v3 uses on a surface with vertex normals: opposite to the
/// direction of the first texture coordinate, and perpendicular to it.
fn v3_tangents(dp_du: DVec3, normal: DVec3) -> [DVec3; 2] {
    match dp_du.cross(normal).try_normalize() {
        Some(across) => [across.cross(normal), across],
        None => {
            let frame = Frame::from_normal(normal);
            [frame.x, frame.y]
        }
    }
}

/// Returns the normal from a normal map, whose components are along ∂p/∂u (x), towards ∂p/∂v (y)
/// and along the normal (z).
fn mapped(
    map: &NormalMap,
    at: impl Into<Footprint>,
    [dp_du, dp_dv]: [DVec3; 2],
    normal: DVec3,
) -> DVec3 {
    let value = 2.0 * map.texture.evaluate(at) - DVec3::ONE;
    let Some(x) = (dp_du - normal * normal.dot(dp_du)).try_normalize() else {
        return normal;
    };
    let y = normal.cross(x);
    let y = if y.dot(dp_dv) < 0.0 { -y } else { y };
    map.scale * (x * value.x + y * value.y) + normal * value.z
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tangents_are_the_derivatives() {
        let p = [
            DVec3::ZERO,
            DVec3::new(2.0, 0.0, 1.0),
            DVec3::new(0.0, 3.0, 0.0),
        ];
        let uv = [
            DVec2::new(0.5, 0.25),
            DVec2::new(1.0, 0.5),
            DVec2::new(0.0, 1.0),
        ];
        let [du, dv] = tangents(p, uv);
        for k in 1..3 {
            let d = uv[k] - uv[0];
            assert!((du * d.x + dv * d.y - (p[k] - p[0])).length() < 1e-15);
        }
        let [du, dv] = tangents(p, [DVec2::ONE; 3]);
        assert!((du.cross(dv) - winding(p[1], p[2])).length() < 1e-15);
    }

    const UV: DVec2 = DVec2::new(0.25, 0.5);

    #[test]
    fn a_ramp_tilts_the_normal_by_its_slope() {
        // A ramp of height u over a square of two by two: its slope is one half.
        let pixels = (0..=255).map(|i| [i; 3]).collect();
        let data = crate::ImageData::new(256, 1, pixels, false).unwrap();
        let ramp = crate::ImageTexture {
            wrap: [crate::Wrap::Clamp; 2],
            scale: 255.0 / 256.0,
            ..crate::ImageTexture::new(data.into())
        };
        let speed = [2.0 * DVec3::X, 2.0 * DVec3::Y];
        let ramp = Texture::Image(ramp.into());
        let bump = |speed| {
            let still = Default::default();
            bumped(&ramp, &UV.into(), speed, DVec3::Z, still).normalize()
        };
        let normal = bump(speed);
        let want = DVec3::new(-0.5, 0.0, 1.0).normalize();
        // Differences of values of about 1/4 over a step of 5e-4: a few 2^-54 / 5e-4.
        assert!((normal - want).length() < 1e-11, "{normal}");
        // pbrt-v3: a slope of one, turned inside out.
        let normal = bump(v3_tangents(speed[0], DVec3::Z));
        let want = DVec3::new(1.0, 0.0, 1.0).normalize();
        assert!((normal - want).length() < 1e-11, "{normal}");
    }

    #[test]
    fn normal_maps_bend_along_the_tangents_even_when_mirrored() {
        let map = NormalMap {
            texture: Texture::Constant(DVec3::new(0.8, 0.9, 0.5)),
            scale: 0.5,
        };
        // x: 2 · 0.8 − 1 = 0.6, y: 0.8, both halved; z: 0.
        let straight = mapped(&map, UV, [DVec3::X, DVec3::Y], DVec3::Z);
        assert!((straight - DVec3::new(0.3, 0.4, 0.0)).length() < 1e-15);
        let mirrored = mapped(&map, UV, [DVec3::X, -DVec3::Y], DVec3::Z);
        assert!((mirrored - DVec3::new(0.3, -0.4, 0.0)).length() < 1e-15);
    }
}
