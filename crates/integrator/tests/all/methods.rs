//! The methods that are listed for the lights on the materials of a scene.

use linelit_formats::LoadOptions;
use linelit_integrator::{Renderer, Settings, Spheres};

/// A matte floor, and a plastic wall behind which there is no light; two quads, one of which is
/// below the floor, a linear light and a sphere.
const SCENE: &str = r#"
    LookAt 0 -4 3  0 0 0  0 0 1
    Camera "perspective" "float fov" [ 50 ]
    WorldBegin
    AttributeBegin
        AreaLightSource "diffuse" "rgb L" [ 1 1 1 ]
        Shape "quad" "point o" [ -1 -1 5 ] "vector u" [ 0 1 0 ] "vector v" [ 1 0 0 ]
        Shape "quad" "point o" [ -1 -1 -5 ] "vector u" [ 0 1 0 ] "vector v" [ 1 0 0 ]
        Shape "line" "point3 p0" [ -1 -2 5 ] "point3 p1" [ 1 -2 5 ]
        Translate 0 -2 4
        Shape "sphere" "float radius" [ 0.5 ]
    AttributeEnd
    MakeNamedMaterial "floor" "string type" [ "matte" ]
    MakeNamedMaterial "wall" "string type" [ "plastic" ]
    NamedMaterial "floor"
    Shape "quad" "point o" [ -9 -9 0 ] "vector u" [ 18 0 0 ] "vector v" [ 0 18 0 ]
    NamedMaterial "wall"
    Shape "quad" "point o" [ -1 1 0 ] "vector u" [ 2 0 0 ] "vector v" [ 0 0 2 ]
"#;

#[test]
fn every_pair_says_what_it_gets() {
    let options = LoadOptions::default();
    let scene = linelit_formats::from_pbrt_str(SCENE, "room.pbrt", &options);
    let scene = scene.unwrap().scene;
    let renderer = Renderer::new(&scene);
    let said = |estimator: &str| {
        let settings = Settings {
            estimator: estimator.parse().unwrap(),
            spheres: Spheres::Exact,
            ..Settings::default()
        };
        let mut rows: Vec<_> = renderer
            .methods(&settings)
            .iter()
            .map(|row| {
                let name = |k: &u32| scene.materials[*k as usize].name.clone();
                let names: Vec<_> = row.materials.iter().map(name).collect();
                let (light, count) = (row.light, row.lights.len());
                format!("{count} {light}, {}: {}", names.join(", "), row.methods)
            })
            .collect();
        rows.sort();
        rows
    };
    let exact = [
        "1 line, floor: closed form over the visible part of the light",
        "1 line, wall: quadrature over the visible part of the light",
        "1 polygon, floor: closed form over the visible part of the light",
        "1 polygon, wall: closed form of transformed cosines over the visible part of the light, the \
         rest by 16 points as `point-ltc`, one shaft for all where nothing is between, else closed \
         form of transformed cosines over the visible part of the light, the rest by 16 points of \
         that part",
    ];
    let rows = said("exact");
    assert!(
        exact.iter().all(|row| rows.contains(&(*row).to_owned())),
        "{rows:#?}"
    );
    let combined = [
        "1 line, floor: closed form over the visible part of the light",
        "1 line, wall: quadrature over the visible part of the light",
        "1 polygon, floor, wall: 16 samples weighted among `point-area` and `point-bsdf`, one shaft for all",
        "1 sphere, floor, wall: 16 samples weighted among `point-area` and `point-bsdf`, one shaft \
         for all; past too many triangles to keep, 16 samples weighted among `point-area` and \
         `point-bsdf`, a shadow ray each",
    ];
    assert_eq!(said("point-area+point-bsdf"), combined);
}
