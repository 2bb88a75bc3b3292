//! Blocks of time held out by a fit of all others, where the linear step of
//! [`cross_validation`](super::cross_validation) does not reach.
//!
//! An inrush has several times the current of everything else. The one-step leave-block-out update extrapolates too far
//! for such a block, and would reject the right law; such blocks are left out by a refit of all others.

use nalgebra::DVector;
use rayon::prelude::*;

use crate::context::Context;
use crate::error::Result;
use crate::identify::cross_validation::{held_out, squares_of};
use crate::identify::minimise::{Effort, Fit, HeldOut, Residuals, resume};
use crate::identify::space::Space;

/// Squares on data held out over those of the fit beyond which blocks are looked at.
const FAR: f64 = 4.0;
/// Share of the squares of a balance that such a block has.
const MUCH: f64 = 0.1;

/// Leaves out each block in turn: by a linear step, and by a fit of the others where that step makes an error that is
/// many times the fit's.
///
/// # Errors
/// An interrupt.
pub fn held_out_refitted(fit: &Fit, problem: &impl Residuals, blocks: &[usize], ctx: &Context) -> Result<HeldOut> {
    let mut held_out = held_out(fit, problem.groups(), blocks);
    let inside = squares_of(&fit.residuals, fit.rms, problem.groups(), blocks);
    let anew = |block: usize| Ok((block, refitted(fit, problem, blocks, block, ctx)?));
    let anew: Vec<_> = far_off(&held_out.squares, &inside).into_par_iter().map(anew).collect::<Result<_>>()?;
    for (block, squares) in anew {
        held_out.squares[block] = squares;
        held_out.beyond[block] = [0, 1].map(|g| squares[g] > FAR * inside[block][g]);
    }
    Ok(held_out)
}

/// The blocks that make the error on data held out many times that of the fit.
fn far_off(held_out: &[[f64; 2]], inside: &[[f64; 2]]) -> Vec<usize> {
    let total = |squares: &[[f64; 2]], g: usize| squares.iter().map(|s| s[g]).sum::<f64>();
    let is_far = |b: &usize| {
        (0..2).any(|g| {
            let all = total(held_out, g);
            all > FAR * total(inside, g) && held_out[*b][g] > (MUCH * all).max(FAR * inside[*b][g])
        })
    };
    (0..held_out.len()).filter(is_far).collect()
}

/// Squares of a block by the parameters that all others lead to.
fn refitted(fit: &Fit, problem: &impl Residuals, blocks: &[usize], block: usize, ctx: &Context) -> Result<[f64; 2]> {
    let others = Others { problem, blocks, block };
    let mut start = fit.clone();
    others.clear(&mut start.residuals);
    start.jacobian.column_iter_mut().for_each(|mut column| others.clear_rows(column.iter_mut()));
    let elsewhere = resume(&start, &others, Effort::ESTIMATE, ctx)?.space;
    let residuals = problem.at(&elsewhere, &elsewhere.coordinates());
    Ok(squares_of(&residuals, [1.0; 2], problem.groups(), blocks)[block])
}

/// All blocks but one.
struct Others<'a, P> {
    problem: &'a P,
    blocks: &'a [usize],
    block: usize,
}

impl<P> Others<'_, P> {
    fn clear(&self, residuals: &mut DVector<f64>) {
        self.clear_rows(residuals.iter_mut());
    }

    fn clear_rows<'r>(&self, rows: impl Iterator<Item = &'r mut f64>) {
        rows.zip(self.blocks).filter(|(_, b)| **b == self.block).for_each(|(x, _)| *x = 0.0);
    }
}

impl<P: Residuals> Residuals for Others<'_, P> {
    fn at(&self, space: &Space, theta: &[f64]) -> DVector<f64> {
        let mut residuals = self.problem.at(space, theta);
        self.clear(&mut residuals);
        residuals
    }

    fn at_each(&self, space: &Space, thetas: &[Vec<f64>]) -> Vec<DVector<f64>> {
        let mut each = self.problem.at_each(space, thetas);
        each.iter_mut().for_each(|residuals| self.clear(residuals));
        each
    }

    fn groups(&self) -> &[u8] {
        self.problem.groups()
    }

    fn sizes(&self) -> [f64; 2] {
        self.problem.sizes()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Error;
    use crate::identify::minimise::minimise;
    use crate::model::{Base, Kind};

    /// A magnetisation curve by an arc tangent, `A atan(i/i_k)` with ln A and ln i_k as the first two coordinates,
    /// against one of Froelich's form. The others do nothing.
    struct Curve {
        currents: Vec<f64>,
        groups: Vec<u8>,
    }

    impl Curve {
        fn of(currents: Vec<f64>) -> Self {
            Self { groups: vec![0; currents.len()], currents }
        }
    }

    impl Residuals for Curve {
        fn at(&self, _: &Space, theta: &[f64]) -> DVector<f64> {
            let modelled = |i: f64| theta[0].exp() * (i / theta[1].exp()).atan();
            let measured = |i: f64| i / (1.0 + (i / 2.0).abs().powi(3)).cbrt();
            DVector::from_iterator(self.currents.len(), self.currents.iter().map(|i| modelled(*i) - measured(*i)))
        }
        fn groups(&self) -> &[u8] {
            &self.groups
        }
        fn sizes(&self) -> [f64; 2] {
            [1.0; 2]
        }
    }

    /// An inrush of thirty amperes, and nine blocks of up to three.
    fn recording() -> (Vec<f64>, Vec<usize>) {
        let block = |b: usize, largest: f64| (0..40).map(move |n| (largest * (f64::from(n) * 0.37).sin(), b));
        block(0, 30.0).chain((1..10).flat_map(|b| block(b, 0.3 * b as f64 + 0.3))).unzip()
    }

    #[test]
    fn what_an_inrush_is_told_by_all_else_is_what_a_fit_of_all_else_says() {
        let space = Space::new(Kind::PmDc, Base::Full, &[]);
        let (currents, blocks) = recording();
        let whole = Curve::of(currents.clone());
        let fit = minimise(&space, &whole, Effort::FULL, None, &Context::quiet()).unwrap();
        let by_a_step = held_out(&fit, whole.groups(), &blocks);
        let refitted = held_out_refitted(&fit, &whole, &blocks, &Context::quiet()).unwrap();

        // The same by hand: a fit that has never had those rows.
        let others = Curve::of(currents[40..].to_vec());
        let without = minimise(&space, &others, Effort::FULL, None, &Context::quiet()).unwrap().space;
        let inrush = Curve::of(currents[..40].to_vec()).at(&without, &without.coordinates()).norm_squared();

        let off = |held_out: &HeldOut| (held_out.squares[0][0] / inrush - 1.0).abs();
        assert!(off(&by_a_step) > 0.2, "a straight line is not enough: {by_a_step:?} of {inrush}");
        // The fit of the others ends where its error is known to a hundredth.
        assert!(off(&refitted) < 0.1, "{refitted:?} of {inrush}");
        assert_eq!(refitted.squares[1..], by_a_step.squares[1..], "no other block is far off");

        let stopped = Context::quiet();
        stopped.cancel_flag().cancel();
        let refitted = held_out_refitted(&fit, &whole, &blocks, &stopped);
        assert!(matches!(refitted, Err(Error::Interrupted)), "{refitted:?}");
    }
}
