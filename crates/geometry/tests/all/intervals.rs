//! Both interval sets, compared with each other and with a dense grid.

use linelit_geometry::intervals::{Interval, IntervalSet, IntervalTree, VisibleSet};
use proptest::prelude::*;

fn pieces(set: &impl VisibleSet) -> Vec<Interval> {
    let mut out = Vec::new();
    set.for_each(|i| out.push(i));
    out
}

/// Random clips. Those on a coarse lattice often meet end to end; others are a few ulps apart.
fn clips() -> impl Strategy<Value = Vec<(f64, f64)>> {
    let end = prop_oneof![
        (0u32..33).prop_map(|k| f64::from(k) / 32.0),
        -0.5..1.5f64,
        (0u32..33, -3i64..4).prop_map(|(k, ulps)| {
            let v = f64::from(k) / 32.0;
            f64::from_bits(v.to_bits().saturating_add_signed(ulps))
        }),
    ];
    let clip = (end.clone(), end, any::<bool>()).prop_map(|(a, b, short)| {
        let (lo, hi) = if a < b { (a, b) } else { (b, a) };
        (lo, if short { hi.min(lo + 0.01) } else { hi })
    });
    prop::collection::vec(clip, 0..60)
}

proptest! {
    #[test]
    fn flat_and_tree_agree_to_the_bit(clips in clips()) {
        let (mut flat, mut tree) = (IntervalSet::full(), IntervalTree::full());
        for &(lo, hi) in &clips {
            flat.clip(lo, hi);
            tree.clip(lo, hi);
            prop_assert_eq!(pieces(&flat), pieces(&tree));
            prop_assert_eq!(flat.count(), tree.count());
            prop_assert_eq!(flat.is_empty(), tree.is_empty());
        }
    }

    #[test]
    fn order_does_not_matter(clips in clips(), rotate in 0usize..60) {
        let mut a = IntervalSet::full();
        clips.iter().for_each(|&(lo, hi)| a.clip(lo, hi));
        let mut turned = clips.clone();
        if !turned.is_empty() {
            let mid = rotate % turned.len();
            turned.rotate_left(mid);
            turned.reverse();
        }
        let mut b = IntervalSet::full();
        turned.iter().for_each(|&(lo, hi)| b.clip(lo, hi));
        prop_assert_eq!(pieces(&a), pieces(&b));
    }

    #[test]
    fn agrees_with_a_dense_grid(clips in clips()) {
        let mut set = IntervalSet::full();
        clips.iter().for_each(|&(lo, hi)| set.clip(lo, hi));
        for k in 0..4096u32 {
            // Grid points avoid the lattice of the clips, and no clip ends within 4 eps of one.
            let t = (f64::from(k) + 0.387) / 4096.0;
            let hidden = clips.iter().any(|&(lo, hi)| lo < t && t < hi);
            let visible = set.as_slice().iter().any(|i| i.lo <= t && t <= i.hi);
            let near = clips.iter().any(|&(lo, hi)| (lo - t).abs() < 1e-12 || (hi - t).abs() < 1e-12);
            prop_assert!(near || hidden != visible, "t = {t}");
        }
    }

    #[test]
    fn tree_stays_balanced(seed in any::<u64>()) {
        let mut tree = IntervalTree::full();
        let mut state = seed | 1;
        let n = 2000u32;
        for _ in 0..n {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let lo = f64::from(u32::try_from(state >> 32).unwrap()) / 4_294_967_296.0;
            tree.clip(lo, lo + 1e-4);
        }
        // An AVL tree of n nodes is at most 1.4405 log2(n + 2) high.
        let bound = 1.4405 * f64::from(u32::try_from(tree.count() + 2).unwrap()).log2();
        prop_assert!(f64::from(u32::try_from(tree.depth()).unwrap()) <= bound);
    }
}

#[test]
fn closed_ends_that_meet_leave_nothing() {
    let mut set = IntervalSet::full();
    set.clip(0.0, 0.3);
    set.clip(0.3, 1.0);
    assert!(set.is_empty());
    let mut tree = IntervalTree::full();
    tree.clip(0.3, 1.0);
    tree.clip(0.0, 0.3);
    assert!(tree.is_empty());
    tree.reset();
    assert_eq!(tree.count(), 1);
}
