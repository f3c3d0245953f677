//! These tests measure how fast errors fall: exact variances where theory gives them, and slopes
//! where it gives rates (the table of variance exponents in the crate's README).

use linelit_samplers::{SampleSet, Sampler, SamplerKind};
use linelit_testkit::chi2::sidak;
use linelit_testkit::rng::SplitMix64;
use linelit_testkit::ztest::{Welford, critical_z, z_score_two};

/// All tests of this file together err with probability 0.01 at most; there are fewer than this
/// many.
const TESTS: usize = 200;

/// Squared errors of the estimate of ∫f over `trials` seeds; `f` may depend on the trial, and comes
/// with its integral.
fn squared_errors<F: Fn([f64; 2]) -> f64>(
    kind: SamplerKind,
    n: u32,
    trials: u64,
    make: impl Fn(u64) -> (F, f64),
) -> Welford {
    let error = |trial| {
        let (f, integral) = make(trial);
        mean(samples(kind, n, trial).iter_2d().map(f)) - integral
    };
    (0..trials).map(|trial| error(trial).powi(2)).collect()
}

/// As [`squared_errors`], in one dimension.
fn squared_errors_1d<F: Fn(f64) -> f64>(
    kind: SamplerKind,
    n: u32,
    trials: u64,
    make: impl Fn(u64) -> (F, f64),
) -> Welford {
    let error = |trial| {
        let (f, integral) = make(trial);
        mean(samples(kind, n, trial).iter_1d().map(f)) - integral
    };
    (0..trials).map(|trial| error(trial).powi(2)).collect()
}

fn samples(kind: SamplerKind, n: u32, seed: u64) -> SampleSet {
    Sampler::new(kind, seed).points([11, 13], 2, n)
}

fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let n = values.len() as f64;
    values.sum::<f64>() / n
}

fn assert_variance(got: &Welford, expected: f64, name: &str) {
    let z = got.z_score(expected);
    assert!(
        z.abs() < critical_z(sidak(0.01, TESTS)),
        "{name}: variance {:e}, expected {expected:e}, z = {z}",
        got.mean()
    );
}

/// f(x) = x: 1/(12 N³) with one independent point per stratum (at N = 2^m that is what
/// Owen-scrambled points are, too), 1/(12 N²) with a common offset, 1/(12 N) independent.
#[test]
fn variances_of_a_ramp() {
    use SamplerKind::{Halton, Independent, MultiJitter, Sobol, Stratified, UniformJitter, ZSobol};
    for n in [1_u32, 2, 4, 16, 64, 256, 1024] {
        for (kind, power) in [
            (Independent, 1),
            (UniformJitter, 2),
            (Stratified, 3),
            (MultiJitter, 3),
            (Sobol, 3),
            (Halton, 3),
            (ZSobol, 3),
        ] {
            let got = squared_errors_1d(kind, n, 5_000, |_| (|x| x, 0.5));
            assert_variance(
                &got,
                1.0 / (12.0 * f64::from(n).powi(power)),
                &format!("{kind}, N = {n}"),
            );
        }
    }
    for n in [3_u32, 7, 97] {
        for (kind, power) in [(UniformJitter, 2), (Stratified, 3), (MultiJitter, 3)] {
            let got = squared_errors_1d(kind, n, 5_000, |_| (|x| x, 0.5));
            assert_variance(
                &got,
                1.0 / (12.0 * f64::from(n).powi(power)),
                &format!("{kind}, N = {n}"),
            );
        }
    }
}

/// A jump at a random position c: one stratum is cut in the ratio p : 1 − p with p uniform, E[p(1 −
/// p)] = 1/6, so that for any N the variance is 1/(6 N²) for all stratified patterns and for
/// uniform jitter, and 1/(6 N) for independent samples.
#[test]
fn variances_of_a_jump() {
    use SamplerKind::{Independent, MultiJitter, Sobol, Stratified, UniformJitter};
    let jump = |trial: u64| {
        let c = SplitMix64::new(trial ^ 0xABCD).next_f64();
        (move |x: f64| f64::from(u8::from(x < c)), c)
    };
    for n in [1_u32, 4, 64, 1024] {
        for (kind, power) in [
            (Independent, 1),
            (UniformJitter, 2),
            (Stratified, 2),
            (MultiJitter, 2),
            (Sobol, 2),
        ] {
            let got = squared_errors_1d(kind, n, 10_000, jump);
            assert_variance(
                &got,
                1.0 / (6.0 * f64::from(n).powi(power)),
                &format!("{kind}, N = {n}"),
            );
        }
    }
}

/// A kink |x − c| at a random place c: N − 1 strata see a ramp, of variance 1/(12 N²); in the
/// stratum with the kink, at a uniform place, it is 1/(20 N²) (from E = ∫(p³ + (1 − p)³)/3 − ((p² +
/// (1 − p)²)/2)² dp = 1/6 − 7/60).
#[test]
fn variances_of_a_kink() {
    let kink = |trial: u64| {
        let c = SplitMix64::new(trial ^ 0x1234).next_f64();
        (
            move |x: f64| (x - c).abs(),
            0.5 * (c * c + (1.0 - c) * (1.0 - c)),
        )
    };
    for n in [1_u32, 4, 64, 1024] {
        for kind in [
            SamplerKind::Stratified,
            SamplerKind::MultiJitter,
            SamplerKind::Sobol,
            SamplerKind::Halton,
        ] {
            let got = squared_errors_1d(kind, n, 10_000, kink);
            let n = f64::from(n);
            assert_variance(
                &got,
                ((n - 1.0) / 12.0 + 0.05) / n.powi(4),
                &format!("{kind}, N = {n}"),
            );
        }
    }
}

/// An endpoint with infinite slope, √x: the variance of a stratum [a, b] is its midpoint minus the
/// squared mean 2(b^1.5 − a^1.5)/(3(b − a)); their sum falls as N⁻³ log N.
#[test]
fn variances_of_a_root() {
    for n in [1_u32, 4, 64, 1024] {
        let within = |k: u32| {
            let (a, b) = (f64::from(k) / f64::from(n), f64::from(k + 1) / f64::from(n));
            // (b^1.5 − a^1.5)/(b − a) = (a + √(ab) + b)/(√a + √b); the difference cancels about
            // 1/(12k²) of the values, 10⁸ ε at k = 1024, far below the Monte Carlo error.
            let mean = 2.0 / 3.0 * (a + (a * b).sqrt() + b) / (a.sqrt() + b.sqrt());
            0.5 * (a + b) - mean * mean
        };
        let expected = (0..n).map(within).sum::<f64>() / f64::from(n).powi(2);
        for kind in [
            SamplerKind::Stratified,
            SamplerKind::MultiJitter,
            SamplerKind::Sobol,
            SamplerKind::Halton,
        ] {
            let got = squared_errors_1d(kind, n, 10_000, |_| (f64::sqrt, 2.0 / 3.0));
            assert_variance(&got, expected, &format!("{kind}, N = {n}"));
        }
    }
}

/// f = xy on cells of a×b: with local coordinates a cell of width w and height h at centre (cx, cy)
/// has variance (cx² h² + cy² w²)/12 + w²h²/144; the mean over the grid of cx² is 1/3 − w²/12,
/// likewise for y.
#[test]
fn variances_of_a_product_on_grids() {
    for (n, columns, rows) in [
        (1_u32, 1, 1),
        (2, 2, 1),
        (4, 2, 2),
        (8, 4, 2),
        (12, 4, 3),
        (64, 8, 8),
        (1024, 32, 32),
    ] {
        let (w, h) = (1.0 / f64::from(columns), 1.0 / f64::from(rows));
        let (cx, cy) = (1.0 / 3.0 - w * w / 12.0, 1.0 / 3.0 - h * h / 12.0);
        let cell = (cx * h * h + cy * w * w) / 12.0 + w * w * h * h / 144.0;
        let got = squared_errors(SamplerKind::Stratified, n, 10_000, |_| {
            (|[x, y]| x * y, 0.25)
        });
        assert_variance(&got, cell / f64::from(n), &format!("stratified, N = {n}"));
        // The sum x + y is additive: multi-jittered points stratify each axis N-fold, 2/(12 N³).
        let got = squared_errors(SamplerKind::MultiJitter, n, 10_000, |_| {
            (|[x, y]| x + y, 1.0)
        });
        assert_variance(
            &got,
            1.0 / (6.0 * f64::from(n).powi(3)),
            &format!("multijitter, N = {n}"),
        );
    }
    // Uniform jitter shifts x as a whole, by (ξ − ½)/N, and y's points are fract(ζ + j/φ): with the
    // Bernoulli polynomial B₂, E[(fract(ζ + a) − ½)(fract(ζ + b) − ½)] = B₂(fract(a − b))/2.
    for n in [1_u32, 3, 16, 100, 1024] {
        let bernoulli = |t: f64| t * t - t + 1.0 / 6.0;
        let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
        let pairs = (0..n).flat_map(|j| (0..n).map(move |k| f64::from(j.abs_diff(k))));
        let y = pairs.map(|d| bernoulli((d * golden).fract())).sum::<f64>() / 2.0;
        let got = squared_errors(SamplerKind::UniformJitter, n, 10_000, |_| {
            (|[x, y]| x + y, 1.0)
        });
        let expected = (1.0 / 12.0 + y) / f64::from(n).powi(2);
        assert_variance(&got, expected, &format!("uniform-jitter, N = {n}"));
    }
}

/// Equal cells for any N: a ramp in x + y has the mean cell variance of the bricks, (w² + h²)/12
/// each.
#[test]
fn variances_of_a_ramp_on_bricks() {
    for (n, sizes) in [
        (3_u32, vec![1, 2]),
        (5, vec![2, 3]),
        (7, vec![2, 2, 3]),
        (13, vec![3, 3, 3, 4]),
    ] {
        let area = 1.0 / f64::from(n);
        let per_cell = |&columns: &u32| {
            let (w, h) = (1.0 / f64::from(columns), f64::from(columns) * area);
            f64::from(columns) * (w * w + h * h) / 12.0
        };
        let expected = sizes.iter().map(per_cell).sum::<f64>() * area * area;
        let got = squared_errors(SamplerKind::Stratified, n, 20_000, |_| {
            (|[x, y]| x + y, 1.0)
        });
        assert_variance(&got, expected, &format!("N = {n}"));
    }
}

/// Weighted least-squares slope of ln variance over ln N, with its standard error; weights
/// 1/(relative standard error)².
fn slope(points: &[(u32, Welford)]) -> (f64, f64) {
    let rows: Vec<[f64; 3]> = points
        .iter()
        .map(|(n, w)| {
            [
                f64::from(*n).ln(),
                w.mean().ln(),
                (w.mean() / w.standard_error()).powi(2),
            ]
        })
        .collect();
    let total: f64 = rows.iter().map(|r| r[2]).sum();
    let mean = |k: usize| rows.iter().map(|r| r[2] * r[k]).sum::<f64>() / total;
    let (x, y) = (mean(0), mean(1));
    let xx: f64 = rows.iter().map(|r| r[2] * (r[0] - x).powi(2)).sum();
    let xy: f64 = rows.iter().map(|r| r[2] * (r[0] - x) * (r[1] - y)).sum();
    (xy / xx, 1.0 / xx.sqrt())
}

/// The exponent must lie between `steepest` and `flattest`, up to its own standard error.
fn assert_slope(points: &[(u32, Welford)], steepest: f64, flattest: f64, name: &str) {
    let (slope, error) = slope(points);
    let margin = critical_z(sidak(0.01, TESTS)) * error;
    assert!(
        slope > steepest - margin && slope < flattest + margin,
        "{name}: exponent {slope} ± {error}, expected {steepest} to {flattest}"
    );
}

/// A disc of radius 0.3 at a random place of the torus: a jump along all directions, without end
/// effects at the border.
fn random_disc(trial: u64) -> (impl Fn([f64; 2]) -> f64, f64) {
    let mut rng = SplitMix64::new(trial ^ 0x5EED);
    let (cx, cy) = (rng.next_f64(), rng.next_f64());
    let torus = |d: f64| d.abs().min(1.0 - d.abs());
    let inside =
        move |[x, y]: [f64; 2]| f64::from(u8::from(torus(x - cx).hypot(torus(y - cy)) < 0.3));
    (inside, 0.09 * std::f64::consts::PI)
}

/// Rates in two dimensions. A grid's relative deviation from its asymptotic law is O(1/√N) (cells
/// at the border and at the ends of an edge), so exponents are compared with the range of slopes of
/// N^−r(1 ± ½N^−½) over the N used.
#[test]
fn rates_in_two_dimensions() {
    use SamplerKind::{Halton, Independent, MultiJitter, Sobol, Stratified, UniformJitter, ZSobol};
    let ns = [64_u32, 256, 1024, 4096];
    let smooth = |_| (|[x, y]: [f64; 2]| (x * y).exp(), 1.317_902_151_454_403_9);
    let kink = |_| (|[x, y]: [f64; 2]| (x + y - 1.0).max(0.0), 1.0 / 6.0);
    let nets = -3.0 + (4096.0_f64.ln() / 64.0_f64.ln()).ln() / 64.0_f64.ln();
    let lattices = nets + 1.0;
    let spread = 0.5 * 0.5 * (1.0 / 8.0 - 1.0 / 64.0) / (64.0_f64.ln() / 2.0);
    for (kind, rates) in [
        (Independent, [(-1.0, -1.0); 3]),
        (Stratified, [(-2.0, -2.0), (-2.0, -2.0), (-1.5, -1.5)]),
        // Axis-wise strata remove the additive part of the variance, N⁻³; what remains is N⁻².
        (MultiJitter, [(-3.0, -2.0), (-3.0, -2.0), (-1.5, -1.5)]),
        // N⁻³(1 + a log N) with any a ≥ 0; for the kink no theorem, but measured −2.45 to −2.5 to N
        // = 1024.
        (Sobol, [(-3.0, nets), (-2.55, -2.45), (-1.55, -1.5)]),
        (ZSobol, [(-3.0, nets), (-2.55, -2.45), (-1.55, -1.5)]),
        // One shift of a lattice: N⁻²(1 + a log N); at jumps N^−1.5 with a factor that swings with
        // N (the few shortest vectors of the dual lattice carry the error), so that four N show a
        // bound only.
        (
            UniformJitter,
            [(-2.0, lattices), (-2.0, lattices), (-2.0, -1.5)],
        ),
        // No common period of the bases 2 and 3: no better than a grid, on average over N.
        (Halton, [(-2.5, -2.0), (-2.5, -2.0), (-1.55, -1.5)]),
    ] {
        let fit = |integrand: usize| -> Vec<(u32, Welford)> {
            ns.map(|n| {
                let trials = 400_000 / u64::from(n).max(400);
                let errors = match integrand {
                    0 => squared_errors(kind, n, trials, smooth),
                    1 => squared_errors(kind, n, trials, kink),
                    _ => squared_errors(kind, n, trials, random_disc),
                };
                (n, errors)
            })
            .to_vec()
        };
        for (integrand, name) in ["smooth", "kink", "jump"].iter().enumerate() {
            let (steep, flat) = rates[integrand];
            assert_slope(
                &fit(integrand),
                steep - spread,
                flat + spread,
                &format!("{kind}, {name}"),
            );
        }
    }
}

/// Our nets have the variance of sobol_burley's nets, for smooth and discontinuous integrands: two
/// independent means of squared errors.
#[test]
fn nets_are_as_good_as_sobol_burley() {
    let trials = 10_000;
    for n in [16_u32, 64, 256] {
        let theirs = |f: &dyn Fn([f64; 2]) -> f64, integral: f64, seed: u64| {
            let seed = u32::try_from(seed * 31 + 7).expect("few trials");
            let points =
                (0..n).map(|i| [0, 1].map(|d| f64::from(sobol_burley::sample(i, d, seed))));
            // Their 23 bits round down by 2⁻²⁴ on average; here the bias is far below the error.
            let middle = points.map(|p| p.map(|v| v + 0.5 / f64::from(1 << 23)));
            (middle.map(f).sum::<f64>() / f64::from(n) - integral).powi(2)
        };
        let smooth = |[x, y]: [f64; 2]| (x * y).exp();
        let ours = squared_errors(SamplerKind::Sobol, n, trials, |_| {
            (smooth, 1.317_902_151_454_403_9)
        });
        let burley: Welford = (0..trials)
            .map(|t| theirs(&smooth, 1.317_902_151_454_403_9, t))
            .collect();
        let jump_ours = squared_errors(SamplerKind::Sobol, n, trials, random_disc);
        let jump_burley: Welford = (0..trials)
            .map(|t| {
                let (f, integral) = random_disc(t);
                theirs(&f, integral, t)
            })
            .collect();
        for (name, a, b) in [("smooth", ours, burley), ("jump", jump_ours, jump_burley)] {
            let z = z_score_two(&a, &b);
            assert!(
                z.abs() < critical_z(sidak(0.01, TESTS)),
                "{name}, N = {n}: {:e} against {:e}, z = {z}",
                a.mean(),
                b.mean()
            );
        }
    }
}
