//! These tests freeze the estimates by which lights are chosen. They affect only the noise, so that
//! no other test notices a formula that is slightly wrong.

use crate::choices::{mixed, receivers};
use linelit_geometry::DVec3;
use linelit_lights::Light;
use linelit_selection::bsdf::microfacet::TrowbridgeReitz;
use linelit_selection::bsdf::{Bsdf, Fresnel, Layers, Lobe, Reflector};
use linelit_selection::{
    Estimated, LightTree, LtcReceiver, can_contribute, diffuse, reflecting, unshadowed,
    unshadowed_at_center,
};
use linelit_testkit::assert_close;

/// Rough and diffuse.
fn surface() -> Bsdf {
    let mut layers = Layers::new(DVec3::Z);
    layers.add_diffuse(DVec3::new(0.2, 0.3, 0.4));
    let facets = Reflector {
        reflectance: DVec3::splat(0.5),
        facets: TrowbridgeReitz::new([0.3, 0.6]),
        fresnel: Fresnel::Full,
    };
    assert!(layers.add(DVec3::ONE, Lobe::Reflector(facets)));
    Bsdf::from(layers)
}

/// Sums over 40 points: of three estimates for each kind of light, and of all lights' numbers by
/// their probabilities for each way to choose. The same bits everywhere but for the order of sums.
#[test]
fn estimates_are_frozen() {
    let lights = mixed(20, 5);
    let bsdf = surface();
    let tree = LightTree::new(&lights);
    let (mut by_kind, mut by_choice) = ([[0.0; 3]; 5], [[0.0; 2]; 2]);
    for (x, n) in receivers(40) {
        let wo = (n + n.any_orthonormal_vector() * 0.7).normalize();
        let cosines = LtcReceiver::new(&bsdf, x, n, wo);
        let points = reflecting(&bsdf, x, n, wo);
        let estimate = |light: &Light| unshadowed(light, &points, [0.3, 0.7]);
        for (i, light) in lights.iter().enumerate() {
            let all = [
                estimate(light),
                unshadowed_at_center(light, &points),
                cosines.light(light),
            ];
            for (sum, value) in by_kind[i % 5].iter_mut().zip(all) {
                *sum += value;
            }
        }
        let mut buffers = [[0.0; 20]; 2];
        let possible = |i: usize| can_contribute(&lights[i], x, n);
        let [random, centre] = &mut buffers;
        let estimated = [
            Estimated::new(random, |i| estimate(&lights[i]), possible),
            Estimated::new(
                centre,
                |i| unshadowed_at_center(&lights[i], &points),
                possible,
            ),
        ];
        for i in 0..lights.len() {
            let number = (i * i) as f64;
            for (sum, estimated) in by_choice[1].iter_mut().zip(&estimated) {
                *sum += number * estimated.probability(i);
            }
            let sum = &mut by_choice[0];
            sum[0] += number * tree.probability(|i| &lights[i], &diffuse(x, n), i);
            sum[1] += number * tree.probability(|i| &lights[i], &cosines.receiver(), i);
        }
    }
    for (k, (got, want)) in by_kind
        .iter()
        .flatten()
        .zip(BY_KIND.iter().flatten())
        .enumerate()
    {
        assert_close!(*got, *want, rel = 1e-11, "{k}: {by_kind:?}");
    }
    for (k, (got, want)) in by_choice
        .iter()
        .flatten()
        .zip(BY_CHOICE.iter().flatten())
        .enumerate()
    {
        assert_close!(*got, *want, rel = 1e-11, "{k}: {by_choice:?}");
    }
}

/// An estimate by a random point, one by the centre and that by transformed cosines, of triangles,
/// lines, spheres, cylinders and disks.
const BY_KIND: [[f64; 3]; 5] = [
    [
        0.001_351_389_748_442_223,
        0.001_340_545_129_317_326_7,
        0.001_398_863_446_479_405_3,
    ],
    [
        0.009_479_117_256_755_792,
        0.009_599_139_024_627_437,
        0.010_433_792_010_408_65,
    ],
    [
        0.412_492_820_031_873_9,
        0.338_606_016_546_282_25,
        0.297_918_223_086_733_8,
    ],
    [
        0.036_450_175_140_912_21,
        0.016_534_265_276_245_02,
        0.026_727_627_948_667_412,
    ],
    [
        0.028_132_450_147_570_043,
        0.027_688_786_781_224_932,
        0.027_674_319_218_085_17,
    ],
];

/// Of a diffuse surface and the rough one by the tree; by estimates at random points and at
/// centres.
const BY_CHOICE: [[f64; 2]; 2] = [
    [3_784.423_953_463_469_4, 3_878.071_958_920_473_7],
    [3_843.387_791_217_844, 3_874.701_762_771_065_7],
];
