//! The vector kernels, written once for any width of register.
//!
//! Every operation takes K registers at once: independent chains of operations side by side keep
//! the processor busy, where a single one would mostly wait for its roots and quotients. Each
//! operation is that of the scalar twin in the same order, without fused operations, so the bits
//! are the same.
//!
//! No closures: they do not inherit the instruction set, and every operation in them would be a
//! call.

/// Four terms of a polynomial, from the coefficient i on. A macro, for a constant stays a constant:
/// as an argument the coefficients were gathered in a register and taken apart again.
macro_rules! four {
    ($c:expr, $i:expr, $x:expr, $x2:expr) => {{
        const C: [f64; 4] = [$c[$i], $c[$i + 1], $c[$i + 2], $c[$i + 3]];
        add(
            add(splat(C[0]), mul(splat(C[1]), $x)),
            mul(add(splat(C[2]), mul(splat(C[3]), $x)), $x2),
        )
    }};
}
pub(super) use four;

/// Everything that is built from the elementary operations of a width.
macro_rules! kernels {
    ($feature:literal) => {
        /// Registers in a round of segments.
        const LINES: usize = 1;
        type W = [V; LINES];
        /// Nodes of a group and of a pair, and lanes of a round.
        const GROUP: usize = 3 * WIDTH;
        const PAIR: usize = 2 * WIDTH;
        const ROUND: usize = LINES * WIDTH;

        /// x·a + y·b + z·c, from the left.
        #[inline]
        #[target_feature(enable = $feature)]
        fn dot(a: [W; 3], b: [W; 3]) -> W {
            add(add(mul(a[0], b[0]), mul(a[1], b[1])), mul(a[2], b[2]))
        }

        /// What the first half of the twin of [`ordinary`](crate::ordinary) hands to the second.
        #[derive(Clone, Copy)]
        struct Seen {
            dot: W,
            square: W,
            product: W,
            sum: W,
            lever: W,
            scale: W,
            /// Its sign is set where the result may not be trusted.
            doubt: W,
            /// A bit for each lane that is a number.
            number: u32,
        }

        /// Dot products, tests and roots.
        #[inline]
        #[target_feature(enable = $feature)]
        fn see<const MODEL: u8>(p0: [W; 3], p1: [W; 3], n: [W; 3], [least, near]: [W; 2]) -> Seen {
            let (a, b, d) = (dot(p0, p0), dot(p1, p1), dot(p0, p1));
            let square = mul(a, b);
            let product = if MODEL == POINT_LINE {
                splat(0.0)
            } else {
                sqrt(square)
            };
            let e = [sub(p1[0], p0[0]), sub(p1[1], p0[1]), sub(p1[2], p0[2])];
            let length2 = dot(e, e);
            let (c0, c1) = (dot(n, p0), dot(n, p1));
            let (low, far) = (min(c0, c1), max(a, b));
            let low2 = mul(low, low);
            // Differences that are not negative, by their signs: sums have pipes of their own.
            let mut doubt = or(
                or(low, sub(low2, mul(least, far))),
                or(sub(low2, near), sub(splat(FAR), far)),
            );
            let mut seen = Seen {
                dot: d,
                square,
                product,
                sum: add(c0, c1),
                lever: add(mul(c0, sub(b, d)), mul(c1, sub(a, d))),
                scale: length2,
                doubt: low,
                number: 0,
            };
            if MODEL == POINT_LINE {
                let (r0, r1) = (sqrt(a), sqrt(b));
                seen.product = mul(r0, r1);
                seen.sum = add(mul(c0, r1), mul(c1, r0));
            }
            if MODEL == CYLINDER {
                let x = [
                    sub(mul(p0[1], e[2]), mul(p0[2], e[1])),
                    sub(mul(p0[2], e[0]), mul(p0[0], e[2])),
                    sub(mul(p0[0], e[1]), mul(p0[1], e[0])),
                ];
                seen.scale = dot(x, x);
                doubt = or(doubt, sub(seen.scale, mul(splat(CLEAR), mul(a, length2))));
            }
            seen.doubt = doubt;
            seen.number = at_least(length2, splat(SHORT));
            seen
        }

        /// The cosine (in the place of the dot product) and the root of the scale.
        #[inline]
        #[target_feature(enable = $feature)]
        fn turn<const MODEL: u8>(mut seen: Seen) -> Seen {
            seen.scale = sqrt(seen.scale);
            if MODEL == POINT_LINE {
                let narrow = sub(seen.dot, mul(splat(LEAST_COSINE), seen.product));
                seen.number &= !signs(or(seen.doubt, narrow));
                seen.dot = mul(seen.product, add(seen.product, seen.dot));
            } else {
                seen.dot = div(seen.dot, seen.product);
                let narrow = sub(seen.dot, splat(LEAST_COSINE));
                seen.number &= !signs(or(seen.doubt, narrow));
            }
            seen
        }

        /// Polynomials and the quotient: the values.
        #[inline]
        #[target_feature(enable = $feature)]
        fn finish<const MODEL: u8>(seen: Seen) -> W {
            if MODEL == POINT_LINE {
                return div(mul(seen.scale, seen.sum), seen.dot);
            }
            let s = add(splat(1.0), seen.dot);
            let s2 = mul(s, s);
            let s4 = mul(s2, s2);
            // The last coefficient of the numerator is zero, and its product as well.
            let high = add(
                add(splat(OVER[4]), mul(splat(OVER[5]), s)),
                mul(splat(OVER[6]), s2),
            );
            let over = add(four!(OVER, 0, s, s2), mul(high, s4));
            let under = add(four!(UNDER, 0, s, s2), mul(four!(UNDER, 4, s, s2), s4));
            let below = mul(seen.product, under);
            let sum = add(mul(seen.sum, below), mul(seen.lever, over));
            div(mul(seen.scale, sum), mul(seen.square, below))
        }

        #[target_feature(enable = $feature)]
        pub(in crate::simd) fn ribbons(
            columns: &Columns<'_>,
            n: DVec3,
            out: &mut [f64],
            trusted: &mut [u8; BLOCK / 8],
        ) {
            lines::<RIBBON>(columns, n, out, trusted)
        }

        #[target_feature(enable = $feature)]
        pub(in crate::simd) fn cylinders(
            columns: &Columns<'_>,
            n: DVec3,
            out: &mut [f64],
            trusted: &mut [u8; BLOCK / 8],
        ) {
            lines::<CYLINDER>(columns, n, out, trusted)
        }

        #[target_feature(enable = $feature)]
        pub(in crate::simd) fn point_lines(
            columns: &Columns<'_>,
            n: DVec3,
            out: &mut [f64],
            trusted: &mut [u8; BLOCK / 8],
        ) {
            lines::<POINT_LINE>(columns, n, out, trusted)
        }

        /// Columns as long as `out`, a multiple of [`LANES`](super::super::LANES) of at most 64; a
        /// bit for each that is trusted. The roots of a round are taken while the last one is
        /// finished: a single chain of operations would mostly wait.
        #[inline]
        #[target_feature(enable = $feature)]
        fn lines<const MODEL: u8>(
            columns: &Columns<'_>,
            n: DVec3,
            out: &mut [f64],
            trusted: &mut [u8; BLOCK / 8],
        ) {
            let least = CLEAR * (n.x * n.x + n.y * n.y + n.z * n.z);
            if !(least < LONG_NORMAL) {
                trusted.fill(0);
                return;
            }
            // The ribbon's half is exact wherever it is taken: here, once.
            let half = if MODEL == RIBBON { 0.5 } else { 1.0 };
            let bounds = [splat(least * half * half), splat(NEAR * half * half)];
            let n = [splat(half * n.x), splat(half * n.y), splat(half * n.z)];
            let (out, _) = out.as_chunks_mut::<ROUND>();
            let rounds = out.len();
            if rounds == 0 {
                return;
            }
            let x0 = &columns[0].as_chunks::<ROUND>().0[..rounds];
            let y0 = &columns[1].as_chunks::<ROUND>().0[..rounds];
            let z0 = &columns[2].as_chunks::<ROUND>().0[..rounds];
            let x1 = &columns[3].as_chunks::<ROUND>().0[..rounds];
            let y1 = &columns[4].as_chunks::<ROUND>().0[..rounds];
            let z1 = &columns[5].as_chunks::<ROUND>().0[..rounds];
            let dark = Seen {
                dot: splat(0.0),
                square: splat(0.0),
                product: splat(0.0),
                sum: splat(0.0),
                lever: splat(0.0),
                scale: splat(0.0),
                doubt: splat(0.0),
                number: 0,
            };
            let (mut second, mut third) = (dark, dark);
            let marks = &mut trusted[..rounds * ROUND / 8];
            for i in 0..rounds + 2 {
                let from = i.min(rounds - 1);
                let p0 = [load(&x0[from]), load(&y0[from]), load(&z0[from])];
                let p1 = [load(&x1[from]), load(&y1[from]), load(&z1[from])];
                let done = finish::<MODEL>(third);
                let number = third.number;
                third = turn::<MODEL>(second);
                second = see::<MODEL>(p0, p1, n, bounds);
                // What has not been through all stages is overwritten later.
                let to = i.saturating_sub(2);
                store(done, &mut out[to]);
                mark(number, marks, to);
            }
        }

        /// exp, 0 below −700; with ten terms instead of twelve if `SHORT`.
        #[inline]
        #[target_feature(enable = $feature)]
        fn exp_bounded<const SHORT: bool, const K: usize>(x: [V; K]) -> [V; K] {
            let clamped = max(x, splat(-700.0));
            let shifted = add(mul(clamped, splat(std::f64::consts::LOG2_E)), splat(SHIFT));
            let n = sub(shifted, splat(SHIFT));
            let r = together(sub(
                sub(clamped, mul(n, splat(LN2_HIGH))),
                mul(n, splat(LN2_LOW)),
            ));
            let r2 = mul(r, r);
            let r4 = mul(r2, r2);
            let low = together(four!(INVERSE_FACTORIALS, 0, r, r2));
            let middle = four!(INVERSE_FACTORIALS, 4, r, r2);
            let high = if SHORT {
                add(
                    splat(INVERSE_FACTORIALS[8]),
                    mul(splat(INVERSE_FACTORIALS[9]), r),
                )
            } else {
                four!(INVERSE_FACTORIALS, 8, r, r2)
            };
            let tail = add(low, mul(together(add(middle, mul(high, r4))), r4));
            let mantissa = add(splat(1.0), add(r, mul(r2, tail)));
            zero_below(x, mul(mantissa, power_of_two(shifted)))
        }

        #[inline]
        #[target_feature(enable = $feature)]
        fn atanh_ratio<const K: usize>(q: [V; K]) -> [V; K] {
            let y = mul(q, q);
            let y2 = mul(y, y);
            let y4 = mul(y2, y2);
            let low = four!(ODD_RECIPROCALS, 0, y, y2);
            let middle = four!(ODD_RECIPROCALS, 4, y, y2);
            let high = four!(ODD_RECIPROCALS, 8, y, y2);
            add(low, mul(add(middle, mul(high, y4)), y4))
        }

        #[inline]
        #[target_feature(enable = $feature)]
        fn atanh_ratio_narrow<const K: usize>(q: [V; K]) -> [V; K] {
            let y = mul(q, q);
            let y2 = mul(y, y);
            let last = mul(splat(ODD_RECIPROCALS[4]), mul(y2, y2));
            add(four!(ODD_RECIPROCALS, 0, y, y2), last)
        }

        /// A factor at the nodes s, times 1 + t².
        #[inline]
        #[target_feature(enable = $feature)]
        fn factor<const K: usize>(
            [from, to]: [f64; 2],
            end: [V; K],
            wide: [V; K],
            s: [V; K],
        ) -> [V; K] {
            let one = splat(1.0);
            let near = mul(
                mul(sub(one, s), add(one, mul(end, mul(end, s)))),
                splat(from),
            );
            add(near, mul(mul(s, wide), splat(to)))
        }

        /// See [`Panel::terms`].
        #[target_feature(enable = $feature)]
        pub(in crate::simd) fn panel<const COUNT: usize>(
            shape: [f64; 2],
            factors: [[f64; 2]; COUNT],
            k: f64,
            terms: &mut [f64; NODES],
        ) {
            let (nodes, weights) = (NODE.as_chunks::<GROUP>().0, WEIGHT.as_chunks::<GROUP>().0);
            let (terms, _) = terms.as_chunks_mut::<GROUP>();
            for i in 0..NODES / GROUP {
                let (s, weight): ([V; 3], [V; 3]) = (load(&nodes[i]), load(&weights[i]));
                let [value, q] = node(shape, factors, s, weight);
                let depth = mul(mul(splat(-2.0 * k), q), atanh_ratio(q));
                store(mul(value, exp_bounded::<false, 3>(depth)), &mut terms[i]);
            }
        }

        /// See [`Panel::few_sum`].
        #[target_feature(enable = $feature)]
        #[allow(
            clippy::too_many_arguments,
            reason = "one by one they stay in registers"
        )]
        pub(in crate::simd) fn few<const COUNT: usize, const SLIM: bool>(
            half_tan: f64,
            slope: f64,
            a: f64,
            b: f64,
            c: f64,
            d: f64,
            k: f64,
            offset: f64,
        ) -> f64 {
            let mut factors = [[a, b]; COUNT];
            if COUNT == 2 {
                factors[COUNT - 1] = [c, d];
            }
            let shape = [half_tan, slope];
            let nodes = FEW_NODES.as_chunks::<PAIR>().0;
            let weights = FEW_WEIGHTS.as_chunks::<PAIR>().0;
            let mut sums: [V; 2] = splat(0.0);
            for i in 0..FEW / PAIR {
                let [value, q] = node(shape, factors, load(&nodes[i]), load(&weights[i]));
                let steep = mul(splat(-2.0 * k), q);
                // Where atanh needs five terms only.
                let depth = if SLIM {
                    together(mul(steep, atanh_ratio_narrow(q)))
                } else {
                    mul(steep, atanh_ratio(q))
                };
                let terms = mul(value, exp_bounded::<true, 2>(add(splat(offset), depth)));
                sums = if i == 0 { terms } else { add(sums, terms) };
            }
            total(sums)
        }

        /// The factors at the nodes s times the weights, and q.
        #[inline]
        #[target_feature(enable = $feature)]
        fn node<const K: usize, const COUNT: usize>(
            [half_tan, slope]: [f64; 2],
            factors: [[f64; 2]; COUNT],
            s: [V; K],
            weight: [V; K],
        ) -> [[V; K]; 2] {
            let one = splat(1.0);
            let (end, slope) = (splat(half_tan), splat(slope));
            let wide = add(one, mul(end, end));
            let t = mul(end, s);
            let (round, fall) = (add(one, mul(t, t)), sub(one, mul(slope, t)));
            let both = div(one, mul(round, fall));
            let q = together(mul(mul(mul(t, add(t, slope)), round), both));
            let inverse = mul(fall, both);
            let mut value = mul(mul(factor(factors[0], end, wide, s), inverse), inverse);
            if COUNT == 2 {
                value = mul(value, mul(factor(factors[1], end, wide, s), inverse));
            }
            [mul(weight, value), q]
        }
    };
}
pub(super) use kernels;
