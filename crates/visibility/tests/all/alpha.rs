//! Alpha masks: lines are compared with points, and extreme numbers are tried.

use crate::common::InSpace;
use linelit_geometry::intervals::Interval;
use linelit_testkit::{
    cases::cases,
    rng::SplitMix64,
    strategies::{hostile, hostile_unit},
};
use linelit_visibility::{
    AlphaCutoff, AlphaError, AlphaLookup, AlphaMask, AlphaTexels, AlphaWrap, Filter,
};
use proptest::prelude::*;
use std::sync::Arc;

const WRAPS: [AlphaWrap; 4] = [
    AlphaWrap::Repeat,
    AlphaWrap::Mirror,
    AlphaWrap::Clamp,
    AlphaWrap::Zero,
];

fn texels(rng: &mut SplitMix64) -> AlphaTexels {
    let (w, h) = (1 + rng.index(7), 1 + rng.index(7));
    let values = (0..w * h).map(|_| [0.0, 0.3, 0.5, 1.0][rng.index(4)]);
    let values = values.collect();
    let [w, h] = [w, h].map(|n| u32::try_from(n).unwrap());
    let cutoffs = [
        AlphaCutoff::Above(0.0),
        AlphaCutoff::Above(0.4),
        AlphaCutoff::AtLeast(0.5),
    ];
    AlphaTexels::new(w, h, values)
        .unwrap()
        .with_wrap([WRAPS[rng.index(4)], WRAPS[rng.index(4)]])
        .with_lookup([AlphaLookup::Nearest, AlphaLookup::Bilinear][rng.index(2)])
        .with_cutoff(cutoffs[rng.index(3)])
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(800), failure_persistence: None, ..ProptestConfig::default() })]

    /// At many points of a segment, the mask hides where its intervals say so, except next to their
    /// ends.
    #[test]
    fn lines_hide_where_points_do(seed in any::<u64>(), far in 0.1..6.0_f64) {
        let mut rng = SplitMix64::new(seed);
        let texels = Arc::new(texels(&mut rng));
        let mut corner = || [rng.in_range(-far, far), rng.in_range(-far, far)];
        let uv = [corner(), corner(), corner()];
        let mask = AlphaMask::new(texels.clone(), vec![uv]).unwrap();
        let mut place = || {
            let (b, c) = (rng.next_f64(), rng.next_f64());
            if b + c > 1.0 { [1.0 - b, 1.0 - c] } else { [b, c] }
        };
        let ends = [place(), place()];
        let mut hidden = Vec::new();
        mask.hides_along(0, ends, &mut hidden);
        prop_assert!(hidden.is_sorted_by(|a, b| a.lo < a.hi && a.hi < b.lo && b.lo < b.hi));
        prop_assert!(hidden.iter().all(|i| i.lo >= 0.0 && i.hi <= 1.0));
        for k in 0..100 {
            let s = (f64::from(k) + rng.next_f64()) / 100.0;
            let next_to = |x: f64| (x - s).abs() < 1e-9;
            if hidden.iter().any(|i| next_to(i.lo) || next_to(i.hi)) {
                continue;
            }
            let within = hidden.iter().any(|i| i.lo <= s && s <= i.hi);
            let at = [0, 1].map(|k| ends[0][k] * (1.0 - s) + ends[1][k] * s);
            prop_assert_eq!(mask.hides(0, at), within, "{} {:?}", s, hidden);
        }
    }

    /// Numbers of any size, and NaN: no panic, no interval outside of the segment, and no endless
    /// walk.
    #[test]
    fn hostile_numbers(
        v in prop::array::uniform6(hostile()),
        ends in prop::array::uniform4(prop_oneof![hostile(), hostile_unit()]),
        seed in any::<u64>(),
    ) {
        let mut rng = SplitMix64::new(seed);
        let texels = Arc::new(texels(&mut rng));
        let _ = (texels.alpha([v[0], v[1]]), texels.hides([v[2], v[3]]));
        let [a, b, c, d] = ends;
        // At most some thousands of texels, so that the walk along them takes little time.
        let uv = [[v[0], v[1]], [v[2], v[3]], [v[4], v[5]]];
        let near = uv.map(|uv| uv.map(|x| if x.abs() > 1e3 { 1e3_f64.copysign(x) } else { x }));
        let finite = near.as_flattened().iter().all(|x| x.is_finite());
        let mask = AlphaMask::new(texels.clone(), vec![near]);
        prop_assert_eq!(mask.is_ok(), finite);
        let Ok(mask) = mask else { return Ok(()) };
        let mut hidden: Vec<Interval> = Vec::new();
        mask.hides_along(0, [[a, b], [c, d]], &mut hidden);
        prop_assert!(hidden.iter().all(|i| i.lo >= 0.0 && i.lo < i.hi && i.hi <= 1.0));
        let _ = mask.hides(0, [a, b]);
        prop_assert!(mask.hides(1, [a, b]));
    }
}

/// A grid of one texel has the same alpha everywhere, with any lookup. Grids without texels, values
/// that are not finite, and coordinates too far out to resolve texels are refused.
#[test]
fn edges_of_what_is_accepted() {
    for (value, hides) in [(0.0, false), (1e-30, true), (1.0, true)] {
        let one = AlphaTexels::new(1, 1, vec![value]).unwrap();
        assert_eq!(one.hides([0.3, 17.5]), hides);
        let far = [[-2e6, 0.0], [2e6, 1.0], [0.0, 3.0]];
        let mask = AlphaMask::new(Arc::new(one), vec![far]).unwrap();
        let mut hidden = Vec::new();
        mask.hides_along(0, [[0.5, 0.25], [0.51, 0.25]], &mut hidden);
        assert_eq!(hidden == [Interval::UNIT], hides);
    }
    let new = |w, h, n| AlphaTexels::new(w, h, vec![1.0; n]).err();
    assert_eq!(new(0, 0, 0), Some(AlphaError::Size));
    assert_eq!(new(2, 2, 3), Some(AlphaError::Size));
    assert_eq!(new(u32::MAX, u32::MAX, 1), Some(AlphaError::Size));
    let nan = AlphaTexels::new(1, 1, vec![f32::NAN]).unwrap_err();
    assert_eq!(nan, AlphaError::Value);
    let texels = Arc::new(AlphaTexels::new(2, 2, vec![1.0; 4]).unwrap());
    let far = [[0.0, 0.0], [1e7, 0.0], [0.0, 0.0]];
    let error = AlphaMask::new(texels, vec![[[0.0; 2]; 3], far]).unwrap_err();
    assert_eq!(error, AlphaError::Coordinates { triangle: 1 });
    assert!(error.to_string().contains("triangle 1"));
}

/// pbrt cuts out what is exactly zero; glTF what is below its cutoff. Bilinear lookups are exact
/// where all four texels are the same.
#[test]
fn cutoffs_are_those_of_pbrt_and_gltf() {
    let at = |value: f32, cutoff| {
        let texels = AlphaTexels::new(3, 1, vec![value; 3]).unwrap();
        texels.with_cutoff(cutoff).hides([0.41, 0.77])
    };
    let (pbrt, gltf) = (AlphaCutoff::default(), AlphaCutoff::AtLeast(0.5));
    assert_eq!([at(0.0, pbrt), at(f32::MIN_POSITIVE, pbrt)], [false, true]);
    assert_eq!([at(0.499_999_97, gltf), at(0.5, gltf)], [false, true]);
}
