//! Errors of all functions in units of the last digit, against evaluation in double-double numbers.
#![allow(clippy::print_stdout, reason = "what a test did is said when it fails")]

use linelit_elementary as own;
use linelit_testkit::cases::rng;
use linelit_testkit::dd::Dd;
use linelit_testkit::rng::SplitMix64;

/// The number of inputs of each kind.
const COUNT: u32 = 40_000;

/// The error of `got` in units of the last digit of the correct value, which `Dd` has to 40 bits
/// more.
fn ulps(got: f64, want: Dd) -> f64 {
    let size = want.hi().abs().max(f64::MIN_POSITIVE);
    let ulp = size.next_up() - size;
    ((Dd::from(got) - want).hi() / ulp).abs()
}

/// The bits by which what is too small for `Dd` is moved up, and the power of two.
const UP: f64 = 200.0;

/// What is too small for `Dd`, and what it should be times 2²⁰⁰, as numbers whose last digits are
/// as much above it as that of the smallest numbers: [`ulps`] of it.
fn moved_up(got: f64, want_up: Dd) -> (f64, Dd) {
    // Round to units of the smallest number times 2²⁰⁰, in which ordinary numbers of 53 bits are
    // counted.
    let unit = Dd::from(2f64.powi(200 - 1074));
    let count = |x: Dd| x / unit;
    // 2⁵² more has a last digit of one.
    let whole = Dd::from(2f64.powi(52));
    let got = count(Dd::from(got * 2f64.powi(200)));
    ((got + whole).hi(), count(want_up) + whole)
}

/// Checks that the largest error over many inputs is within the bound that the function's doc
/// states.
fn check(
    name: &str,
    bound: f64,
    input: impl Fn(&mut SplitMix64) -> [f64; 2],
    of: impl Fn([f64; 2]) -> (f64, Dd),
) {
    let (mut random, mut worst) = (rng(7), (0.0, [0.0; 2]));
    for _ in 0..COUNT {
        let at = input(&mut random);
        let (got, want) = of(at);
        let error = ulps(got, want);
        assert!(error.is_finite(), "{name} at {at:?}: {got:e}");
        if error > worst.0 {
            worst = (error, at);
        }
    }
    println!("{name}: {:.3} ulp at {:?}", worst.0, worst.1);
    assert!(worst.0 <= bound, "{name}: {worst:?}, more than {bound}");
}

/// Numbers of both signs whose magnitudes are spread evenly over powers of ten.
fn sizes(from: f64, to: f64) -> impl Fn(&mut SplitMix64) -> [f64; 2] {
    move |random| {
        [(); 2].map(|()| {
            let size = 10f64.powf(random.in_range(from, to));
            if random.below(2) == 0 { size } else { -size }
        })
    }
}

fn evenly(from: f64, to: f64) -> impl Fn(&mut SplitMix64) -> [f64; 2] {
    move |random| [(); 2].map(|()| random.in_range(from, to))
}

fn positive(input: impl Fn(&mut SplitMix64) -> [f64; 2]) -> impl Fn(&mut SplitMix64) -> [f64; 2] {
    move |random| input(random).map(f64::abs)
}

#[test]
fn exponentials() {
    let exp = |[x, _]: [f64; 2]| (own::exp(x), Dd::from(x).exp());
    check("exp", 0.52, evenly(-708.0, 709.0), exp);
    check("exp of small ones", 0.52, sizes(-12.0, 1.0), exp);
    // One rounding more, to a unit that is not smaller than that of the smallest normal number.
    let subnormal = |[x, _]: [f64; 2]| {
        let up = Dd::from(x) + Dd::LN_2 * Dd::from(UP);
        moved_up(own::exp(x), up.exp())
    };
    check("exp, subnormal", 1.02, evenly(-744.0, -708.5), subnormal);
    // Absolute errors of 1e-31 beside results of 1e-8.
    let less_one = |[x, _]: [f64; 2]| (own::exp_m1(x), Dd::from(x).exp() - Dd::ONE);
    check("exp_m1", 1.0, sizes(-8.0, 2.0), less_one);
    let binary = |[x, _]: [f64; 2]| (own::exp2(x), (Dd::LN_2 * Dd::from(x)).exp());
    check("exp2", 1.0, evenly(-1020.0, 1020.0), binary);
}

#[test]
fn logarithms() {
    let ln = |[x, _]: [f64; 2]| (own::ln(x), Dd::from(x).ln());
    check("ln", 0.52, positive(sizes(-140.0, 140.0)), ln);
    check("ln of moderate ones", 0.52, evenly(0.01, 10.0), ln);
    let near_one = |random: &mut SplitMix64| sizes(-14.0, -1.0)(random).map(|x| 1.0 + x);
    check("ln near 1", 0.52, near_one, ln);
    let excess = |[x, _]: [f64; 2]| (own::ln_1p(x), Dd::sum(1.0, x).ln());
    check("ln_1p", 1.0, sizes(-12.0, -0.01), excess);
    check(
        "ln_1p of large ones",
        1.0,
        positive(sizes(0.0, 100.0)),
        excess,
    );
    let binary = |[x, _]: [f64; 2]| (own::log2(x), Dd::from(x).ln() / Dd::LN_2);
    check("log2", 1.0, positive(sizes(-100.0, 100.0)), binary);
    let ten = Dd::from(10.0).ln();
    let decimal = |[x, _]: [f64; 2]| (own::log10(x), Dd::from(x).ln() / ten);
    check("log10", 1.5, positive(sizes(-100.0, 100.0)), decimal);
    let half = Dd::from(0.5);
    let area = |[x, _]: [f64; 2]| {
        let ratio = Dd::sum(1.0, x) / Dd::sum(1.0, -x);
        (own::atanh(x), ratio.ln() * half)
    };
    check("atanh", 2.0, sizes(-8.0, -0.0001), area);
}

#[test]
fn powers() {
    let pow = |[x, y]: [f64; 2]| (own::pow(x, y), (Dd::from(x).ln() * Dd::from(y)).exp());
    // Lobes: cosines to powers of up to 100,000, and roots.
    let lobe = |random: &mut SplitMix64| {
        let [x, y] = [random.next_f64(), random.in_range(-2.0, 5.0)];
        let power = 10f64.powf(y);
        // Only where the power is a normal number.
        [x.max((-700.0 / power).exp()), power]
    };
    check("pow of lobes", 0.52, lobe, pow);
    let all = |random: &mut SplitMix64| {
        let x = positive(sizes(-140.0, 140.0))(random)[0];
        [x, random.in_range(-700.0, 700.0) / x.ln().abs().max(1e-3)]
    };
    check("pow", 0.52, all, pow);
    let near_one = |random: &mut SplitMix64| {
        let excess = sizes(-12.0, -2.0)(random)[0];
        [1.0 + excess, random.in_range(-700.0, 700.0) / excess.abs()]
    };
    check("pow near 1", 0.52, near_one, pow);
    let small = |random: &mut SplitMix64| {
        let x = random.in_range(1e-9, 0.5);
        [x, random.in_range(-744.0, -709.0) / x.ln()]
    };
    let subnormal = |[x, y]: [f64; 2]| {
        let up = Dd::from(x).ln() * Dd::from(y) + Dd::LN_2 * Dd::from(UP);
        moved_up(own::pow(x, y), up.exp())
    };
    check("pow, subnormal", 1.02, small, subnormal);
    let cube = |[x, _]: [f64; 2]| {
        let root = own::cbrt(x);
        // Improve the result by one Newton step.
        let start = Dd::from(root);
        let rest = (start * start * start - Dd::from(x)) / (start * start * Dd::from(3.0));
        (root, start - rest)
    };
    check("cbrt", 0.5, sizes(-40.0, 40.0), cube);
    let length = |[x, y]: [f64; 2]| {
        let square = Dd::product(x, x) + Dd::product(y, y);
        (own::hypot(x, y), square.sqrt())
    };
    check("hypot", 1.0, sizes(-3.0, 3.0), length);
    check("hypot of like ones", 1.0, evenly(-1.0, 1.0), length);
}

#[test]
fn angles() {
    let wide = || evenly(-1e5, 1e5);
    let sin = |[x, _]: [f64; 2]| (own::sin(x), Dd::from(x).sin());
    let cos = |[x, _]: [f64; 2]| (own::cos(x), Dd::from(x).cos());
    let tan = |[x, _]: [f64; 2]| (own::tan(x), Dd::from(x).sin() / Dd::from(x).cos());
    check("sin", 1.0, wide(), sin);
    check("sin of small ones", 1.0, sizes(-20.0, 1.0), sin);
    check("cos", 1.0, wide(), cos);
    check("tan", 1.0, wide(), tan);
    check("tan of small ones", 1.0, sizes(-20.0, 1.0), tan);
    let one = Dd::ONE;
    let atan = |[x, _]: [f64; 2]| (own::atan(x), Dd::from(x).atan2(one));
    check("atan", 1.0, sizes(-20.0, 20.0), atan);
    let atan2 = |[y, x]: [f64; 2]| (own::atan2(y, x), Dd::from(y).atan2(Dd::from(x)));
    check("atan2", 1.5, evenly(-1.0, 1.0), atan2);
    check("atan2 of all sizes", 1.5, sizes(-20.0, 20.0), atan2);
    let asin = |[x, _]: [f64; 2]| (own::asin(x), Dd::from(x).asin());
    let acos = |[x, _]: [f64; 2]| (own::acos(x), Dd::from(x).acos());
    for (name, bound) in [("evenly", 1.0), ("near the ends", 1.0)] {
        let input = |random: &mut SplitMix64| match name {
            "evenly" => evenly(-1.0, 1.0)(random),
            _ => sizes(-15.0, -1.0)(random).map(|x| x.signum() * (1.0 - x.abs())),
        };
        check(&format!("asin {name}"), bound, input, asin);
        check(&format!("acos {name}"), bound, input, acos);
    }
}

#[test]
fn sine_and_cosine_are_those() {
    let mut random = rng(3);
    for _ in 0..COUNT {
        let x = sizes(-10.0, 10.0)(&mut random)[0];
        let (sin, cos) = own::sin_cos(x);
        assert_eq!(
            [sin.to_bits(), cos.to_bits()],
            [own::sin(x).to_bits(), own::cos(x).to_bits()],
            "{x:e}"
        );
    }
}

/// A digest of results (FNV), in which a change of any bit shows.
fn digest(of: impl Fn([f64; 2]) -> f64) -> u64 {
    let mut random = SplitMix64::new(1);
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    for _ in 0..10_000 {
        let at = [random.in_range(0.001, 0.999), random.in_range(0.001, 30.0)];
        for byte in of(at).to_bits().to_le_bytes() {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }
    hash
}

/// The bits that pictures depend on, on any machine and with any release of libm. If one of these
/// digests changes, the version of everything computed with the function has to change.
#[test]
fn bits_are_frozen() {
    let found = [
        ("sin", digest(|[_, b]| own::sin(b))),
        ("cos", digest(|[_, b]| own::cos(b))),
        ("tan", digest(|[_, b]| own::tan(b))),
        ("asin", digest(|[a, _]| own::asin(a))),
        ("acos", digest(|[a, _]| own::acos(a))),
        ("atan", digest(|[_, b]| own::atan(b))),
        ("atan2", digest(|[a, b]| own::atan2(a, b - 15.0))),
        ("exp", digest(|[_, b]| own::exp(-b))),
        ("exp_m1", digest(|[_, b]| own::exp_m1(-b))),
        ("exp2", digest(|[_, b]| own::exp2(-b))),
        ("ln", digest(|[a, _]| own::ln(a))),
        ("ln_1p", digest(|[a, _]| own::ln_1p(-a))),
        ("log2", digest(|[_, b]| own::log2(b))),
        ("log10", digest(|[_, b]| own::log10(b))),
        ("atanh", digest(|[a, _]| own::atanh(a))),
        ("pow", digest(|[a, b]| own::pow(a, b))),
        ("cbrt", digest(|[_, b]| own::cbrt(b))),
        ("hypot", digest(|[a, b]| own::hypot(a, b))),
    ];
    assert_eq!(found, FROZEN);
}

const FROZEN: [(&str, u64); 18] = [
    ("sin", 0x0605_9d4a_8737_bd8b),
    ("cos", 0xd324_d009_7adf_14b8),
    ("tan", 0x3d7b_701d_23d0_78f6),
    ("asin", 0xdb83_a60f_e7c6_c561),
    ("acos", 0x871c_3040_523c_2690),
    ("atan", 0xe057_5492_097a_4a33),
    ("atan2", 0xa15f_83b7_6983_8495),
    ("exp", 0x397f_d0ca_acf2_9c64),
    ("exp_m1", 0xb522_f38a_1c34_a421),
    ("exp2", 0xe283_a721_e771_84c6),
    ("ln", 0xc760_3143_a68d_31e1),
    ("ln_1p", 0x4e4d_103b_3371_bdd0),
    ("log2", 0xf077_5228_d3f6_9d6e),
    ("log10", 0xfa18_3d32_161b_a2f9),
    ("atanh", 0xc81b_4f6c_5ab8_96bb),
    ("pow", 0x369a_bb9f_0a0a_4a42),
    ("cbrt", 0x9984_9033_c36f_79ba),
    ("hypot", 0x8559_df5d_8a0b_fcc7),
];
