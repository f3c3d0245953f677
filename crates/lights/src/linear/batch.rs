//! This module samples a linear light by projected solid angle for many random numbers at once,
//! with every operation in a loop over columns.
//!
//! The loops have no branches and no calls, so that the compiler uses the vector instructions of
//! the machine. The length of the loops is hidden from the compiler, because it would unroll them
//! instead. The kernels are the ones of a single sample, and so are the bits, except that some
//! samples of a block take more steps than they need.

use super::projected::{End, Inversion};
use super::view::{LineView, SolidAngleEnd, nearer};
use crate::linear::numbers::{Angle, Bounds, CLOSE, STEPS, rotate, sine_and_cosine, step_sin_cos};

/// The largest number of samples in a block.
pub(crate) const BLOCK: usize = 16;

/// One number for each sample of a block.
type Column = [f64; BLOCK];

/// The samples of a block.
#[derive(Clone, Debug, Default)]
pub(crate) struct Batch {
    /// For each sample of the block, the position on the clipped line.
    pub lambda: Column,
    /// The coordinates x, y and z of the points relative to the shading point, one column each; the
    /// next field holds the unit directions.
    pub point: [Column; 3],
    pub direction: [Column; 3],
    /// The cosines n·ω.
    pub cosine: Column,
}

/// The angles of a block with their sines and cosines.
#[derive(Default)]
struct Angles {
    v: Column,
    s: Column,
    c: Column,
}

impl Batch {
    /// Computes the samples for at most [`BLOCK`] random numbers. The iteration ends when the
    /// longest step is below the fraction [`CLOSE`] of the distance to the nearer end.
    pub(crate) fn fill(&mut self, arc: &Inversion, view: &LineView, numbers: &[f64]) {
        let n = numbers.len().min(BLOCK);
        let mut xi = [0.0; BLOCK];
        xi[..n].copy_from_slice(&numbers[..n]);
        let mut at = start(arc, view, &xi, n);
        for _ in 0..STEPS {
            if advance(arc, &xi, n, &mut at) {
                break;
            }
        }
        if view.is_short() {
            self.place::<true>(arc, view, &xi, n, &at);
        } else {
            self.place::<false>(arc, view, &xi, n, &at);
        }
    }

    /// Computes [`LineView::arc_point`] and the cosines for the block.
    #[inline(never)]
    fn place<const SHORT: bool>(
        &mut self,
        arc: &Inversion,
        view: &LineView,
        xi: &Column,
        n: usize,
        at: &Angles,
    ) {
        let (n, arc, view) = (n.min(BLOCK), *arc, *view);
        let mut out = Self::default();
        for (i, xi) in xi[..n].iter().enumerate() {
            let (second, _) = nearer(*xi);
            let (s, c) = (at.s[i], at.c[i]);
            let [here, there] = End::select(second, &arc.ends).over_sine;
            out.cosine[i] = here * view.sine_of_rest(s, c) + there * s;
            let place = view.place::<SHORT>(second, s, c);
            out.lambda[i] = place.lambda;
            for k in 0..3 {
                out.point[k][i] = place.point[k];
                out.direction[k][i] = place.direction[k];
            }
        }
        *self = out;
    }
}

/// Returns the angles from which the iteration starts.
#[inline(never)]
fn start(arc: &Inversion, view: &LineView, xi: &Column, n: usize) -> Angles {
    let (n, arc) = (n.min(BLOCK), *arc);
    let ends = [false, true].map(|second| view.solid_angle_end(second));
    let mut out = Angles::default();
    for i in 0..n {
        let (second, xi) = nearer(xi[i]);
        let at = End::select(second, &arc.ends).start(xi, &SolidAngleEnd::select(second, &ends));
        out.v[i] = at.v;
        out.s[i] = at.s;
        out.c[i] = at.c;
    }
    out
}

/// Returns the next step of each sample, limited to the arc.
#[inline(never)]
fn steps(arc: &Inversion, xi: &Column, n: usize, at: &Angles) -> Column {
    let (n, arc) = (n.min(BLOCK), *arc);
    let mut step = [0.0; BLOCK];
    for i in 0..n {
        let (second, xi) = nearer(xi[i]);
        let at = Angle {
            v: at.v[i],
            s: at.s[i],
            c: at.c[i],
        };
        let [_, raw] = End::select(second, &arc.ends).steps(&at, xi * arc.total);
        step[i] = raw.at_least(-at.v).at_most(arc.delta - at.v);
    }
    step
}

/// Advances every sample by one step, and returns whether all have converged.
#[inline(never)]
fn advance(arc: &Inversion, xi: &Column, n: usize, at: &mut Angles) -> bool {
    let n = n.min(BLOCK);
    let step = steps(arc, xi, n, at);
    // Rotate each angle by its step; small steps have short polynomials.
    let (mut sine, mut cosine) = ([0.0; BLOCK], [0.0; BLOCK]);
    let mut large = 0_u64;
    for i in 0..n {
        large |= u64::from(step[i].abs() > 0.5);
        let (s, c) = sine_and_cosine(step[i] * step[i]);
        sine[i] = step[i] * s;
        cosine[i] = c;
    }
    if large != 0 {
        for i in 0..n {
            (sine[i], cosine[i]) = step_sin_cos(step[i]);
        }
    }
    let mut busy = 0_u64;
    for i in 0..n {
        let (s, c) = rotate((at.s[i], at.c[i]), (sine[i], cosine[i]));
        at.s[i] = s.at_least(0.0);
        at.c[i] = c;
        at.v[i] += step[i];
        let room = at.v[i].at_most(arc.delta - at.v[i]);
        busy |= u64::from(step[i].abs() > CLOSE * room);
    }
    busy == 0
}
