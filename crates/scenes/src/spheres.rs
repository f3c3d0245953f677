//! The scenes `spheres`: closed bumpy spheres with any number of triangles. Coarse and fine meshes
//! cast nearly the same shadows, by which the time of queries can be compared.

use super::mesh::Mesh;
use super::{Files, facing_down, facing_up, light_text, text};
use linelit_elementary::{cos, sin};
use std::collections::BTreeMap;

/// The spheres of the scene. The numbers of each are x, z and the height y of its centre, and its
/// radius.
const SPHERES: [[f64; 4]; 6] = [
    [-1.15, 0.55, 0.62, 0.42],
    [0.05, 0.85, 0.75, 0.5],
    [1.2, 0.6, 0.66, 0.4],
    [-0.65, -0.55, 0.45, 0.3],
    [0.55, -0.4, 1.15, 0.27],
    [1.05, -0.75, 0.4, 0.28],
];

/// Returns the number of triangles of a geodesic sphere, for an icosahedron whose edges are divided
/// into `parts`.
const fn triangles_of(parts: u32) -> u32 {
    20 * parts * parts
}

/// Returns the files of a scene: six bumpy spheres over a floor under one light, with 120 `parts`²
/// triangles in all.
pub(super) fn spheres(name: &str, parts: u32) -> Files {
    let [red, green, blue] = [[0.6, 0.35, 0.3], [0.35, 0.55, 0.35], [0.35, 0.4, 0.6]];
    // Make the floor, and a PLY file for each sphere.
    let unit = geodesic(parts);
    let mut geometry = text::diffuse(
        [0.7, 0.7, 0.7],
        &Mesh::polygon(&facing_up([-4.0; 2], [4.0; 2], 0.0)),
    );
    let mut files = Files::new();
    for (k, [x, z, y, radius]) in SPHERES.into_iter().enumerate() {
        let mesh = Mesh {
            points: unit
                .points
                .iter()
                .map(|&p| bumpy(p, [x, y, z], radius, k))
                .collect(),
            triangles: unit.triangles.clone(),
        };
        let [r, g, b] = [red, green, blue][k % 3];
        let file = format!("{name}-{k}.ply");
        geometry.push_str(&format!(
            "AttributeBegin\nMaterial \"diffuse\" \"rgb reflectance\" [ {r} {g} {b} ]\nShape \"plymesh\" \"string filename\" [ \"{file}\" ]\nAttributeEnd\n"
        ));
        files.push((file, mesh.ply()));
    }
    // Write the main file with the camera and the light.
    let light = light_text([24.0, 23.2, 21.9], &facing_down([0.3, 3.2, -0.2], [0.7; 2]));
    let main = format!(
        "# linelit: {name}. {} triangles in six closed spheres with bumps.\n\
         LookAt 0.2 3 -4.2  0 0.4 0.2  0 1 0\nCamera \"perspective\" \"float fov\" [ 36 ]\n\
         Sampler \"independent\" \"integer pixelsamples\" [ 16 ]\n\
         PixelFilter \"box\" \"float xradius\" [ 0.5 ] \"float yradius\" [ 0.5 ]\n\
         Film \"rgb\" \"integer xresolution\" [ 512 ] \"integer yresolution\" [ 512 ] \"string filename\" [ \"{name}.exr\" ]\n\
         WorldBegin\n{geometry}{}",
        6 * triangles_of(parts),
        text::emitter(&light)
    );
    files.push((format!("{name}.pbrt"), main.into_bytes()));
    files
}

/// Returns the point of a bumpy sphere for a point of the unit sphere; `k` is the index of the
/// sphere, since each sphere has its own bumps.
fn bumpy([x, y, z]: [f64; 3], centre: [f64; 3], radius: f64, k: usize) -> [f64; 3] {
    let phase = [0.0, 1.1, 2.3, 3.1, 4.2, 5.3][k % 6];
    let waves = sin(7.0 * x + phase) * cos(6.0 * y - phase) + sin(8.0 * z + phase);
    let r = radius * (1.0 + 0.05 * waves);
    [centre[0] + r * x, centre[1] + r * y, centre[2] + r * z]
}

/// Returns a geodesic sphere: an icosahedron, each of whose faces is divided into `parts`²
/// triangles, projected to the unit sphere. The mesh is closed, and neighbours share their corners.
///
/// ```text
///          c            A point of the face a b c is a sum of its corners with whole weights whose
///         / \           sum is `parts`, here 2: a + c, for example, is the middle of an edge.
///    a+c /___\ b+c      Points on an edge have the weight 0 for the third corner, so that they
///       /\   /\         have the same key from both faces and become one vertex.
///      /  \ /  \
///     a────────b
///         a+b
/// ```
fn geodesic(parts: u32) -> Mesh {
    // Make the corners (0, ±1, ±φ) and their cyclic permutations, with the golden ratio φ.
    let golden = 0.5 * (1.0 + 5.0_f64.sqrt());
    let mut corners = Vec::new();
    for axis in 0..3 {
        for (a, b) in [
            (1.0, golden),
            (1.0, -golden),
            (-1.0, golden),
            (-1.0, -golden),
        ] {
            let mut p = [0.0; 3];
            (p[(axis + 1) % 3], p[(axis + 2) % 3]) = (a, b);
            corners.push(p);
        }
    }
    // `place` returns the vertex for three corners with weights, and adds it the first time. The
    // key does not depend on the order of the corners, or on corners with the weight zero.
    let mut mesh = Mesh::default();
    let mut known = BTreeMap::new();
    let mut place = |mesh: &mut Mesh, of: [(usize, u32); 3]| {
        let mut key = of;
        for (corner, share) in &mut key {
            *corner = if *share == 0 { usize::MAX } else { *corner };
        }
        key.sort_unstable();
        *known.entry(key).or_insert_with(|| {
            let mut p = [0.0; 3];
            for (corner, share) in key.into_iter().filter(|(_, share)| *share > 0) {
                for (x, c) in p.iter_mut().zip(corners[corner]) {
                    *x += c * f64::from(share);
                }
            }
            let length = p.iter().map(|x| x * x).sum::<f64>().sqrt();
            mesh.points.push(p.map(|x| x / length));
            u32::try_from(mesh.points.len() - 1).unwrap_or(u32::MAX)
        })
    };
    // Add the triangles of each face.
    for [a, b, c] in faces(&corners) {
        for i in 0..parts {
            for j in 0..parts - i {
                let mut at =
                    |i: u32, j: u32| place(&mut mesh, [(a, parts - i - j), (b, i), (c, j)]);
                let (here, right, up) = (at(i, j), at(i + 1, j), at(i, j + 1));
                let beyond = (i + j + 1 < parts).then(|| at(i + 1, j + 1));
                mesh.triangles.push([here, right, up]);
                if let Some(beyond) = beyond {
                    mesh.triangles.push([right, beyond, up]);
                }
            }
        }
    }
    mesh
}

/// Returns the faces of an icosahedron with edges of length 2, as indices of `corners`,
/// counter-clockwise as seen from outside: all triples of corners whose distances from each other
/// are 2.
fn faces(corners: &[[f64; 3]]) -> Vec<[usize; 3]> {
    let apart = |a: usize, b: usize| {
        let d = [0, 1, 2].map(|k| corners[a][k] - corners[b][k]);
        d.iter().map(|x| x * x).sum::<f64>()
    };
    let near = |a, b| apart(a, b) < 4.1;
    let mut faces = Vec::new();
    for a in 0..corners.len() {
        for b in a + 1..corners.len() {
            for c in b + 1..corners.len() {
                if near(a, b) && near(b, c) && near(a, c) {
                    let [p, q, r] = [a, b, c].map(|k| corners[k]);
                    let volume = p[0] * (q[1] * r[2] - q[2] * r[1])
                        + p[1] * (q[2] * r[0] - q[0] * r[2])
                        + p[2] * (q[0] * r[1] - q[1] * r[0]);
                    faces.push(if volume > 0.0 { [a, b, c] } else { [a, c, b] });
                }
            }
        }
    }
    faces
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every edge belongs to two triangles, which run along it in opposite directions. The number
    /// of triangles is the one in the scene's name, to a tenth.
    #[test]
    fn spheres_are_closed() {
        for (parts, count) in [(3, 1e3), (9, 1e4), (29, 1e5), (91, 1e6)] {
            let six = 6.0 * f64::from(triangles_of(parts));
            assert!((six / count - 1.0).abs() < 0.1, "{six}");
        }
        for parts in [1, 2, 3, 9] {
            let mesh = geodesic(parts);
            assert_eq!(mesh.triangles.len(), triangles_of(parts) as usize);
            assert_eq!(mesh.points.len(), mesh.triangles.len() / 2 + 2);
            let sides = mesh
                .triangles
                .iter()
                .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
            let set: std::collections::BTreeSet<_> = sides.clone().collect();
            assert_eq!(set.len(), 3 * mesh.triangles.len());
            assert!(sides.clone().all(|(a, b)| set.contains(&(b, a))));
        }
    }
}
