//! Pictures of scenes at the large coordinates that maps have.

use crate::common::{load, points, settings};
use linelit_geometry::DVec3;
use linelit_integrator::{Renderer, Workspace};

/// A floor, a tilted board, a lamp, a small lamp where a ball is, and a delta light, all moved.
/// Coordinates are multiples of 1/64, so that they are exact anywhere.
fn text(at: DVec3) -> String {
    let p = |v: [f64; 3]| {
        let DVec3 { x, y, z } = at + DVec3::from(v);
        format!("{x} {y} {z}")
    };
    let quad = |corners: [[f64; 3]; 4]| {
        let corners = corners.map(p).join("  ");
        format!(
            "Shape \"trianglemesh\" \"integer indices\" [ 0 1 2 0 2 3 ] \"point P\" [ {corners} ]\n"
        )
    };
    let floor = quad([
        [-3.0, -3.0, 0.0],
        [3.0, -3.0, 0.0],
        [3.0, 3.0, 0.0],
        [-3.0, 3.0, 0.0],
    ]);
    let board = quad([
        [-0.5, -0.5, 0.75],
        [0.5, -0.5, 1.0],
        [0.5, 0.5, 1.25],
        [-0.5, 0.5, 1.0],
    ]);
    let lamp = quad([
        [-0.5, 0.5, 2.0],
        [0.5, 0.5, 2.0],
        [0.5, -0.5, 2.0],
        [-0.5, -0.5, 2.0],
    ]);
    format!(
        r#"LookAt {} {} 0 1 0
Camera "perspective" "float fov" [ 60 ]
Film "rgb" "integer xresolution" [ 12 ] "integer yresolution" [ 12 ]
WorldBegin
LightSource "point" "point3 from" [ {} ] "rgb I" [ 2 1 0 ]
Material "diffuse" "rgb reflectance" [ 0.5 0.5 0.5 ]
{floor}{board}
AttributeBegin
AreaLightSource "diffuse" "rgb L" [ 0 4 8 ]
{lamp}
AttributeEnd"#,
        p([0.5, -2.0, 3.0]),
        p([0.0, 0.0, 0.25]),
        p([1.0, 0.75, 1.5]),
    )
}

/// The picture is the same at each position.
///
/// Camera rays meet the floor to within rounding of the position, which is some twenty units ε of
/// it: the camera's matrix is inverted twice, over a distance of four. Points are lifted by 2⁻⁴⁶ =
/// 64 ε. The light there changes by less than eight times itself per unit of distance, except at
/// the shadow of the delta light, whose edge is left out, since a pixel is on either side of it.
#[test]
fn pictures_are_the_same_everywhere_on_the_map() {
    let light = |at: DVec3| -> Vec<DVec3> {
        let scene = load(&text(at));
        let renderer = Renderer::new(&scene);
        let (settings, mut workspace) = (settings("exact", 1, 0), Workspace::new());
        let all = points(&renderer);
        assert!(all.len() > 100, "{}", all.len());
        let each = all.into_iter();
        each.map(|(pixel, point)| renderer.direct(&settings, &point, pixel, &mut workspace))
            .collect()
    };
    let want = light(DVec3::ZERO);
    let shadowed = want.iter().filter(|v| v.x == 0.0).count();
    assert!(shadowed > 4 && shadowed < 100, "{shadowed}");
    for place in [
        [1e3, -1e3, 1e3],
        [5e3, 5e3, 0.0],
        [500_000.0, 5_400_000.0, 300.0],
        [1e7, -1e7, 1e7],
    ] {
        let far = DVec3::from(place).abs().max_element();
        let found = light(place.into());
        assert_eq!(found.len(), want.len());
        for (got, want) in found.iter().zip(&want) {
            let error = (*got - *want).abs().max_element();
            let bound = 8.0 * (20.0 + 64.0) * f64::EPSILON * far + 1e-12;
            assert!(
                error <= bound * want.max_element(),
                "{place:?}: {got} {want}"
            );
        }
    }
}
