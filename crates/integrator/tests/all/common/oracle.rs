//! The oracle computes the light of a horizontal square past triangles, slab by slab, in any number
//! type.

use linelit_testkit::real::{Real, cross, dot, length, sub, vector};

type Point<R> = [R; 2];

/// Computes `∫ max(0, cos θ) dω` over the visible part of a square light, as seen from `x` with the
/// normal +z. The square has the half side `half` and the centre (0, 0, `height`), and triangles
/// may be between x and its plane.
///
/// Between two successive u at which edges end or cross, the visible part consists of trapezoids.
/// Lambert's formula is applied to each.
pub(crate) fn irradiance<R: Real>(
    x: [f64; 3],
    half: f64,
    height: f64,
    triangles: &[[[f64; 3]; 3]],
) -> R {
    let project = |v: [f64; 3]| -> Point<R> {
        let d = sub(&vector::<R>(v), &vector(x));
        let t = (R::new(height) - R::new(x[2])) / d[2].clone();
        [0, 1].map(|k| R::new(x[k]) + d[k].clone() * t.clone())
    };
    let square =
        [[-half, -half], [half, -half], [half, half], [-half, half]].map(|p| p.map(R::new));
    let mut polygons = vec![square.to_vec()];
    polygons.extend(triangles.iter().map(|t| t.map(project).to_vec()));
    let events = events(&polygons, half);
    let mut sum = R::new(0.0);
    for pair in events.windows(2) {
        for [low, high] in visible(&polygons, &pair[0], &pair[1]) {
            let at = |u: &R, side: &[Point<R>; 2]| [u.clone(), on(side, u)];
            let corners = [
                at(&pair[0], &low),
                at(&pair[1], &low),
                at(&pair[1], &high),
                at(&pair[0], &high),
            ];
            let lifted = corners.map(|[u, v]| sub(&[u, v, R::new(height)], &vector(x)));
            sum = sum + lambert(&lifted);
        }
    }
    sum
}

/// The coordinate v of a side at u.
fn on<R: Real>([a, b]: &[Point<R>; 2], u: &R) -> R {
    let slope = (b[1].clone() - a[1].clone()) / (b[0].clone() - a[0].clone());
    a[1].clone() + slope * (u.clone() - a[0].clone())
}

fn sides<R: Real>(polygon: &[Point<R>]) -> impl Iterator<Item = [Point<R>; 2]> + '_ {
    (0..polygon.len()).map(|i| [polygon[i].clone(), polygon[(i + 1) % polygon.len()].clone()])
}

/// All u within the square at which an edge begins, ends or crosses another.
fn events<R: Real>(polygons: &[Vec<Point<R>>], half: f64) -> Vec<R> {
    let all: Vec<_> = polygons.iter().flat_map(|p| sides(p)).collect();
    let mut out: Vec<R> = all.iter().map(|s| s[0][0].clone()).collect();
    for (i, [a, b]) in all.iter().enumerate() {
        for [c, d] in &all[..i] {
            let e = [0, 1].map(|k| b[k].clone() - a[k].clone());
            let f = [0, 1].map(|k| d[k].clone() - c[k].clone());
            let g = [0, 1].map(|k| c[k].clone() - a[k].clone());
            let det = e[0].clone() * f[1].clone() - e[1].clone() * f[0].clone();
            if det.abs() > R::new(1e-30) {
                let t = (g[0].clone() * f[1].clone() - g[1].clone() * f[0].clone()) / det;
                out.push(a[0].clone() + e[0].clone() * t);
            }
        }
    }
    out.retain(|u| u.abs() <= R::new(half));
    out.sort_by(|a, b| a.partial_cmp(b).expect("numbers"));
    out
}

/// The sides below and above each visible trapezoid between two events.
fn visible<R: Real>(polygons: &[Vec<Point<R>>], from: &R, to: &R) -> Vec<[[Point<R>; 2]; 2]> {
    let middle = (from.clone() + to.clone()) * R::new(0.5);
    if !(to.clone() - from.clone() > R::new(1e-40)) {
        return Vec::new();
    }
    let chord = |polygon: &[Point<R>]| {
        let crossed = |s: &[Point<R>; 2]| (s[0][0] <= middle) != (s[1][0] <= middle);
        let mut found: Vec<_> = sides(polygon).filter(crossed).collect();
        found.sort_by(|a, b| {
            on(a, &middle)
                .partial_cmp(&on(b, &middle))
                .expect("numbers")
        });
        (found.len() == 2).then(|| [found[0].clone(), found[1].clone()])
    };
    let Some([mut reached, top]) = chord(&polygons[0]) else {
        return Vec::new();
    };
    let mut hidden: Vec<_> = polygons[1..].iter().filter_map(|p| chord(p)).collect();
    let v = |side: &[Point<R>; 2]| on(side, &middle);
    hidden.sort_by(|a, b| v(&a[0]).partial_cmp(&v(&b[0])).expect("numbers"));
    let mut out = Vec::new();
    for [low, high] in hidden {
        if v(&low) > v(&top) {
            break;
        }
        if v(&low) > v(&reached) {
            out.push([reached.clone(), low]);
        }
        if v(&high) > v(&reached) {
            reached = high;
        }
    }
    if v(&top) > v(&reached) {
        out.push([reached, top]);
    }
    out
}

/// Lambert's formula for the normal +z: ½ Σ Θ (a × b)·n/|a × b|.
fn lambert<R: Real>(corners: &[[R; 3]; 4]) -> R {
    let n = vector::<R>([0.0, 0.0, 1.0]);
    let mut sum = R::new(0.0);
    for i in 0..4 {
        let (a, b) = (&corners[i], &corners[(i + 1) % 4]);
        let c = cross(a, b);
        let size = length(&c);
        if size > R::new(1e-60) {
            let angle = size.atan2(&dot(a, b));
            sum = sum + angle * dot(&c, &n) / size;
        }
    }
    sum.abs() * R::new(0.5)
}
