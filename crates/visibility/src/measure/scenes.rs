//! Small generators of the built-in scenes: grids over a plane, a soup of triangles, a colonnade.

use super::hash_unit;
use crate::{Occluders, Ray, Scratch};
use linelit_geometry::DVec3;

/// A scene with a small and a large light.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// What it is called.
    pub name: String,
    /// Corner positions.
    pub positions: Vec<[f32; 3]>,
    /// Triangles by their corners.
    pub triangles: Vec<[u32; 3]>,
    /// Lights by name.
    pub lights: Vec<(String, Vec<DVec3>)>,
    /// Where the camera is, and what it looks at.
    pub camera: (DVec3, DVec3),
    /// The tangent of half the camera's vertical angle.
    pub tan_half_angle: f64,
}

impl Scene {
    #[allow(clippy::cast_possible_truncation, reason = "f32 geometry")]
    fn vertex(&mut self, p: DVec3) -> u32 {
        self.positions.push(p.as_vec3().to_array());
        self.positions.len() as u32 - 1
    }

    fn triangle(&mut self, a: DVec3, b: DVec3, c: DVec3) {
        let t = [self.vertex(a), self.vertex(b), self.vertex(c)];
        self.triangles.push(t);
    }

    fn quad(&mut self, o: DVec3, u: DVec3, v: DVec3) {
        let [a, b, c, d] = [o, o + u, o + u + v, o + v].map(|p| self.vertex(p));
        self.triangles.extend([[a, b, c], [a, c, d]]);
    }

    fn block(&mut self, lo: DVec3, hi: DVec3) {
        let d = hi - lo;
        let (x, y, z) = (DVec3::X * d.x, DVec3::Y * d.y, DVec3::Z * d.z);
        for (o, u, v) in [
            (lo, x, y),
            (lo, y, z),
            (lo, z, x),
            (hi, -x, -y),
            (hi, -y, -z),
            (hi, -z, -x),
        ] {
            self.quad(o, u, v);
        }
    }

    fn light(&mut self, name: &str, centre: DVec3, u: DVec3, v: DVec3) {
        let o = centre - (u + v) * 0.5;
        self.lights
            .push((name.into(), vec![o, o + u, o + u + v, o + v]));
    }

    /// The camera's ray through each pixel of a film.
    #[must_use]
    pub fn view(&self, width: u32, height: u32) -> Vec<Ray> {
        let (eye, target) = self.camera;
        let z = (target - eye).normalize();
        let x = z.cross(DVec3::Y).normalize();
        let y = x.cross(z);
        let mut rays = Vec::new();
        for j in 0..height {
            for i in 0..width {
                let s = self.tan_half_angle * (2.0 * f64::from(i) + 1.0 - f64::from(width));
                let t = self.tan_half_angle * (f64::from(height) - 2.0 * f64::from(j) - 1.0);
                rays.push(Ray {
                    origin: eye,
                    direction: z + (x * s + y * t) / f64::from(height),
                    t_min: 0.0,
                    t_max: f64::INFINITY,
                });
            }
        }
        rays
    }
}

/// Where the rays first meet the scene, moved off the surface towards the eye, where they see the
/// light's plane from the light's front (the side its first three corners run counter-clockwise
/// on) or, for `two_sided`, from either.
#[must_use]
pub fn shading_points(occluders: &Occluders, rays: &[Ray], offset: f64) -> Vec<DVec3> {
    let mut scratch = Scratch::new();
    rays.iter()
        .filter_map(|ray| {
            let hit = occluders.closest_hit(ray, &mut scratch)?;
            let back = ray.direction.normalize() * offset;
            Some(ray.origin + ray.direction * hit.t - back)
        })
        .collect()
}

/// Three grids of bars over a plane: 1.6 thousand triangles.
#[must_use]
pub fn grid() -> Scene {
    let mut s = Scene {
        name: "grid".into(),
        camera: (DVec3::new(0.0, 5.0, 9.0), DVec3::new(0.0, 0.5, 0.0)),
        tan_half_angle: 0.4,
        ..Scene::default()
    };
    s.quad(
        DVec3::new(-6.0, 0.0, -6.0),
        DVec3::Z * 12.0,
        DVec3::X * 12.0,
    );
    for layer in 0..3 {
        let y = 0.8 + 0.7 * f64::from(layer);
        let turn = 0.3 * f64::from(layer);
        let first = s.positions.len();
        for k in 0..22 {
            let c = -2.1 + 0.2 * f64::from(k);
            s.block(
                DVec3::new(c - 0.03, y, -2.2),
                DVec3::new(c + 0.03, y + 0.05, 2.2),
            );
            s.block(
                DVec3::new(-2.2, y, c - 0.03),
                DVec3::new(2.2, y + 0.05, c + 0.03),
            );
        }
        #[allow(clippy::cast_possible_truncation, reason = "f32 geometry")]
        for p in &mut s.positions[first..] {
            let (sin, cos) = (turn.sin() as f32, turn.cos() as f32);
            *p = [p[0] * cos - p[2] * sin, p[1], p[0] * sin + p[2] * cos];
        }
    }
    s.light(
        "S",
        DVec3::new(0.5, 5.0, 0.2),
        DVec3::X * 0.15,
        DVec3::Z * 0.15,
    );
    s.light(
        "L",
        DVec3::new(0.5, 5.0, 0.2),
        DVec3::X * 2.0,
        DVec3::Z * 2.0,
    );
    s
}

/// A thousand separate triangles in a box.
#[must_use]
pub fn soup() -> Scene {
    let mut s = Scene {
        name: "soup".into(),
        camera: (DVec3::new(0.0, 2.0, 7.5), DVec3::new(0.0, 1.7, 0.0)),
        tan_half_angle: 0.3,
        ..Scene::default()
    };
    let (x, y, z) = (DVec3::X * 4.0, DVec3::Y * 4.0, DVec3::Z * 4.0);
    let o = DVec3::new(-2.0, 0.0, -2.0);
    s.quad(o, z, x);
    s.quad(o, x, y);
    s.quad(o, y, z);
    s.quad(o + x, z, y);
    s.quad(o + y, x, z);
    let mut state = 3;
    for _ in 0..1000 {
        let mut r = || hash_unit(&mut state) - 0.5;
        let c = DVec3::new(3.4 * r(), 2.0 + 2.4 * r(), 3.4 * r());
        let mut corner = || c + DVec3::new(r(), r(), r()) * 0.35;
        let (a, b, d) = (corner(), corner(), corner());
        s.triangle(a, b, d);
    }
    s.light(
        "S",
        DVec3::new(0.0, 3.98, 0.0),
        DVec3::X * 0.25,
        DVec3::Z * 0.25,
    );
    s.light(
        "L",
        DVec3::new(0.0, 3.98, 0.0),
        DVec3::X * 1.5,
        DVec3::Z * 1.5,
    );
    s
}

/// Arcades of round columns with plants between and curtains above: 350 thousand triangles.
#[must_use]
pub fn colonnade() -> Scene {
    let mut s = Scene {
        name: "colonnade".into(),
        camera: (DVec3::new(-9.0, 1.7, 0.6), DVec3::new(0.0, 2.4, -0.4)),
        tan_half_angle: 0.55,
        ..Scene::default()
    };
    s.quad(
        DVec3::new(-12.0, 0.0, -6.0),
        DVec3::Z * 12.0,
        DVec3::X * 24.0,
    );
    s.quad(
        DVec3::new(-12.0, 0.0, -6.0),
        DVec3::X * 24.0,
        DVec3::Y * 8.0,
    );
    s.quad(DVec3::new(-12.0, 0.0, 6.0), DVec3::Y * 8.0, DVec3::X * 24.0);
    let mut state = 5;
    for side in [-1.0, 1.0] {
        for storey in 0..2 {
            let y = 3.6 * f64::from(storey);
            for k in 0..14 {
                let at = DVec3::new(-9.1 + 1.4 * f64::from(k), y, 2.6 * side);
                column(&mut s, at);
                if k < 13 {
                    arch(&mut s, at + DVec3::Y * 2.6);
                    plant(&mut s, at + DVec3::new(0.7, 0.0, 0.4 * side), &mut state);
                }
            }
            s.block(
                DVec3::new(-10.0, y + 3.3, 2.6 * side - 0.3),
                DVec3::new(10.0, y + 3.6, 2.6 * side + 0.3),
            );
        }
    }
    for k in 0..5 {
        curtain(&mut s, -7.0 + 3.5 * f64::from(k));
    }
    s.light(
        "S",
        DVec3::new(0.0, 9.5, 0.0),
        DVec3::X * 0.4,
        DVec3::Z * 0.4,
    );
    s.light(
        "L",
        DVec3::new(0.0, 9.5, 0.0),
        DVec3::X * 4.0,
        DVec3::Z * 2.0,
    );
    s
}

/// A surface of `nu × nv` quads.
fn surface(s: &mut Scene, nu: u32, nv: u32, f: impl Fn(f64, f64) -> DVec3) {
    let first = u32::try_from(s.positions.len()).unwrap_or(0);
    for j in 0..=nv {
        for i in 0..=nu {
            s.vertex(f(
                f64::from(i) / f64::from(nu),
                f64::from(j) / f64::from(nv),
            ));
        }
    }
    for j in 0..nv {
        for i in 0..nu {
            let a = first + j * (nu + 1) + i;
            let (b, c, d) = (a + 1, a + nu + 2, a + nu + 1);
            s.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
}

fn column(s: &mut Scene, at: DVec3) {
    surface(s, 48, 24, |u, v| {
        let (sin, cos) = (u * std::f64::consts::TAU).sin_cos();
        let flutes = 1.0 - 0.04 * (u * std::f64::consts::TAU * 12.0).cos();
        let r = 0.22 * flutes * (1.0 - 0.15 * v)
            + 0.12 * (1.0 - 16.0 * v).max(16.0 * v - 15.0).max(0.0);
        at + DVec3::new(r * cos, 2.6 * v, r * sin)
    });
}

fn arch(s: &mut Scene, at: DVec3) {
    surface(s, 24, 16, |u, v| {
        let (sin, cos) = (v * std::f64::consts::TAU).sin_cos();
        let (up, along) = (u * std::f64::consts::PI).sin_cos();
        let r = 0.7 + 0.12 * cos;
        at + DVec3::new(0.7 - r * along, r * up, 0.2 * sin)
    });
}

fn plant(s: &mut Scene, at: DVec3, state: &mut u64) {
    for _ in 0..1500 {
        let mut r = || hash_unit(state) - 0.5;
        let c = at + DVec3::new(0.5 * r(), 0.5 + 0.9 * r(), 0.5 * r());
        let long = DVec3::new(r(), r() + 0.3, r()) * 0.16;
        let wide = DVec3::new(r(), r(), r()) * 0.06;
        s.triangle(c - wide, c + wide, c + long);
    }
}

fn curtain(s: &mut Scene, x: f64) {
    surface(s, 160, 48, |u, v| {
        let fold = 0.08 * (u * 60.0).sin() * (0.3 + v);
        DVec3::new(x + fold, 6.8 - 1.6 * v, -2.2 + 4.4 * u)
    });
}
