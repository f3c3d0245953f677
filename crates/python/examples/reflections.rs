//! A program that computes reflected radiance by the Rust library, for `tests/test_same_bits.py`.
//! `reflections FOLDER` reads points, normals and directions to the viewer from files, and writes
//! the radiance for each kind of reflection to a file of its name.

mod common;

use common::{Folder, soup};
use linelit::bsdf::microfacet::TrowbridgeReitz;
use linelit::bsdf::{
    Bsdf, Fresnel, Frostbite, Layers, Lobe, OrenNayar, Phong, Reflector, Substrate,
};
use linelit::geometry::DVec3;
use linelit::{Estimator, Light, Scene};
use std::error::Error;

/// Returns the reflections that the test makes in Python, with the diffuse part and the lobe of
/// each.
fn reflections() -> Vec<(&'static str, Layers)> {
    // Make the lobes, with the same numbers as in the test.
    let colour = DVec3::new(0.5, 0.4, 0.3);
    let (grey, facets) = (DVec3::splat(0.25), TrowbridgeReitz::new([0.2, 0.2]));
    let reflector = |reflectance, fresnel| {
        Lobe::Reflector(Reflector {
            reflectance,
            facets,
            fresnel,
        })
    };
    let phong = Lobe::Phong(Phong {
        specular: grey,
        exponent: 30.0,
    });
    let metal = Fresnel::Conductor {
        eta: DVec3::new(0.2, 0.9, 1.1),
        k: DVec3::new(3.9, 2.4, 2.2),
    };
    let substrate = Lobe::Substrate(Substrate {
        diffuse: colour,
        specular: grey,
        facets,
    });
    let schlick = Fresnel::Schlick {
        f0: colour,
        f90: 1.0,
    };
    let rough = Lobe::OrenNayar(OrenNayar::new(colour, 20_f64.to_radians()));
    let frostbite = Lobe::Frostbite(Frostbite::new(colour, grey, 0.4));
    // Combine them with diffuse parts.
    let of = |diffuse: DVec3, lobes: &[Lobe]| {
        let mut layers = Layers::new(DVec3::ZERO);
        layers.add_diffuse(diffuse);
        for lobe in lobes {
            assert!(layers.add(DVec3::ONE, *lobe), "few lobes");
        }
        layers
    };
    vec![
        ("lambert", of(colour, &[])),
        ("oren-nayar", of(DVec3::ZERO, &[rough])),
        ("phong", of(colour, &[phong])),
        ("metal", of(DVec3::ZERO, &[reflector(DVec3::ONE, metal)])),
        (
            "plastic",
            of(colour, &[reflector(grey, Fresnel::Dielectric { eta: 1.5 })]),
        ),
        (
            "microfacet",
            of(DVec3::ZERO, &[reflector(DVec3::ONE, schlick)]),
        ),
        ("substrate", of(DVec3::ZERO, &[substrate])),
        ("frostbite", of(DVec3::ZERO, &[frostbite])),
        ("sum", of(colour, &[rough, phong])),
    ]
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = Folder::of_arguments()?;
    let (vertices, points) = (folder.vectors("vertices")?, folder.vectors("points")?);
    let (normals, outgoing) = (folder.vectors("normals")?, folder.vectors("outgoing")?);
    let faces = soup(vertices.len())?;
    let lamp = Light::rectangle(
        [-1.0, -1.0, 2.0],
        [0.0, 2.0, 0.0],
        [2.0, 0.0, 0.0],
        [3.0, 2.0, 1.0],
    )?;
    let scene = Scene::builder_from(&vertices, &faces).seed(3).build()?;
    let scene = scene.with_lights([lamp])?;
    let scene = scene.with_method(Estimator::hybrid(), 4)?;
    for (name, layers) in reflections() {
        let bsdfs = vec![Bsdf::from(layers); points.len()];
        let mut found = vec![[0.0; 3]; points.len()];
        scene.radiances(&points, &normals, &bsdfs, &outgoing, &mut found)?;
        folder.write(name, found.as_flattened())?;
    }
    Ok(())
}
