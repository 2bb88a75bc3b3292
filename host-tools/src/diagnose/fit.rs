//! A fit, and what it makes of data held out.

use std::ops::Deref;
use std::sync::OnceLock;

use super::blocks::HeldOut;
use crate::identify::minimise::Refined;

/// A fit to one problem, with its errors on blocks of time held out once they have been asked for.
#[derive(Debug, Clone)]
pub struct Fit {
    refined: Refined,
    held_out: OnceLock<HeldOut>,
}

impl Fit {
    /// Its errors on blocks of time held out, found `by` leaving them out the first time.
    pub fn held_out(&self, by: impl FnOnce(&Refined) -> HeldOut) -> &HeldOut {
        match self.held_out.get() {
            Some(known) => known,
            None => {
                // Not within `get_or_init`: what leaves blocks out waits for other work meanwhile, which may ask for the same.
                let held_out = by(&self.refined);
                self.held_out.get_or_init(|| held_out)
            }
        }
    }
}

impl From<Refined> for Fit {
    fn from(refined: Refined) -> Self {
        Self { refined, held_out: OnceLock::new() }
    }
}

impl Deref for Fit {
    type Target = Refined;
    fn deref(&self) -> &Refined {
        &self.refined
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use nalgebra::{DMatrix, DVector};

    use super::*;
    use crate::identify::space::Space;
    use crate::model::{Base, Kind};

    #[test]
    fn blocks_are_held_out_once() {
        let refined = Refined {
            space: Space::new(Kind::PmDc, Base::Full, &[]),
            residuals: DVector::zeros(1),
            jacobian: DMatrix::zeros(1, 1),
            rms: [1.0; 2],
            ended: true,
        };
        let asked = Cell::new(0);
        let by = |_: &Refined| {
            asked.set(asked.get() + 1);
            HeldOut { squares: vec![[4.0, 9.0]], rows: vec![[1.0; 2]] }
        };
        let fit = Fit::from(refined);
        assert_eq!(fit.held_out(by).rms(), [2.0, 3.0]);
        // A copy knows it, too.
        assert_eq!(fit.clone().held_out(by).rms(), [2.0, 3.0]);
        assert_eq!(asked.get(), 1);
    }
}
