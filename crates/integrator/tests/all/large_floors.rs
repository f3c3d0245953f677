//! Shadows close to their occluders, on floors of any size and at any position, are compared with
//! Lambert's sum.

use crate::common::{load, points, settings};
use linelit_geometry::DVec3;
use linelit_integrator::{Renderer, Workspace};
use linelit_shading::polygon;
use std::f64::consts::PI;

/// A floor that extends as far as `floor`, the objects on it, and a light. All are moved by
/// `offset` and seen from straight above, from `height`, over `width` to either side.
struct Setting {
    floor: f64,
    offset: DVec3,
    height: f64,
    width: f64,
    occluder: [[f64; 3]; 4],
    light: [[f64; 3]; 4],
}

impl Setting {
    fn text(&self) -> String {
        let at = |p: [f64; 3]| {
            let p = self.offset + DVec3::from(p);
            format!("{} {} {}", p.x, p.y, p.z)
        };
        let quad = |corners: [[f64; 3]; 4]| {
            let corners = corners.map(at).join("  ");
            format!(
                "Shape \"trianglemesh\" \"integer indices\" [ 0 1 2 0 2 3 ] \"point P\" [ {corners} ]\n"
            )
        };
        let f = self.floor;
        let floor = quad([[-f, -f, 0.0], [f, -f, 0.0], [f, f, 0.0], [-f, f, 0.0]]);
        format!(
            r#"
LookAt {}  {}  0 1 0
Camera "orthographic" "float screenwindow" [ -{width} {width} -0.125 0.125 ]
Film "rgb" "integer xresolution" [ 16 ] "integer yresolution" [ 1 ]
WorldBegin
Material "diffuse" "rgb reflectance" [ 1 1 1 ]
{floor}{}
AreaLightSource "diffuse" "rgb L" [ 1 1 1 ]
{}"#,
            at([0.0, 0.0, self.height]),
            at([0.0, 0.0, -1.0]),
            quad(self.occluder),
            quad(self.light),
            width = self.width,
        )
    }

    /// Compares the light on the floor with the expected light at each point, to 1e-6 of it. Points
    /// are lifted by at most 2e-8 here, below shadow edges that are at least a tenth above the
    /// floor, or seen from where they hide all or none of the light. Points in shadow are black.
    /// Returns how many points are dark and how many are lit.
    fn hold(&self, expected: impl Fn(DVec3) -> f64) -> [u32; 2] {
        let scene = load(&self.text());
        let renderer = Renderer::new(&scene);
        let mut seen = [0; 2];
        for (pixel, point) in points(&renderer) {
            let at = (point.position - self.offset) * DVec3::new(1.0, 1.0, 0.0);
            let want = expected(at);
            seen[usize::from(want > 0.0)] += 1;
            for estimator in ["exact", "line-analytic", "point-area"] {
                let settings = settings(estimator, 1, 0);
                let got = renderer.direct(&settings, &point, pixel, &mut Workspace::new());
                // Samples may miss the light of a lit point, but a dark point has none.
                let error = match estimator {
                    "exact" => (got.x - want).abs(),
                    _ if want > 0.0 => 0.0,
                    _ => got.x,
                };
                assert!(
                    error <= 1e-6 * want,
                    "floor {:e}, offset {}, {estimator} at {at}: {} for {want}",
                    self.floor,
                    self.offset,
                    got.x
                );
            }
        }
        seen
    }
}

/// A wall of the height 1/8, and an upright light far behind it.
fn hold_wall(floor: f64, offset: DVec3) {
    let quad =
        |x: f64, y: f64, z: [f64; 2]| [[x, -y, z[0]], [x, -y, z[1]], [x, y, z[1]], [x, y, z[0]]];
    let setting = Setting {
        floor,
        offset,
        height: 64.0,
        width: 2.0,
        occluder: quad(0.0, 32.0, [0.0, 0.125]),
        light: quad(8.0, 1.0, [1.0, 2.0]),
    };
    let [dark, lit] = setting.hold(by_the_wall);
    assert!(dark > 1 && lit > 8, "{dark} dark, {lit} lit");
}

/// The light that a point of the floor reflects of a polygon.
fn reflected(at: DVec3, corners: [[f64; 3]; 4]) -> f64 {
    let corners = corners.map(|v| DVec3::from(v) - at);
    polygon::irradiance(&corners, DVec3::Z) / PI
}

/// The expected light is the light of the part that is above the wall's shadow.
fn by_the_wall(at: DVec3) -> f64 {
    let hidden_up_to = match at.x < 0.0 {
        true => 0.125 * (8.0 - at.x) / -at.x,
        false => 0.0,
    };
    let [low, high] = [hidden_up_to.clamp(1.0, 2.0), 2.0];
    match low < high {
        true => reflected(
            at,
            [
                [8.0, -1.0, low],
                [8.0, -1.0, high],
                [8.0, 1.0, high],
                [8.0, 1.0, low],
            ],
        ),
        false => 0.0,
    }
}

#[test]
fn shadows_meet_walls_on_floors_of_any_size() {
    for floor in [64.0, 1e3, 1e4, 1e5] {
        hold_wall(floor, DVec3::ZERO);
    }
}

#[test]
fn shadows_meet_walls_far_from_the_origin() {
    for far in [4096.0, 65_536.0, 1_048_576.0] {
        for direction in [DVec3::X, DVec3::Z, DVec3::new(1.0, -1.0, 1.0)] {
            hold_wall(64.0, direction * far);
        }
    }
}

/// A board a thousandth above the floor, below a light of its size, with the camera between them.
#[test]
fn boards_close_to_large_floors_cast_shadows() {
    let quad = |z: f64| {
        [
            [-0.25, -0.25, z],
            [-0.25, 0.25, z],
            [0.25, 0.25, z],
            [0.25, -0.25, z],
        ]
    };
    for floor in [2.0, 500.0, 1e3, 1e4, 1e5] {
        let setting = Setting {
            floor,
            offset: DVec3::ZERO,
            height: 1.0 / 2048.0,
            width: 0.375,
            occluder: quad(1.0 / 1024.0),
            light: quad(1.0),
        };
        let [dark, lit] = setting.hold(|at| match at.x.abs() < 0.25 {
            true => 0.0,
            false => reflected(at, quad(1.0)),
        });
        assert_eq!([dark, lit], [10, 6]);
    }
}
